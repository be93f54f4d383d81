"""Spectra of tables of amplitude and phase; their only known noise is the rounding of the printed digits."""

from collections import Counter

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.conventions import combine, measured_direction
from rotorstudy.measurement.findings import Finding
from rotorstudy.measurement.quality import DEAD, SIGNIFICANT, left_out
from rotorstudy.measurement.tables import (
    OF_NODES,
    OF_PROBES,
    check_columns,
    harmonics_in,
    is_probe_table,
    nodes_in,
    open_table,
    probes_in,
    quantities_of,
    speeds_in,
)
from rotorstudy.measurement.text_table import MISSING, header_of
from rotorstudy.measurement.wide_tables import wide_table

PEAK = {"peak": 1.0, "peak_to_peak": 0.5, "rms": np.sqrt(2)}  # factor to the peak
PARTS = ("amplitude_", "velocity_", "phase_", "reference_phase_")  # of the columns of a reading


def read_table(path, conventions, nodes):
    """Spectra of a table, a row for each harmonic of a node's orbit or of a probe's signal (docs/measured_records.md).

    A probe that reads A cos(n (angle - mark) + phase) has the harmonic A e^{j (phase - n mark)} / 2. Those of the
    probes of a node are combined to R_n and, conjugated, to R_-n. A speed that is written again is a repeat.

    returns : list of (speed rad/s, {node: (amplitude (harmonic,) complex m, covariance (component, component))},
              {node: direction of a single probe, rad}), and findings
    """
    import pandas as pd

    text, where = open_table(path, conventions.csv), str(path)
    by_probe = is_probe_table(text.columns)
    size = "velocity" if by_probe and any(name.startswith("velocity_") for name in text) else "amplitude"
    check_columns(
        text.columns, path, ("probe" if by_probe else "node", "harmonic"), OF_PROBES if by_probe else OF_NODES
    )
    if size == "velocity" and any(name.startswith("amplitude_") for name in text):
        raise RotorstudyError(f"{where}: columns of an amplitude and of a velocity; keep one")
    rows = pd.DataFrame({"speed": speeds_in(text, path), "harmonic": harmonics_in(text, path)})
    if by_probe:
        _check_rows(rows.speed, rows.harmonic, where)
        rows["probe"], probes = probes_in(text, conventions, nodes, where)
        rows["node"] = rows.probe.map({name: probe.node for name, probe in probes.items()})
    else:
        rows["node"], rows["probe"], probes = nodes_in(text, conventions, nodes, path), "", {}
        rows["harmonic"] *= conventions.sense  # a plane that is seen from the other end is mirrored
    rows["repeat"] = rows.groupby(list(rows.columns)).cumcount()
    kept, findings = _complete(text, rows, conventions, where)
    text, rows = text[kept], rows[kept].reset_index(drop=True)
    units = {size: OF_PROBES[size], "phase": OF_PROBES["phase"]} if by_probe else OF_NODES
    values, steps, inferred = quantities_of(text, path, units)
    rows["reading"], rows["along"], rows["across"] = _readings(rows, values, steps, by_probe, conventions, where)
    dead = _dead(rows)
    spectra = []
    for (speed, again), record in rows.groupby(["speed", "repeat"], sort=False):
        of_node, directions = {}, {}
        place = f"{where}, {speed * 30 / np.pi:.6g} rpm{f', repeat {again + 1}' * bool(again)}"
        for node, own in record.groupby("node"):
            own = own[[(node, name) not in dead for name in own.probe]]
            angles = [probes[name].angle_deg for name in dict.fromkeys(own.probe)] if by_probe else []
            angles = conventions.direction_rad(angles)
            of_node[int(node)] = _of_node(own, angles, conventions.harmonics, f"{place}, node {node}")
            if by_probe and np.isfinite(single := measured_direction(angles)):
                directions[int(node)] = single
        spectra.append((float(speed), of_node, directions))
    findings += _unread(path, conventions)
    return spectra, [*findings, *left_out(dead, where), *_notes(conventions.table_noise_m, inferred, where)]


def _readings(rows, values, steps, by_probe, conventions, where):
    """Harmonics (row,) of nodes or probes, complex m, in the project's axes; variances (row,) along and across them."""
    size = next(iter(values))
    if by_probe and (values[size] < 0).any():
        raise RotorstudyError(
            f"{where}: column of {size}: a value is negative; state it positive, its phase by 180° more"
        )
    harmonic, lag = rows.harmonic.to_numpy(), conventions.table_phase == "lag"
    if by_probe:  # a harmonic is half the peak; a velocity leads its displacement
        probe = {p.channel: p.sign for p in conventions.probes}
        factor = PEAK[conventions.table_amplitude] / (harmonic * rows.speed.to_numpy() if size == "velocity" else 1.0)
        phase = (-1 if lag else 1) * values["phase"] - harmonic * conventions.mark_rad
        turned, noise = steps["phase"] ** 2, 2 * conventions.table_noise_m**2
        sign = rows.probe.map(probe).to_numpy() / 2
        phase = phase - (np.pi / 2 if size == "velocity" else 0.0)
    else:  # the mean has a direction, which neither lags nor has a reference
        still = harmonic == 0
        phase = np.where(lag & ~still, -1, 1) * (values["phase"] - values["reference_phase"])
        phase = (
            conventions.sense * (phase - np.deg2rad(conventions.gravity_angle_deg)) - harmonic * conventions.mark_rad
        )
        turned = steps["phase"] ** 2 + np.where(still, 0, steps["reference_phase"]) ** 2
        factor, sign, noise = 1.0, 1.0, conventions.table_noise_m**2
    along = (factor * steps[size]) ** 2 / 12 + noise
    reading = factor * values[size] * np.exp(1j * phase)
    across = np.where(reading == 0, along, np.abs(reading) ** 2 * turned / 12 + noise)
    return sign * reading, sign**2 * along, sign**2 * across


def _complete(text, rows, conventions, where):
    """(row,) whether each row has its reading and is of a record with all usual readings; findings on the others.

    A record is a speed, or its repeat; readings are usual if more than half of the records have them. If no record has
    them all, only the rows without a reading are left out.
    """
    cells = text[[name for name in text.columns if name.startswith(PARTS)]]
    there = ~cells.apply(lambda column: column.str.lower().isin(MISSING)).any(axis=1).to_numpy()
    wanted, findings = rows.harmonic.isin(conventions.harmonics).to_numpy(), []
    if not wanted.all() and "harmonics" not in conventions.model_fields_set:
        others = ", ".join(f"{n:+d}" for n in sorted(set(rows.harmonic[~wanted].tolist())))
        said = f"the table also has {others}; state 'measurement: harmonics:' to read them"
        findings.append(Finding("note", "harmonics not read", where, said))
    there, held = there & wanted, {}
    records = list(zip(rows.speed, rows.repeat, strict=True))
    readings = zip(rows.node, rows.probe, rows.harmonic, strict=True)
    for ok, record, reading in zip(there, records, readings, strict=True):
        held.setdefault(record, set()).update({reading} if ok else ())
    count = Counter(reading for readings in held.values() for reading in readings)
    usual = {reading for reading, times in count.items() if 2 * times > len(held)}
    lacks = {record: usual - readings for record, readings in held.items() if not usual <= readings}
    if not lacks or len(lacks) == len(held):
        return there, findings
    (one, again), readings = next(iter(lacks.items()))
    node, probe, n = min(readings)
    again = f" (repeat {again + 1})" * bool(again)
    others = ", and others" if len(lacks) > 1 or len(readings) > 1 else ""
    said = (
        f"{len(lacks)} of {len(held)} speeds are left out, as readings are missing: at {one * 30 / np.pi:.6g} rpm"
        f"{again}, {n}X of {repr(probe) if probe else f'node {node}'}{others}. A harmonic that is missing at many "
        "speeds is better left out of 'measurement: harmonics:'"
    )
    whole = np.array([record not in lacks for record in records])
    return there & whole, [*findings, Finding("warning", "missing readings", where, said)]


def _dead(rows):
    """{(node, probe)} of the probes that show nothing in any row, though others of their node show what they would."""
    sizes = rows.assign(size=rows.reading.abs(), std=np.sqrt(rows.along))
    sizes["silent"] = sizes["size"] <= SIGNIFICANT * sizes["std"]
    of_probe = sizes.groupby(["node", "probe"]).agg({"size": "max", "std": "max", "silent": "all"})
    shown = of_probe["size"].groupby("node").transform("max")
    dead = of_probe[of_probe.silent & (shown > DEAD * of_probe[["size", "std"]].max(axis=1))]
    return {(int(node), name) for node, name in dead.index}


def _check_rows(speed, harmonic, where):
    if (speed <= 0).any():
        raise RotorstudyError(f"{where}: a speed is not positive")
    if (harmonic < 1).any():
        raise RotorstudyError(
            f"{where}: harmonic {int(harmonic.min())}; a probe's signal is real, and its harmonics count from 1 (the "
            "mean is not in these tables)"
        )


def _of_node(rows, angles, wanted, where):
    """Amplitude (harmonic,) and covariance (component, component) of a node at one speed.

    angles : (probe,) rad, of the probes in the order of their first rows; empty if the rows are those of the orbit
    """
    wanted, order = list(wanted), {name: i for i, name in enumerate(dict.fromkeys(rows.probe))}
    share = combine(angles, np.eye(len(angles))) if len(angles) else [1.0]  # of each probe in x + j y
    amplitude, covariance = np.zeros(len(wanted), complex), np.zeros((2 * len(wanted),) * 2)
    held = Counter(zip(rows.probe, rows.harmonic, strict=True))
    for name in order:
        for n in wanted:
            if held[name, n] != 1 and not (len(angles) and n < 0):
                raise RotorstudyError(
                    f"{where}: harmonic {n} {f'of probe {name!r} ' * bool(name)}occurs {held[name, n]} times; each of "
                    f"{wanted} must occur once, at each repeat of a speed too. Add the readings, or state those of the "
                    "table under 'measurement: harmonics:'"
                )
    for name, n, reading, along, across in zip(
        rows.probe, rows.harmonic, rows.reading, rows.along, rows.across, strict=True
    ):
        places = [wanted.index(n)] + ([wanted.index(-n)] if len(angles) else [])
        part = share[order[name]]
        turned = reading / abs(reading) if reading else 1.0
        seen = np.array([reading, turned * along**0.5, 1j * turned * across**0.5])
        seen = part * np.array([seen, seen.conj()])[: len(places)]  # (place, reading and its two errors)
        amplitude[places] += seen[:, 0]
        spread = np.concatenate([seen[:, 1:].real, seen[:, 1:].imag])
        both = [*places, *(len(wanted) + place for place in places)]
        covariance[np.ix_(both, both)] += spread @ spread.T
    return amplitude, covariance


def _unread(path, conventions):
    """A note on columns of amplitudes, phases or speeds that are not read."""
    wide = wide_table(*header_of(path, conventions.csv)[:2], path)
    if wide is None or not wide.unread:
        return []
    text = "neither the first speed nor readings of a probe and a whole harmonic, such as 'DE X 1X Amp (mil pp)': "
    return [Finding("note", "columns not read", str(path), text + ", ".join(wide.unread))]


def _notes(noise, inferred, where):
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
