"""Whirl over speed: Campbell diagram and critical speeds."""

import numpy as np

from rotorstudy.response.stability import eigenvalues, state_matrix


def time_invariant(model):
    """The model without the terms that are nonlinear or vary with the rotation, such as a crack."""
    kinds = [
        t.kind
        for t in model.terms
        for u in t.unknowns
        for e in u.entries
        if e.reads_motion and (e.shift or e.frequency_only)
    ]
    kinds += [t.kind for t in model.terms for u in t.unknowns if u.force]
    return model.without(kinds)


def without_damping(model):
    """Amplitudes (parameter,) of a model, in its units, with every damping set to zero."""
    return np.where(["damping" in name for name in model.names], 0.0, model.theta)


def whirl_modes(model, speed, theta=None):
    """Whirl modes at one speed, in order of frequency, normalised to a largest component of 1.

    speed   : rad/s
    returns : eigenvalues (mode,) 1/s and shapes (mode, dof) complex; on anisotropic bearings (mode, 2 dof), where the
              second half is the motion of opposite whirl direction
    """
    values, vectors = np.linalg.eig(state_matrix(model, [speed], theta)[0])
    order = np.argsort(values.imag)
    shapes = vectors[: len(values) // 2, order].T
    tallest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=1)[:, None], axis=1)
    return values[order], shapes / tallest


def critical_speeds(model, up_to, orders=(1,), theta=None):
    """Speeds at which a whirl frequency equals a multiple of the spin speed.

    Parameters
    ----------
    model : Model
        Time-invariant, see `time_invariant`.
    up_to : float
        Highest speed, rad/s.
    orders : sequence of int
        n > 0 forward, n < 0 backward; n = 1 are the critical speeds of unbalance.
    theta : array (parameter,), optional
        Amplitudes, SI; the model's own by default.

    Returns
    -------
    list of array (critical,)
        For each order, rad/s, ascending; damped frequencies are used, so an overdamped mode has none.
    """
    from scipy.optimize import brentq

    speeds = np.geomspace(1e-4 * up_to, up_to, 600)
    frequency = eigenvalues(model, speeds, theta).imag  # sorted, so continuous in speed

    def off(w, mode, order):
        return eigenvalues(model, [w], theta).imag[0, mode] - order * w

    def meeting(order):
        change = np.diff(np.sign(frequency - order * speeds[:, None]), axis=0) != 0
        return np.sort(
            [brentq(off, *speeds[i : i + 2], args=(mode, order), xtol=1e-9 * up_to) for i, mode in np.argwhere(change)]
        )

    return [meeting(order) for order in orders]
