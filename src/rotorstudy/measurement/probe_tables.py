"""Tables of a probe's amplitude and phase, as balancing instruments write them: a row per probe, speed, harmonic."""

from collections import Counter

import numpy as np

from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.measurement.conventions import check_once, combine, measured_direction
from rotorstudy.measurement.findings import Finding
from rotorstudy.measurement.quality import DEAD, SIGNIFICANT, left_out
from rotorstudy.measurement.tables import (
    ANGLES,
    SPEEDS,
    check_columns,
    notes_on,
    numbers_of,
    one_of,
    open_table,
    quantities_of,
    whole_numbers,
)
from rotorstudy.measurement.text_table import MISSING
from rotorstudy.units import METRES, RAD_PER_S

VELOCITIES = {"m_per_s": 1.0, "mm_per_s": 1e-3, "in_per_s": 25.4e-3}
PARTS = ("amplitude_", "velocity_", "phase_")  # of the columns of a reading
PEAK = {"peak": 1.0, "peak_to_peak": 0.5, "rms": np.sqrt(2)}  # factor to the peak


def is_probe_table(columns):
    """Whether these columns are those of a table of probes: a probe and a phase, or an amplitude and no node."""
    shown = any(name.startswith(("amplitude_", "velocity_")) for name in columns)
    turned = any(name.startswith("phase") for name in columns)
    return ("probe" in columns and (shown or turned)) or (shown and not {"harmonic", "node"} & set(columns))


def _harmonics_in(path, conventions):
    """(harmonic,) whole numbers from 1, of a table of probes."""
    text = open_table(path, conventions.csv)
    return sorted(set(whole_numbers(text, "harmonic", path).tolist())) if "harmonic" in text else [1]


def with_harmonics_of_tables(conventions, paths):
    """Conventions with the harmonics of the tables of probes, if the rig file states none; RotorstudyError if fewer."""
    if not paths:
        return conventions
    held = {n for path in paths for n in _harmonics_in(path, conventions)}
    if "harmonics" not in conventions.model_fields_set:
        return conventions.model_copy(update={"harmonics": [n for m in sorted(held) for n in (m, -m)]})
    for n in conventions.harmonics:
        if abs(n) not in held or -n not in conventions.harmonics:
            raise RotorstudyError(
                f"{paths[0]}: 'measurement: harmonics:' has {n}, and the tables of probes have {sorted(held)}, each of "
                "which gives n and -n; leave 'harmonics:' out, or state these"
            )
    return conventions


def read_probe_table(path, conventions, nodes):
    """Spectra of a table of probes.

    columns : one of speed_rad_per_s, speed_Hz, speed_rpm; probe (its channel in the rig file; not needed for one
              probe); amplitude_m (_mm, _um, _mil) or velocity_m_per_s (_mm_per_s, _in_per_s), by `table_amplitude` of
              the rig file peak, peak_to_peak or rms; phase_deg or phase_rad, lead or lag by `table_phase`, of the
              probe's signal against the phase mark; harmonic (1 by default); amplitude_last_digit,
              velocity_last_digit, phase_last_digit (as in `read_table`); a speed written again is a repeat
    returns : list of (speed rad/s, {node: (amplitude (harmonic,) complex m, covariance (component, component))},
              {node: direction of a single probe, rad}), and findings

    A probe that reads A cos(n (angle - mark) + phase) has the harmonic A e^{j (phase - n mark)} / 2. Those of the
    probes of a node are combined to R_n and, conjugated, to R_-n.
    """
    text, where = open_table(path, conventions.csv), str(path)
    size = "velocity" if any(name.startswith("velocity_") for name in text.columns) else "amplitude"
    units = {size: VELOCITIES if size == "velocity" else METRES, "phase": ANGLES}
    every = {"amplitude": METRES, "velocity": VELOCITIES, "phase": ANGLES}
    check_columns(text.columns, path, ("probe", "harmonic"), every)
    if any(name.startswith("amplitude_") for name in text.columns) and size == "velocity":
        raise RotorstudyError(f"{where}: columns of an amplitude and of a velocity; keep one")
    speed_column = one_of(SPEEDS, text.columns, path)
    speed = numbers_of(text, speed_column, path) * RAD_PER_S[SPEEDS[speed_column]]
    harmonic = whole_numbers(text, "harmonic", path) if "harmonic" in text else np.ones(len(text), int)
    _check_rows(speed, harmonic, where)
    probe = _probes(text, conventions, nodes, where)
    repeat = _repeats([(p.channel, *row) for p, *row in zip(probe, speed.tolist(), harmonic.tolist(), strict=True)])
    kept, missing = _complete(text, probe, speed, repeat, harmonic, conventions.harmonics, where)
    text, probe, speed, repeat, harmonic = text[kept], probe[kept], speed[kept], repeat[kept], harmonic[kept]
    values, steps, inferred = quantities_of(text, path, units)
    if (values[size] < 0).any():
        raise RotorstudyError(
            f"{where}: column of {size}: a value is negative; state it positive, its phase by 180° more"
        )
    factor = PEAK[conventions.table_amplitude] / ((harmonic * speed) if size == "velocity" else 1.0)
    phase = (-1 if conventions.table_phase == "lag" else 1) * values["phase"] - harmonic * conventions.mark_rad
    phase = phase - (np.pi / 2 if size == "velocity" else 0.0)  # a velocity leads its displacement
    vector = factor * values[size] * np.exp(1j * phase)
    noise = 2 * conventions.table_noise_m**2  # of a reading: a harmonic is half the sum of those of two probes
    along = (factor * steps[size]) ** 2 / 12 + noise
    across = np.where(vector == 0, along, np.abs(vector) ** 2 * steps["phase"] ** 2 / 12 + noise)
    spectra = []
    dead = _dead(probe, np.abs(vector), np.sqrt(along))
    alive = np.array([(p.node, p.channel) not in dead for p in probe])
    records = list(zip(speed.tolist(), repeat.tolist(), strict=True))
    for (one, again), rows in _rows_of(records).items():
        rows = rows[alive[rows]]
        of_node, directions = {}, {}
        for node in sorted({p.node for p in probe[rows]}):
            place = f"{where}, {one * 30 / np.pi:.6g} rpm, {f'repeat {again + 1}, ' * bool(again)}node {node}"
            at = [row for row in rows if probe[row].node == node]
            of_node[node], single = _node(at, probe, harmonic, vector, along, across, conventions, place)
            if np.isfinite(single):
                directions[node] = single
        spectra.append((float(one), of_node, directions))
    return spectra, [*missing, *left_out(dead, where), *notes_on(noise, inferred, where)]


def _complete(text, probe, speed, repeat, harmonic, wanted, where):
    """(row,) whether each row has its reading and is of a record with all usual readings; findings on the others.

    A record is a speed, or its repeat; readings are usual if more than half of the records have them. If no record has
    them all, only the rows without a reading are left out.
    """
    cells = text[[name for name in text.columns if name.startswith(PARTS)]]
    there = ~cells.apply(lambda column: column.str.lower().isin(MISSING)).any(axis=1).to_numpy()
    there = there & np.isin(harmonic, wanted)
    records, held = list(zip(speed.tolist(), repeat.tolist(), strict=True)), {}
    for i, record in enumerate(records):
        held.setdefault(record, set()).update({(probe[i].node, probe[i].channel, int(harmonic[i]))} if there[i] else ())
    count = Counter(reading for readings in held.values() for reading in readings)
    usual = {reading for reading, times in count.items() if 2 * times > len(held)}
    lacks = {record: usual - readings for record, readings in held.items() if not usual <= readings}
    if not lacks or len(lacks) == len(held):
        return there, []
    (one, _), readings = next(iter(lacks.items()))
    _, channel, n = min(readings)
    others = ", and others" if len(lacks) > 1 or len(readings) > 1 else ""
    text = (
        f"{len(lacks)} of {len(held)} speeds are left out, as readings are missing: at {one * 30 / np.pi:.6g} rpm, "
        f"{n}X of '{channel}'{others}. A harmonic that is missing at many speeds is better left out of 'measurement: "
        "harmonics:'"
    )
    whole = np.array([record not in lacks for record in records])
    return there & whole, [Finding("warning", "missing readings", where, text)]


def _dead(probe, size, std):
    """{(node, channel)} of the probes that show nothing in any row, though others of their node show what they would.

    probe : (row,) Probe;  size, std : (row,) peak of a reading and its standard deviation, m
    """
    rows = _rows_of([(p.node, p.channel) for p in probe])
    largest = {key: size[own].max() for key, own in rows.items()}
    least = {key: max(largest[key], std[own].max()) for key, own in rows.items()}
    silent = {key for key, own in rows.items() if (size[own] <= SIGNIFICANT * std[own]).all()}
    shown = {node: max(one for (place, _), one in largest.items() if place == node) for node, _ in rows}
    return {(node, name) for node, name in silent if shown[node] > DEAD * least[node, name]}


def _rows_of(keys):
    """{key: (row,) positions of its rows}, in the order of the first ones."""
    found = {}
    for i, key in enumerate(keys):
        found.setdefault(key, []).append(i)
    return {key: np.array(own) for key, own in found.items()}


def _repeats(rows):
    """(row,) how often each row, hashable, occurs above it: a repeat of the speed is written below the first."""
    seen, before = Counter(), []
    for row in rows:
        before.append(seen[row])
        seen[row] += 1
    return np.array(before)


def _check_rows(speed, harmonic, where):
    if (speed <= 0).any():
        raise RotorstudyError(f"{where}: a speed is not positive")
    if (harmonic < 1).any():
        raise RotorstudyError(
            f"{where}: harmonic {int(harmonic.min())}; a probe's signal is real, and its harmonics count from 1 (the "
            "mean is not in these tables)"
        )


def _probes(text, conventions, nodes, where):
    """(row,) Probe of the rig file."""
    check_once(conventions.probes, where)
    known = {p.channel: p for p in conventions.probes}
    if not known:
        raise RotorstudyError(f"{where}: no probes; list them with their angles under 'measurement: probes:'")
    if "probe" not in text and len(known) > 1:
        raise RotorstudyError(f"{where}: no column 'probe', and the rig file has {', '.join(known)}; add it")
    found = {}
    names = list(text["probe"]) if "probe" in text else list(known) * len(text)
    for name in dict.fromkeys(names):
        if name not in known:
            raise unknown_name("probe", name, known, f"{where}; list it under 'measurement: probes:'")
        probe = known[name]
        node = nodes[0] if probe.node is None and len(nodes) == 1 else probe.node
        if node not in nodes:
            raise unknown_name("node", node, nodes, f"'measurement: probes:' of the rig file, of the probe '{name}'")
        found[name] = probe.model_copy(update={"node": node})
    return np.array([found[name] for name in names], object)


def _node(rows, probe, harmonic, vector, along, across, conventions, where):
    """Amplitude (harmonic,) and covariance of a node from its rows, and the direction of a single probe, else NaN."""
    wanted = list(conventions.harmonics)
    names = list(dict.fromkeys(probe[row].channel for row in rows))
    chosen = {name: next(probe[row] for row in rows if probe[row].channel == name) for name in names}
    angles = conventions.direction_rad([one.angle_deg for one in chosen.values()])
    amplitude, covariance = np.zeros(len(wanted), complex), np.zeros((2 * len(wanted),) * 2)
    for n in (n for n in wanted if n > 0):
        own = [[row for row in rows if probe[row].channel == name and harmonic[row] == n] for name in names]
        for name, found in zip(names, own, strict=True):
            if len(found) != 1:
                raise RotorstudyError(
                    f"{where}: no harmonic {n} of probe '{name}'; every probe needs the same harmonics, at each "
                    f"repeat of a speed too. Add the readings, or leave ±{n} out of 'measurement: harmonics:'"
                )
        own = np.ravel(own)
        sign = np.array([one.sign for one in chosen.values()])
        places = [wanted.index(n), wanted.index(-n)]
        places += [len(wanted) + place for place in places]
        for i, row in enumerate(own):
            both = _parts(angles, i, sign[i] * vector[row] / 2)
            amplitude[places[:2]] += both[:2] + 1j * both[2:]
            turned = vector[row] / abs(vector[row]) if vector[row] else 1.0
            for part, variance in ((turned, along[row]), (1j * turned, across[row])):
                spread = _parts(angles, i, part / 2)
                covariance[np.ix_(places, places)] += variance * np.outer(spread, spread)
    return (amplitude, covariance), measured_direction(angles)


def _parts(angles, i, reading):
    """Real parts of R_n and R_-n, then imaginary parts, of a node by the harmonic `reading` of its probe i alone."""
    readings = np.zeros((len(angles), 2), complex)
    readings[i] = reading, np.conj(reading)
    both = combine(angles, readings)
    return np.concatenate([both.real, both.imag])
