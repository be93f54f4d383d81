"""Tables of amplitude and phase in long form: a row for each speed, node or probe, and harmonic.

The rows are harmonics of the orbit of a node, or of the signal of a probe, as balancing instruments write them. Tables
of monitoring systems have a column for each probe and harmonic, and the units there or in a row below:

    Speed (rpm),DE X 1X Amp (mil pp),DE X 1X Phase (deg),DE X 2X Amp (mil pp),DE X 2X Phase (deg),DE Y 1X Amp ...

Without the words Amp and Phase the units of a pair of columns say what it holds: DE X 1X [mil pp],DE X 1X [deg].
"""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.channel_names import (
    SPEED_WORDS,
    UNIT_OF,
    as_known,
    bare,
    kind_in,
    stated_units,
    unit_of,
    words_in,
)
from rotorstudy.measurement.conventions import SAME_SPEED, Conventions, combine
from rotorstudy.measurement.files import SUFFIXES
from rotorstudy.measurement.text_table import header_of, numbers_of, text_in, whole_numbers
from rotorstudy.units import DERIVATIVES, METRES, RAD_PER_S

USUAL_V_PER_M = 7874.0  # 200 mV/mil, of most eddy-current probes (API 670)
WIDE = re.compile(
    r"(?P<probe>.+?)[\s_:,;/-]+(?<!\s-)(?P<harmonic>\d{1,3})x[\s_:,;/-]*"
    r"(?:(?P<what>amp|mag|pha?s)[a-z]*\b(?P<unit>.*)|(?P<alone>[\[(].*[\])]))",
    re.IGNORECASE,
)
NO_HARMONIC = re.compile(r".+?[\s_:,;/-]+(amp|mag|pha?s)[a-z]*\b", re.IGNORECASE)
GAP = re.compile(r"(?P<probe>.+?)[\s_:,;/-]+(?:dc[\s_:,;/-]*)?gap\b.*", re.IGNORECASE)  # "DE X Gap (V)"


class Column(NamedTuple):
    """A quantity in a unit, which a column of a long table holds; factor : to SI."""

    quantity: str
    unit: str
    factor: float


ANGLES = {"rad": 1.0, "deg": np.pi / 180}
UNITS = {  # of each quantity: factors to SI
    "speed": RAD_PER_S,
    "amplitude": METRES,
    "velocity": {unit: factor for unit, (order, factor) in DERIVATIVES.items() if order == 1},
    "phase": ANGLES,
    "reference_phase": ANGLES,
}
COLUMNS = {  # of a long table by their names, such as `velocity_mm_per_s`
    f"{quantity}_{unit.replace('/', '_per_')}": Column(quantity, unit, factor)
    for quantity, units in UNITS.items()
    for unit, factor in units.items()
}
SPEED_OF = {one.unit: name for name, one in COLUMNS.items() if one.quantity == "speed"}
SIZES = {one.unit: name for name, one in COLUMNS.items() if one.quantity in ("amplitude", "velocity")}
SIZES = {word: SIZES[unit] for word, unit in UNIT_OF.items() if unit in SIZES}
DEGREES = ("", "deg", "degs", "degree", "degrees", "°", "º")  # no unit is degrees; gon is none of them
PHASES = dict.fromkeys(DEGREES, "phase_deg") | dict.fromkeys(("rad", "radian", "radians"), "phase_rad")
STATED = {  # key of `measurement:` -> the quantity whose unit says it, and its values
    "table_amplitude": ("amplitude", ("peak_to_peak", "rms", "peak")),
    "table_phase": ("phase", ("lag", "lead")),
}


class Table(NamedTuple):
    """A table of amplitude and phase."""

    path: Path
    text: object  # data frame of its cells as text, in long form, by the line of the file
    by_probe: bool  # whether its rows are of probes; otherwise of orbits
    stated: dict = {}  # key of `measurement:` -> the value that its header says
    unread: tuple = ()  # names of other columns, which are not read

    def called(self, known):
        """This Table with its probes by names of the rig file, of which a unit in brackets is no part."""
        names = list(self.text.get("probe", pd.Series(dtype=str)).unique())
        own = dict(zip(names, as_known(names, known), strict=True))
        return self._replace(text=self.text.assign(probe=self.text["probe"].map(own))) if names else self


def open_table(path, layout):
    """The Table in a file; None if the file has signals in time."""
    if SUFFIXES.get(path.suffix.lower()) != "csv" or not path.is_file():
        return None
    names, units, _ = header_of(path, layout)
    below = dict(zip(names, units, strict=True))
    if wide := _wide(below, path, layout):
        return wide
    starts = {"amplitude": ("amplitude_", "velocity_"), "phase": ("phase_",)}
    texts = {what: {n: [u] for n, u in below.items() if n.startswith(start)} for what, start in starts.items()}
    shown, turned = texts["amplitude"], any(name.startswith("phase") for name in names)
    by_probe = ("probe" in names and (shown or turned)) or (shown and not {"harmonic", "node"} & set(names))
    if not by_probe:
        return Table(path, text_in(path, layout), False) if "harmonic" in names else None
    for name, text in below.items():
        if name in COLUMNS and unit_of(text) not in (None, COLUMNS[name].unit):
            raise RotorstudyError(f"{path}: column '{name}' has the unit '{text}' below it; correct the wrong one")
    return Table(path, text_in(path, layout), True, _stated(texts, path))


def _stated(texts, where):
    """{key of `measurement:`: value} by texts of units {quantity: {column: texts}}; RotorstudyError if they differ."""
    found = {}
    for key, (what, values) in STATED.items():
        by = {value: name for name, both in texts[what].items() if (value := kind_in(" ".join(both), values))}
        if len(by) > 1:
            said = " and ".join(f"'{name}' {value.replace('_', ' ')}" for value, name in by.items())
            raise RotorstudyError(f"{where}: of its columns {said} are stated; write all in one way")
        found |= dict.fromkeys([key] * bool(by), *by)
    return found


def _wide(below, where, layout):
    """The Table of a file {column: text of its unit below it}; None of another one; RotorstudyError if some lack."""
    vectors, speeds = _vectors(below), _speed_columns(below)
    pairs, texts = {}, {"amplitude": {}, "phase": {}}
    for name, (at, what, unit) in vectors.items():
        own = pairs.setdefault(at, {})
        if what in own:
            raise RotorstudyError(f"{where}: columns '{own[what]}' and '{name}' are the same {what}; keep one")
        own[what], texts[what][name] = name, (unit, below[name])
    if all(len(own) == 1 for own in pairs.values()):
        of = {match[1][:2].lower(): name for name in below if (match := NO_HARMONIC.match(name))}
        if speeds and "ph" in of and len(of) > 1:
            raise RotorstudyError(
                f"{where}: columns such as '{of['ph']}' must name probe and harmonic, as 'DE X 1X Phase (deg)' does"
            )
        return None
    if not speeds:
        raise RotorstudyError(f"{where}: no column of the speed in rpm, Hz or rad/s, such as 'Speed (rpm)'")
    for (probe, harmonic), own in pairs.items():
        if len(own) == 1:
            ((have, name),) = own.items()
            lack, word = ("phase", "Phase") if have == "amplitude" else ("amplitude", "Amp")
            raise RotorstudyError(
                f"{where}: column '{name}' is the {have} of probe '{probe}' at {harmonic}X, and no column is its "
                f"{lack}, such as '{probe} {harmonic}X {word}'; add it, or take the {have} out"
            )
    known = f"{', '.join(METRES)}, mm/s, m/s, in/s with pp, pk or rms, as in 'DE X 1X Amp (mil pp)'"
    size = _one_unit(texts["amplitude"], SIZES, known, where)
    columns = size, _one_unit(texts["phase"], PHASES, "deg and rad, with lag or lead", where)
    stated, rows = _stated(texts, where), _in_rows(text_in(where, layout), speeds, pairs, columns, where)
    first, *others = speeds
    read = {*vectors, first, *filter(GAP.fullmatch, below)}
    left = (name for name in below if name not in (*read, *others) and not name.startswith("Unnamed: "))
    return Table(where, rows, True, stated, (*others, *left))


def _vectors(names):
    """{name: ((probe, harmonic), quantity, text of its unit)} of columns; of those told by units, whole pairs only."""
    found = {}
    for name, match in ((name, match) for name in names if (match := WIDE.fullmatch(name))):
        word, unit = (match["what"] or "").lower(), match["unit"] or match["alone"] or ""
        turned = word.startswith("ph") if word else bare(unit) in PHASES
        if word or turned or bare(unit) in SIZES:
            at = match["probe"].strip(), int(match["harmonic"])
            found[name] = at, "phase" if turned else "amplitude", unit
    whats = {at: {what for other, what, _ in found.values() if other == at} for at, *_ in found.values()}
    return {name: one for name, one in found.items() if not WIDE.fullmatch(name)["alone"] or len(whats[one[0]]) > 1}


def _one_unit(texts, columns, known, where):
    """The column of a long table for all columns {name: texts of the unit}, by {unit: column}, to the letter."""
    found = {}
    for name, both in texts.items():
        said = {bare(one.strip(" .,:;-")).removeprefix("angle") for one in both} - {""}
        held = {columns.get(one) for one in said or {""}}
        found.setdefault(held.pop() if len(held) == 1 else None, name)
    if None in found:
        text = " ".join(texts[found[None]]).strip()
        said = f"the unit '{text}'" if text else "no unit"
        raise RotorstudyError(
            f"{where}: column '{found[None]}' has {said}; known are {known}. They may also stand in a row below the "
            "names ('csv: {unit_rows: 1}')"
        )
    if len(found) > 1:
        (one, name), (other, second) = list(found.items())[:2]
        raise RotorstudyError(
            f"{where}: column '{name}' is in {one.partition('_')[2]}, '{second}' in {other.partition('_')[2]}; a table "
            "needs one unit of all amplitudes, and one of all phases"
        )
    return next(iter(found))


def _speed_columns(below):
    """{name: column of a long table, as `speed_rpm`} of the columns of speeds."""
    found = {}
    for (name, text), stated in zip(below.items(), stated_units([*below], [*below.values()]), strict=True):
        if SPEED_WORDS & set(words_in(name)) and not WIDE.fullmatch(name):
            units_in = [stated] if stated else [UNIT_OF.get(word) for word in words_in(f"{name} {text}")]
            found |= {name: SPEED_OF[unit]} if (unit := next(filter(SPEED_OF.get, units_in), None)) else {}
    return found


def _in_rows(text, speeds, pairs, columns, where):
    """The cells of a wide table with a row for each speed, probe and harmonic, by the columns of a long one."""
    turning = {n: numbers_of(text, n, where, may_lack=True) * COLUMNS[own].factor for n, own in speeds.items()}
    first, *others = turning
    for name in others:
        if (np.abs(turning[name] - turning[first]) > SAME_SPEED * np.abs(turning[first])).any():
            raise RotorstudyError(
                f"{where}: columns '{first}' and '{name}' are speeds that differ; take out what is not the shaft's own"
            )
    rows = []
    for (probe, harmonic), own in pairs.items():
        part = text[[first, own["amplitude"], own["phase"]]]
        for name in part:
            numbers_of(text, name, where, may_lack=True)
        rows.append(part.set_axis([speeds[first], *columns], axis=1).assign(probe=probe, harmonic=str(harmonic)))
    return pd.concat(rows).sort_index(kind="stable")


def harmonics_in(text, path):
    """(row,) whole numbers; 1 without a column of harmonics."""
    return whole_numbers(text, "harmonic", path) if "harmonic" in text else np.ones(len(text), int)


def with_harmonics_of_tables(conventions, tables):
    """Conventions with the harmonics of the tables of probes, if the rig file states none; RotorstudyError if fewer."""
    if not tables:
        return conventions
    held = {n for table in tables for n in harmonics_in(table.text, table.path).tolist()}
    if "harmonics" not in conventions.model_fields_set:
        return conventions.model_copy(update={"harmonics": [n for m in sorted(held) for n in (m, -m)]})
    for n in conventions.harmonics:
        if abs(n) not in held or -n not in conventions.harmonics:
            raise RotorstudyError(
                f"{tables[0].path}: 'measurement: harmonics:' has {n}, and the tables of probes have {sorted(held)}, "
                "each of which gives n and -n; leave 'harmonics:' out, or state these"
            )
    return conventions


def gap_positions(path, conventions: Conventions) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """Mean positions by the gap voltages of a table, of nodes whose probes all have theirs.

    A voltage rises (becomes less negative) as the shaft comes nearer, for a probe whose `sign` is 1. Returned are
    {node: (speed (row,), rad/s, position (row,), complex, m, from where the shaft lay at rest)}.
    """
    names, units, _ = header_of(path, conventions.csv)
    columns = {match["probe"].strip(): name for name in names if (match := GAP.fullmatch(name))}
    columns = dict(zip(as_known(list(columns), conventions.channels), columns.values(), strict=True))
    for name, unit in zip(names, stated_units(names, units), strict=True):
        if name in columns.values() and unit not in (None, "V"):
            raise RotorstudyError(f"{path}: column '{name}' is in '{unit}'; gaps are read in V, convert them")
    speeds = _speed_columns(dict(zip(names, units, strict=True)))
    probes = [p for p in conventions.probes if p.channel in columns and p.gap_at_rest_V is not None]
    if not probes or not speeds:
        return {}
    text, found, (speed, column) = text_in(path, conventions.csv), {}, next(iter(speeds.items()))
    turning = numbers_of(text, speed, path) * COLUMNS[column].factor
    for node in {p.node for p in probes}:
        own = [p for p in probes if p.node == node]
        if left := [p.channel for p in conventions.probes if p.node == node and p.channel in columns and p not in own]:
            raise RotorstudyError(f"{path}: column '{columns[left[0]]}': state 'gap_at_rest_V:' of this probe too")
        moved = [
            p.sign * (numbers_of(text, columns[p.channel], path) - p.gap_at_rest_V)
            / (p.sensitivity_V_per_m or USUAL_V_PER_M)
            for p in own
        ]  # fmt: skip
        if len(own) > 1:
            found[node] = turning, combine(conventions.direction_rad([p.angle_deg for p in own]), moved)
    return found
