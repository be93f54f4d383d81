"""Tables of amplitude and phase with a column for each probe and harmonic, as monitoring systems export them.

    Speed (rpm),DE X 1X Amp (mil pp),DE X 1X Phase (deg),DE X 2X Amp (mil pp),DE X 2X Phase (deg),DE Y 1X Amp ...

The units may be in a row of their own below the names. They become tables of a probe's amplitude and phase, with a row
for each (`tables`).
"""

import re
from typing import NamedTuple

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.channel_names import SPEED_WORDS, UNIT_OF, words_in
from rotorstudy.measurement.text_table import MISSING, number

QUANTITY = re.compile(
    r"(?P<probe>.+?)[\s_:,;/-]+(?P<harmonic>\d{1,3})x?[\s_:,;/-]*(?P<what>amp|mag|pha?s)[a-z]*\b(?P<unit>.*)",
    re.IGNORECASE,
)
MAY_BE_READ = re.compile(r"amp|mag|phase", re.IGNORECASE)
SPEED_UNITS = {"rpm": "rpm", "Hz": "Hz", "rad/s": "rad_per_s"}
LENGTHS, VELOCITIES = ("m", "mm", "um", "mil"), {"m": "m_per_s", "mm": "mm_per_s", "in": "in_per_s", "ips": "in_per_s"}
PER_SECOND = re.compile(r"/\s*s|\bips\b", re.IGNORECASE)
SIZES = {  # words of a unit -> how the amplitude is stated
    "peak_to_peak": re.compile(r"\b(pp|p-p|pk-?pk|p2p|peak.to.peak)\b", re.IGNORECASE),
    "rms": re.compile(r"\brms\b", re.IGNORECASE),
    "peak": re.compile(r"\b(pk|0-p|0-pk|peak)\b", re.IGNORECASE),
}
TURNS = {"lag": re.compile(r"\blag", re.IGNORECASE), "lead": re.compile(r"\blead", re.IGNORECASE)}


class WideTable(NamedTuple):
    """The columns of a wide table.

    speed : (column, unit as in `speed_rpm`)
    pairs : {(probe, harmonic): (column of the amplitude, column of the phase)}
    units : of the amplitude, with its quantity, and of the phase, as in `amplitude_mil`, `phase_deg`
    size, turn : how the headers state amplitudes (a value of `table_amplitude`) and phases (`table_phase`), or None
    unread : names of other columns that may be of amplitudes, phases or speeds
    """

    speed: tuple[str, str]
    pairs: dict
    units: tuple[str, str]
    size: str | None
    turn: str | None
    unread: list

    @property
    def columns(self):
        """Names of the columns of the table with a row for each probe and harmonic."""
        return [f"speed_{self.speed[1]}", "probe", "harmonic", *self.units]


def wide_table(names, units, where):
    """The WideTable of some columns, or None if they are those of another file.

    names : (column,);  units : (column,) text below each name, empty where there is none
    raises : RotorstudyError, where a column of a table lacks its partner, or its unit is not known
    """
    found = {}
    for name, below in zip(names, units, strict=True):
        match = QUANTITY.fullmatch(name)
        if match:
            what = "phase" if match["what"].lower().startswith("ph") else "amplitude"
            own = found.setdefault((match["probe"].strip(), int(match["harmonic"])), {})
            if what in own:
                raise RotorstudyError(f"{where}: columns '{own[what][0]}' and '{name}' are the same {what}; keep one")
            own[what] = (name, f"{match['unit']} {below}".strip())
    speed = speed_column(names, units)
    pairs = {key: (own["amplitude"], own["phase"]) for key, own in found.items() if len(own) == 2}
    if speed is None or not pairs:
        return None
    _check_partners(found, where)
    sizes, turns = ([texts[i] for texts in pairs.values()] for i in (0, 1))
    return WideTable(
        speed,
        {key: (amplitude[0], phase[0]) for key, (amplitude, phase) in pairs.items()},
        (_one_unit(sizes, _size_unit, where), _one_unit(turns, _angle, where)),
        _stated(SIZES, sizes),
        _stated(TURNS, turns),
        [name for name in names if MAY_BE_READ.search(name) and not QUANTITY.fullmatch(name)]
        + list(_speed_columns(names, units))[1:],
    )


def in_rows(text, table, where):
    """A wide table (a data frame of text, indexed by line) with a row for each speed, probe and harmonic."""
    import pandas as pd

    _check_cells(text, [table.speed[0], *(name for names in table.pairs.values() for name in names)], where)
    rows = {
        (line, probe, harmonic): (row[table.speed[0]], probe, str(harmonic), *(row[name] for name in names))
        for line, row in text.iterrows()
        for (probe, harmonic), names in table.pairs.items()
    }
    return pd.DataFrame(rows.values(), columns=table.columns, index=[line for line, *_ in rows])


def _check_cells(text, columns, where):
    """Raise RotorstudyError for a cell that is no number and does not say that the reading is missing."""
    for name in columns:
        for line, cell in text[name].items():
            try:
                number("0" if cell.lower() in MISSING else cell)
            except ValueError:
                raise RotorstudyError(
                    f"{where}, line {line}, column '{name}': '{cell}' is not a number; correct it, or leave the cell "
                    "empty if the reading is missing"
                ) from None


def _check_partners(found, where):
    """Raise RotorstudyError for an amplitude without its phase, or a phase without its amplitude."""
    for (probe, harmonic), own in found.items():
        if len(own) == 1:
            have, name = next((what, name) for what, (name, _) in own.items())
            lack = "phase" if have == "amplitude" else "amplitude"
            raise RotorstudyError(
                f"{where}: column '{name}' is the {have} of probe '{probe}' at {harmonic}X, and no column is its "
                f"{lack}, such as '{probe} {harmonic}X {'Phase' if lack == 'phase' else 'Amp'}'; add it, or take the "
                f"{have} out"
            )


def _one_unit(columns, unit_of, where):
    """The one unit of some columns (name, text of the unit); RotorstudyError if there is none, or two."""
    units = {}
    for name, text in columns:
        units.setdefault(unit_of(text), name)
    if None in units:
        text = dict(columns)[units[None]]
        said = f"the unit '{text}'" if text else "no unit"
        raise RotorstudyError(
            f"{where}: column '{units[None]}' has {said}; known are {', '.join(LENGTHS)}, mm/s, m/s, in/s with pp, pk "
            "or rms, as in 'DE X 1X Amp (mil pp)'. They may also stand in a row below the names ('csv: {unit_rows: 1}')"
        )
    if len(units) > 1:
        (one, name), (other, second) = list(units.items())[:2]
        raise RotorstudyError(
            f"{where}: column '{name}' is in {one.partition('_')[2]}, '{second}' in {other.partition('_')[2]}; a table "
            "needs one unit of all amplitudes, and one of all phases"
        )
    return next(iter(units))


def check_stated(table, conventions, path):
    """Raise RotorstudyError if the headers of a wide table contradict the rig file."""
    for key, own, stated in (
        ("table_amplitude", table.size, conventions.table_amplitude),
        ("table_phase", table.turn, conventions.table_phase),
    ):
        if own not in (None, stated):
            raise RotorstudyError(
                f"{path}: its header says {own.replace('_', ' ')}, and 'measurement: {key}:' of the rig file is "
                f"{stated}; state '{key}: {own}'"
            )


def speed_column(names, units):
    """(name, unit) of the first column of a speed, or None."""
    return next(iter(_speed_columns(names, units).items()), None)


def _speed_columns(names, units):
    """{name: unit} of the columns of speeds."""
    found = {}
    for name, below in zip(names, units, strict=True):
        if SPEED_WORDS & set(words_in(name)):
            units_in = [UNIT_OF.get(word) for word in words_in(f"{name} {below}")]
            found |= {name: SPEED_UNITS[unit]} if (unit := next(filter(SPEED_UNITS.get, units_in), None)) else {}
    return found


def _size_unit(text):
    """The quantity and unit that a text says, as in `amplitude_mil`, or None."""
    words = words_in(text)
    if PER_SECOND.search(text):
        return next((f"velocity_{VELOCITIES[word]}" for word in words if word in VELOCITIES), None)
    return next((f"amplitude_{UNIT_OF[word]}" for word in words if UNIT_OF.get(word) in LENGTHS), None)


def _angle(text):
    return "phase_rad" if "rad" in words_in(text) else "phase_deg"


def _stated(words, columns):
    """The first of some words that the texts of the units of columns say."""
    return next((name for name, word in words.items() if any(word.search(text) for _, text in columns)), None)
