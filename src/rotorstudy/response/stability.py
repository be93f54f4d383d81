"""Whether a rotor returns to its steady state at a speed: eigenvalues, or multipliers of one revolution (`floquet`)."""

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.errors import NoSteadyState, RotorstudyError
from rotorstudy.model.model import Model
from rotorstudy.response.coupling import check_speed
from rotorstudy.response.few_shapes import few_shapes
from rotorstudy.response.floquet import periodic_growth_rate, varies_in_time
from rotorstudy.units import spin

ROUND_OFF = 1e-12  # of the largest eigenvalue: real part of an undamped mode due to round-off
RELATIVE_STEP = 1e-4  # of amplitudes, in the central difference of the forces of an effect
NUMBERS_AT_ONCE = 2e6  # complex numbers in the state matrices of the speeds taken together, 32 MB
SEARCHED = 400  # speeds of the search for a threshold
SLOWEST_GROWTH = 1e-6  # per revolution; slower growth is round-off of an undamped mode


def state_matrix(model, speed, theta=None, shapes=None):
    """State matrix A (speed, state, state) of a time-invariant model: of q, or q on conj(q); or of shapes."""
    k, c, m = _stiffness_damping_mass(model, speed, theta, shapes)
    identity = np.broadcast_to(np.eye(k.shape[-1]), k.shape)
    return np.block([[np.zeros_like(k), identity], [-np.linalg.solve(m, k), -np.linalg.solve(m, c)]])


def _stiffness_damping_mass(model, speed, theta, shapes):
    """Matrices (3, speed, coordinate, coordinate) on q and its first and second derivative, as in `state_matrix`."""
    speed = check_speed(speed, may_rest=True)
    model, theta = model.at(theta)

    matrices = model.matrices(theta)[:3]
    mass, stiffness, gyroscopic = matrices if shapes is None else (shapes.T @ one @ shapes for one in matrices)
    on_z, on_conj = np.zeros((2, 3, len(speed), *mass.shape), complex)  # by the order of the derivative
    on_z[0] += stiffness
    on_z[1] -= 1j * speed[:, None, None] * gyroscopic
    on_z[2] += mass
    for position, unknown in model.acting:
        if unknown.force:
            raise RotorstudyError(f"{unknown.name!r} is nonlinear; the model has no eigenvalues")
        for entry in (e for e in unknown.entries if e.reads_motion):
            if entry.shift or entry.frequency_only:
                wrong = "makes the model time-varying or frequency-dependent"
                raise RotorstudyError(f"{unknown.name!r} {wrong}; it has no eigenvalues")
            target = on_conj if entry.is_conjugate else on_z
            row, column, value = entry.nonzero
            matrix = entry.matrix if shapes is None else shapes[row].T @ (value[:, None] * shapes[column])
            target[entry.order] -= theta[position] * entry.gain_at(speed, 0)[:, None, None] * matrix
    return np.block([[on_z, on_conj], [on_conj.conj(), on_z.conj()]]) if on_conj.any() else on_z


def eigenvalues(
    model: Model, speed: ArrayLike, theta: ArrayLike | None = None, shapes: np.ndarray | None = None
) -> np.ndarray:
    """Eigenvalues of the time-invariant model.

    Parameters
    ----------
    model : Model
        Rotor with its terms.
    speed : array (speed,)
        Spin speeds in rad/s, 0 for the rotor at rest.
    theta : array (parameter,), optional
        Amplitudes in the units of `model.units`; the model's own by default.
    shapes : array (dof, mode), optional
        Of which the motion consists, of any unit, such as `few_shapes` of a fine mesh; all coordinates by default.

    Returns
    -------
    array (speed, mode)
        Complex, 1/s, sorted by imaginary part; a positive one is forward whirl. With entries on conj(z) both mirror
        images of each mode appear.

    Raises
    ------
    RotorstudyError
        If the model is time-varying (an open or breathing crack), frequency-dependent or nonlinear.
    """
    values = np.linalg.eigvals(state_matrix(model, speed, theta, shapes))
    return np.take_along_axis(values, np.argsort(values.imag, axis=-1), axis=-1)


def growth_rate(model, speed, theta=None):
    """Largest real part (speed,) of the eigenvalues beyond round-off, 1/s; unstable if > 0. Speed (speed,) in rad/s."""
    speed, shapes, found = check_speed(speed), few_shapes(model, theta), []
    size = len(model.structure.dofs) if shapes is None else shapes.shape[1]
    at_once = max(1, int(NUMBERS_AT_ONCE / (4 * size) ** 2))
    for first in range(0, len(speed), at_once):
        values = eigenvalues(model, speed[first : first + at_once], theta, shapes)
        found.append(values.real.max(axis=-1) - ROUND_OFF * np.abs(values).max(axis=-1))
    return np.concatenate(found)


def stability_threshold(
    model: Model, up_to: float, theta: ArrayLike | None = None, *, lowest: float | None = None
) -> float | None:
    """Lowest speed at which a whirl mode becomes unstable.

    For the Jeffcott rotor with viscous dampings this is w_n (1 + c_E / c_H).

    Parameters
    ----------
    model : Model
        Rotor with its terms.
    up_to : float
        Highest speed of the search, rad/s.
    theta : array (parameter,), optional
        Amplitudes in the units of `model.units`; the model's own by default.
    lowest : float, optional
        Lowest speed of the search, rad/s; a millionth of `up_to` by default. Bearings tabulated over speed, and
        journal bearings without a film at very low speed, need a higher one.

    Returns
    -------
    float | None
        Speed in rad/s, None if there is none up to `up_to`.

    Raises
    ------
    RotorstudyError
        For an invalid range of speeds, and as `eigenvalues`.

    References
    ----------
    Gasch, Nordmann, Pfuetzner, Rotordynamik.
    """
    from scipy.optimize import brentq

    lowest = 1e-6 * up_to if lowest is None else lowest
    if not 0 < lowest < up_to:
        raise RotorstudyError(f"stability search from {lowest:g} to {up_to:g} rad/s: give 0 < lowest < up_to")
    speeds = np.geomspace(lowest, up_to, SEARCHED)
    unstable = growth_rate(model, speeds, theta) > 0
    if not unstable.any():
        return None
    first = int(np.argmax(unstable))
    if first == 0:
        return float(speeds[0])
    return float(brentq(lambda w: growth_rate(model, [w], theta)[0], speeds[first - 1], speeds[first], xtol=1e-9))


def damping_of_effects(model, speed):
    """{effect with its label: its part of the growth rate of the least stable mode, 1/s}, the largest first.

    It is the work of its force in a cycle of the mode over twice the energy: a spring does none, and that of all
    effects is the growth rate. Of a mode that does not oscillate it is the change with the force.
    """
    theta = np.asarray(model.theta, float)
    shapes = few_shapes(model, theta)
    values, right = np.linalg.eig(state_matrix(model, [speed], theta, shapes)[0])
    worst = int(np.argmax(values.real))
    mode, value = right[: len(right) // 2, worst], values[worst]
    oscillates = abs(value.imag) > ROUND_OFF**0.5 * abs(value)
    part, at = (np.imag, 1j * value.imag) if oscillates else (np.real, value)

    def forces(amplitudes):
        k, c, m = mode.conj() @ _stiffness_damping_mass(model, [speed], amplitudes, shapes)[:, 0] @ mode
        return part(k + at * c + at**2 * m), part(c + 2 * at * m)

    _, scale = forces(theta)
    effect_of = {u.name: f"{t.kind} ({t.label})" if t.label else t.kind for t in model.terms for u in t.unknowns}
    effects, found = np.array([effect_of[name] for name in model.names]), {}
    for effect in dict.fromkeys(effects.tolist()):
        change = RELATIVE_STEP * np.where(effects == effect, theta, 0)
        up, down = (forces(theta + one)[0] for one in (change, -change))
        found[effect] = float((down - up) / (2 * RELATIVE_STEP * scale))
    least = ROUND_OFF**0.5 * max(map(abs, found.values()), default=0.0)
    return {name: found[name] for name in sorted(found, key=lambda name: -abs(found[name])) if abs(found[name]) > least}


def growth_of_free_motion(model, speeds, theta=None):
    """Growth rate (speed,) of the fastest growing free motion, 1/s; -inf if stated in frequency only."""
    if any(e.reads_motion and e.frequency_only for u in model.rotor_unknowns for e in u.entries):
        return np.full(len(speeds), -np.inf)
    try:
        return (periodic_growth_rate if varies_in_time(model) else growth_rate)(model, speeds, theta)
    except np.linalg.LinAlgError:  # a mass that is not positive, as a fit may try: a motion grows at every speed
        return np.full(len(speeds), np.inf)


def check_stable(model: Model, speeds: ArrayLike, theta: ArrayLike | None = None) -> None:
    """Raise if a free motion grows at one of the speeds; models stated in frequency only are not checked.

    Parameters
    ----------
    model : Model
        Rotor with its terms; nonlinear forces are linearised along their steady state.
    speeds : array (speed,)
        In rad/s.
    theta : array (parameter,), optional
        In the units of `model.units`; the model's own by default.

    Raises
    ------
    NoSteadyState
        With the growth rate.
    """
    growth, speeds = growth_of_free_motion(model, speeds, theta), check_speed(speeds)
    if varies_in_time(model):
        unstable = growth * 2 * np.pi / speeds > SLOWEST_GROWTH
        why = "the rotating stiffness (a crack, an asymmetric shaft) or internal damping drives a whirl there; "
        if model.nonlinear_forces:
            why = "a nonlinear force (a crack, a contact) or internal damping drives it away from its steady state; "
    else:
        unstable = growth > 0
        why = "internal damping or cross-coupled bearings make the rotor unstable there; "
    if unstable.any():
        raise NoSteadyState(
            f"no steady state at {spin(speeds[unstable][0])}, where a free motion grows by "
            f"{growth[unstable][0]:.3g} 1/s: {why}stay below the stability threshold, or add external damping"
        )
