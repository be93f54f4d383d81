import numpy as np

from rotorstudy.plugins import SpectrumMethod, spectral_lines, white_noise_covariance


@SpectrumMethod(
    source="thesis section 2.2.5; Goldman and Muszynska 1999 (full spectrum)",
    checked="thesis Tables 2.2 to 2.4 (scoreboard); variance sigma^2 / (2 N) of a discrete Fourier transform",
)
def fft(signal, time, speed, harmonics):
    """Fourier transform at the lines nearest to the harmonics; leakage unless the record has whole revolutions."""
    lines = spectral_lines(time, speed, harmonics)
    amplitude = np.fft.fft(signal, axis=-1)[..., lines] / len(time)
    return amplitude, white_noise_covariance(signal, np.eye(len(lines)) / len(time), lines)
