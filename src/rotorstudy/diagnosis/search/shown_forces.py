"""A force on one coordinate, free at every measured harmonic and speed: what it shows, and the motion with it."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.prediction import neighbourhood, predicted
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.response.harmonic import positions
from rotorstudy.response.neighbourhood import Motion, Neighbourhood

DEPENDENT = 1e-9  # ratio of a column's part that others do not have to the longest: below it nothing tells it apart


def motions_by_free_forces(
    fitted: Fit, spectrum: Spectrum, rows: Sequence[np.ndarray], near: Neighbourhood
) -> list[Motion]:
    """The Motions of a fitted model with a force on one coordinate, free at every harmonic and speed, fitted best.

    rows    : (dof,) each, the coordinates by a unit of each of the model: a node, or a deformation of the shaft
    near    : of the fitted model at the speeds and harmonics of the spectrum
    returns : one for each row
    raises  : NoSteadyState
    """
    if not rows:
        return []
    apart = spectrum.without_common_error()
    off = apart.whitened(apart.amplitude - apart.shown(predicted(fitted.model, apart, fitted.theta)))
    columns, still = free_force_columns(near, apart, rows), near.motion
    found = least_squares(columns, off.reshape(len(spectrum.speed), -1))
    real, imaginary = np.split(found, 2, axis=-1)  # (row, speed, harmonic)
    force, along = np.zeros((len(rows), *still.amplitude.shape), complex), np.array(rows)[:, None, None]
    force[:, :, positions(near.harmonics, near.blocks)] = (real + 1j * imaginary)[..., None] * along
    return [Motion(still.amplitude + one, still.deflection) for one in near.moved_by(force)]


def with_vibrations(model: Model, fitted: Fit, spectrum: Spectrum) -> Model:
    """The model that knows the largest vibration of each node, over the speeds, if a fault acts there.

    A clearance is reached, or a support lifts, by the motion where it is, which a stiff support of a rig without the
    fault understates.

    fitted : of the rig without the fault
    """
    structure = model.structure
    near = neighbourhood(fitted.model, spectrum, fitted.theta)
    moving, found = near.blocks.harmonics != 0, {}
    for node in structure.nodes:
        with suppress(NoSteadyState):
            (motion,) = motions_by_free_forces(fitted, spectrum, [structure.unit(node)], near)
            size = np.linalg.norm(motion.amplitude[:, moving] @ structure.unit(node), axis=1)
            found[node] = float(size.max())
    return replace(model, structure=replace(structure, vibrations=found))


def free_force_columns(near: Neighbourhood, spectrum: Spectrum, rows: Sequence[np.ndarray]) -> np.ndarray:
    """What the sensors show of a force on one coordinate that is free at every measured harmonic and speed.

    near    : at the speeds and harmonics of the spectrum
    rows    : (dof,) each, the coordinates
    returns : (row, speed, component, force) in standard deviations per newton; the real and imaginary parts of the
              force at each harmonic
    """
    shown = shown_forces(near, spectrum, rows)
    return np.moveaxis(spectrum.whitened(shown).reshape(*shown.shape[:3], -1), 1, -1)


def shown_forces(near: Neighbourhood, spectrum: Spectrum, rows: Sequence[np.ndarray]) -> np.ndarray:
    """The same (row, force, speed, harmonic, sensor), complex, m/N; none of a row that shows only round-off.

    As a moment in the middle of a symmetric rotor does: a force, whose size is free, would explain anything by it.
    """
    rows, measured = np.array(rows), positions(near.harmonics, near.blocks)
    acted = np.flatnonzero(rows.any(axis=0))
    free = [2 * i + part for part in (0, 1) for i in measured]  # real and imaginary parts of the measured harmonics
    shown = np.tensordot(rows[:, acted], near.shown_by_units[acted][:, :, free], 1)
    largest = np.abs(shown).max(axis=(1, 2, 3), initial=0.0)
    shown[largest < DEPENDENT * np.abs(rows) @ near.largest_shown] = 0.0
    return np.swapaxes(shown, 1, 2).reshape(len(rows), len(free), len(spectrum.speed), len(spectrum.harmonics), -1)


def least_squares(matrices: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solutions (..., unknown) of systems (..., equation, unknown) with right-hand sides (..., equation).

    Of least length where a column depends on others.
    """
    unknowns, right = matrices.shape[-1], np.broadcast_to(right, matrices.shape[:-1])
    if matrices.shape[-2] < unknowns:  # of a single probe, which shows half of an orbit
        return (np.linalg.pinv(matrices, rcond=DEPENDENT) @ right[..., None])[..., 0]
    both = np.linalg.qr(np.concatenate([matrices, right[..., None]], axis=-1), mode="r")  # without forming Q
    r, turned = both[..., :unknowns, :unknowns], both[..., :unknowns, unknowns:]
    size = np.abs(np.diagonal(r, axis1=-2, axis2=-1))
    found = np.empty(size.shape)
    independent = size.min(axis=-1) > DEPENDENT * size.max(axis=-1)
    found[independent] = np.linalg.solve(r[independent], turned[independent])[..., 0]
    for at in zip(*np.nonzero(~independent), strict=True):
        found[at] = np.linalg.lstsq(matrices[at], right[at], rcond=DEPENDENT)[0]
    return found
