"""Tables of amplitude and phase: a row for each speed, node or probe, and harmonic, in SI; and wide ones made so.

Two forms are read. In one the rows are harmonics of the orbit of a node; in the other those of a probe's signal, as
balancing instruments and monitoring systems write them.
"""

import re

import numpy as np

from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.measurement.conventions import Conventions, check_once, combine
from rotorstudy.measurement.files import SUFFIXES
from rotorstudy.measurement.text_table import header_of, number, text_in
from rotorstudy.measurement.wide_tables import check_stated, in_rows, speed_column, wide_table
from rotorstudy.units import METRES, RAD_PER_S

SPEEDS = {"speed_rad_per_s": "rad/s", "speed_Hz": "Hz", "speed_rpm": "rpm"}
LARGEST_VALUE = 1e100  # its square is a number
LARGEST_WHOLE = 10**9  # of a node or a harmonic
ANGLES = {"rad": 1.0, "deg": np.pi / 180}
VELOCITIES = {"m_per_s": 1.0, "mm_per_s": 1e-3, "in_per_s": 25.4e-3}
GAP = re.compile(r"(?P<probe>.+?)[\s_:,;/-]+(?:dc[\s_:,;/-]*)?gap\b.*", re.IGNORECASE)  # "DE X Gap (V)"
USUAL_V_PER_M = 7874.0  # 200 mV/mil, API 670
OF_NODES = {"amplitude": METRES, "phase": ANGLES, "reference_phase": ANGLES}  # quantity -> {unit: factor to SI}
OF_PROBES = {"amplitude": METRES, "velocity": VELOCITIES, "phase": ANGLES}


def table_columns(path, conventions):
    """Columns of a text file, of which the reader depends; none of another file."""
    if SUFFIXES.get(path.suffix.lower()) != "csv" or not path.is_file():
        return []
    names, units, _ = header_of(path, conventions.csv)
    wide = wide_table(names, units, path)
    if wide is None:
        return names
    check_stated(wide, conventions, path)
    return wide.columns


def is_probe_table(columns):
    """Whether these columns are those of a table of probes: a probe and a phase, or an amplitude and no node."""
    shown = any(name.startswith(("amplitude_", "velocity_")) for name in columns)
    turned = any(name.startswith("phase") for name in columns)
    return ("probe" in columns and (shown or turned)) or (shown and not {"harmonic", "node"} & set(columns))


def with_harmonics_of_tables(conventions, paths):
    """Conventions with the harmonics of the tables of probes, if the rig file states none; RotorstudyError if fewer."""
    if not paths:
        return conventions
    tables = [open_table(path, conventions.csv) for path in paths]
    held = {n for text, path in zip(tables, paths, strict=True) for n in harmonics_in(text, path).tolist()}
    if "harmonics" not in conventions.model_fields_set:
        return conventions.model_copy(update={"harmonics": [n for m in sorted(held) for n in (m, -m)]})
    for n in conventions.harmonics:
        if abs(n) not in held or -n not in conventions.harmonics:
            raise RotorstudyError(
                f"{paths[0]}: 'measurement: harmonics:' has {n}, and the tables of probes have {sorted(held)}, each of "
                "which gives n and -n; leave 'harmonics:' out, or state these"
            )
    return conventions


def open_table(path, layout):
    """The cells of a table as text, stripped, of a wide one in rows (`wide_tables`), by the line of the file."""
    text = text_in(path, layout)
    wide = wide_table(*header_of(path, layout)[:2], path)
    return text if wide is None else in_rows(text, wide, path)


def harmonics_in(text, path):
    """(row,) whole numbers; 1 without a column of harmonics."""
    return whole_numbers(text, "harmonic", path) if "harmonic" in text else np.ones(len(text), int)


def speeds_in(text, path):
    """(row,) rad/s."""
    column = one_of(SPEEDS, text.columns, path)
    return numbers_of(text, column, path) * RAD_PER_S[SPEEDS[column]]


def nodes_in(text, conventions, nodes, path):
    """(row,) node of the rig."""
    if "node" in text:
        labels = whole_numbers(text, "node", path)
        node = np.array([conventions.node(label, str(path)) for label in labels.tolist()])
    elif conventions.table_node is not None:
        node = np.full(len(text), conventions.table_node)
    elif len(nodes) == 1:
        node = np.full(len(text), nodes[0])
    else:
        raise RotorstudyError(f"{path}: no column 'node'; add one, or give 'table_node:' in the rig file")
    for one in np.unique(node):
        if one not in nodes:
            raise unknown_name("node", one, nodes, f"{path}; the probes must sit at nodes of the rig")
    return node


def probes_in(text, conventions, nodes, where):
    """Names (row,) of the probes, and {name: Probe of the rig file}."""
    check_once(conventions.probes, where)
    known = {p.channel: p for p in conventions.probes}
    if not known:
        raise RotorstudyError(f"{where}: no probes; list them with their angles under 'measurement: probes:'")
    if "probe" not in text and len(known) > 1:
        raise RotorstudyError(f"{where}: no column 'probe', and the rig file has {', '.join(known)}; add it")
    names, found = list(text["probe"]) if "probe" in text else list(known) * len(text), {}
    for name in dict.fromkeys(names):
        if name not in known:
            raise unknown_name("probe", name, known, f"{where}; list it under 'measurement: probes:'")
        node = nodes[0] if known[name].node is None and len(nodes) == 1 else known[name].node
        if node not in nodes:
            raise unknown_name("node", node, nodes, f"'measurement: probes:' of the rig file, of the probe '{name}'")
        found[name] = known[name].model_copy(update={"node": node})
    return names, found


def quantities_of(text, path, known):
    """{quantity: (row,) values} and {quantity: (row,) unit of the last digit}, SI; whether a digit was inferred.

    known : quantity -> {unit in its column: factor to SI}
    """
    values, steps, inferred = {}, {}, False
    for quantity, units in known.items():
        columns = {f"{quantity}_{unit}": factor for unit, factor in units.items()}
        column = one_of(columns, text.columns, path, quantity == "reference_phase")
        if column is None:
            values[quantity] = steps[quantity] = np.zeros(len(text))
            continue
        values[quantity] = numbers_of(text, column, path) * columns[column]
        stated = f"{quantity}_last_digit" in text
        digits = numbers_of(text, f"{quantity}_last_digit", path) if stated else [last_digit(c) for c in text[column]]
        steps[quantity] = np.array(digits) * columns[column]
        inferred = inferred or not stated
    return values, steps, inferred


def last_digit(cell):
    """One unit of the last digit of a printed number: 0.01 for 2.70, 1e-7 for 27.0e-06."""
    found = re.fullmatch(r"[-+]?\d*\.?(\d*)(?:[eE]([-+]?\d+))?", cell)
    decimals = len(found[1]) if found and "." in cell else 0
    return 10.0 ** (int(found[2] or 0) - decimals) if found else np.nan


def check_columns(columns, path, own, quantities):
    """RotorstudyError for a column that is none of the speeds, `own` ones and quantities {name: units}."""
    known = {*SPEEDS, *own}
    for quantity, units in quantities.items():
        known |= {f"{quantity}_{unit}" for unit in units} | {f"{quantity}_last_digit"}
    for name in columns:
        if name not in known:
            raise unknown_name("column", name, known, str(path))


def one_of(known, columns, path, optional=False):
    """The one of some known columns that a table has."""
    found = [name for name in known if name in columns]
    if optional and not found:
        return None
    if len(found) != 1:
        told = f"columns {found}" if found else "no column"
        raise RotorstudyError(f"{path}: {told} of {', '.join(known)}; exactly one is needed")
    return found[0]


def numbers_of(text, column, path):
    """(row,) numbers of a column."""
    numbers = []
    for line, cell in text[column].items():
        try:
            numbers.append(number(cell))
        except ValueError:
            raise RotorstudyError(
                f"{path}, line {line}, column '{column}': '{cell}' is not a number; correct it"
            ) from None
    if not (np.abs(numbers) <= LARGEST_VALUE).all():
        raise RotorstudyError(f"{path}: column '{column}' has values that are not finite, or beyond {LARGEST_VALUE:g}")
    return np.array(numbers)


def whole_numbers(text, column, path):
    """(row,) whole numbers of a column."""
    numbers = numbers_of(text, column, path)
    if not (numbers == np.rint(numbers)).all() or (np.abs(numbers) > LARGEST_WHOLE).any():
        raise RotorstudyError(f"{path}: column '{column}' must hold whole numbers, at most {LARGEST_WHOLE}")
    return numbers.astype(int)


def gap_positions(path, conventions: Conventions) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """Mean positions by the gap voltages of a table, of nodes whose probes all have theirs.

    A voltage rises (becomes less negative) as the shaft comes nearer, for a probe whose `sign` is 1.

    returns : {node: (speed (row,), rad/s, position (row,), complex, m, from where the shaft lay at rest)}
    raises  : RotorstudyError for a cell that is no number
    """
    names, units, _ = header_of(path, conventions.csv)
    columns = {match["probe"].strip(): name for name in names if (match := GAP.fullmatch(name))}
    speed = speed_column(names, units)
    probes = [p for p in conventions.probes if p.channel in columns and p.gap_at_rest_V is not None]
    if not probes or speed is None:
        return {}
    text, found = text_in(path, conventions.csv), {}
    turning = numbers_of(text, speed[0], path) * RAD_PER_S[speed[1].replace("rad_per_s", "rad/s")]
    for node in {p.node for p in probes}:
        own = [p for p in probes if p.node == node]
        moved = [
            p.sign * (numbers_of(text, columns[p.channel], path) - p.gap_at_rest_V)
            / (p.sensitivity_V_per_m or USUAL_V_PER_M)
            for p in own
        ]  # fmt: skip
        if len(own) > 1:
            found[node] = turning, combine(conventions.direction_rad([p.angle_deg for p in own]), moved)
    return found
