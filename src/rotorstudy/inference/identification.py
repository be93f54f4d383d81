"""Amplitudes from a spectrum: what every estimator shares.

An estimator plugin gets a Problem and returns an Estimate. Two errors can be made small: that of the equations of
motion (linear in the unknowns, fast, but the measured harmonics and their noise stand in the columns) and that of the
output (the predicted harmonics against the measured ones: with their covariance, maximum likelihood).
"""

from dataclasses import dataclass, replace

import numpy as np

from rotorstudy.errors import NoConvergenceError, PluginError, RotorstudyError, UnidentifiableError
from rotorstudy.inference.regression import condensed_regression, equation_sensitivity, regression, residual_sensitivity
from rotorstudy.response.harmonic import COUPLED_ORDER, measured_response
from rotorstudy.response.statics import static_deflection

RANK_TOLERANCE = 1e-9  # smallest over largest singular value of unit-length columns; round-off is near 1e-15
STEP_IN_SIGMA = 1e-4  # a fit has converged when its step is this small against its own standard deviation
STEP_RELATIVE = 1e-12  # or against the amplitudes, for data without noise
MISFIT_RELATIVE = 1e-6  # or when the misfit no longer falls: of a misfit of some hundred, a hundredth of a deviation
DEFLECTION_RELATIVE = 1e-9  # change of the unknowns still to come that ends it
ROUND_OFF_RELATIVE = 1e-6  # or one that no longer falls: weights of exact data differ by up to 1e15
DEFLECTION_STEPS = 40  # of the static deflection; two are enough if the bearings' nodes are measured
WEIGHTED_STEPS = 2  # of weights taken at the estimate they lead to; the second already changes less than the noise
TRIALS_AT_ONCE = 200  # bounds the memory of a Monte Carlo


@dataclass(frozen=True)
class Problem:
    """Which amplitudes of which model are sought, from which spectrum.

    condensation : of the coordinates that are not measured, in equation-error least squares: "exact", or "without
                   gyroscopic moments" as the thesis does it
    """

    model: object
    spectrum: object
    names: tuple
    order: int = COUPLED_ORDER
    condensation: str = "exact"

    def __post_init__(self):
        model, spectrum = self.model, self.spectrum
        if not self.names:
            raise RotorstudyError(f"no unknowns; name at least one of {', '.join(model.names) or 'none'}")
        twice = sorted({name for name in self.names if list(self.names).count(name) > 1})
        if twice:
            raise RotorstudyError(f"{', '.join(twice)}: named twice among the unknowns; name each once")
        if tuple(spectrum.sensors) != tuple(model.sensors):
            raise RotorstudyError(f"the spectrum is of sensors {spectrum.sensors}, the model of {model.sensors}")
        for name in ("amplitude", "covariance"):
            if not np.isfinite(getattr(spectrum, name)).all():
                raise RotorstudyError(f"the {name} of the spectrum has NaN or infinite values; leave those out")

    def equations(self):
        """Real linear system A (..., row, parameter), b (..., row) of the equation error, in newtons."""
        if self.condensation != "exact":
            return condensed_regression(self.model, self.spectrum, self.names).real_system()
        return regression(self.model, self.spectrum, self.names, order=self.order).real_system()

    def holding(self, theta):
        """The problem with the static deflection held that unknown bearings of given stiffness lead to.

        theta : (..., parameter);  returns None if no unknown carries the weight
        """
        model = self.model
        carrying = [u.name for u in model.rotor_unknowns if u.carries and u.name in self.names]
        if model.held_deflection is not None or not carrying or not model.structure.static_load.any():
            return None
        deflection = static_deflection(model, self.spectrum.speed, self._rotor_amplitudes(theta)).value
        return replace(self, model=replace(model, held_deflection=deflection))

    def _rotor_amplitudes(self, theta):
        given = np.concatenate([term.theta for term in self.model.terms])
        full = np.broadcast_to(given, (*np.shape(theta)[:-1], len(given))).copy()
        full[..., self.model.position(self.names)] = theta
        return full[..., : len(self.model.rotor_unknowns)]

    def _moved_residual(self, theta):
        """(row, parameter) derivative of A theta - b by the unknowns through the static deflection alone."""
        model, speed = self.model, self.spectrum.speed
        deflection, changes = static_deflection(model, speed, self._rotor_amplitudes(theta), jacobian=True)

        change = {p: changes.get(int(model.position([name])[0])) for p, name in enumerate(self.names)}
        moving = [p for p, one in change.items() if one is not None]
        # the residual is affine in the deflection, so any step is exact; all steps at once
        tried = np.stack([deflection, *(deflection + theta[p] * change[p] for p in moving)])
        a, b = replace(self, model=replace(model, held_deflection=tried)).equations()
        residual = a @ theta - b
        moved = np.zeros((residual.shape[-1], len(self.names)))
        moved[:, moving] = ((residual[1:] - residual[0]) / theta[moving][:, None]).T
        return moved

    def equation_error_covariance(self, theta, weights=None):
        """First-order covariance (parameter, parameter) of a linear estimate theta = (W A)^+ W b.

        The residual A theta - b moves with the spectrum by a known matrix; noise in A is in it, its square is not.
        weights : (speed, row, row) W of each speed, one if None
        """
        mean, theta = self.mean(theta)
        held = mean.holding(theta)
        problem = held or mean
        a, _ = problem.equations()
        weighted = a if weights is None else by_speed(weights, a)
        gain = np.linalg.pinv(weighted / np.linalg.norm(weighted, axis=0), RANK_TOLERANCE)
        gain = gain / np.linalg.norm(weighted, axis=0)[:, None]
        if weights is not None:
            gain = by_speed(np.swapaxes(weights, -1, -2), gain.T).T
        if held is not None:  # theta = A^+ b where A and b move with theta
            gain = np.linalg.solve(np.eye(len(theta)) + gain @ mean._moved_residual(theta), gain)
        sensitivity = residual_sensitivity(problem.model, problem.spectrum, self.names, theta, order=self.order)
        gain = gain.reshape(len(self.names), len(self.spectrum.speed), -1)
        through = np.einsum("psr,src->psc", gain, sensitivity)
        variance, turn = np.linalg.eigh(self.spectrum.full_covariance())
        root = turn * np.sqrt(np.maximum(variance, 0))[:, None, :]  # so that round-off leaves no negative variance
        spread = np.einsum("psc,scd->psd", through, root)
        return np.einsum("psd,qsd->pq", spread, spread)

    def mean(self, theta):
        """The problem with the mean spectrum of all trials, and their mean estimate (parameter,)."""
        mean = self.spectrum.amplitude.reshape(-1, *self.spectrum.amplitude.shape[-3:]).mean(axis=0)
        theta = np.asarray(theta).reshape(-1, len(self.names)).mean(axis=0)
        return replace(self, spectrum=self.spectrum.with_amplitude(mean)), theta

    def equation_weights(self, theta):
        """(..., speed, row, row) W that whitens the noise which the spectrum's covariance makes in the equations.

        The residual moves with the spectrum by a square matrix S, so W = (whitener of the spectrum) S^-1: weighted
        rows are errors of the harmonics again, in standard deviations.
        theta : (..., parameter), the current estimate
        """
        mean, at = self.mean(theta)
        held = mean.holding(at) or mean
        sensitivity = residual_sensitivity(held.model, held.spectrum, self.names, theta, order=self.order)
        return np.swapaxes(
            np.linalg.solve(np.swapaxes(sensitivity, -1, -2), np.swapaxes(self._full_whitener(), -1, -2)), -1, -2
        )

    def _full_whitener(self):
        """(speed, component, component) whitener of all sensors together."""
        return replace(self.spectrum, covariance=self.spectrum.whitener).full_covariance()

    def chunks(self):
        """The problem itself, or for many trials at once a few at a time; bounds the memory."""
        amplitude = self.spectrum.amplitude
        if amplitude.ndim == 3:
            yield self
            return
        for first in range(0, len(amplitude), TRIALS_AT_ONCE):
            part = self.spectrum.with_amplitude(amplitude[first : first + TRIALS_AT_ONCE])
            yield replace(self, spectrum=part)


@dataclass(frozen=True)
class Estimate:
    """Estimated amplitudes.

    theta      : (..., parameter)
    covariance : (..., parameter, parameter) or (parameter, parameter) for all trials
    misfit     : (...) weighted sum of squares of the residual; NaN for estimators without one
    """

    names: tuple
    theta: np.ndarray
    covariance: np.ndarray
    misfit: np.ndarray

    @property
    def std(self):
        return np.sqrt(np.diagonal(self.covariance, axis1=-2, axis2=-1))


def estimate_by(estimator, problem):
    """The Estimate an Estimator plugin gives, its shapes checked; PluginError names file, shapes and unknowns.

    Of many trials those without an estimate are NaN; of one spectrum only unknowns that are left open may be.
    """
    found, who = estimator.function(problem), f"estimator '{estimator.name}' ({estimator.file})"
    if not isinstance(found, Estimate):
        raise PluginError(
            f"{who} gives {type(found).__name__}; it must give an Estimate(names, theta, covariance, misfit), see "
            "rotorstudy.inference.identification"
        )
    lead, size = problem.spectrum.amplitude.shape[:-3], len(problem.names)
    for name, allowed in (
        ("theta", [(*lead, size)]),
        ("covariance", [(*lead, size, size), (size, size)]),
        ("misfit", [lead]),
    ):
        shape = np.shape(getattr(found, name))
        if shape not in allowed:
            trials = f" and trials of shape {lead}" if lead else ""
            raise PluginError(
                f"{who} gives {name} of shape {shape}; it must be {' or '.join(map(str, dict.fromkeys(allowed)))} for "
                f"{size} unknowns{trials}"
            )
    if not lead and not estimator.handles_rank_deficiency:
        bad = ~(np.isfinite(found.theta) & np.isfinite(np.diagonal(found.covariance)))
        if bad.any():
            names = ", ".join(name for name, wrong in zip(problem.names, bad, strict=True) if wrong)
            raise PluginError(f"{who} gives NaN or infinity for {names} or its variance, without an error")
    return found


def by_speed(weights, rows):
    """Weights (..., speed, row, row) on rows (..., speed * row) or columns (..., speed * row, parameter)."""
    stacked = rows.reshape(*rows.shape[: weights.ndim - 3], *weights.shape[-3:-1], -1)
    return (weights @ stacked).reshape(*stacked.shape[:-3], *rows.shape[weights.ndim - 3 :])


def undetermined(columns, names):
    """Names of the unknowns that columns (row, parameter) leave open: without effect, or traded against others."""
    length = np.linalg.norm(columns, axis=0)
    missing = np.zeros((max(0, columns.shape[1] - columns.shape[0]), columns.shape[1]))
    scaled = np.concatenate([columns / np.where(length, length, 1), missing])
    _, singular, vectors = np.linalg.svd(scaled, full_matrices=False)
    share = np.abs(vectors[singular < RANK_TOLERANCE * singular[0]]).max(axis=0, initial=0)
    return [name for name, part in zip(names, share, strict=True) if part > 0.05]


def check_identifiable(columns, names):
    """Raise if columns (row, parameter) cannot tell the unknowns apart; name those that trade off."""
    if columns.shape[0] < columns.shape[1]:
        raise UnidentifiableError(
            f"{columns.shape[0]} equations for {columns.shape[1]} unknowns ({', '.join(names)}); "
            "add harmonics or speeds, or fix some unknowns",
            names,
        )
    dead = [name for name, size in zip(names, np.linalg.norm(columns, axis=0), strict=True) if size == 0]
    if dead:
        raise UnidentifiableError(
            f"the data do not depend on {', '.join(dead)}; fix it, or measure what it acts on", dead
        )
    traded = undetermined(columns, names)
    if traded:
        raise UnidentifiableError(
            f"rank-deficient regression: {' and '.join(traded)} trade off against each other; "
            "fix one of them, or add speeds or harmonics",
            traded,
        )


def solve_linear(columns, right_side, names):
    """Least squares A theta = b, batched, by QR with columns scaled to unit length.

    columns, right_side : (..., row, parameter), (..., row); real
    raises : UnidentifiableError if the unknowns of the first trial cannot be told apart
    """
    check_identifiable(columns.reshape(-1, *columns.shape[-2:])[0], names)
    return solve_full_rank(columns, right_side)


def solve_full_rank(columns, right_side):
    """Least squares of columns that are known to be independent, see `solve_linear`."""
    length = np.linalg.norm(columns, axis=-2, keepdims=True)
    q, r = np.linalg.qr(columns / length)
    scaled = np.linalg.solve(r, np.swapaxes(q, -1, -2) @ right_side[..., None])[..., 0]
    return scaled / length[..., 0, :]


def solve_truncated(columns, right_side, names):
    """Least squares A theta = b, batched, of unit-length columns without their zero singular values."""
    length = np.linalg.norm(columns, axis=-2, keepdims=True)
    length = np.where(length, length, 1)
    inverse = np.linalg.pinv(columns / length, RANK_TOLERANCE)
    return (inverse @ right_side[..., None])[..., 0] / length[..., 0, :]


def solve_equations(problem, solve=solve_linear, start=None, settled=True):
    """theta (..., parameter) by least squares of the equations of motion, or another `solve` of them.

    Where unknown bearings carry the weight, the static deflection that the crack and internal damping act on is found
    with them: it is held, the equations solved, the deflection taken anew, until both stand.

    start   : (..., parameter) for the first deflection
    settled : whether to go on until both stand; False solves the equations once
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
        left = change * min(1.0, change / last)  # as much smaller as this change was than the one before
        if left <= DEFLECTION_RELATIVE or last <= change <= ROUND_OFF_RELATIVE:
            return theta
        last = change
    raise NoConvergenceError("the static deflection and the bearings that carry it were not found together")


def whitened(weights, solve=solve_linear):
    """A `solve` of equations that are weighted first."""
    return lambda columns, right_side, names: solve(by_speed(weights, columns), by_speed(weights, right_side), names)


def solve_weighted(problem, solve=solve_linear, start=solve_linear):
    """theta (..., parameter) of equations whitened by the noise that the spectrum makes in them.

    The weights depend on the unknowns, so they are taken anew at each estimate.
    solve, start : of whitened equations; of plain ones, for the first estimate
    """
    theta = solve_equations(problem, start, settled=False)
    for step in range(WEIGHTED_STEPS):
        weights = problem.equation_weights(theta)
        theta = solve_equations(problem, whitened(weights, solve), theta, settled=step == WEIGHTED_STEPS - 1)
    return theta


def in_chunks(problem, solve):
    """theta (..., parameter) by solve(part of the problem), a few trials at a time."""
    theta = np.concatenate([np.atleast_2d(solve(part)) for part in problem.chunks()])
    return theta.reshape(*problem.spectrum.amplitude.shape[:-3], -1)


def linear_estimate(problem, theta, covariance):
    """Estimate without a misfit."""
    return Estimate(problem.names, theta, covariance, np.full(theta.shape[:-1], np.nan))


def noise_in_equations(problem, theta, weights):
    """(..., parameter + 1, parameter + 1) covariance of (A, b) by the spectrum's noise, summed over whitened rows.

    theta   : (..., parameter), which a static deflection may be held by;  weights : (..., speed, row, row)
    """
    mean, at = problem.mean(theta)
    held = mean.holding(at) or mean
    columns, right_side = equation_sensitivity(held.model, held.spectrum, problem.names, order=problem.order)
    both = np.concatenate([columns, right_side[..., None]], axis=-1)  # (speed, row, component, parameter + 1)
    noisy = np.einsum("scd,srdp->srcp", problem.spectrum.full_covariance(), both, optimize=True)
    products = np.einsum("srcp,stcq->srtpq", both, noisy, optimize=True)
    inverse = np.swapaxes(weights, -1, -2) @ weights  # of the covariance of the residual
    return np.tensordot(inverse, products, axes=3)


def predicted_derivatives(problem, theta):
    """Whitened prediction (..., component) and its derivatives (..., component, parameter) by the unknowns."""
    model, spectrum = problem.model, problem.spectrum
    position = model.position(problem.names)
    full = np.concatenate([term.theta for term in model.terms])
    full = np.broadcast_to(full, (*theta.shape[:-1], len(full))).copy()
    full[..., position] = theta
    if np.isnan(full).any():
        missing = [model.names[p] for p in np.flatnonzero(np.isnan(full).reshape(-1, full.shape[-1]).any(axis=0))]
        raise RotorstudyError(f"{', '.join(missing)}: neither among the unknowns nor given a value")
    shown, change = measured_response(
        model, spectrum.speed, spectrum.harmonics, full, order=problem.order, jacobian=True
    )
    found = spectrum.whitened(np.stack([shown, *np.moveaxis(change[..., position], -1, 0)]))
    return found[0], np.moveaxis(found[1:], 0, -1)


def start_values(problem):
    """(..., parameter) where a fit starts: equation-error least squares weighted once, else values given or typical."""
    given = np.concatenate([term.theta for term in problem.model.terms])
    nominal = np.where(np.isnan(given), problem.model.typical, given)[problem.model.position(problem.names)]
    linear = [n for n in problem.names if n in {u.name for u in problem.model.rotor_unknowns}]
    start = np.broadcast_to(nominal, (*problem.spectrum.amplitude.shape[:-3], len(nominal))).copy()
    if len(linear) < len(problem.names):
        return start

    def weighted_once(part):
        theta = solve_equations(part, settled=False)
        return solve_equations(part, whitened(part.equation_weights(theta)), theta, settled=False)

    try:
        return in_chunks(problem, weighted_once)
    except RotorstudyError:
        return start


def _clipped(residual, clip):
    """Huber's loss (...) of residuals (..., component), squares up to `clip`, and the weights that give its slope."""
    weight = np.minimum(1, clip / np.maximum(np.abs(residual), np.finfo(float).tiny))
    return np.sum(weight * (2 - weight) * residual**2, axis=-1), weight


def output_error_fit(problem, start=None, iterations=200, clip=np.inf):
    """Levenberg-Marquardt fit of the predicted to the measured harmonics, weighted by their covariance.

    All trials are fitted at once.

    start   : (..., parameter), see `start_values`
    clip    : standard deviations from which on a residual counts by its size, not its square (Huber)
    returns : Estimate with covariance (J^T J)^-1, and the misfit
    raises  : UnidentifiableError if the unknowns trade off at the start; NoConvergenceError if no fit converges.
              Of many trials, those that do not converge are NaN
    """
    measured = problem.spectrum.whitened(problem.spectrum.amplitude)
    theta = np.array(start_values(problem) if start is None else start, float)
    shape = (*measured.shape[:-1], theta.shape[-1])
    measured = measured.reshape(-1, measured.shape[-1])
    theta = np.broadcast_to(theta.reshape(-1, shape[-1]), (len(measured), shape[-1])).copy()
    trials = np.arange(len(theta))
    damping = np.full(len(theta), 1e-6)
    predicted, jacobian = predicted_derivatives(problem, theta)
    check_identifiable(jacobian[0], problem.names)
    residual = measured - predicted
    misfit, weight = _clipped(residual, clip)
    normal = np.zeros((len(theta), shape[-1], shape[-1]))
    freedom = max(1, measured.shape[-1] - shape[-1])
    for _ in range(iterations):
        weighted = np.swapaxes(jacobian * weight[..., None], -1, -2)
        normal[trials] = weighted @ jacobian
        scale = np.sqrt(np.diagonal(normal[trials], axis1=-2, axis2=-1))
        lost = ~(np.isfinite(scale) & (scale > 0)).all(axis=-1)  # an unknown gone where the data do not depend on it
        if lost.any():
            theta[trials[lost]] = np.nan
            parts = (trials, scale, weighted, jacobian, residual, weight)
            trials, scale, weighted, jacobian, residual, weight = (part[~lost] for part in parts)
            if not len(trials):
                break
        scaled = normal[trials] / (scale[:, :, None] * scale[:, None, :])
        scaled = scaled + damping[trials, None, None] * np.eye(shape[-1])
        gradient = (weighted @ residual[..., None])[..., 0] / scale
        step = np.linalg.solve(scaled, gradient[..., None])[..., 0] / scale
        tried = theta[trials] + step
        new_predicted, new_jacobian = predicted_derivatives(problem, tried)
        new_residual = measured[trials] - new_predicted
        new_misfit, new_weight = _clipped(new_residual, clip)
        better = new_misfit <= misfit[trials] * (1 + 1e-12)
        in_sigma = np.sqrt(np.maximum(np.einsum("tp,tpq,tq->t", step, normal[trials], step), 0))
        in_sigma = in_sigma / np.sqrt(np.maximum(1, new_misfit / freedom))  # of what the misfit says
        small = (in_sigma < STEP_IN_SIGMA) | np.all(np.abs(step) <= STEP_RELATIVE * np.abs(tried), axis=-1)
        small |= better & (misfit[trials] - new_misfit <= MISFIT_RELATIVE * new_misfit)
        theta[trials[better]] = tried[better]
        misfit[trials[better]] = new_misfit[better]
        damping[trials] *= np.where(better, 0.1, 10.0)
        jacobian = np.where(better[:, None, None], new_jacobian, jacobian)[~small]
        residual = np.where(better[:, None], new_residual, residual)[~small]
        weight = np.where(better[:, None], new_weight, weight)[~small]
        trials = trials[~small]
        if not len(trials):
            break
    theta[trials] = np.nan
    without = np.isnan(theta).any(axis=-1)
    if without.all():
        raise NoConvergenceError(
            f"the output-error fit did not converge in {iterations} steps; start closer, or fix a weak parameter"
        )
    normal[without] = np.nan
    return Estimate(
        problem.names, theta.reshape(shape), invert(normal).reshape(*shape, shape[-1]), misfit.reshape(shape[:-1])
    )


def invert(normal):
    """Inverse of (..., parameter, parameter) J^T J, scaled: parameters differ by many orders of magnitude."""
    scale = np.sqrt(np.diagonal(normal, axis1=-2, axis2=-1))
    outer = scale[..., :, None] * scale[..., None, :]
    return np.linalg.inv(normal / outer) / outer


def cramer_rao_bound(problem, theta):
    """(parameter, parameter) smallest covariance an unbiased estimate can have at the true amplitudes theta."""
    _, jacobian = predicted_derivatives(problem, np.asarray(theta, float))
    check_identifiable(jacobian, problem.names)
    return invert(jacobian.T @ jacobian)


def magnitude_and_phase(names, theta, covariance):
    """Complex amplitudes as engineers read them: real and imaginary parts turned into magnitude and phase.

    returns : names, theta (..., parameter), covariance (..., parameter, parameter); x_real, x_imag become x, x_phase
    """
    names, theta = list(names), np.array(theta, float)
    turn = np.broadcast_to(np.eye(len(names)), (*theta.shape[:-1], len(names), len(names))).copy()
    for i, name in enumerate(names):
        stem = name.removesuffix("_real")
        if stem == name or i + 1 == len(names) or names[i + 1] != f"{stem}_imag":
            continue
        a, b = theta[..., i].copy(), theta[..., i + 1].copy()
        size = np.hypot(a, b)
        turn[..., i, i], turn[..., i, i + 1] = a / size, b / size
        turn[..., i + 1, i], turn[..., i + 1, i + 1] = -b / size**2, a / size**2
        theta[..., i], theta[..., i + 1] = size, np.arctan2(b, a)
        names[i], names[i + 1] = stem, f"{stem}_phase"
    return tuple(names), theta, turn @ covariance @ np.swapaxes(turn, -1, -2)
