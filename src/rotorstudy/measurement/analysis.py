"""One raw record to harmonics with covariance, a clean record, facts and findings."""

from dataclasses import replace

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement import quality
from rotorstudy.measurement.angle_fit import fit_each, fit_harmonics
from rotorstudy.measurement.findings import NodeFacts, RecordFacts, errors_among, node_facts, told
from rotorstudy.measurement.full_spectra import compensate, phase_from_reference
from rotorstudy.measurement.harmonics import FEWEST_BLOCKS, estimate, spectral_lines, white_noise_covariance
from rotorstudy.measurement.keyphasor import count_revolutions, pulses_of, steady_turning
from rotorstudy.measurement.records import Record, reference_signal
from rotorstudy.measurement.run_up import FAST, LOST, REMOVED, is_swept, peaks, speed_grid, track
from rotorstudy.units import RAD_PER_S, number, spin, um

NO_MEAN = 1e-3  # m, standard deviation of the mean displacement where a velocity or an acceleration is measured
SLOWEST = 0.2  # of the speed: what a velocity or an acceleration shows of slower motion is drift
STEEP = 8  # power of the frequency with which it fades: integrated noise shows no line there, and 1X loses 3e-6
WHOLE_REVOLUTION = 0.01  # revolutions by which a record may fall short of a whole number: its marks are not exact
PIECES = 50  # of a record, of which the loudest shows the state of the probes
MOST_ROUNDED = 2  # steps from one sample to the next where times are rounded; beyond it samples are missing
STEPS_BESIDE = 51  # whose median is the usual step there: samples at equal angles come closer during a run-up
REVOLUTIONS = 8  # at least, in the pieces in which spikes are sought


def _steady(facts, raw, pulses, with_signals):
    """Adds to the RecordFacts of a record at one speed all that it says, and the clean record if wanted."""
    where, harmonics = raw.where, np.array(raw.conventions.harmonics)
    facts.label = np.nan if raw.label is None else raw.label
    turning, findings = _turning(raw, pulses)
    facts.findings += findings
    if turning is None:
        return
    by_marks = raw.keyphasor is not None or raw.marks is not None
    angle = turning.angle(raw.time) + (raw.conventions.mark_rad if by_marks else 0.0)
    step = np.median(np.diff(raw.time))
    held = (angle[-1] - angle[0]) / (2 * np.pi) + turning.speed(raw.time[-1]) * step / (2 * np.pi)
    wrong = list(quality.check_sampling(len(raw.time), held + WHOLE_REVOLUTION, harmonics, where))
    facts.findings += wrong
    if wrong:
        return
    revolutions = int(np.floor(held + WHOLE_REVOLUTION))
    whole = angle - angle[0] < 2 * np.pi * revolutions - 1e-9
    time, angle, signals = raw.time[whole], angle[whole], raw.displacement[:, whole]
    speed = float(turning.speed(time).mean())
    signals = integrated(signals, raw.orders, time, speed)
    first, last = turning.speed(time[[0, -1]])
    facts.measured_speed, facts.speed_drift = speed, float((last - first) / speed)
    facts.revolutions, facts.samples_per_revolution = revolutions, len(raw.time) / held
    facts.jitter, facts.mark_resolution = turning.jitter_rad, speed * turning.resolution_s
    facts.missing_pulses, facts.doubled_pulses = turning.missing, turning.doubled
    facts.missing_samples = float(np.mean(~np.isfinite(signals)))
    facts.findings += quality.check_drift(facts.speed_drift, where)
    _check_signals(facts, raw, whole, angle, facts.missing_samples)
    if facts.dead or facts.missing_samples > quality.GAP[1]:
        return
    mark_variance = turning.jitter_rad**2 / len(turning.marks) + facts.mark_resolution**2
    psi = np.zeros(len(harmonics)), mark_variance * np.outer(harmonics, harmonics)
    try:
        psi = psi if by_marks else _reference_phase(raw, whole, angle, harmonics)
    except RotorstudyError as error:
        facts.findings.append(told("reference signal", where, problem=error))
        return
    facts.findings += _find_harmonics(raw, facts, signals, angle, psi)
    if facts.blocks < FEWEST_BLOCKS:
        facts.findings.append(told("few revolutions", where, revolutions=revolutions, needed=FEWEST_BLOCKS))
    if errors_among(facts.findings):
        return
    facts.speed = speed
    if not with_signals:
        return
    lead = (angle.mean() - speed * time.mean()) / speed - psi[0][harmonics == 1][0] / speed
    marks = turning.whole_marks - raw.conventions.mark_rad / speed + lead if by_marks else None
    reference = reference_signal(speed, harmonics, time + lead)
    facts.record = Record(time + lead, signals, speed, raw.nodes, reference, None, where, marks)


def integrated(signals, orders, time, speed):
    """Displacements (node, time), m, without what is slower than SLOWEST; orders : (node,) of derivative of each."""
    found = signals.copy()
    frequency = 2 * np.pi * np.fft.fftfreq(len(time), np.median(np.diff(time)))
    passed = _passed(frequency[1:] / speed)
    for i in np.flatnonzero(orders):
        there = np.isfinite(signals[i])
        spectrum = np.fft.fft(np.interp(time, time[there], signals[i, there]) if there.any() else signals[i])
        spectrum[1:] *= passed / (1j * frequency[1:]) ** orders[i]
        spectrum[0] = 0
        found[i] = np.where(there, np.fft.ifft(spectrum), np.nan)
    return found


def _passed(orders):
    """Share that integration leaves of motion at some orders."""
    return 1 / (1 + (SLOWEST / np.asarray(orders)) ** STEEP)


def _turning(raw, pulses):
    """The Turning of a raw record, None if the record does not determine it, and findings."""
    where = raw.where
    if raw.keyphasor is None and raw.marks is None:
        if raw.reference is not None and raw.label is not None:
            return steady_turning(raw.label, raw.time), []
        return None, [told("no phase reference", where)]
    if pulses is None:
        return None, [told("dead keyphasor", where)]
    turning = count_revolutions(pulses.time, pulses.resolution)
    if turning is None:
        return None, [told("too few revolutions (marks)", where, count=len(pulses.time))]
    findings = [*quality.check_pulses(pulses, turning, raw.conventions.keyphasor.polarity, where)]
    return turning, [*findings, *quality.check_speed_label(raw.label, float(turning.speed(np.mean(raw.time))), where)]


def _find_harmonics(raw, facts, signals, angle, psi):
    """Adds to facts the harmonics of nodes; returns findings. psi : phases (harmonic,), rad, and their covariance."""
    harmonics, findings = np.array(raw.conventions.harmonics), []
    *fits, drift = fit_each(np.array([*signals, angle - angle.mean()]), angle, harmonics)
    for node, signal, direction, fit, order in zip(raw.nodes, signals, raw.directions, fits, raw.orders, strict=True):
        facts.nodes[node] = own = estimate(signal, angle, int(facts.revolutions), harmonics, direction, fit, drift)
        (own.amplitude,), (own.covariance,) = compensate(own.amplitude[None], own.covariance[None], *psi)
        if order:
            own.covariance = own.covariance + NO_MEAN**2 * np.diag(np.tile(harmonics == 0, 2))
            left = [(line, _passed(line.order)) for line in own.lines if line.order > SLOWEST]
            own.lines = tuple(one._replace(forward=one.forward / by, backward=one.backward / by) for one, by in left)
        findings += quality.check_noise(own, harmonics, f"{raw.where}, node {node}")
        facts.blocks = len(own.blocks)
    return findings


def _reference_phase(raw, whole, angle, harmonics):
    """Phase (harmonic,) of the reference signal's harmonics, and its covariance."""
    amplitude, residual, inverse = fit_harmonics(raw.reference[whole].astype(complex), angle, harmonics)
    covariance = white_noise_covariance(residual, inverse, spectral_lines(angle, 1.0, harmonics))
    return phase_from_reference(raw.where, harmonics, amplitude, covariance)


def _check_signals(facts, raw, chosen, angle, missing):
    """Adds to RecordFacts dead probes and findings on the signals. missing : fraction of the samples."""
    findings, facts.dead = quality.check_channels(raw, chosen, angle)
    facts.findings += findings
    if not facts.dead:
        steps = np.diff(raw.time)
        facts.findings += quality.check_gaps(missing, float(np.max(steps)) / np.median(steps), raw.where)


def analyse_each(raw, with_signals=True):
    """RecordFacts of a raw record: one, or of a run-up or coast-down one for each speed at which it was tracked."""
    pulses = pulses_of(raw, raw.conventions.keyphasor)
    raw, findings = _without_spikes(raw, 1 if pulses is None else len(pulses.time) // REVOLUTIONS)
    single = {node: float(a) for node, a in zip(raw.nodes, raw.directions, strict=True) if np.isfinite(a)}
    facts = RecordFacts(raw.where, {node: NodeFacts() for node in raw.nodes}, findings=findings, directions=single)
    if pulses is not None and is_swept(pulses.time):
        return _tracked(facts, raw, pulses)
    _steady(facts, raw, pulses, with_signals)
    return [facts]


def _without_spikes(raw, pieces):
    """A raw record whose samples that are no motion of the shaft are missing, and findings on them."""
    channels, findings = [], []
    for channel in raw.channels:
        odd = quality.spikes(channel.readings, int(np.clip(pieces, 1, PIECES)))
        if odd.any():
            place = quality.place_of(raw.where, channel.node, channel.name)
            value = um(channel.readings[odd][0], 4)
            findings.append(told("spikes", place, count=odd.sum(), value=value, first=int(odd.argmax()) + 1))
        channels.append(channel._replace(readings=np.where(odd, np.nan, channel.readings)))
    return (replace(raw, channels=channels) if findings else raw), findings


def _tracked(whole, raw, pulses):
    """The RecordFacts of each speed of a sweep, by those of the whole without harmonics, which it is after an error."""
    from scipy.ndimage import median_filter

    sweep = count_revolutions(pulses.time, pulses.resolution, swept=True)
    findings = whole.findings
    findings += quality.check_pulses(pulses, sweep, raw.conventions.keyphasor.polarity, raw.where)
    harmonics = np.array(raw.conventions.harmonics)
    grid, step = speed_grid(sweep), np.median(np.diff(raw.time))
    fastest = grid.speed.max() / (2 * np.pi)
    findings += quality.check_sampling(len(raw.time), len(raw.time) * step * fastest, harmonics, raw.where)
    steps = np.diff(raw.time)
    steps = np.rint(steps / np.maximum(median_filter(steps, STEPS_BESIDE), step / MOST_ROUNDED))
    row = np.concatenate([[0], np.cumsum(np.where(steps > MOST_ROUNDED, steps, 1))])  # with those that time leaves out
    loudest, missing = _loudest(raw, sweep), float(1 - np.isfinite(raw.displacement).mean() * len(row) / (row[-1] + 1))
    _check_signals(whole, raw, loudest, sweep.angle(raw.time[loudest]) + raw.conventions.mark_rad, missing)
    if errors_among(findings):
        return [whole]
    variance = sweep.jitter_rad**2 / (grid.length * grid.speed / (3 * np.pi))  # of the marks in 2/3 of a Hann window
    resolution = (grid.speed[grid.given].mean() * sweep.resolution_s) ** 2
    time = np.interp(np.arange(row[-1] + 1), row, raw.time)
    signals, angle = np.full((len(raw.nodes), len(time)), np.nan, complex), sweep.angle(time) + raw.conventions.mark_rad
    signals[:, row.astype(int)] = np.where(sweep.is_followed(raw.time), raw.displacement, np.nan)
    *tracked, known = track(signals, time, angle, grid, harmonics, raw.directions, variance, resolution)
    for i in np.flatnonzero(raw.orders):
        _to_displacement(*(part[i] for part in tracked), grid.speed[grid.given], harmonics, raw.orders[i])
    findings += check_sweep(grid, known, tracked[0], harmonics, raw.where)
    tracked, grid = [part[:, known] for part in tracked], grid._replace(given=grid.given[known])
    speed = grid.speed[grid.given]
    whole.is_tracked = True
    if errors_among(findings):
        return [whole]
    whole.jitter, whole.missing_samples = sweep.jitter_rad, missing
    whole.missing_pulses, whole.doubled_pulses = sweep.missing, sweep.doubled
    found = []
    for k, w in enumerate(speed):
        each = [node_facts(a, c, harmonics, std) for a, c, std in zip(*(part[:, k] for part in tracked), strict=True)]
        of_node = dict(zip(raw.nodes, each, strict=True))
        where, own = f"{raw.where}, tracked at {spin(w, 6)}", [] if k else findings
        facts = replace(whole, where=where, nodes=of_node, measured_speed=float(w), speed=float(w), findings=own)
        facts.revolutions = grid.length[grid.given[k]] * w / (2 * np.pi)
        facts.samples_per_revolution = 2 * np.pi / w / step
        found.append(facts)
    return found


def _to_displacement(amplitude, covariance, noise, speed, harmonics, order):
    """Changes tracked harmonics of a derivative (speed, harmonic), and what belongs to them, to the displacement's."""
    moving = harmonics != 0
    factor = np.where(moving, (1j * np.where(moving, harmonics, 1) * speed[:, None]) ** -float(order), 0)
    turned = factor[..., None] * np.eye(len(harmonics))
    turned = np.block([[turned.real, -turned.imag], [turned.imag, turned.real]])
    amplitude *= factor
    covariance[:] = turned @ covariance @ np.swapaxes(turned, 1, 2) + NO_MEAN**2 * np.diag(np.tile(~moving, 2))
    noise /= speed**order


def _loudest(raw, sweep):
    """(time,) whether a sample is in the loudest of PIECES of the sweep."""
    edges = np.linspace(*sweep.ends, PIECES + 1)
    piece = np.clip(np.searchsorted(edges, raw.time) - 1, 0, PIECES - 1)
    moving = np.nan_to_num(raw.displacement - np.nanmean(raw.displacement, axis=1, keepdims=True))
    inside = (raw.time >= edges[0]) & (raw.time <= edges[-1])
    power = np.bincount(piece[inside], np.sum(np.abs(moving[:, inside]) ** 2, axis=0), PIECES)
    return inside & (piece == int(power.argmax()))


def check_sweep(grid, known, amplitude, harmonics, where):
    """A note on a sweep, amplitude (node, speed, harmonic), and whether it is too fast for its narrowest resonance."""
    speed, rate, rpm = grid.speed[grid.given], grid.rate[grid.given], RAD_PER_S["rpm"]
    if known.any():
        kind, (first, *_, last) = "run-up" if rate.mean() > 0 else "coast-down", [*speed[known], speed[known][-1]]
        said = {"kind": kind, "rate": number(abs(np.median(rate))), "count": known.sum(), "every": len(known)}
        yield told(kind, where, **said, first=number(first / rpm, 4), last=number(last / rpm, 4))
    else:
        yield told("no speed", where, every=len(known))
    there = np.isfinite(amplitude).all(axis=(0, 2))
    speed, rate, once = speed[there], rate[there], amplitude[:, there][..., np.abs(harmonics) == 1]
    resonances = peaks(speed, np.sqrt(np.sum(np.abs(once) ** 2, axis=(0, 2))))
    if not resonances:
        return
    at, bandwidth, _ = min(resonances, key=lambda one: one[1])
    here = abs(float(np.interp(at, speed, rate)))
    ratio = here / bandwidth**2
    if (transient := 4 * ratio) > REMOVED:  # rate over the squared decay rate, of the peak
        yield told("moving frequency", where, at=number(at / rpm, 4), share=number(100 * transient, 2))
    if ratio <= FAST:
        return
    beats = (
        f"near {number(at / rpm, 4)} rpm the speed changes by {number(here)} rad/s per second, {number(ratio, 2)} "
        f"times the square of the half-power bandwidth of {number(bandwidth)} rad/s: transient beats"
    )
    slower = f"run through it at {number(FAST * bandwidth**2, 2)} rad/s per second or less"
    lost = " (lost)" * (ratio > LOST)
    yield told(f"sweep too fast{lost}", where, beats=beats, slower=slower)
