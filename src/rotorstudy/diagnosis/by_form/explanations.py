"""Sets of causes fitted together with their shapes and an error of their form, and their posterior odds."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotorstudy.diagnosis.by_form.form import FormError, changes_of, most_probable_form
from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation, log_posterior_odds, odds_of
from rotorstudy.diagnosis.search.shape_fit import point_of, ranges_of, reshaped, response_with_shape
from rotorstudy.errors import CannotAct, NoSteadyState
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.levenberg_marquardt import HYPOTHESIS, levenberg_marquardt
from rotorstudy.inference.linear import invert
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.spectrum import Spectrum

log = logging.getLogger(__name__)

TRIAL = replace(HYPOTHESIS, steps=3, first_damping=1e-3)  # after which it is decided whether to go on
SETTLED = 0.25  # change of the log odds by another round of a fit with the error of form that it has found
ROUNDS = 4  # of these
LONGEST_OF_SHAPE = 0.1  # of the range of an option: the longest step, as columns change with the shape
LONGEST_OF_FIXED = 2.0  # standard deviations of its prior: the same of an amplitude whose size is known
FAILURES = 2  # shapes in which a cause cannot act, or the rotor has no steady motion, after which a fit ends


@dataclass(frozen=True)
class FormExplanation(Explanation):
    """An Explanation whose causes have an error of their form; spectrum : with that error, to which it was fitted."""

    form: FormError | None = None
    spectrum: Spectrum | None = None

    @property
    def kind(self):
        """Its causes, each with its alternatives and the quadrants of its angles, between which steps do not lead."""
        return frozenset(
            (c.cause, *c.variant.items(), *(v // (np.pi / 2) for name, v in c.shape.items() if name.endswith("_rad")))
            for c in self.causes
        )


@dataclass(frozen=True)
class FormSearch(Search):
    """A search whose explanations are FormExplanation; `found` has the best one of each kind."""

    has_form_errors: bool = True

    @property
    def nothing(self) -> FormExplanation:
        """The explanation without causes."""
        return self.found[frozenset()]

    def explain(self, causes: Sequence[Candidate], values: dict, thoroughly: bool = True) -> FormExplanation | None:
        """The explanation by some causes, from their shapes and values of amplitudes by name; None if no fit succeeds.

        The best one of its kind is kept and returned.

        thoroughly : until nothing changes; else after a few steps
        """
        log.debug("fitting %s (%d explanations)", " and ".join(c.cause for c in causes), len(self.found) - 1)
        try:
            one = _explained(self, tuple(causes), values, thoroughly)
        except (NoSteadyState, CannotAct):
            return None
        except Exception as error:
            self.note_broken(causes, error)
            return None
        known = self.found.get(one.kind)
        if known is None or odds_of(one) > odds_of(known):
            self.found[one.kind] = known = one
        return known


@dataclass(frozen=True)
class _Parameters:
    """The parameters of an explanation: those of the rig, the amplitudes of the causes, and their shapes.

    causes   : whose shapes are those of the start;  ranges : option -> ShapeRange, of each cause
    prior    : Prior without the shapes;  whole : with them, as fractions of their ranges
    ends     : (cause,) where the amplitudes and the shape of each cause end, to split theta
    """

    causes: tuple[Candidate, ...]
    ranges: tuple[dict, ...]
    prior: Prior
    whole: Prior
    ends: np.ndarray

    @classmethod
    def of(cls, work, causes):
        """Those of some causes."""
        ranges = tuple(ranges_of(work, c) if c.shape else {} for c in causes)
        prior = work.prior.plus(Prior.independent({name: known for c in causes for name, known in c.prior.items()}))
        shapes = {
            f"{name} of {c.term.label}": (x if ends.goes_around else 0.5, 1.0)
            for c, own in zip(causes, ranges, strict=True)
            for (name, ends), x in zip(own.items(), point_of(work, c) if own else (), strict=True)
        }
        whole = prior.plus(Prior.independent(shapes)) if shapes else prior
        return cls(causes, ranges, prior, whole, np.cumsum([len(prior.names), *map(len, ranges)])[:-1])

    def start(self, work, values):
        """(parameter,) at values of amplitudes by name, and the shapes of the causes."""
        known = dict(zip(work.prior.names, work.prior.mean, strict=True)) | values
        points = [point_of(work, c) for c in self.causes if c.shape]
        return np.concatenate([[known.get(name, 0.0) for name in self.prior.names], *points])

    def response(self, work, theta):
        """What `response_with_shape` returns."""
        amplitudes, *points = np.split(theta, self.ends)
        return response_with_shape(work, self.causes, amplitudes, points)

    @property
    def longest(self):
        """(parameter,) longest step of a fit."""
        fixed = {n: LONGEST_OF_FIXED * c.prior[n][1] for c in self.causes if c.fixed for n in c.names}
        shapes = len(self.whole.names) - len(self.prior.names)
        return np.array([*(fixed.get(n, np.inf) for n in self.prior.names), *[LONGEST_OF_SHAPE] * shapes])

    def form(self, work, theta, response):
        """The most probable FormError at the values of a fit."""
        shown, change = response
        rows, spectrum, names = self.whole.whitener, work.spectrum, self.prior.names
        off = np.append(spectrum.whitened(spectrum.amplitude - shown), rows @ (self.whole.mean - theta))
        changes = changes_of(self.causes, dict(zip(names, theta, strict=False)), names, change)
        return most_probable_form(spectrum, changes, off, spectrum.whitened(change).T, rows, work.settings.form_error)


def _explained(work, causes, values, thoroughly):
    """The FormExplanation by some causes; see `FormSearch.explain`."""
    parameters = _Parameters.of(work, causes)
    theta, known, failed, odds = parameters.start(work, values), {}, [], -np.inf

    def response(theta):
        """Of the last few values."""
        key = theta.tobytes()
        if key not in known:
            if len(known) > 2:
                del known[next(iter(known))]
            try:
                known[key] = parameters.response(work, theta)
            except (CannotAct, NoSteadyState) as error:
                failed.append(error)
                raise NoSteadyState(str(error)) from None
        return known[key]

    for _ in range(ROUNDS if thoroughly else 1):
        spectrum = work.spectrum.with_shared_error(parameters.form(work, theta, response(theta)).columns)

        def predict(trials, spectrum=spectrum):
            if len(failed) > FAILURES:
                raise NoSteadyState(str(failed[-1]))
            shown, change = response(trials[0])
            both = spectrum.whitened(np.concatenate([shown[None], change]))
            return both[:1], both[1:].T[None]

        found = levenberg_marquardt(
            predict,
            spectrum.whitened(spectrum.amplitude)[None],
            theta[None],
            parameters.whole.names,
            prior=parameters.whole,
            longest=parameters.longest,
            convergence=HYPOTHESIS if thoroughly else TRIAL,
        )
        theta = found.theta[0]
        one = _explanation(work, parameters, theta, response(theta), bool(found.converged[0]))
        if abs(odds_of(one) - odds) < SETTLED:
            break
        odds = odds_of(one)
    return one


def _explanation(work, parameters, theta, response, converged):
    """The FormExplanation at the values of a fit, with the error of form that is most probable there."""
    shown, change = response
    form = parameters.form(work, theta, response)
    spectrum = work.spectrum.with_shared_error(form.columns)
    amplitudes, *points = np.split(theta, parameters.ends)
    residual, jacobian = spectrum.whitened(spectrum.amplitude - shown), spectrum.whitened(change).T
    free, rows = len(amplitudes), parameters.whole.whitener
    covariance = invert(jacobian.T @ jacobian + rows.T @ rows)
    distance = rows @ (parameters.whole.mean - theta)
    stds = np.split(np.sqrt(np.diag(covariance)), parameters.ends)[1:]
    causes = []
    for cause, ranges, point, std in zip(parameters.causes, parameters.ranges, points, stds, strict=True):
        if ranges:
            cause = reshaped(work, cause, point)
            spread = {n: ends.slope(cause.shape[n]) * x for (n, ends), x in zip(ranges.items(), std, strict=True)}
            cause = cause._replace(shape_std=spread)
        causes.append(cause)
    model = work.model.plus(*(cause.term for cause in causes))
    whole = model.stated.copy()
    whole[model.position(parameters.prior.names)] = amplitudes
    fitted = Fit(
        model=model,
        theta=whole,
        prior=parameters.prior,
        covariance=covariance[:free, :free],
        misfit=float(residual @ residual),
        penalty=float(distance @ distance),
        residual=residual,
        jacobian=jacobian[:, :free],
        evidence=form.evidence,
        converged=converged,
    )
    odds = log_posterior_odds(tuple(causes), fitted, work.base, work.prior_odds)
    return FormExplanation(tuple(causes), fitted, odds, form, spectrum)
