"""What is corrected in a spectrum before a fit: repeats at one speed, slow roll, and a mean that was not recorded."""

from contextlib import suppress
from dataclasses import replace
from itertools import combinations

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.findings import Finding, told
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.response.whirl import first_resonance
from rotorstudy.units import RAD_PER_S, p_value, percent, quantity, spin, spins, um

SAME_SPEED = 5e-4  # relative difference up to which records are repeats at one speed
MANY = 500  # records of a table, of which some are equal by rounding
SIGNIFICANT = 1e-3  # p-value below which repeats differ by more than the noise of each explains
NO_MEAN = 0.02  # of the vibration; a journal in a film moves by a tenth of its clearance and more from speed to speed


def averaged(spectrum: Spectrum, where: str) -> tuple[Spectrum, list[Finding]]:
    """A spectrum with the repeats at each speed averaged; RotorstudyError if two records are the same.

    What repeats differ by beyond the noise within each record is the scatter from run to run. Its variance, of each
    harmonic at each sensor, is pooled over the speeds and added to the covariance of every speed, divided by the number
    of its repeats: a speed measured once scatters too.
    """
    groups = _groups(spectrum.speed)
    if len(groups) == len(spectrum.speed):
        return spectrum, []
    mean = np.array([spectrum.amplitude[group].mean(axis=0) for group in groups])
    squares, expected, freedom = 0.0, 0.0, 2 * (len(spectrum.speed) - len(groups))
    for group, centre in zip(groups, mean, strict=True):
        records = spectrum.amplitude[group]
        if len(spectrum.speed) <= MANY and any(np.array_equal(*pair) for pair in combinations(records, 2)):
            speed = spin(spectrum.speed[group[0]])
            raise RotorstudyError(f"{where}: the same record occurs twice at {speed}; give it once")
        squares = squares + np.sum(np.abs(records - centre) ** 2, axis=0)
        expected = expected + (len(group) - 1) * spectrum.variance[group].mean(axis=0)
    # the expected value of an inverse chi-square variable: few repeats leave the variance uncertain
    wider = freedom / (freedom - 2) if freedom > 2 else 3.0
    scatter = wider * np.maximum(squares - expected, 0) / freedom  # of each of the real and imaginary parts
    counts = np.array([len(group) for group in groups])
    covariance = np.array([spectrum.covariance[group].mean(axis=0) / len(group) for group in groups])
    speed = np.array([spectrum.speed[group].mean() for group in groups])
    found = replace(spectrum, amplitude=mean, speed=speed, covariance=covariance)
    return found.with_error(scatter / counts[:, None, None]), _findings(squares, expected, freedom, counts, where)


def _groups(speed):
    """Positions of the records at each speed, in the order of the speeds."""
    groups = []
    for one in np.argsort(speed, kind="stable").tolist():
        if groups and speed[one] <= (1 + SAME_SPEED) * speed[groups[-1][0]]:
            groups[-1].append(one)
        else:
            groups.append([one])
    return groups


def _findings(squares, expected, freedom, counts, where):
    """A note on the repeats, or a warning if they differ by more than the noise within each of them."""
    from scipy.special import chdtrc

    ratio = np.divide(squares, expected, out=np.ones_like(squares), where=expected > 0)
    p = min(1.0, float(chdtrc(freedom, freedom * ratio).min()) * ratio.size)
    said = {"records": int(counts.sum()), "speeds": len(counts), "size": um(float(np.sqrt(squares / freedom).max()))}
    if p >= SIGNIFICANT:
        return [told("repeats", where, **said)]
    return [told("repeats differ", where, times=float(np.sqrt(ratio.max())), p=p_value(p), **said)]


def without_slow_roll(
    spectrum: Spectrum, rig: Model, below_rpm: float | None, where: str
) -> tuple[Spectrum, list[Finding]]:
    """The spectrum less the mean (with its noise) below a speed, which is runout and bow at rest; 0X is not changed."""
    if below_rpm is None:
        return spectrum, []
    slow = spectrum.speed < below_rpm * RAD_PER_S["rpm"]
    if not slow.any() or slow.all():
        raise RotorstudyError(
            f"{where}: measurement: slow_roll_below_rpm = {below_rpm:g}: "
            f"{'every speed is' if slow.all() else 'no speed is'} below it ({spins(spectrum.speed)}); give records at "
            "slow roll and above it"
        )
    moving = np.asarray(spectrum.harmonics) != 0
    vectors = np.where(moving[:, None], spectrum.amplitude[slow].mean(axis=0), 0)
    components = np.tile(moving, 2)
    noise = spectrum.covariance[slow].mean(axis=0) / slow.sum() * np.outer(components, components)
    rest = spectrum.at_speeds(np.flatnonzero(~slow))
    rest = replace(rest, amplitude=rest.amplitude - vectors, covariance=rest.covariance + noise)
    first = np.abs(vectors[list(spectrum.harmonics).index(1)])
    sizes = ", ".join(f"node {n} {quantity(x, 'm')}" for n, x in zip(spectrum.sensors, first, strict=True))
    subtracted = told("slow roll subtracted", where, speeds=spins(spectrum.speed[slow]), sizes=sizes)
    return rest, [subtracted, *check_slow_roll(spectrum.speed[slow], rig, where)]


def check_slow_roll(speed: np.ndarray, rig: Model, where: str) -> list[Finding]:
    """A finding if speeds (speed,), rad/s, of a slow roll are above a critical speed of the rig: it is not runout."""
    fastest = float(np.max(speed))
    with suppress(RotorstudyError):  # of a rotor whose motion is not free vibration, as of an asymmetric shaft
        if critical := first_resonance(rig, fastest):
            return [told("slow roll above a critical speed", where, critical=spin(critical), fastest=spin(fastest))]
    return []


def without_missing_mean(spectrum: Spectrum, rig: Model, where: str) -> tuple[Spectrum, list[Finding]]:
    """The spectrum without 0X if AC-coupled: zero at every speed, though films move the journals with the speed."""
    on_films = any(e.gain and not e.frequency_only for u in rig.rotor_unknowns if u.carries for e in u.entries)
    if not on_films or 0 not in spectrum.harmonics or len(spectrum.speed) < 2:
        return spectrum, []
    is_mean = np.asarray(spectrum.harmonics) == 0
    size = np.sqrt(np.sum(np.abs(spectrum.amplitude[:, ~is_mean]) ** 2, axis=1))  # (speed, sensor)
    if np.any(np.abs(spectrum.amplitude[:, is_mean][:, 0]) > NO_MEAN * size):
        return spectrum, []
    moving = [n for n in spectrum.harmonics.tolist() if n]
    return spectrum.at_harmonics(moving), [told("AC coupling", where, share=percent(NO_MEAN))]
