"""Signals from harmonics."""

import numpy as np


def rotating_basis(time, speed, harmonics):
    """e^{jnwt} (harmonic, ..., time) by repeated multiplication; time (..., time) s, speed rad/s."""
    first = np.exp(1j * speed * time)
    powers = {0: np.ones_like(first), 1: first}
    for n in range(2, max(abs(int(h)) for h in harmonics) + 1):
        powers[n] = powers[n - 1] * first
    basis = np.empty((len(harmonics), *first.shape), complex)
    for row, n in zip(basis, harmonics, strict=True):
        if n >= 0:
            row[:] = powers[int(n)]
        else:
            np.conj(powers[-int(n)], out=row)
    return basis


def synthesize(amplitude, speed, harmonics, time):
    """Signal (..., time) with harmonics `amplitude` (..., harmonic), in their unit; speed rad/s, time (time,) s."""
    return np.asarray(amplitude) @ rotating_basis(time, speed, harmonics)
