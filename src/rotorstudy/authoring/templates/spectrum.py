import numpy as np

from rotorstudy.plugins import SpectrumMethod, rotating_basis, spectral_lines, white_noise_covariance


@SpectrumMethod(
    source="the paper and equation it comes from",
    checked="the published or closed-form numbers it was compared with",
)
def my_model(signal, time, speed, harmonics):
    """Fourier sum at each harmonic: mean of signal e^{-jnwt} over the samples."""
    # signal (..., time) is complex; amplitudes (..., harmonic) have the phase at the first sample.
    samples, lines = len(time), spectral_lines(time, speed, harmonics)
    basis = rotating_basis(time - time[0], speed, harmonics)  # (harmonic, time)
    amplitude = signal @ basis.conj().T / samples
    # The covariance of the real parts, then the imaginary parts, must be correct under white noise.
    return amplitude, white_noise_covariance(signal - amplitude @ basis, np.eye(len(lines)) / samples, lines)
