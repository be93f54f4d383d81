"""Records of a study, and their full spectra."""

from functools import partial

import numpy as np

from rotorstudy.measurement.full_spectra import PHASES, full_spectra
from rotorstudy.measurement.records import Record, keyphasor_signal, reference_signal, simulate_records
from rotorstudy.model.registry import registry
from rotorstudy.response.integration import time_response, transient_response
from rotorstudy.store import as_complex
from rotorstudy.studies.common import results


def steady_state(config, model, speeds, late_samples=0.0):
    """(speed, node, time) steady state in closed form, m; late_samples : delay of the start of the record."""
    options = {"start_angle_rad": late_samples * config.record.step * np.asarray(speeds), "keyphasor_wanted": False}
    found = simulate_records(model, speeds, config.harmonics, config.record.time, **options)
    return np.array([record.displacement for record in found])


def from_rest(config, model, speeds, late_samples=0.0):
    """(speed, node, time) motion after a start from rest and the settling time, with the remaining transient, m."""
    record, speeds = config.record, np.asarray(speeds, float)
    time = record.time + late_samples * record.step
    settled = np.ceil(record.settling_s * speeds / (2 * np.pi) - 1e-9) * 2 * np.pi / speeds  # whole revolutions
    move = transient_response if record.from_rest == "exact" else partial(time_response, relative_tolerance=1e-8)
    found = (move(model, w, time + start) for w, start in zip(speeds, settled, strict=True))
    return np.array([model.seen(motion).T for motion in found])


SOURCES = {"steady state": steady_state, "from rest": from_rest}


def simulate(config, rig):
    """A Dataset of the records of a rig at the shown speeds: the steady state in closed form, and from rest."""
    model, speeds = config.rig(rig), config.shown_speeds_rad_s
    given = config.coordinates | {"source": list(SOURCES), "node": list(model.sensors), "time": config.record.time}
    given["displacement"] = [make(config, model, speeds) for make in SOURCES.values()]
    return results("records", f"{config.title}: records, rig {rig}", **given)


def take(config, kind, signal, speed, sensors):
    """The Record of a RecordKind from a signal (node, time), m, which already starts late if it should."""
    record, cut = config.record, kind.dropped_samples
    angle_time = record.time[cut:] + kind.late_samples * record.step
    marks = reference_signal(speed, config.harmonics, angle_time), keyphasor_signal(speed, angle_time)
    taken = record.time[cut:] - record.time[cut], signal[..., cut:]
    return Record(*taken, float(speed), sensors, *marks, f"record at {speed:g} rad/s")


def kind_spectra(config, kind, records, name, phases):
    """Phase -> Spectrum of records of one kind by a spectrum method; phase "none" from the time origin of that kind."""
    method = registry().get("spectrum", name)
    found = full_spectra(records, config.harmonics, method, phases, whole_revolutions=kind.whole_revolutions)
    early = kind.clock_samples.get(name, 0) * config.record.step
    if "none" in phases and early:
        spectrum = found["none"]
        shift = np.exp(1j * np.multiply.outer(spectrum.speed, spectrum.harmonics) * early)
        found["none"] = spectrum.with_amplitude(spectrum.amplitude * shift[..., None])
    return found


def spectra(config, rig, records):
    """A Dataset of spectra of the records of `simulate` by every kind (some are late), method and reference."""
    methods, kinds, records = config.spectra, config.record.kinds, records[rig]
    displacement = as_complex(records.displacement)  # (source, speed, node, time)
    speeds, sensors = records.speed.values, tuple(int(n) for n in records.node.values)
    sources, size = records.source.values, (len(speeds), len(config.harmonics))
    found = np.zeros((len(sources), len(kinds), len(methods), len(PHASES), *size, len(sensors)), complex)
    reference_phase = np.zeros((len(kinds), len(methods), *size))
    for k, kind in enumerate(kinds.values()):
        for s, w in enumerate(speeds):
            taken = [take(config, kind, _delayed(z, kind.late_samples), w, sensors) for z in displacement[:, s]]
            mark = Record(taken[0].time, taken[0].reference[None], float(w), sensors[:1])
            for m, name in enumerate(methods):
                reference = kind_spectra(config, kind, [mark], name, ["none"])["none"]
                reference_phase[k, m, s] = np.angle(reference.amplitude[0, :, 0])
                for o, record in enumerate(taken):
                    seen = kind_spectra(config, kind, [record], name, PHASES)
                    found[o, k, m, :, s] = [seen[phase].amplitude[0] for phase in PHASES]
    given = config.coordinates | {"source": sources, "record": list(kinds), "node": list(sensors)}
    given |= {"displacement": found, "reference_phase": reference_phase}
    return results("spectra", f"{config.title}: full spectra", **given)


def _delayed(signal, samples):
    """A periodic signal (..., time) that starts `samples` later."""
    if samples == int(samples):
        return np.roll(signal, -int(samples), axis=-1)
    frequency = np.fft.fftfreq(signal.shape[-1])
    return np.fft.ifft(np.fft.fft(signal, axis=-1) * np.exp(2j * np.pi * frequency * samples), axis=-1)


def case_records(config, model, speeds, kind, source):
    """Records of one kind at the given speeds (rad/s); source : "steady state" or "from rest"."""
    return records_of(config, model, speeds, kind, SOURCES[source](config, model, speeds, kind.late_samples))


def records_of(config, model, speeds, kind, signals):
    """Records of one kind from signals (speed, node, time), m, that start as late as it does."""
    return [take(config, kind, z, w, model.sensors) for z, w in zip(signals, speeds, strict=True)]
