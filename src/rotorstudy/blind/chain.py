"""Effects of the measuring chain on a signal in time, exact and not linearised.

Each is a function(signal (sensor, time) complex m, angle (time,) rad, speed rad/s, values, where, sensors) -> signal,
named as the effect of the plugin library; the last two are foreign to it (see `simulated_effects`). Records hold whole
revolutions, so time shifts by Fourier transform are exact.
"""

import numpy as np


def _chosen(where, sensors):
    return range(len(sensors)) if "node" not in where else [list(sensors).index(where["node"])]


def probe_gain(signal, angle, speed, values, where, sensors):
    """Probe gains off by a common error `gain_error` and an x-y `gain_mismatch`."""
    g, m = values["gain_error"], values["gain_mismatch"]
    for s in _chosen(where, sensors):
        signal[s] = (1 + g + m) * signal[s].real + 1j * (1 + g - m) * signal[s].imag
    return signal


def probe_angle(signal, angle, speed, values, where, sensors):
    """Probes off their nominal directions: both by `probe_rotation`, y by `probe_skew` more, rad."""
    first, second = values["probe_rotation"], values["probe_rotation"] + values["probe_skew"]
    for s in _chosen(where, sensors):
        x, y = signal[s].real, signal[s].imag
        signal[s] = x * np.cos(first) + y * np.sin(first) + 1j * (y * np.cos(second) - x * np.sin(second))
    return signal


def probe_error(signal, angle, speed, values, where, sensors):
    """The probe along one direction reads `probe_error_along` more of the motion there, and some of that across."""
    c, s = np.cos(where["direction_rad"]), np.sin(where["direction_rad"])
    for i in _chosen(where, sensors):
        x, y = signal[i].real, signal[i].imag
        wrong = values["probe_error_along"] * (c * x + s * y) + values["probe_error_across"] * (c * y - s * x)
        signal[i] = signal[i] + wrong * (c + 1j * s)
    return signal


def swapped_probes(signal, angle, speed, values, where, sensors):
    """The x and y probes exchanged."""
    for s in _chosen(where, sensors):
        signal[s] = signal[s].imag + 1j * signal[s].real
    return signal


def reversed_probe(signal, angle, speed, values, where, sensors):
    """One probe with reversed sign."""
    for s in _chosen(where, sensors):
        signal[s] = signal[s].conj() * (-1 if where["probe"] == "x" else 1)
    return signal


def runout(signal, angle, speed, values, where, sensors):
    """Runout: a circular motion at one harmonic of the spin speed, complex, m."""
    (value,) = values.values()
    for s in _chosen(where, sensors):
        signal[s] += value * np.exp(1j * where["harmonic"] * angle)
    return signal


def phase_reference(signal, angle, speed, values, where, sensors):
    """The phase mark comes late by an angle, so all phases counted from it are advanced by that angle."""
    return _shifted(signal, angle, values["phase_reference"], range(len(signal)))


def delay(signal, angle, speed, values, where, sensors):
    """A signal that is late by a time, s."""
    return _shifted(signal, angle, -speed * values["delay"], _chosen(where, sensors))


def _shifted(signal, angle, by, chosen):
    orders = np.fft.fftfreq(len(angle), d=(angle[1] - angle[0]) / (2 * np.pi))
    for s in chosen:
        signal[s] = np.fft.ifft(np.fft.fft(signal[s]) * np.exp(1j * orders * by))
    return signal


def ac_coupling(signal, angle, speed, values, where, sensors):
    """First-order high-pass filter with a corner frequency in rad/s."""
    frequency = 1j * speed * np.fft.fftfreq(len(angle), d=(angle[1] - angle[0]) / (2 * np.pi))
    return np.fft.ifft(np.fft.fft(signal) * frequency / (frequency + where["corner_rad_per_s"]))


def probe_saturation(signal, angle, speed, values, where, sensors):
    """A saturating amplifier: x becomes tanh(a x) / a."""
    a = values["bending_per_m"]
    for s in _chosen(where, sensors):
        signal[s] = (np.tanh(a * signal[s].real) + 1j * np.tanh(a * signal[s].imag)) / a
    return signal


def mains_modulation(signal, angle, speed, values, where, sensors):
    """A 50 Hz ripple of the probe supply that modulates the signal."""
    return signal * (1 + values["ripple"] * np.cos(2 * np.pi * 50 * angle / speed))
