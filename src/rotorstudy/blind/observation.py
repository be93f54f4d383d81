"""Probe signals of a blind test, and the spectrum measured from them."""

import numpy as np

from rotorstudy.blind.chain import phase_reference, probe_gain
from rotorstudy.blind.machine import steady_motion
from rotorstudy.blind.simulated_effects import SIMULATED_EFFECTS
from rotorstudy.measurement.harmonics import estimate
from rotorstudy.measurement.records import Record
from rotorstudy.measurement.spectrum import Spectrum

CARRIED = np.arange(-12, 13)  # harmonics of the motion that a record holds


def observe(setting, acting):
    """(speed, sensor, time) complex signals without noise, m; acting : [(name, values, place and options)]."""
    sensors, speeds = setting.nominal.sensors, setting.speeds
    acting = [(SIMULATED_EFFECTS[name], name, values, where) for name, values, where in acting]
    for effect, name, values, _ in acting:
        if effect.on == "speed":
            speeds = speeds * (1 + values[name])
    plant = setting.plant(speeds)
    for effect, _, values, where in acting:
        if effect.on == "rotor":
            effect.function(plant, values, where)
    motion = steady_motion(plant, CARRIED)[..., [plant.index(node) for node in sensors]]
    turning = np.exp(1j * np.multiply.outer(CARRIED, setting.angle))
    signals = np.einsum("shn,ht->snt", motion, turning)
    for s, speed in enumerate(speeds):
        for effect, _, values, where in acting:
            if effect.on == "output":
                signals[s] = effect.function(signals[s].copy(), setting.angle, speed, values, where, sensors)
        for node, (g, m) in zip(sensors, setting.gains, strict=True):
            error = {"gain_error": g, "gain_mismatch": m}
            signals[s] = probe_gain(signals[s], setting.angle, speed, error, {"node": node}, sensors)
        error = {"phase_reference": setting.mark}
        signals[s] = phase_reference(signals[s], setting.angle, speed, error, {}, sensors)
    return signals


def harmonics_of(signals, harmonics, config):
    """(speed, sensor, harmonic) of signals (speed, sensor, time) over whole revolutions."""
    lines = np.fft.fft(signals, axis=-1) / signals.shape[-1]
    return lines[..., np.asarray(harmonics) * config.revolutions]


def colouring(colour, harmonics, samples):
    """(harmonic,) standard deviation of noise with lag-one autocorrelation `colour`, relative to white noise."""
    angle = 2 * np.pi * harmonics / samples
    return np.sqrt(1 - colour**2) / np.abs(1 - colour * np.exp(-1j * angle))


def measure(config, setting, signals, level, colour, generator):
    """Records with noise, and the Spectrum estimated from them as from any measured record."""
    from scipy.signal import lfilter

    samples = signals.shape[-1]
    draws = generator.standard_normal((*signals.shape, 2))
    draws[..., 0, :] /= np.sqrt(1 - colour**2)  # stationary from the first sample
    noise = lfilter([1.0], [1.0, -colour], draws, axis=-2) * np.sqrt(1 - colour**2)
    noise = (noise[..., 0] + 1j * noise[..., 1]) * level * np.sqrt(samples / 2)
    records, amplitude, covariance = [], [], []
    for s, speed in enumerate(setting.speeds):
        shown = signals[s] + noise[s]
        where = f"blind record at {speed:.6g} rad/s"
        records.append(Record(setting.angle / speed, shown, float(speed), setting.nominal.sensors, where=where))
        found = [estimate(z, setting.angle, config.revolutions, config.harmonics) for z in shown]
        amplitude.append(np.transpose([one.amplitude for one in found]))
        covariance.append([one.covariance for one in found])
    spectrum = Spectrum(
        np.array(amplitude),
        setting.speeds,
        np.array(config.harmonics),
        tuple(setting.nominal.sensors),
        np.array(covariance),
    )
    return records, spectrum
