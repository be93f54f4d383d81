"""Tables of harmonics: amplitude, phase and reference phase; their only known noise is the rounding."""

import re

import numpy as np

from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.measurement.findings import Finding
from rotorstudy.measurement.text_table import header_of, number, text_in
from rotorstudy.measurement.wide_tables import in_rows, wide_table
from rotorstudy.units import METRES, RAD_PER_S

SPEEDS = {"speed_rad_per_s": "rad/s", "speed_Hz": "Hz", "speed_rpm": "rpm"}
LARGEST_VALUE = 1e100  # its square is a number
LARGEST_WHOLE = 10**9  # of a node or a harmonic
ANGLES = {"rad": 1.0, "deg": np.pi / 180}
QUANTITIES = {"amplitude": METRES, "phase": ANGLES, "reference_phase": ANGLES}


def read_table(path, conventions, nodes):
    """Spectra of a table of harmonics, one harmonic per row.

    columns : one of speed_rad_per_s, speed_Hz, speed_rpm; node (or `table_node` in the rig file); harmonic;
              amplitude_m (_mm, _um, _mil); phase_rad or phase_deg; reference_phase_rad or _deg (zero if left out);
              amplitude_last_digit, phase_last_digit, reference_phase_last_digit (one unit of the last printed digit, in
              the unit of the quantity; by default from the digits of each cell)
    returns : list of (speed rad/s, {node: (amplitude (harmonic,) complex m, covariance (component, component))},
              harmonics), and findings
    """
    text = open_table(path, conventions.csv)
    check_columns(text.columns, path)
    speed_column = one_of(SPEEDS, text.columns, path)
    speed = numbers_of(text, speed_column, path) * RAD_PER_S[SPEEDS[speed_column]]
    harmonic, node = whole_numbers(text, "harmonic", path), _nodes(text, conventions, nodes, path)
    values, steps, inferred = quantities_of(text, path)
    steps["reference_phase"] = np.where(harmonic == 0, 0, steps["reference_phase"])  # the mean has no reference phase
    lead = np.where((harmonic != 0) & (conventions.table_phase == "lag"), -1, 1)
    amplitude = values["amplitude"] * np.exp(1j * lead * (values["phase"] - values["reference_phase"]))
    noise = conventions.table_noise_m**2
    along = steps["amplitude"] ** 2 / 12 + noise
    across = np.abs(amplitude) ** 2 * (steps["phase"] ** 2 + steps["reference_phase"] ** 2) / 12 + noise
    across = np.where(amplitude == 0, along, across)
    harmonic, amplitude = _into_project_axes(conventions, harmonic, amplitude)
    spectra = []
    for one in dict.fromkeys(speed):
        of_speed = {}
        for place in np.unique(node[speed == one]):
            rows = np.flatnonzero((speed == one) & (node == place))
            where = f"{path}, {one:.6g} rad/s, node {place}"
            of_speed[int(place)] = _in_order(rows, harmonic, amplitude, along, across, conventions.harmonics, where)
        spectra.append((float(one), of_speed))
    return spectra, notes_on(noise, inferred, str(path))


def open_table(path, layout):
    """The cells of a table as text, stripped, of a wide one in rows (`wide_tables`), by the line of the file."""
    text = text_in(path, layout)
    wide = wide_table(*header_of(path, layout)[:2], path)
    return text if wide is None else in_rows(text, wide, path)


def _nodes(text, conventions, nodes, path):
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


def quantities_of(text, path, known=QUANTITIES):
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


def notes_on(noise, inferred, where):
    """Findings on the covariance of a table."""
    findings = []
    if not noise:
        text = (
            "the covariance is that of the rounding of the printed digits. A table does not contain the noise of the "
            "measurement; where that exceeds the rounding, intervals are too narrow. State 'measurement: "
            "table_noise_m:' if it is known"
        )
        findings.append(Finding("note", "rounding only", where, text))
    if inferred:
        text = "the last digits are those of the cells as printed; give columns '..._last_digit' if zeros were dropped"
        findings.append(Finding("note", "last digits", where, text))
    return findings


def last_digit(cell):
    """One unit of the last digit of a printed number: 0.01 for 2.70, 1e-7 for 27.0e-06."""
    found = re.fullmatch(r"[-+]?\d*\.?(\d*)(?:[eE]([-+]?\d+))?", cell)
    decimals = len(found[1]) if found and "." in cell else 0
    return 10.0 ** (int(found[2] or 0) - decimals) if found else np.nan


def _into_project_axes(conventions, harmonic, amplitude):
    """Harmonics in the project's axes, with phases relative to the shaft's reference line.

    The user's plane is rotated to gravity. If the shaft rotates against the user's angles it is mirrored: harmonic n
    becomes -n and is conjugated. The phase mark passes when the reference line is at `mark_rad`.
    """
    turned = amplitude * np.exp(-1j * np.deg2rad(conventions.gravity_angle_deg))
    if conventions.sense < 0:
        harmonic, turned = -harmonic, turned.conj()
    return harmonic, turned * np.exp(-1j * harmonic * conventions.mark_rad)


def _in_order(rows, harmonic, amplitude, along, across, wanted, where):
    """Amplitude (harmonic,) and covariance of some rows, in the order of the harmonics wanted."""
    order = []
    for n in wanted:
        found = rows[harmonic[rows] == n]
        if len(found) != 1:
            raise RotorstudyError(
                f"{where}: harmonic {n} occurs {len(found)} times; each of {list(wanted)} must occur once. "
                "State the harmonics of the table under 'measurement: harmonics:' in the rig file"
            )
        order.append(found[0])
    size, phase = np.abs(amplitude[order]), np.angle(amplitude[order])
    along, across = along[order], across[order]
    real = along * np.cos(phase) ** 2 + across * np.sin(phase) ** 2
    imag = along * np.sin(phase) ** 2 + across * np.cos(phase) ** 2
    both = (along - across) * np.sin(phase) * np.cos(phase)
    if not np.isfinite(size).all():
        raise RotorstudyError(f"{where}: an amplitude or phase is missing")
    return amplitude[order], np.block([[np.diag(real), np.diag(both)], [np.diag(both), np.diag(imag)]])


def check_columns(columns, path, own=("node", "harmonic"), quantities=QUANTITIES):
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
