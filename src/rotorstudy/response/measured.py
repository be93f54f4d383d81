"""What the sensors show: the response at the sensors changed by the output terms, and its derivatives."""

from collections.abc import Iterable
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.model.model import Model
from rotorstudy.model.terms import apply_entries, apply_summed, force_columns, summed_entries
from rotorstudy.response.alternating import nonlinear_columns
from rotorstudy.response.coupling import COUPLED_ORDER, layout
from rotorstudy.response.harmonic import (
    Linearised,
    carried_response,
    positions,
    response_inputs,
    solver,
)
from rotorstudy.response.statics import static_deflection

EXACT_STEP = 1e-4  # of a typical amplitude: relative errors of the derivative of 1e-11, by truncation and round-off


def measured_response(
    model: Model,
    speed: ArrayLike,
    harmonics: Iterable[int],
    theta: ArrayLike | None = None,
    *,
    order: int = COUPLED_ORDER,
) -> np.ndarray:
    """Displacement harmonics shown by the sensors: the translations at `model.sensors` changed by the output terms.

    They count from the static deflection, from the unloaded line if the model says so, or from what the sensors show in
    an earlier state of the machine.

    Parameters
    ----------
    model, harmonics, order
        As for `harmonic_response`.
    speed : array (speed,)
        In rad/s.
    theta : array (..., parameter), optional
        In the units of `model.units`.

    Returns
    -------
    array (..., speed, harmonic, sensor)
        Complex, m.

    Raises
    ------
    RotorstudyError, NoSteadyState
        As `harmonic_response`.
    """
    return _measured(model, speed, harmonics, theta, order, False).response


def measured_response_and_jacobian(
    model: Model,
    speed: ArrayLike,
    harmonics: Iterable[int],
    theta: ArrayLike | None = None,
    *,
    order: int = COUPLED_ORDER,
) -> Linearised:
    """Displacement harmonics shown by the sensors and their derivatives with respect to the amplitudes.

    Parameters
    ----------
    model, harmonics, order
        As for `harmonic_response`.
    speed : array (speed,)
        In rad/s.
    theta : array (..., parameter), optional
        In the units of `model.units`.

    Returns
    -------
    Linearised
        Response (..., speed, harmonic, sensor) in m and its derivatives (..., speed, harmonic, sensor, parameter) per
        unit of each amplitude.

    Raises
    ------
    RotorstudyError, NoSteadyState
        As `harmonic_response`.
    """
    return _measured(model, speed, harmonics, theta, order, True)


def _measured(model, speed, harmonics, theta, order, jacobian):
    """The Linearised response at the sensors, its Jacobian None unless asked for."""
    shown = _shown(model, speed, harmonics, theta, order, jacobian)
    if model.earlier is None:
        return shown
    place = model.position(model.earlier.names)
    theta = np.asarray(model.theta if theta is None else theta, float)
    earlier = _shown(model.earlier, speed, harmonics, theta[..., place], order, jacobian)
    if jacobian:
        shown.jacobian[..., place] -= earlier.jacobian
    return shown._replace(response=shown.response - earlier.response)


def _shown(model, speed, harmonics, theta, order, jacobian):
    """The Linearised response of one state of the machine."""
    speed, harmonics, theta, blocks = response_inputs(model, speed, harmonics, theta, order)
    found, derivatives = carried_response(model, speed, theta, blocks, jacobian, model.involved)
    first, chosen = len(model.rotor_unknowns), positions(harmonics, blocks)
    true, derivatives = _at_sensors(model, speed, theta[..., :first], blocks.harmonics, found, derivatives)
    shown = true.copy()
    if jacobian:
        change, rotor = derivatives.copy(), np.moveaxis(derivatives[..., :first], -1, 0)
    linear = [(p, u) for p, u in enumerate(model.output_unknowns, start=first) if not u.exact]
    shown += apply_summed(summed_entries(linear, theta), true, speed, blocks.harmonics)
    if jacobian:
        change[..., [p for p, _ in linear]] += force_columns([u for _, u in linear], true, speed, blocks.harmonics)
        moving = summed_entries(linear, theta, lambda _, e: e.reads_motion)
        change[..., :first] += np.moveaxis(apply_summed(moving, rotor, speed, blocks.harmonics), 0, -1)
    for p, unknown in enumerate(model.output_unknowns, start=first):
        if unknown.exact:  # not small, so it acts on what the others show
            step, size, seen = EXACT_STEP * unknown.typical, theta[..., p], shown
            shown = seen + _exact_change(unknown, size, seen, speed, blocks.harmonics)
            if jacobian:
                columns = np.moveaxis(change, -1, 0)
                change += np.moveaxis(_exact_change(unknown, size, columns, speed, blocks.harmonics), 0, -1)
                up, down = (_exact_change(unknown, size + h, seen, speed, blocks.harmonics) for h in (step, -step))
                change[..., p] += (up - down) / (2 * step)
    return Linearised(shown[..., chosen, :], change[..., chosen, :, :] if jacobian else None)


def _at_sensors(model, speed, theta, carried, found, derivatives=None):
    """Displacements (..., speed, harmonic, sensor) at the sensors, from the stated zero, m, and their derivatives.

    found, derivatives : (..., dof) and (..., dof, parameter) from the static deflection; changed are those of 0X if
                         displacements count from the unloaded line. Without derivatives None is returned for them.
    """
    true = found[..., model.measured]
    derivatives = None if derivatives is None else derivatives[..., model.measured, :]
    if model.from_unloaded_line:
        deflection, changes = static_deflection(model, speed, theta, jacobian=derivatives is not None)
        for mean in np.flatnonzero(carried == 0):
            true[..., mean, :] += deflection[..., model.measured]
            for p, change in changes.items():
                derivatives[..., mean, :, p] += change[..., model.measured]
    return true, derivatives


def _exact_change(unknown, amplitude, motion, speed, harmonics):
    """What an output term that is not linear in its amplitude (...) adds to a motion (..., speed, harmonic, sensor)."""
    lead = np.broadcast_shapes(amplitude.shape, motion.shape[:-3])
    found = np.empty((*lead, *motion.shape[-3:]), complex)
    amplitude, motion = np.broadcast_to(amplitude, lead), np.broadcast_to(motion, found.shape)
    for i in np.ndindex(lead):
        found[i] = apply_entries(unknown.exact(amplitude[i]), motion[i], speed, harmonics)
    return found


class Motion(NamedTuple):
    """A steady motion.

    amplitude  : (speed, harmonic, dof) complex, about the deflection, m; harmonics as carried by `Near`
    deflection : (..., dof) static deflection, m
    """

    amplitude: np.ndarray
    deflection: np.ndarray


def carried_motion(model, speed, harmonics, theta=None, *, order=COUPLED_ORDER):
    """The Motion of a model at all harmonics that are carried; arguments as for `Near`."""
    speed, harmonics, theta, _ = response_inputs(model, speed, harmonics, theta, order)
    blocks = layout(model, np.union1d(np.arange(-order, order + 1), harmonics), order)
    deflection = static_deflection(model, speed, theta[: len(model.rotor_unknowns)]).value
    return Motion(carried_response(model, speed, theta, blocks, False)[0], deflection)


class Near:
    """The neighbourhood of a model: what forces that it does not contain add to its motion and measured harmonics.

    To first order, as the added motion does not act back on these forces.

    model, speed, harmonics, theta : as for `harmonic_response`;  harmonics -order..order are carried
    """

    def __init__(self, model, speed, harmonics, theta=None, *, order=COUPLED_ORDER):
        self.model, self.order = model, order
        self.speed, self.harmonics, self.theta, _ = response_inputs(model, speed, harmonics, theta, order)
        self.blocks = layout(model, np.union1d(np.arange(-order, order + 1), self.harmonics), order)
        self.by_coordinate = {}

    @cached_property
    def motion(self):
        """The Motion of the model itself."""
        return carried_motion(self.model, self.speed, self.harmonics, self.theta, order=self.order)

    @cached_property
    def _solved(self):
        own = self.theta[: len(self.model.rotor_unknowns)]
        return solver(self.model, own, self.speed, self.blocks)[0]

    def replies(self, coordinate):
        """Motion (speed, carried harmonic, dof, component) by a unit force on each harmonic of a coordinate, m/N.

        The components are the real and imaginary part of each carried harmonic. Each coordinate is solved once.
        """
        if coordinate not in self.by_coordinate:
            carried, dof = len(self.blocks.harmonics), len(self.model.structure.dofs)
            force = np.zeros((len(self.speed), carried, dof, 2 * carried), complex)
            force[:, :, coordinate] = np.kron(np.eye(carried), [1, 1j])
            self.by_coordinate[coordinate] = self._solved(force)
        return self.by_coordinate[coordinate]

    def _moved(self, force):
        """Measured harmonics (speed, carried harmonic, sensor, unknown) by forces (speed, carried, dof, unknown)."""
        acted = np.flatnonzero(force.any(axis=(0, 1, 3))).tolist()
        fresh = sum(coordinate not in self.by_coordinate for coordinate in acted)
        if not acted or 2 * len(self.blocks.harmonics) * fresh >= force.shape[-1]:
            return self._solved(force)[:, :, self.model.measured]
        reply = np.concatenate([self.replies(i)[:, :, self.model.measured] for i in acted], axis=-1)
        parts = np.ascontiguousarray(force.transpose(0, 3, 2, 1)[:, :, acted]).view(float)
        reply = np.ascontiguousarray(np.moveaxis(reply, -1, 1)).view(float)  # (speed, component, harmonic, ...)
        speeds, count, carried = len(self.speed), force.shape[-1], len(self.blocks.harmonics)
        moved = parts.reshape(speeds, count, -1) @ reply.reshape(speeds, reply.shape[1], -1)
        return np.moveaxis(moved.view(complex).reshape(speeds, count, carried, -1), 1, -1)

    def sensitivities(self, unknowns, motion=None):
        """First-order change of the measured harmonics by one unit of amplitudes that the model does not contain.

        unknowns : two lists of Unknown of further terms, those that act on the rotor and those that act on the output
        motion   : the Motion on which forces on the rotor act, by default that of the model; with the motion that
                   results, the change is exact
        returns  : (speed, harmonic, sensor, unknown) complex, m per unit
        """
        rotor, output = unknowns
        found, deflection = motion or self.motion
        speed, carried = self.speed, self.blocks.harmonics
        shown = np.zeros((len(speed), len(carried), len(self.model.sensors), len(rotor) + len(output)), complex)
        if rotor:
            force = force_columns(rotor, found, speed, carried, deflection)
            in_time = [p for p, u in enumerate(rotor) if u.force]
            local = [rotor[p].force for p in in_time]
            force[..., in_time] = nonlinear_columns(local, found, speed, carried, deflection)
            shown[..., : len(rotor)] = self._moved(force)
        own = self.theta[: len(self.model.rotor_unknowns)]
        true, _ = _at_sensors(self.model, speed, own, carried, found)
        shown[..., len(rotor) :] = force_columns(output, true, speed, carried)
        return shown[:, positions(self.harmonics, self.blocks)]
