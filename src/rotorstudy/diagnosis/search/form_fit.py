"""The fit of a set of causes: amplitudes and shapes together, with the error of their form that is most probable."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from rotorstudy.diagnosis.search.candidates import SCALES, Candidate, with_priors
from rotorstudy.diagnosis.search.form import changes_of, most_probable_form
from rotorstudy.diagnosis.search.odds import Explanation, log_posterior_odds, odds_of
from rotorstudy.diagnosis.search.shape_fit import (
    causes_at,
    point_of,
    ranges_of,
    reshaped,
    response_with_shape,
    whitened_with_slopes,
    with_shape_std,
)
from rotorstudy.errors import CannotAct, NoSteadyState
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.levenberg_marquardt import HYPOTHESIS, levenberg_marquardt
from rotorstudy.inference.linear import invert
from rotorstudy.inference.prior import Prior

WITHIN = 30.0  # log odds of the best explanation so far, which one must be able to reach to be fitted to its end
SETTLED = 0.25  # log odds that another round of a fit, with the error of form that it has found, must promise
ROUNDS = 4  # of these
ROUND = replace(HYPOTHESIS, steps=15, gain_relative=1e-3)  # then it is decided whether another one is worth it
LONGEST_OF_SHAPE = 0.1  # of the range of an option: the longest step, as columns change with the shape
WIDTH = (2 * np.pi) ** -0.5  # standard deviation of a shape, of its range: in the middle as probable as an even prior
FAILURES = 2  # shapes in which a cause cannot act, or the rotor has no steady motion, after which a fit ends


@dataclass(frozen=True)
class _Parameters:
    """The parameters of an explanation: those of the rig, the amplitudes of the causes, and their shapes."""

    work: object  # Search
    causes: tuple[Candidate, ...]  # whose shapes are those of the start
    ranges: tuple[dict, ...]  # option -> ShapeRange, of each cause
    prior: Prior  # without the shapes
    whole: Prior  # with them, as fractions of their ranges
    ends: np.ndarray  # (cause,) where the amplitudes and the shape of each cause end, to split theta

    @classmethod
    def of(cls, work, causes):
        """Those of some causes."""
        ranges, prior = tuple(ranges_of(work, c) for c in causes), with_priors(work.prior, causes)
        shapes = {
            f"{name} of {c.term.label}": (x if ends.goes_around else 0.5, WIDTH)
            for c, own in zip(causes, ranges, strict=True)
            for (name, ends), x in zip(own.items(), point_of(work, c), strict=True)
        }
        whole = prior.plus(Prior.independent(shapes))
        return cls(work, causes, ranges, prior, whole, np.cumsum([len(prior.names), *map(len, ranges)])[:-1])

    def start(self, values):
        """(parameter,) at values of amplitudes by name, and the shapes of the causes."""
        known = dict(zip(self.prior.names, self.prior.mean, strict=True)) | values
        points = [point_of(self.work, c) for c in self.causes]
        return np.concatenate([[known[name] for name in self.prior.names], *points])

    def response(self, theta):
        """What `response_with_shape` returns."""
        amplitudes, *points = np.split(theta, self.ends)
        return response_with_shape(self.work, self.causes, amplitudes, points)

    @property
    def longest(self):
        """(parameter,) longest step of a fit."""
        return np.where(np.arange(len(self.whole.names)) < len(self.prior.names), np.inf, LONGEST_OF_SHAPE)

    def bounds(self, theta):
        """(parameter,) least and largest values of a fit from some on; of shapes see `ShapeRange.between_breaks`.

        An amplitude that cannot be negative, with what the rig has of the same, is at least zero.
        """
        amplitudes, shapes = np.full((len(self.prior.names), 2), [-np.inf, np.inf]), theta[len(self.prior.names) :]
        known = dict(zip(self.work.model.names, self.work.model.stated, strict=True))
        known |= dict(zip(self.prior.names, theta, strict=False))
        for positive in (cause.positive for cause in self.causes):
            for name, same in positive.items():
                total = known[name] + sum(factor * known[other] for other, factor in same.items())
                powers = 1 + len(positive.keys() & same.keys())  # each may fall by its share
                amplitudes[self.prior.names.index(name), 0] = known[name] - max(total, 0.0) / powers
        ends = [ends for own in self.ranges for ends in own.values()]
        ends = [one.between_breaks(x) for one, x in zip(ends, shapes, strict=True)]
        return np.concatenate([amplitudes, np.reshape(ends, (-1, 2))]).T

    def form(self, theta, linearised, by_harmonic=True):
        """The most probable FormError at the values of a fit; linearised : what the method of that name returns."""
        work, (amplitudes, *points) = self.work, np.split(theta, self.ends)
        values, largest = dict(zip(self.prior.names, amplitudes, strict=True)), work.settings.form_error
        model = work.model.plus(*(c.term for c in causes_at(work, self.causes, amplitudes, points)))
        motion = work.local_forces.motion(model, model.filled(self.prior.names, amplitudes))
        changes = changes_of(self.causes, values, motion, work.local_forces, largest)
        return most_probable_form(work.spectrum, changes, *linearised, largest, by_harmonic)

    def narrowed(self, theta, off, jacobian, rows):
        """A linearised fit with amplitudes of the causes whose priors are as wide as these are large.

        By the widest prior an error of form that leaves amplitudes less certain would gain evidence.
        """
        factor = np.ones(len(theta))
        for cause in (c for c in self.causes if not c.fixed):
            at = [self.prior.names.index(name) for name in cause.names]
            square = (theta[at] * np.diag(rows)[at]) ** 2  # in standard deviations of the prior
            mean = np.bincount(cause.parameter, square) / np.bincount(cause.parameter)
            factor[at] = 1 / np.clip(np.sqrt(mean), SCALES[-1], 1.0)[cause.parameter]
        distance = len(off) - len(theta)
        return np.append(off[:distance], factor * off[distance:]), jacobian, factor[:, None] * rows

    def linearised(self, theta, response):
        """Residual and distance from the prior, Jacobian and whitener of the prior, without an error of form."""
        (shown, change), spectrum, rows = response, self.work.spectrum, self.whole.whitener
        off = np.append(spectrum.whitened(spectrum.amplitude - shown), rows @ (self.whole.mean - theta))
        return off, spectrum.whitened(change).T, rows

    def explanation(self, theta, response, form, evidence, converged):
        """The Explanation at the values of a fit with an error of form."""
        work, (shown, change), (amplitudes, *points) = self.work, response, np.split(theta, self.ends)
        spectrum, rows, free = work.spectrum.with_shared_error(form.columns), self.whole.whitener, len(amplitudes)
        residual, jacobian = spectrum.whitened(spectrum.amplitude - shown), spectrum.whitened(change).T
        distance, covariance = rows @ (self.whole.mean - theta), invert(jacobian.T @ jacobian + rows.T @ rows)
        stds = np.split(np.sqrt(np.diag(covariance)), self.ends)[1:]
        here = causes_at(work, self.causes, amplitudes, points)
        causes = tuple(map(with_shape_std, here, self.ranges, stds))
        fitted = Fit(
            model=work.model.plus(*(cause.term for cause in causes)),
            prior=self.prior,
            free=amplitudes,
            covariance=covariance[:free, :free],
            misfit=float(residual @ residual),
            penalty=float(distance @ distance),
            residual=residual,
            jacobian=jacobian[:, :free],
            evidence=evidence,
            converged=converged,
        )
        odds = log_posterior_odds(causes, fitted, work.base, work.prior_odds)
        return Explanation(causes, fitted, odds, form, spectrum, covariance if len(theta) > free else None)


def fitted_with_form(work, causes: tuple[Candidate, ...], values: dict) -> Explanation:
    """The Explanation of a Search by some causes; see `Search.explain`.

    A fit stays in the element where it begins, as the response jumps at a node by the inertia that a crack there moves;
    if it ends at the node, it goes on beyond it, not back again, and the better one is returned.

    raises : NoSteadyState, CannotAct
    """
    least = max(map(odds_of, work.explanations)) - WITHIN
    best, is_upward, gained = _fitted_within(work, causes, values, least), {}, np.inf
    while gained > SETTLED:
        before = odds_of(best)
        for n, name, x, fraction in _at_a_node(work, best.causes):
            if is_upward.setdefault((n, name), fraction > x) != (fraction > x):
                continue
            try:
                beyond = _moved(work, best.causes, n, name, fraction)
                other = _fitted_within(work, beyond, best.fit.values, max(least, odds_of(best)))
            except (CannotAct, NoSteadyState):  # such as in a hollow part of the shaft
                continue
            best = max(best, other, key=odds_of)
        gained = odds_of(best) - before
    if any(_at_a_node(work, best.causes)):
        best = max(best, _fitted_within(work, best.causes, best.fit.values, least, to_end=True), key=odds_of)
    return best


def _at_a_node(work, causes):
    """(number of the cause, option, fraction, fraction beyond) of each option that has ended at a node."""
    for n, cause in enumerate(causes):
        for (name, ends), x in zip(ranges_of(work, cause).items(), point_of(work, cause), strict=True):
            if (beyond := ends.beyond(x)) is not None:
                yield n, name, x, beyond


def _moved(work, causes, n, name, fraction):
    """The causes, one of them with an option at another fraction of its range."""
    names, point = list(ranges_of(work, causes[n])), point_of(work, causes[n])
    point[names.index(name)] = fraction
    return (*causes[:n], reshaped(work, causes[n], point), *causes[n + 1 :])


def _fitted_within(work, causes, values, least, to_end=False):
    """`fitted_with_form` in the elements where the causes are, by one round where it ends at a node, unless `to_end`.

    A round is a fit with the error of form that was most probable at its start; then that of its end is found.

    least : log odds that it must be able to reach
    """
    parameters, failed, best = _Parameters.of(work, causes), [], None
    theta = parameters.start(values)

    @lru_cache(maxsize=3)
    def kept(theta):
        try:
            return parameters.response(np.frombuffer(theta))
        except (CannotAct, NoSteadyState) as error:
            failed.append(error)
            raise NoSteadyState(str(error)) from None

    def response(theta):
        """Of the last few values."""
        return kept(theta.tobytes())

    def fitted(theta, form, linearised, to_gain):
        """The Minimum from some values with an error of form; to_gain : log evidence that is needed."""
        spectrum = work.spectrum.with_shared_error(form.columns)
        residual, distance = spectrum.whitened(spectrum.amplitude - response(theta)[0]), linearised[0][-len(theta) :]

        def predict(trials):
            if len(failed) > FAILURES:
                raise NoSteadyState(str(failed[-1]))
            return whitened_with_slopes(spectrum, *response(trials[0]))

        return levenberg_marquardt(
            predict,
            spectrum.whitened(spectrum.amplitude)[None],
            theta[None],
            parameters.whole.names,
            prior=parameters.whole,
            longest=parameters.longest,
            bounds=parameters.bounds(theta),
            needed=residual @ residual + distance @ distance - 2 * to_gain,
            convergence=ROUND,
        )

    needed = least + work.base.evidence - work.prior_odds.log_odds(causes)
    linearised = parameters.linearised(theta, response(theta))
    form = parameters.form(theta, parameters.narrowed(theta, *linearised), by_harmonic=False)
    for number in range(ROUNDS):
        found, fitted_with = fitted(theta, form, linearised, needed - form.evidence(*linearised)), form
        theta, converged = found.theta[0], bool(found.converged[0])
        linearised = parameters.linearised(theta, response(theta))
        narrowed = parameters.narrowed(theta, *linearised)
        form = parameters.form(theta, narrowed)
        forms = (fitted_with, form) if number else (form,)  # the first one is for the fit alone
        for one in forms:
            tried = parameters.explanation(theta, response(theta), one, one.evidence(*linearised), converged)
            best = tried if best is None else max(tried, best, key=odds_of)
        promised = form.reached - max(one.evidence(*narrowed) for one in forms)
        if promised < SETTLED or odds_of(best) + promised < least:
            break
        if not to_end and any(_at_a_node(work, best.causes)):
            break
    return best
