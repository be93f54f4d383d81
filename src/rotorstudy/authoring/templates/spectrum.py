import numpy as np

from rotorstudy.plugins import SpectrumMethod, hookimpl, rotating_basis, spectral_lines, white_noise_covariance


def my_model(signal, time, speed, harmonics):
    """Mean of the record turned back by each harmonic: sum of signal e^{-jnwt} over the samples, divided by them."""
    # signal (..., time) is complex; amplitudes (..., harmonic) have their phase counted from the first sample.
    samples, lines = len(time), spectral_lines(time, speed, harmonics)
    basis = rotating_basis(time - time[0], speed, harmonics)  # (harmonic, time)
    amplitude = signal @ basis.conj().T / samples
    # The covariance of real parts, then imaginary parts, must be the scatter under white noise.
    return amplitude, white_noise_covariance(signal - amplitude @ basis, np.eye(len(lines)) / samples, lines)


@hookimpl
def rotorstudy_spectrum():
    return SpectrumMethod(
        "my_model",
        my_model,
        source="the paper and equation it comes from",
        checked="the published or closed-form numbers it was compared with",
    )
