"""Balanced machines: how often intervals hold what is left and the next run (`benchmarks/balance.py`: of 200)."""

import numpy as np
from balance import balanced


def shares(seeds, **options):
    """Means over machines of the intervals of the vibration left, and of the next reading, that hold the truth."""
    return np.mean([list(balanced(seed, **options).values()) for seed in seeds], axis=0)


def test_the_intervals_hold_as_often_as_they_say():
    """95 %; the 12 intervals of a machine stand and fall together, so that the mean of six scatters by 6 %."""
    assert np.all(shares(range(1, 7)) > 0.8)
    # negative control: an uncertainty that is stated too small
    left, _ = shares((1, 2), share=0.05)
    assert left < 0.7
