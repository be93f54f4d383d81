"""Signals from harmonics."""

import numpy as np


def rotating_basis(time, speed, harmonics):
    """e^{jnwt} (harmonic, ..., time) by repeated multiplication; time (..., time) s, speed rad/s."""
    first = np.exp(1j * speed * time)
    basis, power = np.empty((len(harmonics), *first.shape), complex), np.ones_like(first)
    for order in range(max(abs(int(n)) for n in harmonics) + 1):
        for row, n in zip(basis, harmonics, strict=True):
            if abs(n) == order:
                (np.conj if n < 0 else np.positive)(power, out=row)
        power *= first
    return basis


def synthesize(amplitude, speed, harmonics, time):
    """Signal (..., time) with harmonics `amplitude` (..., harmonic), in their unit; speed rad/s, time (time,) s."""
    return np.asarray(amplitude) @ rotating_basis(time, speed, harmonics)
