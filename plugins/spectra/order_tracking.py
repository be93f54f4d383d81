import numpy as np

from rotorstudy.plugins import (
    SpectrumMethod,
    fit_basis,
    rotating_basis,
    shaft_angle,
    shared_error_covariance,
    spectral_lines,
    white_noise_covariance,
)


@SpectrumMethod(
    source="Fyfe and Munck 1997, MSSP 11, 187-205 (computed order tracking)",
    checked="closed form: records of known harmonics at drifting speed, with and without jitter of the marks",
    any_length=True,
    uses_marks=True,
    tolerates_wrong_speed=True,
)
def order_tracking(signal, time, speed, harmonics, marks):
    """Least squares on e^{jn angle(t)}, with the shaft angle from the keyphasor marks: the speed may drift.

    There is no resampling error, since nothing is resampled; the covariance includes the jitter of the marks. All
    sensors share the error of the marks; a Spectrum cannot state this correlation.
    """
    angle, slope, angle_covariance = shaft_angle(np.asarray(marks) - time[0], time - time[0])
    basis = rotating_basis(angle, 1.0, harmonics)
    amplitude, residual, inverse = fit_basis(signal, basis)
    mean_speed = (angle[-1] - angle[0]) / (time[-1] - time[0])
    lines = spectral_lines(time, mean_speed, harmonics)
    noise = white_noise_covariance(residual, inverse, lines)
    # an error of the angle rotates the whole signal: R_n changes by -B^+ (sum of jm R_m e^{jm angle}) * slope
    gain = inverse @ basis.conj()
    through = (gain[:, None] * slope.T).reshape(-1, len(time))  # (harmonic * coefficient, time)
    turned = (1j * np.asarray(harmonics) * amplitude) @ basis
    change = -(turned @ through.T).reshape(*amplitude.shape, slope.shape[1])
    return amplitude, noise + shared_error_covariance(change, angle_covariance)
