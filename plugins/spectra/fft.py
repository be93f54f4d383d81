import numpy as np

from rotorstudy.plugins import SpectrumMethod, hookimpl
from rotorstudy.records import white_noise_covariance


def fft(signal, time, speed, harmonics):
    """Fourier transform at the bins nearest to the harmonics; leaks unless the record holds whole revolutions."""
    samples = len(time)
    revolutions = speed * (time[1] - time[0]) * samples / (2 * np.pi)
    bins = np.rint(np.asarray(harmonics) * revolutions).astype(int)
    amplitude = np.fft.fft(signal, axis=-1)[..., bins % samples] / samples
    return amplitude, white_noise_covariance(signal, np.eye(len(bins)) / samples)


@hookimpl
def rotorstudy_spectrum():
    return SpectrumMethod("fft", fft, source="thesis section 2.2.5; Goldman and Muszynska 1999 (full spectrum)")
