"""Resonances of an amplitude over speed: peaks, amplification factors, separation margins (API 684)."""

from typing import NamedTuple

import numpy as np

HALF_POWER = np.sqrt(0.5)
UNCRITICAL = 2.5  # amplification factor below which a resonance is critically damped and needs no margin


class Peak(NamedTuple):
    """A resonance in an amplitude over speed, rad/s; amplification is NaN where a half-power point is not reached."""

    speed: float
    amplitude: float
    amplification: float


def peaks(speed, amplitude):
    """The Peaks of an amplitude over closely spaced speeds; amplification N_c / (N_2 - N_1), API RP 684, Figure 1-1."""
    from scipy.signal import find_peaks

    found = []
    for top in find_peaks(amplitude)[0]:
        below = _crossing(speed[: top + 1][::-1], amplitude[: top + 1][::-1])
        above = _crossing(speed[top:], amplitude[top:])
        found.append(Peak(float(speed[top]), float(amplitude[top]), float(speed[top] / (above - below))))
    return found


def _crossing(speed, amplitude):
    """Speed at which the amplitude first falls to 1/sqrt(2) of its first value; NaN if it rises again before."""
    rises = np.flatnonzero(np.diff(amplitude) > 0)
    end = rises[0] + 1 if len(rises) else len(amplitude)
    low = np.flatnonzero(amplitude[:end] <= HALF_POWER * amplitude[0])
    if not len(low):
        return np.nan
    i = low[0]
    return np.interp(HALF_POWER * amplitude[0], amplitude[[i, i - 1]], speed[[i, i - 1]])


def separation_margin(speed, operating):
    """Distance of a critical speed, rad/s, from the operating range, relative to its nearer end; 0 inside it."""
    lowest, highest = operating
    return max((lowest - speed) / lowest, (speed - highest) / highest, 0.0)


def required_margin(peak, operating):
    """Separation margin that API 617 (8th ed., part 1, 4.8.2.10) asks for; 0 for AF < 2.5, NaN if not known.

    17 (1 - 1/(AF - 1.5)) %, at most 16 %, below the range of operation; 10 % more above it
    """
    if np.isnan(peak.amplification):
        return np.nan
    if peak.amplification < UNCRITICAL:
        return 0.0
    share = 17 * (1 - 1 / (peak.amplification - 1.5))
    return min(share, 16) / 100 if peak.speed < operating[0] else min(10 + share, 26) / 100
