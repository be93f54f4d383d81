import numpy as np

from rotorstudy.plugins import (
    SpectrumMethod,
    circular_covariance,
    fit_basis,
    noise_power,
    rotating_basis,
    shared_error_covariance,
    spectral_lines,
)

LABEL_TOLERANCE = 0.02  # of the stated speed: largest correction
SIGNALS_AT_ONCE = 25  # bounds the memory; each signal has its own speed and basis
STEPS = 3  # Gauss-Newton converges quadratically from within one line of the transform
CONVERGED = 1e-7  # convergence tolerance, rad at the end of the record


@SpectrumMethod(
    source="IEEE Std 1057-2017, four-parameter fit, here of several harmonics",
    checked="phase variance at the first sample four times that at known speed (Rife and Boorstyn 1974)",
    any_length=True,
    tolerates_wrong_speed=True,
)
def sine_fit(signal, time, speed, harmonics):
    """Least squares on e^{jnwt} with the speed w unknown too; the covariance includes the uncertainty of the speed.

    Each signal has its own speed, so that errors of different sensors stay independent. The start is one speed for all,
    fitted to two revolutions, then four, eight and so on, so that the stated speed may be wrong by a whole line.
    """
    t = time - time[0]
    flat = np.reshape(signal, (-1, len(t)))
    whole, revolutions, w = False, 2, float(speed)
    while not whole:
        samples = max(int(revolutions * 2 * np.pi / speed / t[1]), 4 * len(harmonics))
        whole, revolutions = samples >= len(t), 2 * revolutions
        for _ in range(STEPS):
            _, _, _, score, information, _ = _derivatives(flat[:, :samples], t[:samples], w, harmonics)
            w = _limited(w + _ratio(score.sum(), information.sum()), speed)
    parts = [_fit(flat[i : i + SIGNALS_AT_ONCE], t, w, speed, harmonics) for i in range(0, len(flat), SIGNALS_AT_ONCE)]
    amplitude, covariance = (np.concatenate(part) for part in zip(*parts, strict=True))
    return amplitude.reshape(*signal.shape[:-1], -1), covariance.reshape(*signal.shape[:-1], *covariance.shape[-2:])


def _fit(signal, t, w, speed, harmonics):
    for number in range(STEPS):  # one basis suffices for the first step
        _, _, _, score, information, _ = _derivatives(signal, t, w, harmonics)
        step = _ratio(score, information)[:, None]
        w = _limited(w + step, speed)
        if number and np.all(np.abs(step) * t[-1] < CONVERGED):
            break
    amplitude, inverse, residual, _, information, change = _derivatives(signal, t, w, harmonics)
    power = noise_power(residual, spectral_lines(t, speed, harmonics))
    variance = _ratio(power / 2, information)[:, None, None]
    noise = power[:, None, None] * circular_covariance(inverse)
    return amplitude, noise + shared_error_covariance(change[..., None], variance)


def _derivatives(signal, t, w, harmonics):
    """The fit at speeds w and the derivatives of its residual and amplitudes (variable projection)."""
    basis = rotating_basis(t, w, harmonics)
    basis = np.moveaxis(basis, 0, -2)
    amplitude, residual, inverse = fit_basis(signal, basis)
    turned = 1j * np.asarray(harmonics) * amplitude
    change, moved, _ = fit_basis(t * (turned[..., None, :] @ basis)[..., 0, :], basis)
    score = np.sum((moved.conj() * residual).real, axis=-1)
    return amplitude, inverse, residual, score, np.sum(np.abs(moved) ** 2, axis=-1), -change


def _ratio(a, b):
    """a / b, zero where b is zero: a signal without rotation does not determine the speed."""
    return np.divide(a, b, out=np.zeros(np.shape(b)), where=np.asarray(b) > 0)


def _limited(w, speed):
    return np.clip(w, (1 - LABEL_TOLERANCE) * speed, (1 + LABEL_TOLERANCE) * speed)
