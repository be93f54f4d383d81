"""From files and a rig file to a spectrum with covariance, clean records, facts and findings."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement import quality
from rotorstudy.measurement.conventions import read_conventions
from rotorstudy.measurement.files import is_table, read_file
from rotorstudy.measurement.findings import Finding, worst_first
from rotorstudy.measurement.harmonics import estimate, fit, with_phase_noise
from rotorstudy.measurement.keyphasor import count_turns, find_pulses, steady_turning
from rotorstudy.measurement.records import Record, compensate, phase_from_reference, reference_signal
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.measurement.tables import read_table
from rotorstudy.model.model import Model
from rotorstudy.model.rig import build_model
from rotorstudy.response.harmonic import measured_response
from rotorstudy.store import as_complex, dataset, load, read_yaml

WHOLE_TURN = 0.01  # turns short of whole that a record may be, as its marks are not exact
FACTS = {  # of each record: unit and long name
    "label": ("rad/s", "speed as labelled"),
    "measured_speed": ("rad/s", "mean speed from the phase marks"),
    "revolutions": ("1", "whole revolutions used"),
    "blocks": ("1", "repeat blocks for the covariance"),
    "samples_per_revolution": ("1", "samples a revolution"),
    "speed_drift": ("1", "change of speed over the record, relative"),
    "jitter": ("rad", "scatter of the phase marks"),
    "mark_resolution": ("rad", "resolution of the phase marks by the sampling"),
    "missing_pulses": ("1", "keyphasor pulses that did not come"),
    "doubled_pulses": ("1", "keyphasor pulses beside the marks"),
    "missing_samples": ("1", "part of the samples that is missing"),
}
NODE_FACTS = {
    "forward_1x": ("m", "amplitude of harmonic 1"),
    "backward_1x": ("m", "amplitude of harmonic -1"),
    "noise_std": ("m", "noise of a sample of x or y"),
    "variance_shrinkage": ("1", "weight of equal variances in the covariance"),
    "correlation_shrinkage": ("1", "weight of no correlation in the covariance"),
}


@dataclass(frozen=True)
class Measurement:
    """What was measured.

    spectrum : Spectrum over all speeds that could be used, or None if none could
    records  : list of Record, clean: whole revolutions, project's axes, time zero at the shaft's reference line, with a
               reference signal; none from tables
    facts    : list of dicts, one a record or speed of a table: `where`, FACTS, and {node: NODE_FACTS} under `nodes`
    findings : list of Finding, worst first
    rig      : Model with the measured nodes as sensors
    """

    spectrum: Spectrum | None
    records: list
    facts: list
    findings: list
    rig: Model

    @property
    def errors(self):
        return [finding for finding in self.findings if finding.severity == "error"]


def read_measurement(paths, rig_path):
    """The Measurement in some files, as the section `measurement:` of a rig file says they are to be read.

    paths  : files of records (NetCDF, CSV, MATLAB, UFF) or tables of harmonics (CSV), in any order
    raises : RotorstudyError for a file that cannot be read or does not fit the rig file. What is wrong with the signals
             themselves is a finding; a record with an error is left out of the spectrum
    """
    paths = [paths] if isinstance(paths, (str, Path)) else list(paths)
    if not paths:
        raise RotorstudyError("no record files; give at least one")
    given = read_yaml(rig_path)
    conventions = read_conventions(given, str(rig_path))
    nodes = build_model(given, str(rig_path)).structure.nodes
    spectra, records, facts, findings = [], [], [], []
    for path in paths:
        if is_table(path, conventions):
            found, notes = read_table(path, conventions, nodes)
            spectra += found
            facts += [_table_facts(path, speed, of_node, conventions.harmonics) for speed, of_node in found]
            findings += notes
            continue
        for raw in read_file(path, conventions, nodes):
            of_record, record, about, told = analyse(raw, raw.conventions)
            findings += told
            facts.append(about)
            if of_record is not None:
                spectra.append(of_record)
                records.append(record)
    sensors = _common_nodes(spectra, facts)
    rig = build_model({**given, "sensors": list(_sensors(given, sensors, rig_path))}, str(rig_path))
    if not spectra:
        return Measurement(None, [], facts, worst_first(findings), rig)
    spectra.sort(key=lambda one: one[0])
    spectrum = Spectrum(
        np.array([np.transpose([of_node[s][0] for s in rig.sensors]) for _, of_node in spectra]),
        np.array([speed for speed, _ in spectra]),
        np.array(conventions.harmonics),
        tuple(rig.sensors),
        np.array([[of_node[s][1] for s in rig.sensors] for _, of_node in spectra]),
    )
    records = [_with_sensors(record, rig.sensors) for record in sorted(records, key=lambda record: record.speed)]
    findings += _check_together(spectrum, rig, ", ".join(Path(path).name for path in paths))
    return Measurement(spectrum, records, facts, worst_first(findings), rig)


def analyse(raw, conventions):
    """Harmonics of one raw record, with everything that is to be said about it.

    returns : (speed, {node: (amplitude, covariance)}), Record, facts, findings; the first two None after an error
    """
    harmonics, where = np.array(conventions.harmonics), raw.where
    facts = {"where": where, "label": np.nan if raw.label is None else raw.label, "nodes": {n: {} for n in raw.nodes}}
    turning, findings, told = _turning(raw, conventions)
    if turning is None:
        return None, None, facts, findings
    angle = turning.angle(raw.time) + told.get("mark_rad", 0.0)
    step = np.median(np.diff(raw.time))
    turns = (angle[-1] - angle[0]) / (2 * np.pi) + turning.speed(raw.time[-1]) * step / (2 * np.pi)
    revolutions = int(np.floor(turns + WHOLE_TURN))
    per_turn = len(raw.time) / turns
    highest = int(np.abs(harmonics).max())
    if revolutions < 1 or per_turn <= 2 * highest or len(raw.time) <= 2 * len(harmonics):
        text = f"{turns:.2f} revolutions; at least one is needed, and six for a covariance. Take a longer record"
        if revolutions >= 1:
            text = (
                f"{per_turn:.3g} samples a revolution; harmonic {highest} needs more than {2 * highest}. Sample "
                "faster, or leave the highest harmonics out of 'measurement: harmonics:'"
            )
        name = "sampling rate" if revolutions >= 1 else "too few revolutions"
        return None, None, facts, [*findings, Finding("error", name, where, text)]
    whole = angle - angle[0] < 2 * np.pi * revolutions - 1e-9
    time, angle = raw.time[whole], angle[whole]
    speeds = turning.speed(time)
    speed, drift = float(speeds.mean()), float((speeds[-1] - speeds[0]) / speeds.mean())
    missing = float(np.mean(~np.isfinite(raw.displacement[:, whole])))
    facts |= {
        "measured_speed": speed,
        "revolutions": revolutions,
        "samples_per_revolution": per_turn,
        "speed_drift": drift,
        "jitter": turning.jitter_rad,
        "mark_resolution": speed * told.get("resolution", 0.0),
        "missing_pulses": turning.missing,
        "doubled_pulses": turning.doubled,
        "missing_samples": missing,
    }
    findings += quality.check_drift(drift, where)
    findings += quality.check_gaps(missing, float(np.max(np.diff(raw.time))) / step, where)
    if missing > quality.GAP[1]:
        return None, None, facts, findings
    findings += _check_channels(raw, whole, angle, harmonics)
    of_node, facts["nodes"] = {}, {}
    mark_variance = turning.phase_variance + facts["mark_resolution"] ** 2
    try:
        psi = _reference_phase(raw, whole, angle, harmonics) if "mark_rad" not in told else None
    except RotorstudyError as error:
        return None, None, facts, [*findings, Finding("error", "reference signal", where, str(error))]
    for node, signal in zip(raw.nodes, raw.displacement[:, whole], strict=True):
        found = estimate(signal, angle, revolutions, harmonics)
        amplitude, covariance = found.amplitude, found.covariance
        if psi is None:
            covariance = with_phase_noise(amplitude, covariance, harmonics, mark_variance)
        else:
            (amplitude,), (covariance,) = compensate(amplitude[None], covariance[None], *psi)
        of_node[node] = amplitude, covariance
        std = np.sqrt(np.diag(covariance)[: len(harmonics)] + np.diag(covariance)[len(harmonics) :])
        fluctuating = harmonics != 0
        place = f"{where}, node {node}"
        findings += quality.check_noise(amplitude[fluctuating], std[fluctuating], place)
        findings += quality.check_steadiness(found.blocks, harmonics, place)
        facts["nodes"][node] = _node_facts(amplitude, harmonics, found.noise_std, found.shrinkage)
        facts["blocks"] = len(found.blocks)
    findings += quality.check_length(revolutions, facts["blocks"], where)
    if any(finding.severity == "error" for finding in findings):
        return None, None, facts, findings
    lead = (angle.mean() - speed * time.mean()) / speed - (0 if psi is None else psi[0][harmonics == 1][0] / speed)
    clock = time + lead
    record = Record(
        clock, raw.displacement[:, whole], speed, raw.nodes, reference_signal(speed, harmonics, clock), None, where
    )
    return (speed, of_node), record, facts, findings


def _turning(raw, conventions):
    """How the shaft turned (None if nothing told), findings, and of phase marks `mark_rad` and `resolution`, s."""
    where, label = raw.where, raw.label
    if raw.keyphasor is None and raw.marks is None:
        if raw.reference is not None and label is not None:
            return steady_turning(label, raw.time), [], {}
        text = "neither keyphasor nor phase mark times; without them no harmonic has a phase. Record one of them"
        return None, [Finding("error", "no phase reference", where, text)], {}
    pulses, settings = None, conventions.keyphasor
    marks = raw.marks
    if marks is None:
        pulses = find_pulses(raw.keyphasor, raw.time, settings)
        if pulses is None:
            text = "no pulse stands out of the keyphasor signal; is it connected, and the right channel?"
            return None, [Finding("error", "dead keyphasor", where, text)], {}
        marks = pulses.time
    turning = count_turns(np.asarray(marks, float))
    if turning is None:
        text = f"{len(marks)} phase marks; at least two are needed. Take a longer record, or check threshold_V"
        return None, [Finding("error", "too few revolutions", where, text)], {}
    findings = quality.check_pulses(pulses, turning, settings.polarity, where)
    speed = float(turning.speed(np.mean(raw.time)))
    findings += quality.check_speed_label(label, speed, where)
    resolution = 0.0 if pulses is None else pulses.resolution
    return turning, findings, {"mark_rad": conventions.mark_rad, "resolution": resolution}


def _reference_phase(raw, whole, angle, harmonics):
    """Phase (harmonic,) of the reference signal's harmonics, and its covariance."""
    from rotorstudy.measurement.records import white_noise_covariance

    amplitude, residual, inverse = fit(raw.reference[whole].astype(complex), angle, harmonics)
    lines = np.unique(np.rint(harmonics * (angle[-1] - angle[0]) / (2 * np.pi)).astype(int) % len(residual))
    covariance = white_noise_covariance(residual, inverse, lines)
    record = Record(raw.time, raw.displacement, raw.label, raw.nodes, where=raw.where)
    return phase_from_reference(record, harmonics, amplitude, covariance)


def _check_channels(raw, whole, angle, harmonics):
    findings = []
    for node in raw.nodes:
        of_node = [(name, values[whole]) for name, at, values in raw.channels if at == node]
        largest = max(np.nanstd(values) for _, values in of_node)
        for name, values in of_node:
            findings += quality.check_channel(name, node, values, angle, harmonics, largest, raw.where)
    return findings


def _node_facts(amplitude, harmonics, noise_std, shrinkage):
    found = {
        "noise_std": noise_std,
        "variance_shrinkage": float(shrinkage[0]),
        "correlation_shrinkage": float(shrinkage[1]),
    }
    for name, n in (("forward_1x", 1), ("backward_1x", -1)):
        if n in harmonics:
            found[name] = float(np.abs(amplitude[list(harmonics).index(n)]))
    return found


def _table_facts(path, speed, of_node, harmonics):
    nodes = {
        node: _node_facts(amplitude, harmonics, np.nan, (np.nan, np.nan)) for node, (amplitude, _) in of_node.items()
    }
    return {"where": f"{path}, {speed:.6g} rad/s", "label": speed, "measured_speed": np.nan, "nodes": nodes}


def _common_nodes(spectra, facts):
    """Nodes of all records; different ones are an error that says where."""
    first = set(facts[0]["nodes"])
    for one in facts:
        if set(one["nodes"]) != first:
            raise RotorstudyError(
                f"{one['where']} has nodes {sorted(one['nodes'])}, {facts[0]['where']} has {sorted(first)}; all "
                "records of one measurement need the same probes"
            )
    return first


def _sensors(given, measured, rig_path):
    """Sensors for the rig: those the rig file names, if they were measured, or all that were."""
    wanted = given.get("sensors") or sorted(measured)
    for node in wanted:
        if node not in measured:
            raise RotorstudyError(
                f"{rig_path}: sensors has node {node}, but the records are of nodes {sorted(measured)}; leave it out"
            )
    return wanted


def _with_sensors(record, sensors):
    chosen = [record.sensors.index(node) for node in sensors]
    return replace(record, displacement=record.displacement[chosen], sensors=tuple(sensors))


def _check_together(spectrum, rig, where):
    """Findings that need all speeds: sense of rotation, and units against what the rig is expected to do."""
    harmonics = list(spectrum.harmonics)
    fluctuating = spectrum.amplitude[:, np.array(harmonics) != 0]
    rms = np.sqrt(np.sum(np.abs(fluctuating) ** 2, axis=1))
    expected, backward, mean = _expected(rig, spectrum.speed)
    findings = quality.check_units(rms, expected, where)
    if 0 in harmonics:
        findings += quality.check_mean(spectrum.amplitude[:, harmonics.index(0)], mean, rms, spectrum.sensors, where)
    if -1 in harmonics:
        forward, turned = (np.abs(spectrum.amplitude[:, harmonics.index(n)]) for n in (1, -1))
        findings += quality.check_sense(forward, turned, backward, spectrum.sensors, where)
    return findings


def _expected(rig, speeds):
    """By the rig's own values: size of the vibration, m or None; (sensor,) whether it whirls backward; 0X there, m.

    Without values for all parameters the size is the static deflection, and the rig is taken to whirl forward.
    """
    try:
        shown = measured_response(rig, speeds, [1, -1, 0])
    except RotorstudyError:
        deflection = rig.structure.static_deflection
        at_sensors = deflection[list(rig.measured)]
        return float(np.abs(deflection).max()) or None, np.zeros(len(rig.sensors), bool), at_sensors
    size = np.abs(shown[:, :2])
    power = np.sum(size**2, axis=0)
    return float(size.max()) or None, power[1] > power[0], shown[:, 2]


def measurement_dataset(measurement):
    """The Measurement as a Dataset: spectrum, covariance, facts and findings.

    returns : amplitude (speed, harmonic, node, part) m; covariance (speed, node, component, other_component) m^2; facts
              (record) and (record, node); finding_severity, finding_name, finding_where, finding_text (finding)
    """
    spectrum, facts, findings = measurement.spectrum, measurement.facts, measurement.findings
    if spectrum is None:
        raise RotorstudyError("no record could be used; see the findings")
    components = [f"{part} {n}X" for part in ("real", "imag") for n in spectrum.harmonics]
    square = ("speed", "node", "component", "other_component")
    variables = {
        "amplitude": (("speed", "harmonic", "node"), spectrum.amplitude, "m", "harmonics of the displacement x + j y"),
        "covariance": (square, spectrum.covariance, "m2", "covariance of real and imaginary parts of the harmonics"),
        "where": (("record",), np.array([one["where"] for one in facts], object), "1", "file and speed"),
    }
    for name, (unit, long_name) in FACTS.items():
        variables[name] = (("record",), np.array([one.get(name, np.nan) for one in facts], float), unit, long_name)
    for name, (unit, long_name) in NODE_FACTS.items():
        values = [[one["nodes"][node].get(name, np.nan) for node in spectrum.sensors] for one in facts]
        variables[name] = (("record", "node"), np.array(values, float), unit, long_name)
    for name in ("severity", "name", "where", "text"):
        said = np.array([getattr(finding, name) for finding in findings], object)
        variables[f"finding_{name}"] = (("finding",), said, "1", f"{name} of the finding")
    coordinates = {
        "speed": (spectrum.speed, "rad/s", "spin speed"),
        "harmonic": (spectrum.harmonics, "1", "harmonic, n > 0 forward, n < 0 backward"),
        "node": (np.array(spectrum.sensors), "1", "node"),
        "component": (components, "1", "part of which harmonic"),
        "other_component": (components, "1", "part of which harmonic"),
    }
    return dataset(variables, coordinates, title="measured spectrum")


def load_spectrum(path):
    """The Spectrum in a file that `rotorstudy import` wrote."""
    if not Path(path).is_file():
        raise RotorstudyError(f"spectrum file '{path}' does not exist")
    try:
        data = load(path)
    except (OSError, ValueError) as error:
        raise RotorstudyError(f"{path}: not a NetCDF file that can be read ({str(error).splitlines()[0]})") from None
    lacking = [name for name in ("amplitude", "covariance") if name not in data]
    if lacking:
        raise RotorstudyError(f"{path}: no variable '{lacking[0]}'; write it by 'rotorstudy import'")
    return Spectrum(
        as_complex(data.amplitude.transpose("speed", "harmonic", "node", "part")),
        data.speed.values,
        data.harmonic.values,
        tuple(int(node) for node in data.node.values),
        data.covariance.transpose("speed", "node", "component", "other_component").values,
    )
