"""One raw record to harmonics with covariance, a clean record, facts and findings."""

from dataclasses import dataclass, field

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement import quality
from rotorstudy.measurement.angle_fit import fit_each
from rotorstudy.measurement.facts import NodeFacts, RecordFacts, node_facts
from rotorstudy.measurement.findings import Finding, errors_among
from rotorstudy.measurement.full_spectra import compensate, phase_from_reference
from rotorstudy.measurement.harmonics import estimate, fit_basis, white_noise_covariance, with_phase_noise
from rotorstudy.measurement.keyphasor import count_revolutions, find_pulses, steady_turning
from rotorstudy.measurement.records import Record, reference_signal
from rotorstudy.response.series import rotating_basis

NO_MEAN = 1e-3  # m, standard deviation of the mean displacement where a velocity or an acceleration is measured
SLOWEST = 0.2  # of the speed: what a velocity or an acceleration shows of slower motion is drift
WHOLE_REVOLUTION = 0.01  # revolutions by which a record may fall short of a whole number: its marks are not exact


@dataclass(frozen=True)
class Analysed:
    """Result of one raw record, or of one speed of a table.

    harmonics : {node: (amplitude (harmonic,) complex m, covariance (component, component) m^2)}, None after an error
    directions : {node: rad} of the nodes with a single probe
    dead       : {(node, channel)} of dead probes
    is_tracked : whether it is of a run-up or coast-down
    """

    facts: RecordFacts
    findings: list[Finding]
    speed: float = np.nan
    harmonics: dict | None = None
    record: Record | None = None
    directions: dict = field(default_factory=dict)
    dead: frozenset = frozenset()
    is_tracked: bool = False


def analyse(raw, with_signals=True):
    """The Analysed of a RawRecord: harmonics with covariance, the clean record if wanted, facts and findings."""
    where, harmonics = raw.where, np.array(raw.conventions.harmonics)
    facts = RecordFacts(where, {node: NodeFacts() for node in raw.nodes})
    facts.label = np.nan if raw.label is None else raw.label
    turning, findings = _turning(raw)
    if turning is None:
        return Analysed(facts, findings)
    by_marks = raw.keyphasor is not None or raw.marks is not None
    angle = turning.angle(raw.time) + (raw.conventions.mark_rad if by_marks else 0.0)
    step = np.median(np.diff(raw.time))
    held = (angle[-1] - angle[0]) / (2 * np.pi) + turning.speed(raw.time[-1]) * step / (2 * np.pi)
    wrong = quality.check_sampling(len(raw.time), held + WHOLE_REVOLUTION, harmonics, where)
    if wrong:
        return Analysed(facts, [*findings, *wrong])
    revolutions = int(np.floor(held + WHOLE_REVOLUTION))
    whole = angle - angle[0] < 2 * np.pi * revolutions - 1e-9
    time, angle, signals = raw.time[whole], angle[whole], raw.displacement[:, whole]
    speed = float(turning.speed(time).mean())
    signals = integrated(signals, raw.orders, time, speed)
    _fill_in(facts, turning, time, speed, revolutions, len(raw.time) / held, float(np.mean(~np.isfinite(signals))))
    findings += quality.check_drift(facts.speed_drift, where)
    checked, dead = check_channels(raw, whole, angle, harmonics)
    findings += checked
    if dead:
        return Analysed(facts, findings, dead=dead)
    findings += quality.check_gaps(facts.missing_samples, float(np.max(np.diff(raw.time))) / step, where)
    if facts.missing_samples > quality.GAP[1]:
        return Analysed(facts, findings)
    try:
        psi = None if by_marks else _reference_phase(raw, whole, angle, harmonics)
    except RotorstudyError as error:
        return Analysed(facts, [*findings, Finding("error", "reference signal", where, str(error))])
    mark_variance = turning.jitter_rad**2 / len(turning.marks) + facts.mark_resolution**2
    of_node, noted = _harmonics_of_nodes(raw, facts, signals, angle, psi, mark_variance)
    findings += noted + quality.check_length(revolutions, facts.blocks, where)
    if errors_among(findings):
        return Analysed(facts, findings)
    single = {node: float(a) for node, a in zip(raw.nodes, raw.directions, strict=True) if np.isfinite(a)}
    if not with_signals:
        return Analysed(facts, findings, speed, of_node, None, single)
    lead = (angle.mean() - speed * time.mean()) / speed - (0 if psi is None else psi[0][harmonics == 1][0] / speed)
    marks = turning.whole_marks - raw.conventions.mark_rad / speed + lead if by_marks else None
    reference = reference_signal(speed, harmonics, time + lead)
    record = Record(time + lead, signals, speed, raw.nodes, reference, None, where, marks)
    return Analysed(facts, findings, speed, of_node, record, single)


def integrated(signals, orders, time, speed):
    """Displacements (node, time), m, without their mean and what is slower than SLOWEST, of whole revolutions.

    orders : (node,) of the derivative by time that each of the signals (node, time) is; zeros are left as they are
    """
    found = signals.copy()
    frequency = 2 * np.pi * np.fft.fftfreq(len(time), np.median(np.diff(time)))
    kept = np.abs(frequency) > SLOWEST * speed
    for i in np.flatnonzero(orders):
        there = np.isfinite(signals[i])
        spectrum = np.fft.fft(np.interp(time, time[there], signals[i, there]) if there.any() else signals[i])
        spectrum[kept] /= (1j * frequency[kept]) ** orders[i]
        found[i] = np.where(there, np.fft.ifft(np.where(kept, spectrum, 0)), np.nan)
    return found


def _turning(raw):
    """The Turning of a raw record, None if the record does not determine it, and findings."""
    where, settings = raw.where, raw.conventions.keyphasor
    if raw.keyphasor is None and raw.marks is None:
        if raw.reference is not None and raw.label is not None:
            return steady_turning(raw.label, raw.time), []
        text = "neither keyphasor nor phase mark times; the phase of the harmonics is undetermined. Record one of them"
        return None, [Finding("error", "no phase reference", where, text)]
    pulses, marks = None, raw.marks
    if marks is None:
        pulses = find_pulses(raw.keyphasor, raw.time, settings)
        if pulses is None:
            text = "the keyphasor signal has no pulse above its noise; check the connection and the channel name"
            return None, [Finding("error", "dead keyphasor", where, text)]
        marks = pulses.time
    turning = count_revolutions(np.asarray(marks, float), 0.0 if pulses is None else pulses.resolution)
    if turning is None:
        text = f"{len(marks)} phase marks; at least two are needed. Take a longer record, or check threshold_V"
        return None, [Finding("error", "too few revolutions", where, text)]
    findings = quality.check_pulses(pulses, turning, settings.polarity, where)
    findings += quality.check_speed_label(raw.label, float(turning.speed(np.mean(raw.time))), where)
    return turning, findings


def _fill_in(facts, turning, time, speed, revolutions, samples_per_revolution, missing_samples):
    """Fill in the RecordFacts that follow from the Turning."""
    first, last = turning.speed(time[[0, -1]])
    facts.measured_speed = speed
    facts.revolutions = revolutions
    facts.samples_per_revolution = samples_per_revolution
    facts.speed_drift = float((last - first) / speed)
    facts.jitter = turning.jitter_rad
    facts.mark_resolution = speed * turning.resolution_s
    facts.missing_pulses, facts.doubled_pulses = turning.missing, turning.doubled
    facts.missing_samples = missing_samples


def _harmonics_of_nodes(raw, facts, signals, angle, psi, mark_variance):
    """{node: (amplitude, covariance)} of a record, and findings on them; its facts are filled in.

    psi : of `_reference_phase`; None if the angle is counted from the marks, whose variance is then in the covariance
    """
    harmonics, of_node, findings = np.array(raw.conventions.harmonics), {}, []
    fits = fit_each(signals, angle, harmonics)
    for node, signal, direction, fit, order in zip(raw.nodes, signals, raw.directions, fits, raw.orders, strict=True):
        found = estimate(signal, angle, int(facts.revolutions), harmonics, direction, fit)
        amplitude, covariance = found.amplitude, found.covariance
        if psi is None:
            covariance = with_phase_noise(amplitude, covariance, harmonics, mark_variance)
        else:
            (amplitude,), (covariance,) = compensate(amplitude[None], covariance[None], *psi)
        if order:
            covariance = covariance + NO_MEAN**2 * np.diag(np.tile(harmonics == 0, 2))
        of_node[node] = amplitude, covariance
        findings += _check_harmonics(amplitude, covariance, found.blocks, harmonics, f"{raw.where}, node {node}")
        facts.nodes[node] = node_facts(amplitude, harmonics, found.noise_std, found.shrinkage, found.lines)
        facts.blocks = len(found.blocks)
    return of_node, findings


def _reference_phase(raw, whole, angle, harmonics):
    """Phase (harmonic,) of the reference signal's harmonics, and its covariance."""
    basis = rotating_basis(angle, 1.0, harmonics)
    amplitude, residual, inverse = fit_basis(raw.reference[whole].astype(complex), basis)
    lines = np.unique(np.rint(harmonics * (angle[-1] - angle[0]) / (2 * np.pi)).astype(int) % len(residual))
    covariance = white_noise_covariance(residual, inverse, lines)
    return phase_from_reference(raw.where, harmonics, amplitude, covariance)


def check_channels(raw, chosen, angle, harmonics):
    """Findings on each probe from some samples (time,) mask, and the dead ones {(node, channel)}."""
    findings, dead = [], set()
    channels = [(node, channel) for node in raw.nodes for channel in raw.at(node)]
    readings = np.array([channel.readings[chosen] for _, channel in channels])
    seen_by_all = quality.seen_by(readings, angle, harmonics)
    for node in raw.nodes:
        own = [i for i, (place, _) in enumerate(channels) if place == node]
        for i in own:
            channel, others = channels[i][1], [seen_by_all[k] for k in own if k != i]
            found = quality.check_channel(channel.name, node, readings[i], seen_by_all[i], others, raw.where)
            findings += found
            if any(finding.name == "dead probe" for finding in found):
                dead.add((node, channel.name))
    return findings, frozenset(dead)


def _check_harmonics(amplitude, covariance, blocks, harmonics, where):
    """Findings on the noise of the harmonics and on their change over the record."""
    std, moving = np.sqrt(np.diag(covariance).reshape(2, -1).sum(axis=0)), harmonics != 0
    noisy = quality.check_noise(amplitude[moving], std[moving], where)
    return noisy + quality.check_steadiness(blocks, harmonics, where)
