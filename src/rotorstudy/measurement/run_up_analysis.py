"""The raw record of a run-up or coast-down to harmonics at many speeds, with facts and findings."""

import numpy as np

from rotorstudy.measurement import quality
from rotorstudy.measurement.analysis import Analysed, analyse, check_channels
from rotorstudy.measurement.facts import NodeFacts, RecordFacts, node_facts
from rotorstudy.measurement.findings import Finding, errors_among
from rotorstudy.measurement.keyphasor import find_pulses
from rotorstudy.measurement.run_up import peaks, speed_grid, track
from rotorstudy.measurement.sweep import find_sweep, is_swept
from rotorstudy.units import RAD_PER_S, number

PIECES = 50  # of a record, of which the loudest shows the state of the probes
FAST = (0.1, 0.5)  # rate over the squared half-power bandwidth: beats to be corrected, too fast to be corrected


def analyse_each(raw, with_signals=True):
    """Analysed of a raw record: one, or of a run-up or coast-down one for each speed at which it was tracked."""
    marks, pulses = raw.marks, None
    if marks is None and raw.keyphasor is not None:
        pulses = find_pulses(raw.keyphasor, raw.time, raw.conventions.keyphasor)
        marks = None if pulses is None else pulses.time
    if marks is None or not is_swept(np.asarray(marks)):
        return [analyse(raw, with_signals)]
    sweep = find_sweep(np.asarray(marks, float), 0.0 if pulses is None else pulses.resolution)
    findings = quality.check_pulses(pulses, sweep, raw.conventions.keyphasor.polarity, raw.where)
    return _tracked(raw, sweep, findings)


def _tracked(raw, sweep, findings):
    """Analysed of each speed of a sweep; one without harmonics after an error."""
    facts = RecordFacts(raw.where, {node: NodeFacts() for node in raw.nodes})
    harmonics = np.array(raw.conventions.harmonics)
    grid, step = speed_grid(sweep), np.median(np.diff(raw.time))
    fastest = grid.speed.max() / (2 * np.pi)
    findings += quality.check_sampling(len(raw.time), len(raw.time) * step * fastest, harmonics, raw.where)
    angle = sweep.angle(raw.time) + raw.conventions.mark_rad
    loudest = _loudest(raw, sweep)
    checked, dead = check_channels(raw, loudest, angle[loudest], harmonics)
    findings += checked
    missing = float(np.mean(~np.isfinite(raw.displacement)))
    if not dead:
        findings += quality.check_gaps(missing, float(np.max(np.diff(raw.time))) / step, raw.where)
    if raw.orders.any():
        text = "a velocity or an acceleration during a run-up is not integrated; give displacements, or constant speeds"
        findings.append(Finding("error", "no displacement", raw.where, text))
    if errors_among(findings):
        return [Analysed(facts, findings, dead=dead)]
    variance = sweep.jitter_rad**2 / np.median(grid.length * grid.speed / (2 * np.pi))
    resolution = (grid.speed[grid.given].mean() * sweep.resolution_s) ** 2
    nodes = track(raw.displacement, raw.time, angle, grid, harmonics, raw.directions, variance + resolution)
    speed, rate = grid.speed[grid.given], grid.rate[grid.given]
    findings += check_sweep(speed, rate, [one.amplitude for one in nodes], harmonics, raw.where)
    if errors_among(findings):
        return [Analysed(facts, findings, is_tracked=True)]
    single = {node: float(a) for node, a in zip(raw.nodes, raw.directions, strict=True) if np.isfinite(a)}
    tracked, found = dict(zip(raw.nodes, nodes, strict=True)), []
    for k, w in enumerate(speed):
        of_node = {node: (one.amplitude[k], one.covariance[k]) for node, one in tracked.items()}
        seen = {node: node_facts(one.amplitude[k], harmonics, one.noise_std[k]) for node, one in tracked.items()}
        facts = RecordFacts(f"{raw.where}, tracked at {w:.6g} rad/s", seen, measured_speed=float(w))
        facts.revolutions = grid.length[grid.given[k]] * w / (2 * np.pi)
        facts.samples_per_revolution = 2 * np.pi / w / step
        facts.jitter, facts.missing_samples = sweep.jitter_rad, missing
        facts.missing_pulses, facts.doubled_pulses = sweep.missing, sweep.doubled
        found.append(Analysed(facts, [] if k else findings, float(w), of_node, None, single, is_tracked=True))
    return found


def _loudest(raw, sweep):
    """(time,) whether a sample is in the loudest of PIECES of the sweep."""
    edges = np.linspace(sweep.start, sweep.end, PIECES + 1)
    piece = np.clip(np.searchsorted(edges, raw.time) - 1, 0, PIECES - 1)
    moving = np.nan_to_num(raw.displacement - np.nanmean(raw.displacement, axis=1, keepdims=True))
    inside = (raw.time >= edges[0]) & (raw.time <= edges[-1])
    power = np.bincount(piece[inside], np.sum(np.abs(moving[:, inside]) ** 2, axis=0), PIECES)
    return inside & (piece == int(power.argmax()))


def check_sweep(speed, rate, amplitudes, harmonics, where):
    """A note on a sweep, and whether it is too fast for its narrowest resonance.

    speed, rate : (speed,) rad/s, rad/s^2;  amplitudes : of each node (speed, harmonic) complex, m
    """
    rpm = speed / RAD_PER_S["rpm"]
    kind = "run-up" if rate.mean() > 0 else "coast-down"
    text = (
        f"{kind} at {number(abs(np.median(rate)))} rad/s per second, tracked at {len(speed)} speeds from "
        f"{number(rpm[0], 4)} to {number(rpm[-1], 4)} rpm; the transient of the sweep is removed from the harmonics"
    )
    found = [Finding("note", kind, where, text)]
    first = np.flatnonzero(np.abs(harmonics) == 1)
    size = np.sqrt(sum(np.sum(np.abs(one[:, first]) ** 2, axis=1) for one in amplitudes))
    resonances = peaks(speed, size)
    if not resonances:
        return found
    at, bandwidth, _ = min(resonances, key=lambda one: one[1])
    here = abs(float(np.interp(at, speed, rate)))
    ratio = here / bandwidth**2
    if ratio <= FAST[0]:
        return found
    said = (
        f"near {number(at / RAD_PER_S['rpm'], 4)} rpm the speed changes by {number(here)} rad/s per second, "
        f"{number(ratio, 2)} times the square of the half-power bandwidth of {number(bandwidth)} rad/s: transient beats"
    )
    slower = f"run through it at {number(FAST[0] * bandwidth**2, 2)} rad/s per second or less"
    if ratio > FAST[1]:
        found.append(Finding("error", "sweep too fast", where, f"{said}, which cannot be removed; {slower}"))
    else:
        text = f"{said}. They are removed, to about a percent; {slower}"
        found.append(Finding("warning", "sweep too fast", where, text))
    return found
