"""Whirl over speed: Campbell diagram and critical speeds."""

import numpy as np

from rotorstudy.response.stability import eigenvalues, state_matrix


def time_invariant(model):
    """The model without the terms that make it vary in time with the rotation, such as a crack, or are not linear."""
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
    """(parameter,) amplitudes of a model, those of every damping at zero."""
    return np.where(["damping" in name for name in model.names], 0.0, model.theta)


def whirl_modes(model, speed, theta=None):
    """Whirl modes at one speed, by frequency, each as tall as 1 where it moves most.

    speed   : rad/s
    returns : eigenvalues (mode,) 1/s and shapes (mode, dof) complex; on anisotropic bearings (mode, 2 dof), the second
              half is the motion that runs the other way
    """
    values, vectors = np.linalg.eig(state_matrix(model, [speed], theta)[0])
    order = np.argsort(values.imag)
    shapes = vectors[: len(values) // 2, order].T
    tallest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=1)[:, None], axis=1)
    return values[order], shapes / tallest


def critical_speeds(model, up_to, order=1, theta=None):
    """Speeds at which a whirl frequency meets a multiple of the spin speed.

    up_to   : rad/s;  order : n > 0 forward, n < 0 backward; n = 1 is where unbalance meets forward whirl
    returns : (critical,) rad/s, ascending; damped frequencies, so a mode that is damped out has none
    """
    from scipy.optimize import brentq

    speeds = np.geomspace(1e-4 * up_to, up_to, 600)
    distance = eigenvalues(model, speeds, theta).imag - order * speeds[:, None]  # sorted, so continuous in speed
    found = []
    for mode in range(distance.shape[1]):
        for i in np.flatnonzero(np.diff(np.sign(distance[:, mode])) != 0):

            def off(w, mode=mode):
                return eigenvalues(model, [w], theta).imag[0, mode] - order * w

            found.append(brentq(off, speeds[i], speeds[i + 1], xtol=1e-9 * up_to))
    return np.array(sorted(found))
