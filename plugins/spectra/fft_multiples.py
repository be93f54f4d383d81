import numpy as np

from rotorstudy.plugins import SpectrumMethod, spectral_lines, white_noise_covariance


@SpectrumMethod(
    source="thesis section 4.5.1 (columns of incomplete cycles)",
    checked="thesis Tables 4.2 to 4.9, columns of incomplete cycles (scoreboard)",
)
def fft_multiples(signal, time, speed, harmonics):
    """Fourier transform at multiples of the line nearest to 1X; worse than `fft` for incomplete revolutions."""
    lines = spectral_lines(time, speed, [1]) * np.asarray(harmonics) % len(time)
    amplitude = np.fft.fft(signal, axis=-1)[..., lines] / len(time)
    return amplitude, white_noise_covariance(signal, np.eye(len(lines)) / len(time), lines)
