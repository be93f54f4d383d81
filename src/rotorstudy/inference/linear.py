"""Batched linear least squares: identifiability of the unknowns, and solvers of the equations of motion."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rotorstudy.errors import NoConvergenceError, UnidentifiableError
from rotorstudy.inference.equation_error import equation_sensitivity

RANK_TOLERANCE = 1e-9  # smallest over largest singular value of unit-length columns; round-off is about 1e-15
DEFLECTION_RELATIVE = 1e-9  # expected remaining change of the unknowns that ends the iteration of the deflection
ROUND_OFF_RELATIVE = 1e-6  # or a change that stopped decreasing: weights of exact data differ by up to 1e15
DEFLECTION_STEPS = 40  # of the static deflection; two suffice if the bearings' nodes are measured
TRIALS_AT_ONCE = 200  # limits the memory of a Monte Carlo study
WEIGHTED_STEPS = 2  # updates of the weights; the second changes the estimate by less than the noise


def invert(normal: np.ndarray) -> np.ndarray:
    """Covariance of a fit, the inverse of its normal matrix J^T J (..., parameter, parameter), after scaling."""
    scale = np.sqrt(np.diagonal(normal, axis1=-2, axis2=-1))
    outer = scale[..., :, None] * scale[..., None, :]
    return np.linalg.inv(normal / outer) / outer


def marginal(columns: np.ndarray, off: np.ndarray) -> tuple[float, float]:
    """Misfit of data (component,) in which independent unit parameters have columns (component, parameter), log volume.

    All whitened; minus half of both is the logarithm of the marginal likelihood, less a constant. The normal equations
    would lose all digits where the columns are large.
    """
    count = columns.shape[1]
    basis, triangle = np.linalg.qr(np.vstack([columns, np.eye(count)]))
    off = np.concatenate([off, np.zeros(count)])
    left = off - basis @ (basis.T @ off)
    return float(left @ left), 2 * float(np.log(np.abs(np.diag(triangle))).sum())


def by_speed(weights: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Weights (..., speed, row, row) of each speed applied to stacked equations (..., speed * row[, parameter])."""
    stacked = rows.reshape(*rows.shape[: weights.ndim - 3], *weights.shape[-3:-1], -1)
    return (weights @ stacked).reshape(*stacked.shape[:-3], *rows.shape[weights.ndim - 3 :])


def undetermined(columns: np.ndarray, names: Sequence[str]) -> list[str]:
    """Names of the unknowns that columns (row, parameter) do not determine: without effect, or traded off."""
    length = np.linalg.norm(columns, axis=0)
    missing = np.zeros((max(0, columns.shape[1] - columns.shape[0]), columns.shape[1]))
    scaled = np.concatenate([columns / np.where(length, length, 1), missing])
    _, singular, vectors = np.linalg.svd(scaled, full_matrices=False)
    share = np.abs(vectors[singular < RANK_TOLERANCE * singular[0]]).max(axis=0, initial=0)
    return [name for name, part in zip(names, share, strict=True) if part > 0.05]


def check_identifiable(columns: np.ndarray, names: Sequence[str]) -> None:
    """UnidentifiableError unless columns (row, parameter) determine all unknowns; it names those that trade off."""
    if columns.shape[0] < columns.shape[1]:
        raise UnidentifiableError(
            f"{columns.shape[0]} equations for {columns.shape[1]} unknowns ({', '.join(names)}); "
            "add harmonics or speeds, or fix some unknowns",
            names,
        )
    dead = [name for name, size in zip(names, np.linalg.norm(columns, axis=0), strict=True) if size == 0]
    if dead:
        told = f"the data do not depend on {', '.join(dead)}; fix it, or measure what it acts on"
        raise UnidentifiableError(told, dead)
    traded = undetermined(columns, names)
    if traded:
        raise UnidentifiableError(
            f"rank-deficient regression: {' and '.join(traded)} trade off against each other; "
            "fix one of them, or add speeds or harmonics",
            traded,
        )


def solve_linear(columns: np.ndarray, right_side: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """Least squares of (..., row, parameter), (..., row) by QR of columns of unit length; UnidentifiableError."""
    check_identifiable(columns.reshape(-1, *columns.shape[-2:])[0], names)
    return solve_full_rank(columns, right_side)


def solve_full_rank(columns: np.ndarray, right_side: np.ndarray) -> np.ndarray:
    """Least squares of linearly independent columns; shapes as in `solve_linear`."""
    length = np.linalg.norm(columns, axis=-2, keepdims=True)
    q, r = np.linalg.qr(columns / length)
    scaled = np.linalg.solve(r, np.swapaxes(q, -1, -2) @ right_side[..., None])[..., 0]
    return scaled / length[..., 0, :]


def solve_truncated(columns: np.ndarray, right_side: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """Minimum-norm least squares of unit-length columns by truncated SVD; shapes as in `solve_linear`."""
    length = np.linalg.norm(columns, axis=-2, keepdims=True)
    length = np.where(length, length, 1)
    inverse = np.linalg.pinv(columns / length, RANK_TOLERANCE)
    return (inverse @ right_side[..., None])[..., 0] / length[..., 0, :]


def solve_equations(
    problem, solve: Callable = solve_linear, start: np.ndarray | None = None, settled: bool = True
) -> np.ndarray:
    """Solve the equations of motion for the unknowns (..., parameter).

    Where unknown bearings carry the weight, the static deflection, on which crack and internal damping act, depends on
    the unknowns: the equations are solved with the deflection held, which is then updated, until both have converged.

    Parameters
    ----------
    problem : Problem
    solve : callable
        (columns, right_side, names) -> theta, such as `solve_linear`.
    start : ndarray (..., parameter), optional
        For the first deflection.
    settled : bool
        Whether to iterate until both have converged; False solves the equations once.

    Raises
    ------
    NoConvergenceError
        If the deflection does not converge.
    """
    theta, last = start, np.inf
    if start is None or problem.holding(start) is None:
        theta = solve(*problem.equations(), problem.names)
    for _ in range(DEFLECTION_STEPS):
        held = problem.holding(theta) if settled or theta is start else None
        if held is None:
            return theta
        before, theta = theta, solve(*held.equations(), problem.names)
        change = np.max(np.abs(theta - before) / np.maximum(np.abs(theta), np.finfo(float).tiny))
        left = change * min(1.0, change / last)  # extrapolated from the last two changes
        if left <= DEFLECTION_RELATIVE or last <= change <= ROUND_OFF_RELATIVE:
            return theta
        last = change
    raise NoConvergenceError("static deflection and the bearing parameters that determine it do not converge together")


def whitened(weights: np.ndarray, solve: Callable = solve_linear) -> Callable:
    """A `solve` of equations that are weighted first; weights (..., speed, row, row)."""
    return lambda columns, right_side, names: solve(by_speed(weights, columns), by_speed(weights, right_side), names)


def solve_weighted(problem, solve: Callable = solve_linear, start: Callable = solve_linear) -> np.ndarray:
    """Solve the equations of motion, whitened by the covariance that the noise of the spectrum gives them.

    The weights depend on the unknowns (..., parameter) and are updated at each estimate. solve is of the whitened
    equations, start of the unweighted ones, for the first estimate.
    """
    theta = solve_equations(problem, start, settled=False)
    for step in range(WEIGHTED_STEPS):
        weights = problem.equation_weights(theta)
        theta = solve_equations(problem, whitened(weights, solve), theta, settled=step == WEIGHTED_STEPS - 1)
    return theta


def in_chunks(problem, solve: Callable) -> np.ndarray:
    """Estimates (..., parameter) of many trials in chunks of limited memory; solve : part of the Problem -> theta."""
    spectrum, amplitude = problem.spectrum, problem.spectrum.amplitude
    if amplitude.ndim == 3:
        return solve(problem)
    parts = [amplitude[first : first + TRIALS_AT_ONCE] for first in range(0, len(amplitude), TRIALS_AT_ONCE)]
    return np.concatenate([solve(replace(problem, spectrum=spectrum.with_amplitude(part))) for part in parts])


def noise_in_equations(problem, weights: np.ndarray) -> np.ndarray:
    """Covariance (..., parameter + 1, parameter + 1) of equations (A, b) by the noise, summed over whitened rows."""
    columns, right_side = equation_sensitivity(problem.model, problem.spectrum, problem.names, order=problem.order)
    both = np.concatenate([columns, right_side[..., None]], axis=-1)  # (speed, row, component, parameter + 1)
    noisy = np.einsum("scd,srdp->srcp", problem.spectrum.full_covariance(), both, optimize=True)
    products = np.einsum("srcp,stcq->srtpq", both, noisy, optimize=True)
    inverse = np.swapaxes(weights, -1, -2) @ weights  # of the covariance of the residual
    return np.tensordot(inverse, products, axes=3)
