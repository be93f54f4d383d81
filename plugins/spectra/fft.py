import numpy as np

from rotorstudy.plugins import SpectrumMethod, hookimpl, spectral_lines, white_noise_covariance


def fft(signal, time, speed, harmonics):
    """Fourier transform at the lines nearest to the harmonics; leakage unless the record has whole revolutions."""
    lines = spectral_lines(time, speed, harmonics)
    amplitude = np.fft.fft(signal, axis=-1)[..., lines] / len(time)
    return amplitude, white_noise_covariance(signal, np.eye(len(lines)) / len(time), lines)


@hookimpl
def rotorstudy_spectrum():
    return SpectrumMethod(
        "fft",
        fft,
        source="thesis section 2.2.5; Goldman and Muszynska 1999 (full spectrum)",
        checked="thesis Tables 2.2 to 2.4 (scoreboard); variance sigma^2 / (2 N) of a discrete Fourier transform",
    )
