"""Records of the steady state and their full spectra."""

import numpy as np

from rotorstudy.integration import time_response
from rotorstudy.plugins import registry
from rotorstudy.records import Record, full_spectrum, keyphasor_signal, reference_signal, simulate_records
from rotorstudy.store import as_complex, dataset
from rotorstudy.studies.config import SPEED


def simulate(config, rig):
    """Records of a rig at the shown speeds, in closed form and by direct integration of the same equations.

    returns : displacement (source, speed, node, time, part) m
    """
    model, time, speeds = config.rig(rig), config.record.time, config.shown_speeds_rad_s
    settled = np.ceil(config.record.settling_s * np.array(speeds) / (2 * np.pi)) * 2 * np.pi / speeds  # whole turns
    closed = [r.displacement for r in simulate_records(model, speeds, config.harmonics, time, keyphasor_wanted=False)]
    integrated = [
        time_response(model, w, time + start, relative_tolerance=1e-8)[:, model.measured].T
        for w, start in zip(speeds, settled, strict=True)
    ]
    coordinates = {
        "source": (["closed form", "integration"], "1", "how the record was made"),
        "speed": (np.array(speeds), *SPEED),
        "node": (np.array(model.sensors), "1", "node"),
        "time": (time, "s", "time from the first sample"),
    }
    dims = ("source", "speed", "node", "time")
    variables = {
        "displacement": (dims, np.array([closed, integrated]), "m", "complex displacement from the static deflection")
    }
    return dataset(variables, coordinates, title=f"{config.title}: records, rig {rig}")


RECORD_KINDS = {"complete": 0.0, "half a sample late": 0.5, "one sample late": 1.0}


def spectra(config, simulation):
    """Full spectra of the records of `simulate`, complete and late, by every spectrum method and phase reference.

    A record that is late by a fraction of a sample is the closed-form one shifted; of a whole sample, any one rolled.
    returns : displacement (source, record, spectrum_method, phase_reference, speed, harmonic, node, part) m,
              reference_phase (record, spectrum_method, speed, harmonic) rad
    """
    methods = registry().plugins["spectrum"]
    phases = ("none", "reference", "keyphasor")
    harmonics, time = config.harmonics, config.record.time
    step = time[1] - time[0]
    displacement = as_complex(simulation.displacement)  # (source, speed, node, time)
    speeds, sensors = simulation.speed.values, tuple(int(n) for n in simulation.node.values)
    shape = (len(displacement), len(RECORD_KINDS), len(methods), len(phases), len(speeds), len(harmonics), len(sensors))
    found = np.zeros(shape, complex)
    reference_phase = np.zeros((len(RECORD_KINDS), len(methods), len(speeds), len(harmonics)))
    for k, late in enumerate(RECORD_KINDS.values()):
        for s, w in enumerate(speeds):
            reference = reference_signal(w, harmonics, time + late * step)
            keyphasor = keyphasor_signal(w, time + late * step)
            for m, method in enumerate(methods.values()):
                amplitude, _ = method.function(reference, time, w, harmonics)
                reference_phase[k, m, s] = np.angle(amplitude)
                for o in range(len(displacement)):
                    signal = _delayed(displacement[o, s], late)
                    record = Record(time, signal, w, sensors, reference, keyphasor, f"record at {w:g} rad/s")
                    for p, phase in enumerate(phases):
                        found[o, k, m, p, s] = full_spectrum([record], harmonics, method, phase).amplitude[0]
    coordinates = {
        "source": (simulation.source.values, "1", "how the record was made"),
        "record": (list(RECORD_KINDS), "1", "how much of the first revolution is missing"),
        "spectrum_method": (list(methods), "1", "spectrum method"),
        "phase_reference": (list(phases), "1", "what the phase is compensated by"),
        "speed": (speeds, *SPEED),
        "harmonic": (np.array(harmonics), "1", "harmonic of the spin speed, positive forward"),
        "node": (np.array(sensors), "1", "node"),
    }
    variables = {
        "displacement": (
            ("source", "record", "spectrum_method", "phase_reference", "speed", "harmonic", "node"),
            found,
            "m",
            "full spectrum of the displacement",
        ),
        "reference_phase": (
            ("record", "spectrum_method", "speed", "harmonic"),
            reference_phase,
            "rad",
            "phase of the multi-harmonic reference signal",
        ),
    }
    return dataset(variables, coordinates, title=f"{config.title}: full spectra")


def _delayed(signal, samples):
    """A periodic signal (..., time) that starts `samples` later, by its Fourier series."""
    if samples == int(samples):
        return np.roll(signal, -int(samples), axis=-1)
    turns = np.fft.fftfreq(signal.shape[-1])
    return np.fft.ifft(np.fft.fft(signal, axis=-1) * np.exp(2j * np.pi * turns * samples), axis=-1)
