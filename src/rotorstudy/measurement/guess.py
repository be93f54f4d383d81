"""A first section `measurement:` for a record file, guessed from names, units and signals; a person must confirm it."""

import re
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.channel_names import angle_in, numbered_angles, plane_in, unit_in
from rotorstudy.measurement.conventions import Conventions, Keyphasor
from rotorstudy.measurement.files import kind_of, open_channels
from rotorstudy.measurement.keyphasor import LONGEST_PULSE, find_pulses
from rotorstudy.measurement.netcdf_files import existing, netcdf
from rotorstudy.measurement.tables import USUAL_V_PER_M, open_table
from rotorstudy.measurement.text_table import guess_layout, whole_numbers
from rotorstudy.units import METRES, RAD_PER_S, SECONDS, um

VIEW = {"rotation": "with_angles", "gravity_angle_deg": 180}  # angles from straight up, counter-clockwise
PAIR = (-45.0, 45.0)  # X and Y of a node, right and left of the top
TIME = re.compile(r"^\W*(t|time|zeit|seconds?)\b|^time|zeit", re.IGNORECASE)
SPEED = re.compile(r"rpm|speed|drehzahl", re.IGNORECASE)
MARK = re.compile(r"key|kph|tach|trig|mark|once|phase", re.IGNORECASE)
INSTRUMENT_NOISE = 2e-7  # m, standard deviation of real and imaginary part: about 0.01 mil peak to peak
EVEN = 1e-3  # relative scatter of the time steps of a time column


class Guess(NamedTuple):
    """A section `measurement:` of a rig file (dict), and what was guessed, in sentences."""

    section: dict
    said: list[str]


class Column(NamedTuple):
    """A channel of a file: its name, its unit (see `unit_in`), and its values (sample,)."""

    name: str
    unit: str | None
    values: np.ndarray


def guess_measurement(path, nodes):
    """The Guess of a section `measurement:` for a file; nodes : for its probes, first ones first."""
    path = existing(path)
    kind = kind_of(path)
    if kind == "netcdf":
        return _of_netcdf(path, nodes)
    section, said, conventions = dict(VIEW), [], Conventions()
    if kind == "csv":
        layout = guess_layout(path)
        conventions = Conventions(csv=layout)
        changed = layout.model_dump(exclude_defaults=True)
        section |= {"csv": changed} if changed else {}
        said.append(f"layout: {_layout_words(layout)}")
        if table := open_table(path, layout):
            return (_of_table if table.by_probe else _of_harmonics)(table, section, said, nodes)
    columns, said_of_text = _columns(path, conventions)
    try:
        return _of_signals(columns, section, said + said_of_text, nodes)
    except RotorstudyError as error:
        raise RotorstudyError("; ".join((f"{path}: {error}", *said_of_text))) from None


def _columns(path, conventions):
    """The numeric columns of a file, and a sentence on the others, which says why the first is none."""
    channels = open_channels(path, conventions)
    found, left, why = {}, [], ""
    for name in channels.names:
        try:
            values = channels.values(name)
        except RotorstudyError as error:
            left.append(name)
            why = why or str(error)
            continue
        if np.isfinite(values).any():
            unit = unit_in(name, channels.units[name] or "")
            key = values.tobytes() if kind_of(path) == "uff" else name  # a data set has two names, last its label
            found[key] = Column(name, unit, np.where(np.isfinite(values), values, np.nan))
    return list(found.values()), [f"not used, as it is no number: {', '.join(left)} ({why})"] if left else []


def _of_signals(columns, section, said, nodes):
    """Guess of a record in time."""
    left = list(columns)
    time = _take(left, lambda c: TIME.search(c.name) and _is_time(c))
    time = time or _take(left, lambda c: _is_time(c) and (np.diff(c.values) != 1).any())  # no number of the sample
    uneven = None if time else _take(left, lambda c: TIME.search(c.name))
    if uneven:
        section["time_channel"] = uneven.name
        said.append(f"time: '{uneven.name}' does not increase in even steps; correct it, or state sample_rate_Hz")
    elif time is None:
        said.append("time: no column; NOT read before sample_rate_Hz is stated")
    else:
        unit = "ms" if time.unit == "ms" else "s"
        section |= {"time_channel": time.name} | ({"time_unit": "ms"} if unit == "ms" else {})
        step = float(np.mean(np.diff(time.values))) * SECONDS[unit]  # times may be rounded
        said.append(f"time: '{time.name}' in {unit}, {1 / step:.6g} samples per second")
    speed = _take(left, lambda c: SPEED.search(c.name))
    if speed is not None:
        unit = speed.unit if speed.unit in RAD_PER_S else "rpm"
        section |= {"speed_channel": speed.name, "speed_unit": unit}
        said.append(f"speed: '{speed.name}' in {unit}, {np.nanmean(speed.values):.5g} on average")
    mark = _take(left, lambda c: MARK.search(c.name)) or _take(left, _is_pulses)
    if mark is not None:
        section["keyphasor"] = {"channel": mark.name, "sensor_angle_deg": 0, "mark_angle_deg": 0}
        said.append(f"phase mark: '{mark.name}'; its sensor is taken to be at the top (NOT known)")
    else:
        said.append("phase mark: no column found; without one there is no phase, state keyphasor: channel")
    others = [c for c in left if c.unit == "other" or _is_time(c) or not np.nanstd(c.values) > 0]
    others += [c for c in left if c not in others and MARK.search(c.name) and _is_pulses(c)]
    if others:
        said.append(f"not used: {', '.join(c.name for c in others)} (constant, a ramp, pulses, or not a displacement)")
    probes = [c for c in left if c not in others]
    if not probes:
        raise RotorstudyError(f"no column may be a probe (columns: {', '.join(c.name for c in columns)})")
    section["probes"], more = _probes([c.name for c in probes], [_unit(c) for c in probes], nodes)
    unknown = [c.name for c in (time, speed, *probes) if c and c.unit is None]
    if unknown:
        more.append(f"units: the file states none for {', '.join(unknown)}; those above are guesses (NOT known)")
    return Guess(section, said + more)


def _of_table(table, section, said, nodes):
    """Guess of a table of the amplitude and phase of probes."""
    names = list(dict.fromkeys(table.text["probe"])) if "probe" in table.text else ["probe"]
    unit = next((unit for unit in METRES if f"amplitude_{unit}" in table.text), None)
    section["probes"], more = _probes(names, [{"unit": unit} if unit else {}] * len(names), nodes)
    section["keyphasor"] = {"sensor_angle_deg": 0, "mark_angle_deg": 0}
    section |= {"table_amplitude": "peak_to_peak", "table_phase": "lag"} | table.stated
    section["table_noise_m"] = INSTRUMENT_NOISE
    size, turn = section["table_amplitude"].replace("_", " "), section["table_phase"]
    said += [*more, f"amplitudes: {size} (or state peak, peak_to_peak, rms); phases: {turn} (or state lead, lag)"]
    said.append(f"noise: {um(INSTRUMENT_NOISE)} besides the rounding, usual for eddy-current probes (a table has none)")
    said.append("phase mark: its sensor is taken to be at the top (NOT known)")
    return Guess(section, said)


def _of_netcdf(path, nodes):
    """Guess of a NetCDF file: its directions are the probes of every node."""
    with netcdf(path) as data:
        if "displacement" not in data or not {"direction", "node"} <= set(data.coords):
            raise RotorstudyError(f"{path}: no variable 'displacement' with the coordinates 'direction' and 'node'")
        names, labels = [[str(x) for x in data[c].values.tolist()] for c in ("direction", "node")]
        section = {}
        if sorted(names) != ["x", "y"]:
            unit = {} if data.displacement.attrs.get("units") else {"unit": "um"}
            probes, said = _probes(names, [unit] * len(names), nodes)
            section = VIEW | {"probes": [{k: v for k, v in p.items() if k != "node"} for p in probes]}
        else:
            said = ["probes: x along gravity, y a quarter of a revolution ahead of it"]
    section["node_of_label"], words = _nodes_of(labels, path, nodes)
    return Guess(section, [*said, words])


def _of_harmonics(table, section, said, nodes):
    """Guess of a table of harmonics of orbits."""
    path, text = table.path, table.text
    section["harmonics"] = list(dict.fromkeys(whole_numbers(text, "harmonic", path).tolist()))
    said.append("a table of harmonics n of x + j y, n > 0 forward; angle 0, where x points, is taken to be straight up")
    if "node" not in text:
        words = f"nodes: no column; the table is taken to be of node {nodes[0]} of the rig"
        return Guess(section | {"table_node": nodes[0]}, [*said, words])
    section["node_of_label"], words = _nodes_of(list(dict.fromkeys(text["node"])), path, nodes)
    return Guess(section, [*said, words])


def _nodes_of(labels, path, nodes):
    """The nodes of the rig for labels of a file, in their order, and a sentence on them."""
    if len(labels) > len(nodes):
        raise RotorstudyError(f"{path}: has {len(labels)} nodes; the rig has only {len(nodes)}")
    pairs = list(zip(labels, nodes, strict=False))
    words = ", ".join(f"{label} is node {node} of the rig" for label, node in pairs)
    return {int(label) if label.isdecimal() else label: node for label, node in pairs}, f"nodes: {words}"


def _probes(names, units, nodes):
    """Items of `probes:` for names of channels and their keys of units, and sentences on them."""
    planes, angles, origin = [plane_in(name) for name in names], [angle_in(name) for name in names], "its name"
    if all(angle is None for angle in angles) and (numbered := numbered_angles(names)):
        (planes, angles), origin = numbered, "the angle in its name"
    pairs = {plane: [i for i, one in enumerate(planes) if one == plane] for plane in planes}
    if any(angle is None for angle in angles) or any(len(pair) > 2 for pair in pairs.values()):
        pairs = {i // 2: [j for j in (i, i + 1) if j < len(names)] for i in range(0, len(names), 2)}
        angles = [PAIR[i % 2] for i in range(len(names))]
        origin = "the order of the columns"
    if len(pairs) > len(nodes):
        raise RotorstudyError(f"{len(pairs)} pairs of probes; the rig has only {len(nodes)} nodes")
    items, said = [None] * len(names), []
    for pair, node in zip(pairs.values(), nodes, strict=False):
        for i in pair:
            items[i] = {"channel": names[i], "node": node, "angle_deg": angles[i], **units[i]}
            unit = units[i].get("unit", "the unit of its column")
            said.append(f"probe '{names[i]}': node {node}, {direction_words(angles[i])}, in {unit}; by {origin}")
    return items, said


def direction_words(angle_deg):
    """An angle from straight up, positive counter-clockwise, in words."""
    angle = (angle_deg + 180) % 360 - 180
    if angle in (0, -180):
        return "straight up" if angle == 0 else "straight down"
    return f"{abs(angle):g}° {'left' if angle > 0 else 'right'} of the top"


def _unit(column):
    """Keys of the unit of a probe: as its name or the row of units says, else by the size of its values."""
    if column.unit in METRES:
        return {"unit": column.unit}
    is_gap_voltage = -24 < np.nanmedian(column.values) < -1  # of an eddy-current probe
    if column.unit == "V" or (column.unit is None and is_gap_voltage):
        return {"unit": "V", "sensitivity_V_per_m": USUAL_V_PER_M}
    return {"unit": "um" if np.nanstd(column.values) > 1e-3 else "m"}


def _take(columns, wanted):
    """The first column that is wanted, taken out of the list; None if there is none."""
    for column in columns:
        if wanted(column):
            columns.remove(column)
            return column
    return None


def _is_time(column):
    steps = np.diff(column.values)
    uneven = max(EVEN, 0.5 if TIME.search(column.name) else 0)
    return len(steps) > 1 and (steps > 0).all() and np.ptp(steps) < uneven * np.mean(steps)


def _is_pulses(column):
    """Whether a signal has pulses as a keyphasor has them."""
    pulses = find_pulses(column.values, np.arange(len(column.values)), Keyphasor())
    return pulses is not None and len(pulses.time) > 1 and pulses.duty < LONGEST_PULSE


def _layout_words(csv):
    names = {";": "semicolons", "\t": "tabs", ",": "commas", "|": "bars", ":": "colons"}
    separator = names.get(csv.separator, "spaces")
    units = f", {csv.unit_rows} row of units below it" if csv.unit_rows else ""
    return f"columns separated by {separator}, decimal '{csv.decimal}', header in line {csv.skip_rows + 1}{units}"
