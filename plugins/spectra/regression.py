from rotorstudy.plugins import SpectrumMethod, fit_basis, rotating_basis, spectral_lines, white_noise_covariance


@SpectrumMethod(
    source="thesis Eqs. (2.27) to (2.29)",
    checked="thesis Tables 2.2 to 2.4, 4.2 to 4.9, 6.2 to 6.7 (scoreboard); scatter against sigma^2 / (2 N)",
    any_length=True,
)
def regression(signal, time, speed, harmonics):
    """Least squares of the record on e^{jnwt} for the requested harmonics; whole revolutions are not needed."""
    basis = rotating_basis(time - time[0], speed, harmonics)
    amplitude, residual, inverse = fit_basis(signal, basis)
    lines = spectral_lines(time, speed, harmonics)
    return amplitude, white_noise_covariance(residual, inverse, lines)
