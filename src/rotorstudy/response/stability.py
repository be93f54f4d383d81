"""Eigenvalues of the rotor at speed, and the speed above which internal damping makes it unstable."""

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.model import Model
from rotorstudy.response.coupling import check_speed

ROUND_OFF = 1e-12  # of the largest eigenvalue: real part of an undamped mode due to round-off


def state_matrix(model, speed, theta=None):
    """State matrix A of the time-invariant model, d/dt (q, q') = A (q, q').

    speed   : (speed,) rad/s
    returns : (speed, state, state) complex, SI; with entries on conj(z), q is replaced by q stacked on conj(q)
    raises  : RotorstudyError if the model is time-varying at constant speed (an open or breathing crack) or nonlinear
    """
    speed = check_speed(speed)
    theta = np.asarray(model.theta if theta is None else theta, float)
    structure, dof = model.structure, len(model.structure.dofs)
    shape = (len(speed), dof, dof)
    on_z = {order: np.zeros(shape, complex) for order in range(3)}
    on_conj = {order: np.zeros(shape, complex) for order in range(3)}
    on_z[0] += structure.stiffness
    on_z[1] -= 1j * speed[:, None, None] * structure.gyroscopic
    on_z[2] += structure.mass
    for value, unknown in zip(theta, model.rotor_unknowns, strict=False):
        if unknown.force:
            raise RotorstudyError(f"{unknown.name!r} is nonlinear; the model has no eigenvalues")
        for entry in (e for e in unknown.entries if e.reads_motion):
            if entry.shift or entry.frequency_only:
                raise RotorstudyError(
                    f"{unknown.name!r} makes the model time-varying or frequency-dependent; it has no eigenvalues"
                )
            target = on_conj if entry.is_conjugate else on_z
            target[entry.order] -= value * entry.gain_at(speed, 0)[:, None, None] * entry.matrix
    if any(np.any(part) for part in on_conj.values()):
        k, c, m = (
            np.concatenate(
                [
                    np.concatenate([on_z[order], on_conj[order]], axis=-1),
                    np.concatenate([on_conj[order].conj(), on_z[order].conj()], axis=-1),
                ],
                axis=-2,
            )
            for order in range(3)
        )
    else:
        k, c, m = on_z[0], on_z[1], on_z[2]
    identity = np.broadcast_to(np.eye(k.shape[-1]), k.shape)
    lower = np.concatenate([-np.linalg.solve(m, k), -np.linalg.solve(m, c)], axis=-1)
    return np.concatenate([np.concatenate([np.zeros_like(k), identity], axis=-1), lower], axis=-2)


def eigenvalues(model: Model, speed: ArrayLike, theta: ArrayLike | None = None) -> np.ndarray:
    """Eigenvalues of the time-invariant model.

    Parameters
    ----------
    model : Model
        Rotor with its terms.
    speed : array (speed,)
        Spin speeds in rad/s.
    theta : array (parameter,), optional
        Amplitudes in the units of `model.units`; the model's own by default.

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
    values = np.linalg.eigvals(state_matrix(model, speed, theta))
    return np.take_along_axis(values, np.argsort(values.imag, axis=-1), axis=-1)


def growth_rate(model, speed, theta=None):
    """Largest real part (speed,) of the eigenvalues beyond round-off, 1/s; unstable if > 0. Speed (speed,) in rad/s."""
    values = eigenvalues(model, speed, theta)
    return values.real.max(axis=-1) - ROUND_OFF * np.abs(values).max(axis=-1)


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
    speeds = np.geomspace(lowest, up_to, 400)
    unstable = growth_rate(model, speeds, theta) > 0
    if not unstable.any():
        return None
    first = int(np.argmax(unstable))
    if first == 0:
        return float(speeds[0])
    return float(brentq(lambda w: growth_rate(model, [w], theta)[0], speeds[first - 1], speeds[first], xtol=1e-9))


def check_stable(model, speeds):
    """Raise if a whirl mode is unstable at one of the speeds (speed,), rad/s; time-varying models are not checked."""
    varies = any(e.reads_motion and (e.shift or e.frequency_only) for u in model.rotor_unknowns for e in u.entries)
    if varies or model.nonlinear_forces:
        return
    unstable = growth_rate(model, speeds) > 0
    if unstable.any():
        raise RotorstudyError(
            f"no steady state at {np.asarray(speeds)[unstable][0]:g} rad/s: internal damping or cross-coupled bearings "
            "make the rotor unstable there; stay below the stability threshold, or add external damping"
        )
