"""Slow roll and missing means: what a spectrum shows of the probes and their wiring, not of the motion."""

from dataclasses import replace

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.findings import Finding
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.units import RAD_PER_S, percent, quantity, spins

NO_MEAN = 0.02  # of the vibration; a journal in a film moves by a tenth of its clearance and more from speed to speed


def without_slow_roll(spectrum: Spectrum, below_rpm: float | None, where: str) -> tuple[Spectrum, list[Finding]]:
    """The spectrum less the slow-roll vectors: the mean of all harmonics but 0X at the speeds below one, left out then.

    They are runout and the bow at rest. Their noise is added to that of every other speed.

    below_rpm : None if no speed is a slow roll
    raises    : RotorstudyError if no speed is below it, or all are
    """
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
    text = (
        f"the vectors at {spins(spectrum.speed[slow])} (forward 1X: {sizes}) are subtracted at all other speeds: "
        "runout, and the bow of the shaft at rest, of which only what the speed adds is left"
    )
    return rest, [Finding("note", "slow roll subtracted", where, text)]


def without_missing_mean(spectrum: Spectrum, rig: Model, where: str) -> tuple[Spectrum, list[Finding]]:
    """The spectrum without 0X if that is zero at every speed, while the films of the rig move the journals with speed.

    So read AC-coupled recorders. Without films the mean of a sound machine may be zero.
    """
    on_films = any(e.gain and not e.frequency_only for u in rig.rotor_unknowns if u.carries for e in u.entries)
    if not on_films or 0 not in spectrum.harmonics or len(spectrum.speed) < 2:
        return spectrum, []
    is_mean = np.asarray(spectrum.harmonics) == 0
    size = np.sqrt(np.sum(np.abs(spectrum.amplitude[:, ~is_mean]) ** 2, axis=1))  # (speed, sensor)
    if np.any(np.abs(spectrum.amplitude[:, is_mean][:, 0]) > NO_MEAN * size):
        return spectrum, []
    text = (
        f"the mean is below {percent(NO_MEAN)} of the vibration at every speed and node, but the oil films move the "
        "journals with the speed: the records are AC-coupled, or their mean was taken off. 0X is left out, and "
        "nothing is said of static loads. Record the gap voltage of the probes to have it"
    )
    return spectrum.at_harmonics([n for n in spectrum.harmonics.tolist() if n]), [
        Finding("note", "AC coupling", where, text)
    ]
