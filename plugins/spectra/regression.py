import numpy as np

from rotorstudy.plugins import SpectrumMethod, hookimpl
from rotorstudy.records import rotating_basis, spectral_lines, white_noise_covariance


def regression(signal, time, speed, harmonics):
    """Least squares of the record on e^{jnwt} for the harmonics asked for; whole revolutions are not needed."""
    lines = spectral_lines(time, speed, harmonics)
    basis = rotating_basis(time - time[0], speed, harmonics)  # (harmonic, time)
    inverse_normal = np.linalg.inv(basis.conj() @ basis.T)
    amplitude = (signal @ basis.conj().T) @ inverse_normal.T
    return amplitude, white_noise_covariance(signal - amplitude @ basis, inverse_normal, lines)


@hookimpl
def rotorstudy_spectrum():
    return SpectrumMethod("regression", regression, source="thesis Eqs. (2.27) to (2.29)")
