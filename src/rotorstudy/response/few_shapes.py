"""The shapes of which a free motion consists: on a fine mesh the lowest modes, and what each force bends statically."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.model.model import Model

ALL_KEPT = 60  # coordinates, with fewer of which eigenvalues need no shapes
MODES = 24  # lowest ones; the eigenvalues of the first eight are then within 1e-6 of those with all coordinates


def few_shapes(model: Model, theta: ArrayLike | None = None) -> np.ndarray | None:
    """`shapes` for the eigenvalues of a model, None where it has few coordinates; theta : (parameter,), its own."""
    if len(model.structure.dofs) <= ALL_KEPT:
        return None
    return _kept_shapes(model, tuple(np.asarray(model.theta if theta is None else theta, float).tolist()))


@lru_cache(maxsize=8)
def _kept_shapes(model, theta):
    return shapes(model, np.array(theta))


def shapes(model: Model, theta: np.ndarray) -> np.ndarray:
    """Shapes (dof, shape) of which the free motion consists, orthonormal in mass: Craig and Kurdila 2006, ch. 17."""
    from scipy.linalg import eigh, orth

    size, own = len(model.structure.dofs), model.matrices(theta)
    held = model.structure.support if model.structure.support is not None else 0
    stiffness = np.real(own.stiffness + held)
    mass = own.mass + _mass_of_housings(model, theta)
    if size <= MODES:
        return eigh(stiffness, mass)[1]
    modes = eigh(stiffness, mass, subset_by_index=(0, MODES - 1))[1]  # LinAlgError if the mass is not positive
    scale = np.sqrt(np.diag(mass))  # translations and tilts have different units
    touched = np.zeros(size, bool)
    for entry in (e for _, unknown in model.acting for e in unknown.entries if e.reads_motion):
        row, column, _ = entry.nonzero
        here = np.union1d(row, column)
        if len(here) <= MODES:  # others are sums along the shaft, which bend no shape of their own
            touched[here] = True
    loads = np.column_stack([np.eye(size)[:, touched], *(force.matrix.T for _, force in model.nonlinear_forces)])
    static = np.linalg.lstsq(stiffness / np.outer(scale, scale), loads / scale[:, None], rcond=1e-12)[0]
    found = np.column_stack([modes * scale[:, None], static / np.linalg.norm(static, axis=0)])
    kept = orth(found / np.linalg.norm(found, axis=0), rcond=1e-9) / scale[:, None]
    return kept @ eigh(kept.T @ stiffness @ kept, kept.T @ mass @ kept)[1]


def _mass_of_housings(model, theta):
    """Mass (dof, dof) of the foundation, kg, which the rotor alone does not have; 0 without a foundation."""
    entries = [(theta[p], entry) for p, unknown in model.acting for entry in unknown.entries if entry.order == 2]
    here = [(size, entry) for size, entry in entries if entry.on == "z" and not entry.shift]
    return -sum(size * np.real(entry.matrix) for size, entry in here if model.structure.housings)
