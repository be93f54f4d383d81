"""Spectra of tables of amplitude and phase; their only known noise is the rounding of the printed digits."""

import re
from collections import Counter
from itertools import chain, product

import numpy as np
import pandas as pd

from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.measurement.conventions import check_once, combine, measured_direction, one_unit
from rotorstudy.measurement.findings import RecordFacts, node_facts, told
from rotorstudy.measurement.quality import DEAD, SIGNIFICANT, left_out
from rotorstudy.measurement.tables import COLUMNS, harmonics_in
from rotorstudy.measurement.text_table import MISSING, numbers_of, whole_numbers
from rotorstudy.units import DERIVATIVES, LISTED, METRES, RAD_PER_S, spin

PEAK = {"peak": 1.0, "peak_to_peak": 0.5, "rms": np.sqrt(2)}  # factor to the peak
READINGS = ("amplitude", "velocity", "phase", "reference_phase")  # quantities of a row
IN_GROUPS, BELOW_1000 = re.compile(r"[1-9]\d{0,2}(\.\d{3})+"), re.compile(r"[1-9]\d{0,2}")  # of digits
FEW_PHASES = 8  # may all be small
LARGEST_RAD = 4 * np.pi  # of a phase: larger ones are degrees


def read_table(table, conventions, nodes):
    """What a Table says, a row for each harmonic of a node's orbit or of a probe's signal (docs/measured_records.md).

    A probe that reads A cos(n (angle - mark) + phase) has the harmonic A e^{j (phase - n mark)} / 2. Those of the
    probes of a node are combined to R_n and, conjugated, to R_-n. A speed that is written again is a repeat.

    returns : list of RecordFacts, one a speed, and findings
    """
    path, text, by_probe = table.path, table.text, table.by_probe
    turning, *readings = _columns_in(text, path, by_probe)
    _check_groups(text[turning], path)
    speed = numbers_of(text, turning, path) * COLUMNS[turning].factor
    rows = pd.DataFrame({"speed": speed, "harmonic": harmonics_in(text, path)}, text.index)
    if by_probe:
        _check_rows(rows, path)
        rows["probe"], probes = _probes_in(text, conventions, nodes, path)
        rows["node"] = [probes[name].node for name in rows.probe]
    else:
        rows["node"], rows["probe"], probes = _nodes_in(text, conventions, nodes, path), "", {}
        rows["harmonic"] *= conventions.sense  # a plane that is seen from the other end is mirrored
    rows["repeat"] = rows.groupby(list(rows.columns)).cumcount()
    kept, findings = _complete(text, rows, conventions, str(path))
    text, rows = text[kept], rows[kept]
    for name in readings:
        rows = _with_values(rows, name, text, path)
    size = COLUMNS[readings[0]].quantity
    if by_probe and (wrong := rows[size] < 0).any():
        raise RotorstudyError(
            f"{path}, line {rows.index[wrong][0]}: the {size} is negative; leave the cell empty if the reading is "
            "missing, else make it positive, and its phase 180° more"
        )
    rows = _with_readings(rows, size, probes, conventions)
    findings += [*_check_radians(rows.phase, text, path), *_check_zeros(rows, path)]
    dead, found = _dead(rows), []
    for (speed, again), record in rows.groupby(["speed", "repeat"], sort=False):
        facts = RecordFacts(f"{path}, {spin(speed, 6)}", {}, label=float(speed), speed=float(speed))
        place = f"{path}, {speed * 30 / np.pi:.6g} rpm{f', repeat {again + 1}' * bool(again)}"
        for node, own in record.groupby("node"):
            own = own[[(node, name) not in dead for name in own.probe]]
            angles = [probes[name].angle_deg for name in dict.fromkeys(own.probe)] if by_probe else []
            angles = conventions.direction_rad(angles)
            both = _of_node(own, angles, list(conventions.harmonics), f"{place}, node {node}")
            facts.nodes[int(node)] = node_facts(*both, conventions.harmonics)
            if by_probe and np.isfinite(single := measured_direction(angles)):
                facts.directions[int(node)] = single
        found.append(facts)
    findings += left_out(dead, path)
    if names := table.unread:
        more = f" and {len(names) - LISTED} more" * (len(names) > LISTED)
        findings.append(told("columns not read", path, columns=", ".join(names[:LISTED]) + more))
    if not conventions.table_noise_m:
        findings.append(told("rounding only", path))
    if any(f"{COLUMNS[name].quantity}_last_digit" not in text for name in readings):
        findings.append(told("last digits", path))
    return found, findings


def check_stated(table, conventions):
    """Findings on conventions that nothing states; RotorstudyError if a table contradicts the rig file."""
    if conventions.label_rad_per_s(table.path) is not None:
        raise RotorstudyError(f"{table.path}: a table has its own speeds; take it out of 'measurement: speeds_...'")
    units = {COLUMNS[name].unit for name in table.text if table.by_probe and name in COLUMNS}
    named = set(table.text["probe"]) if "probe" in table.text else {probe.channel for probe in conventions.probes}
    for unit in units & {*METRES, *DERIVATIVES}:
        for probe in (one for one in conventions.probes if one.channel in named and one.unit != "V"):
            one_unit(probe.channel, unit, probe, "unit", (unit,), table.path)
    for key, own in table.stated.items():
        if own != (stated := getattr(conventions, key)):
            raise RotorstudyError(
                f"{table.path}: its header says {own.replace('_', ' ')}, and 'measurement: {key}:' of the rig file is "
                f"{stated}; state '{key}: {own}'"
            )
    if not table.by_probe and conventions.table_amplitude != "peak":
        raise RotorstudyError(
            f"{table.path}: a table of orbits, whose amplitudes are radii, and 'measurement: table_amplitude:' of the "
            f"rig file is {conventions.table_amplitude}; leave that out, and write radii"
        )
    lacks = {"table_amplitude", "table_phase"} - conventions.model_fields_set - set(table.stated)
    if not table.by_probe or not lacks:
        return []
    taken = ", ".join(f"'{key}: {getattr(conventions, key)}'" for key in sorted(lacks))
    return [told("not stated", table.path, taken=taken)]


def _columns_in(text, path, by_probe):
    """Columns of speed, size, phase and, if an orbit has one, reference phase; RotorstudyError for none or several."""
    if twice := next((name.removesuffix(" #1") for name in text if name.endswith(" #1")), None):
        raise RotorstudyError(f"{path}: two columns are named '{twice}'; keep one")
    sizes, others = (("amplitude", "velocity"), []) if by_probe else (("amplitude",), [("reference_phase",)])
    wanted, found = [("speed",), sizes, ("phase",), *others], []
    every = [[name for name, column in COLUMNS.items() if column.quantity in one] for one in wanted]
    known = {"harmonic", "probe" if by_probe else "node", *(f"{one}_last_digit" for one in chain(*wanted[1:]))}
    check_known("column", text.columns, known.union(*every), str(path))
    for quantities, names in zip(wanted, every, strict=True):
        held = [name for name in names if name in text]
        if len(held) != 1 and (held or quantities not in others):
            told = f"columns {held}" if held else "no column"
            raise RotorstudyError(f"{path}: {told} of {', '.join(names)}; exactly one is needed")
        found += held
    return found


def _check_groups(cells, where):
    """RotorstudyError if speeds (row,), as text, are written in groups of digits: 904 and 1.004."""
    grouped = [cell for cell in cells if "." in cell]
    if all(map(IN_GROUPS.fullmatch, grouped)) and len(set(grouped)) > 1 and any(map(BELOW_1000.fullmatch, cells)):
        raise RotorstudyError(
            f"{where}: speeds such as '{grouped[0]}' beside whole numbers below 1000: digits in groups? Write 1004, "
            "not 1.004; if thousandths are meant, write all speeds with three decimals"
        )


def _nodes_in(text, conventions, nodes, path):
    """(row,) node of the rig."""
    if "node" in text:
        labels = whole_numbers(text, "node", path)
        node = np.array([conventions.node(label, str(path)) for label in labels.tolist()])
        if conventions.table_node is not None and (node != conventions.table_node).any():
            raise RotorstudyError(
                f"{path}: its column 'node' has other nodes than 'table_node: {conventions.table_node}' of the rig "
                "file; leave one of them out"
            )
    elif conventions.table_node is not None or len(nodes) == 1:
        node = np.full(len(text), nodes[0] if conventions.table_node is None else conventions.table_node)
    else:
        raise RotorstudyError(f"{path}: no column 'node'; add one, or give 'table_node:' in the rig file")
    check_known("node", np.unique(node), nodes, f"{path}; the probes must sit at nodes of the rig")
    return node


def _probes_in(text, conventions, nodes, where):
    """Names (row,) of the probes, and {name: Probe of the rig file}."""
    check_once(conventions.probes, where)
    known = {p.channel: p for p in conventions.probes}
    if not known:
        raise RotorstudyError(f"{where}: no probes; list them with their angles under 'measurement: probes:'")
    if "probe" not in text and len(known) > 1:
        raise RotorstudyError(f"{where}: no column 'probe', and the rig file has {', '.join(known)}; add it")
    names, found = list(text["probe"]) if "probe" in text else list(known) * len(text), {}
    for name in dict.fromkeys(names):
        check_known("probe", [name], known, f"{where}; list it under 'measurement: probes:'")
        node = nodes[0] if known[name].node is None and len(nodes) == 1 else known[name].node
        check_known("node", [node], nodes, f"'measurement: probes:' of the rig file, of the probe '{name}'")
        found[name] = known[name].model_copy(update={"node": node})
    return names, found


def _with_values(rows, name, text, path):
    """The rows with the values of the quantity of a column and, as `quantity_digit`, their last digit's unit, in SI."""
    quantity, unit, factor = COLUMNS[name]
    stated = f"{quantity}_last_digit"
    values = numbers_of(text, name, path) * factor
    if unit == "rad" and (largest := np.abs(values).max(initial=0)) > LARGEST_RAD:
        raise RotorstudyError(
            f"{path}: column '{name}' has {largest:g}, more than two turns; call it '{quantity}_deg' if it is in "
            "degrees, else write angles between -2 pi and 2 pi"
        )
    digits = numbers_of(text, stated, path) if stated in text else np.array([last_digit(cell) for cell in text[name]])
    return rows.assign(**{quantity: values, f"{quantity}_digit": digits * factor})


def last_digit(cell):
    """One unit of the last digit of a printed number: 0.01 for 2.70, 1e-7 for 27.0e-06."""
    found = re.fullmatch(r"[-+]?\d*\.?(\d*)(?:[eE]([-+]?\d+))?", cell)
    decimals = len(found[1]) if found and "." in cell else 0
    return 10.0 ** (int(found[2] or 0) - decimals) if found else np.nan


def _with_readings(rows, size, probes, conventions):
    """The rows with `reading`, complex m, in the project's axes, and its variances `along` and `across` it."""
    harmonic, still = rows.harmonic.to_numpy(), rows.harmonic.to_numpy() == 0
    lead = np.where(still | (conventions.table_phase == "lead"), 1, -1)  # the mean has a direction instead
    phase, turned = lead * rows.phase, rows.phase_digit**2
    if "reference_phase" in rows:
        phase = phase - lead * rows.reference_phase
        turned = turned + np.where(still, 0, rows.reference_phase_digit) ** 2
    if probes:  # a harmonic is half the peak; a velocity leads its displacement
        factor, share = PEAK[conventions.table_amplitude], np.array([probes[name].sign / 2 for name in rows.probe])
        if size == "velocity":
            factor, phase = factor / (harmonic * rows.speed), phase - np.pi / 2
        noise = 2 * conventions.table_noise_m**2
    else:
        factor, share, noise = 1.0, 1.0, conventions.table_noise_m**2
        phase = conventions.sense * (phase - np.deg2rad(conventions.gravity_angle_deg))
    along = (factor * rows[f"{size}_digit"]) ** 2 / 12 + noise
    reading = factor * rows[size] * np.exp(1j * (phase - harmonic * conventions.mark_rad))
    across = np.where(reading == 0, along, reading.abs() ** 2 * turned / 12 + noise)
    return rows.assign(reading=share * reading, along=share**2 * along, across=share**2 * across)


def _complete(text, rows, conventions, where):
    """(row,) whether a row has its reading and its record (speed or repeat) all readings that most have; findings."""
    cells = text[[name for name in text.columns if name.startswith(READINGS)]]
    there = ~cells.apply(lambda column: column.str.lower().isin(MISSING)).any(axis=1).to_numpy()
    wanted, findings = rows.harmonic.isin(conventions.harmonics).to_numpy(), []
    if not wanted.all() and "harmonics" not in conventions.model_fields_set:
        others = ", ".join(f"{n:+d}" for n in sorted(set(rows.harmonic[~wanted].tolist())))
        findings.append(told("harmonics not read", where, others=others))
    there, record = there & wanted, ["speed", "repeat"]
    held = rows.assign(there=there).groupby([*record, "node", "probe", "harmonic"], sort=False).there.any()
    held = held.unstack(["node", "probe", "harmonic"], fill_value=False, sort=False)  # (record, reading)
    usual = held.loc[:, 2 * held.sum() > len(held)]
    lacks = usual[~usual.all(axis=1)]
    if not len(lacks) or len(lacks) == len(held):
        return there, findings
    (speed, again), readings = lacks.index[0], lacks.columns[~lacks.iloc[0]]
    node, probe, n = min(readings)
    said = {"lacking": len(lacks), "count": len(held), "rpm": speed * 30 / np.pi, "n": n}
    said |= {"again": f" (repeat {again + 1})" * bool(again), "place": repr(probe) if probe else f"node {node}"}
    said["others"] = ", and others" if len(lacks) > 1 or len(readings) > 1 else ""
    whole = ~rows.set_index(record).index.isin(lacks.index)
    return there & whole, [*findings, told("missing readings", where, **said)]


def _check_radians(phase, text, where):
    """Whether phases (row,), rad, of a column in degrees are so small that they may have been written in radians."""
    largest = np.rad2deg(phase.abs().max())
    few = "phase_deg" not in text or len(phase) < FEW_PHASES
    return [] if few or not 1 < largest <= 2 * np.pi else [told("phases in radians", where, largest=largest)]


def _check_zeros(rows, where):
    """Whether readings are exactly zero at single speeds, as some exporters write one that is missing."""
    size, reading = rows.reading.abs(), ["node", "probe", "harmonic"]
    large = (size > DEAD * np.sqrt(rows.along)).groupby([rows[name] for name in reading])
    odd = rows[(size == 0) & large.shift(1, fill_value=False) & large.shift(-1, fill_value=False)]
    if 0 < 3 * len(odd) <= len(rows):
        first = next(odd.sort_values(reading, kind="stable").itertuples())
        place = repr(first.probe) if first.probe else f"node {first.node}"
        rpm = first.speed / RAD_PER_S["rpm"]
        yield told("readings of zero", where, count=len(odd), rpm=rpm, n=first.harmonic, place=place)


def _dead(rows):
    """{(node, probe)} of the probes that show nothing in any row, though others of their node show what they would."""
    sizes = pd.DataFrame({"size": rows.reading.abs(), "std": np.sqrt(rows.along)})
    sizes["silent"] = sizes["size"] <= SIGNIFICANT * sizes["std"]
    of_probe = sizes.groupby([rows.node, rows.probe]).agg({"size": "max", "std": "max", "silent": "all"})
    shown = of_probe["size"].groupby("node").transform("max")
    dead = of_probe[of_probe.silent & (shown > DEAD * of_probe[["size", "std"]].max(axis=1))]
    return {(int(node), name) for node, name in dead.index}


def _check_rows(rows, where):
    """RotorstudyError for a speed or a harmonic that no row of a probe can have."""
    if (wrong := rows.speed <= 0).any():
        said = f"line {rows.index[wrong][0]}: the speed {spin(rows.speed[wrong].iloc[0])} is not positive"
        raise RotorstudyError(f"{where}, {said}; correct it, or leave the line out")
    if (wrong := rows.harmonic < 1).any():
        raise RotorstudyError(
            f"{where}, line {rows.index[wrong][0]}: harmonic {rows.harmonic.min()}; a probe's signal is real, and its "
            "harmonics count from 1 (the mean is not in these tables)"
        )


def _of_node(rows, angles, wanted, where):
    """Amplitude and covariance of a node at one speed; angles : (probe,) rad, empty for rows of the orbit."""
    names, held = list(dict.fromkeys(rows.probe)), Counter(zip(rows.probe, rows.harmonic, strict=True))
    for name, n in product(names, wanted):
        if held[name, n] != 1 and not (len(angles) and n < 0):
            raise RotorstudyError(
                f"{where}: harmonic {n} {f'of probe {name!r} ' * bool(name)}occurs {held[name, n]} times; each of "
                f"{wanted} must occur once, at each repeat of a speed too. Add the readings, or state those of the "
                "table under 'measurement: harmonics:'"
            )
    shares = combine(angles, np.eye(len(angles))) if len(angles) else [1.0]  # of the probes in x + j y
    share, wanted = rows.probe.map(dict(zip(names, shares, strict=True))).to_numpy(), np.array(wanted)[:, None]
    turned = np.exp(1j * np.angle(rows.reading))
    seen = np.array([rows.reading, turned * np.sqrt(rows.along), 1j * turned * np.sqrt(rows.across)])
    n = rows.harmonic.to_numpy()  # change : (reading and its two errors, harmonic, row)
    change = (wanted == n) * (share * seen)[:, None]
    if len(angles):
        change = change + (wanted == -n) * (share * seen.conj())[:, None]
    spread = np.hstack(change[1:])
    spread = np.concatenate([spread.real, spread.imag])
    return change[0].sum(axis=1), spread @ spread.T
