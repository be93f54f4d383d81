"""What the sensors show: the response at the sensors changed by the output terms, and its derivatives."""

from collections.abc import Callable, Iterable
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.model.entries import apply_entries
from rotorstudy.model.model import Model
from rotorstudy.response.coupling import COUPLED_ORDER
from rotorstudy.response.harmonic import Linearised, carried_response, positions, response_inputs, with_its_bearings
from rotorstudy.response.statics import static_deflection

RECENT, LARGEST = 48, 50_000  # responses kept, and numbers in each with its derivatives
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

    shown = _state(model, speed, harmonics, theta, order, jacobian)
    if model.earlier is None:
        return shown
    place = model.position(model.earlier.names)
    theta = np.asarray(model.theta if theta is None else theta, float)
    earlier = recent(_state, model.earlier, speed, harmonics, theta[..., place], order=order, jacobian=jacobian)
    if jacobian:
        shown.jacobian[..., place] -= earlier.jacobian
    return shown._replace(response=shown.response - earlier.response)


def recent(response: Callable, model: Model, speed: np.ndarray, harmonics: np.ndarray, theta: np.ndarray, **options):
    """What response(model, speed, harmonics, theta, **options) gives, not to be changed; the last few are kept."""
    if len(speed) * len(harmonics) * len(model.sensors) * theta.size > LARGEST:
        return response(model, speed, harmonics, theta, **options)
    at = (tuple(np.asarray(one).tolist()) for one in (speed, harmonics))
    return _recent(response, model, *at, theta.shape, theta.tobytes(), **options)


@lru_cache(maxsize=RECENT)
def _recent(response, model, speed, harmonics, shape, theta, **options):
    return response(model, np.array(speed), np.array(harmonics), np.frombuffer(theta).reshape(shape), **options)


def _state(model, speed, harmonics, theta, order, jacobian):
    """The same of one state of the machine, with the bearings that it has."""
    return with_its_bearings(lambda *at: _shown(*at, speed, harmonics, order, jacobian), model, theta)


def _shown(model, theta, speed, harmonics, order, jacobian):
    """The Linearised response of one state of the machine."""
    speed, harmonics, theta, blocks = response_inputs(model, speed, harmonics, theta, order)
    found, derivatives = carried_response(model, speed, theta, blocks, jacobian)
    first, chosen = len(model.rotor_unknowns), positions(harmonics, blocks)
    true, derivatives = at_sensors(model, speed, theta[..., :first], blocks.harmonics, found, derivatives)
    shown = true.copy()
    if jacobian:
        change, rotor = derivatives.copy(), np.moveaxis(derivatives[..., :first], -1, 0)
    linear, table = model.output_table
    size = theta[..., linear]
    if linear:
        shown += table.force_of_motion(size, true, speed, blocks.harmonics)
        shown += table.static_force(size, speed, blocks.harmonics)
    if linear and jacobian:
        change[..., linear] += table.dense_columns(true, speed, blocks.harmonics)
        change[..., :first] += np.moveaxis(table.force_of_motion(size, rotor, speed, blocks.harmonics), 0, -1)
    exact = [(p, unknown) for p, unknown in enumerate(model.output_unknowns, start=first) if unknown.exact]
    if exact:
        motions = np.concatenate([shown[None], np.moveaxis(change, -1, 0)]) if jacobian else shown[None]
        for p, unknown in exact:  # not small, so it acts on what the others show
            step, size, seen = EXACT_STEP * unknown.typical, theta[..., p], motions[0].copy()
            motions += _exact_change(unknown, size, motions, speed, blocks.harmonics)
            if jacobian:
                up, down = (_exact_change(unknown, size + h, seen, speed, blocks.harmonics) for h in (step, -step))
                motions[1 + p] += (up - down) / (2 * step)
        shown, change = motions[0], np.moveaxis(motions[1:], 0, -1)
    return Linearised(shown[..., chosen, :], change[..., chosen, :, :] if jacobian else None)


def at_sensors(model, speed, theta, carried, found, derivatives=None):
    """Displacements (..., speed, harmonic, sensor), m, from the stated zero, and their derivatives if given."""
    true = model.seen(found)
    derivatives = None if derivatives is None else model.seen(derivatives, axis=-2)
    if model.from_unloaded_line:
        deflection, changes = static_deflection(model, speed, theta, jacobian=derivatives is not None)
        for mean in np.flatnonzero(carried == 0):
            true[..., mean, :] += model.seen(deflection)
            for p, change in changes.items():
                derivatives[..., mean, :, p] += model.seen(change)
    return true, derivatives


def _exact_change(unknown, amplitude, motion, speed, harmonics):
    """What an output term that is not linear in its amplitude (...) adds to motions (..., speed, harmonic, sensor)."""
    lead = np.broadcast_shapes(amplitude.shape, motion.shape[:-3])
    motion = np.broadcast_to(motion, (*lead, *motion.shape[-3:]))
    found = np.empty(motion.shape, complex)
    for i in np.ndindex(amplitude.shape):  # all motions of one amplitude together
        here = (..., *i, slice(None), slice(None), slice(None))
        found[here] = apply_entries(unknown.exact(amplitude[i]), motion[here], speed, harmonics)
    return found
