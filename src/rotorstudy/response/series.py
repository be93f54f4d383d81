"""Signals from harmonics."""

import numpy as np


def rotating_basis(time, speed, harmonics):
    """e^{jnwt} (harmonic, ..., time) by repeated multiplication; time (..., time) s, speed rad/s."""
    first = np.exp(1j * speed * time)
    powers = {0: np.ones_like(first), 1: first}
    for n in range(2, max(abs(int(h)) for h in harmonics) + 1):
        powers[n] = powers[n - 1] * first
    basis = np.empty((len(harmonics), *first.shape), complex)
    for i, n in enumerate(harmonics):
        basis[i] = powers[int(n)] if n >= 0 else powers[-int(n)].conj()
    return basis


def synthesize(amplitude, speed, harmonics, time):
    """Signal (..., time) with harmonics `amplitude` (..., harmonic), in their unit; speed rad/s, time (time,) s."""
    return np.asarray(amplitude) @ rotating_basis(time, speed, harmonics)
