"""A phase mark at a constant speed."""

import numpy as np
from machine import TIME

SPEED = 80.0
MARKS = np.arange(1, 31) * 2 * np.pi / SPEED


def pulses(marks, sign=1, base=0.0, noise=0.0):
    signal = base + sign * 5 * np.exp(-0.5 * ((TIME[:, None] - marks) * SPEED / 0.1) ** 2).sum(axis=1)
    return {"key": signal + noise * np.random.default_rng(1).normal(size=len(TIME))}
