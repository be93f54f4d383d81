"""Explanations under trial: sets of causes, their fits and posterior odds, and the plugins that failed on the way."""

import logging
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.odds import LEAST_LOG_PROBABILITY, Explanation, PriorOdds, log_posterior_odds, odds_of
from rotorstudy.diagnosis.search.screening import Projected, Screened, project, screen_each
from rotorstudy.diagnosis.search.shape_equations import shape_equations
from rotorstudy.diagnosis.search.shape_fit import ranges_of
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import NoSteadyState, PluginError
from rotorstudy.inference.fit import Fit, fit
from rotorstudy.inference.levenberg_marquardt import HYPOTHESIS
from rotorstudy.inference.linear import invert
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import blamed, registry

log = logging.getLogger(__name__)

LEAST_LOG_ODDS = 2.0  # log posterior odds that an explanation needs: seven to one that something is missing
MODELS_KEPT = 32  # with causes
TRIAL_STEPS = 5  # of a fit, after which it is decided whether to finish it


@dataclass(frozen=True)
class Search:
    """A search under way, and its outcome.

    rig             : Model without the nuisance terms
    model, stated   : with the nuisance terms; the Spectrum with the model error
    spectrum        : that with the error of the causes too
    prior           : Prior of the parameters that are free in every fit;  base : Fit of these alone
    candidates      : list of Candidate;  screened : Screened of each, at the base fit
    scanned         : list of Candidate in the shapes that scans have found
    shapes          : cause, alternatives and label -> the shapes with which each scan of it begins
    found           : labels of the causes -> Explanation, for every one fitted
    equations       : labels of the causes, label of one of them -> what `shape_equations` returns
    models          : Model without causes, terms of the causes -> Model with them, the last few
    failures        : effect -> one line with file and line number, for plugins that failed; the rest was searched
    cause_error     : standard deviation of the error of a cause, which the spectrum has
    unstable        : (speed,) bool, where a free motion of the rig without causes grows; None during the search
    upheld          : whether the best explanation keeps its odds with the held-out speeds
    has_form_errors : whether every explanation was fitted with an error of the form of its causes
    stopped         : whether the search was stopped before its end
    """

    rig: Model
    model: Model
    stated: Spectrum
    spectrum: Spectrum
    settings: Settings
    prior: Prior
    base: Fit
    candidates: list
    screened: list = field(default_factory=list)
    scanned: list = field(default_factory=list)
    shapes: dict = field(default_factory=dict)
    found: dict = field(default_factory=dict)
    equations: dict = field(default_factory=dict)
    models: dict = field(default_factory=dict)
    failures: dict = field(default_factory=dict)
    cause_error: float = 0.0
    unstable: np.ndarray | None = None
    upheld: bool = True
    has_form_errors: bool = False
    stopped: bool = False

    @property
    def whole(self):
        """The model with the nuisance terms, as `shape_fit.Work` calls it."""
        return self.model

    @property
    def broken(self):
        """One line for each effect whose plugin failed and that was therefore not considered, or not throughout."""
        return list(self.failures.values())

    @property
    def explanations(self):
        """Every Explanation that was fitted."""
        return list(self.found.values())

    @property
    def best(self):
        """The explanation with the highest posterior odds; that without causes if they are too low or not upheld."""
        best = max(self.explanations, key=odds_of)
        return best if odds_of(best) > LEAST_LOG_ODDS and self.upheld else self.found[frozenset()]

    @cached_property
    def prior_odds(self) -> PriorOdds:
        """Of the candidates."""
        return PriorOdds(self.candidates, self.settings, self.rig.structure)

    def posterior(self) -> list[tuple[Explanation, float]]:
        """(explanation, posterior probability), most probable first; of each set of causes its best shape."""
        best = {}
        for e in self.explanations:
            if e.named not in best or odds_of(e) > odds_of(best[e.named]):
                best[e.named] = e
        found = sorted(best.values(), key=odds_of, reverse=True)
        odds = np.array([odds_of(e) for e in found])
        probability = np.exp(np.maximum(odds - np.logaddexp.reduce(odds), LEAST_LOG_PROBABILITY))
        return list(zip(found, probability.tolist(), strict=True))

    def note_broken(self, causes, error):
        """Record the plugin that raised an exception; an exception from elsewhere is raised again."""
        line = blamed(error) or (str(error) if isinstance(error, PluginError) else "")
        if not line or not causes:
            raise error
        guilty = [c.effect for c in causes if registry().get("effect", c.effect).file in line]
        self.failures.setdefault(guilty[-1] if guilty else causes[-1].effect, line)

    def project(self, fitted: Fit, chosen: list[Candidate], without=(), free=()) -> tuple[Projected, list[Candidate]]:
        """`project`, and the candidates whose columns could be computed; a plugin that fails is recorded as broken."""
        try:
            return project(fitted, self.spectrum, chosen, without, free), chosen
        except Exception:  # of some plugin; one at a time shows of which
            usable = [one for one in chosen if self._has_columns(fitted, one)]
            return project(fitted, self.spectrum, usable, without, free), usable

    def _has_columns(self, fitted, one):
        try:
            return bool(project(fitted, self.spectrum, [one]))
        except NoSteadyState:
            return False
        except Exception as error:
            self.note_broken([one], error)
            return False

    def screen(self, fitted: Fit, chosen: list[Candidate]) -> list[Screened]:
        """Screened of each candidate at a fit; one whose columns cannot be computed explains nothing."""
        projected, usable = self.project(fitted, chosen)
        known = dict(zip((cause.label for cause in usable), screen_each(projected, usable), strict=True))
        return [known.get(cause.label) or _nothing(cause) for cause in chosen]

    def explain(self, causes, starts=None) -> Explanation | None:
        """The Explanation by some causes; None if no fit succeeds.

        starts : list of (parameter,) of the extended model, by default the stated values; tried in turn until a fit
                 leaves no more than noise
        """
        key = frozenset(c.label for c in causes)
        if key not in self.found:
            extended, known, fresh = self._extension(causes)
            fitted = None
            for start in starts or [fresh]:
                found = self._fit(causes, extended, known, start)
                fitted = min((f for f in (fitted, found) if f), key=lambda f: f.cost, default=None)
                if fitted and fitted.cost < len(fitted.residual):
                    break
            if fitted is None:
                return None
            odds = log_posterior_odds(tuple(causes), fitted, self.base, self.prior_odds)
            self.found[key] = _with_free_shapes(self, Explanation(tuple(causes), fitted, odds))
        return self.found[key]

    def trial_fit(self, causes, start=None) -> Fit | None:
        """Fit of an explanation after a few steps, None if it fails."""
        found = self.found.get(frozenset(c.label for c in causes))
        if found:
            return found.fit
        extended, known, fresh = self._extension(causes)
        return self._fit(causes, extended, known, fresh if start is None else start, steps=TRIAL_STEPS)

    def held(self, causes, values: dict) -> Fit | None:
        """The model with some causes at given values by name, base parameters included; None without a steady state."""
        extended, known, _ = self._extension(causes)
        return self._fit(causes, extended, known, self.start(causes, values), steps=0)

    def is_rejected_as_stated(self, explanation: Explanation) -> bool:
        """Whether noise and the stated model error, without an error of the causes, do not explain what is left."""
        known = explanation.fit
        exact = fit(known.model, self.stated, known.prior, start=known.theta)
        return exact.is_rejected(self.settings.significance)

    def start(self, causes, values: dict) -> np.ndarray:
        """(parameter,) of the model extended by some causes: values by name, the stated ones for the others."""
        extended = self._extended(causes)
        stated = dict(zip(self.model.names, self.model.stated, strict=True))
        stated |= dict(zip(self.prior.names, self.prior.mean, strict=True)) | values
        return np.array([stated.get(name, 0.0) for name in extended.names])

    def _extended(self, causes):
        """The model with some causes; the last few are kept, as their tables take as long to form as a response."""
        key = self.model, *(id(c.term) for c in causes)  # of objects that the kept model holds
        if key not in self.models:
            if len(self.models) == MODELS_KEPT:
                del self.models[next(iter(self.models))]
            self.models[key] = self.model.plus(*(c.term for c in causes))
        return self.models[key]

    def _extension(self, causes):
        """Extended model, Prior of its free parameters, and a start at the stated values."""
        known = self.prior.plus(Prior.independent({name: prior for c in causes for name, prior in c.prior.items()}))
        before = self.before(causes)  # earlier causes start at their fit, the base at its stated values
        values = dict(zip(known.names, known.mean, strict=True)) | {
            name: value
            for name, value in zip(before.model.names, before.theta, strict=True)
            if name not in self.prior.names
        }
        return self._extended(causes), known, self.start(causes, values)

    def before(self, causes) -> Fit:
        """The fit of all causes but the last."""
        known = self.found.get(frozenset(c.label for c in causes[:-1]))
        return known.fit if known else self.base

    def _fit(self, causes, extended, known, start, steps=HYPOTHESIS.steps):
        """The Fit of an extended model, None if it has no steady state or a plugin fails."""
        log.debug("fitting %s (%d explanations fitted)", " and ".join(c.cause for c in causes), len(self.found) - 1)
        try:
            return fit(extended, self.spectrum, known, start=start, steps=steps)
        except NoSteadyState:
            return None
        except Exception as error:
            self.note_broken(causes, error)
            return None


def _with_free_shapes(work, explanation):
    """An explanation whose odds and covariance include that its shapes were searched, with their standard deviations.

    The Occam factor of a shape is how much the data narrow its range; its amplitudes are correlated with it.
    """
    fitted, odds, known = explanation.fit, explanation.log_posterior_odds, []
    free, covariance = len(fitted.names), fitted.covariance
    for cause in explanation.causes:
        if cause.shape:
            try:
                normal, _ = shape_equations(work, explanation.causes, fitted, cause)
            except NoSteadyState:  # of a shape next to it
                known.append(cause)
                continue
            odds -= 0.5 * (np.linalg.slogdet(normal)[1] - np.linalg.slogdet(normal[:free, :free])[1])
            whole = invert(normal)
            ranges = ranges_of(work, cause)
            searched = [name for name in ranges if name in cause.shape]
            std = np.sqrt(np.diag(whole)[free:])
            spread = {n: ranges[n].slope(cause.shape[n]) * x for n, x in zip(searched, std, strict=True)}
            cause, covariance = cause._replace(shape_std=spread), whole[:free, :free]
        known.append(cause)
    return Explanation(tuple(known), replace(fitted, covariance=covariance), float(odds))


def _nothing(cause):
    return Screened(0.0, -np.inf, np.zeros(len(cause.names)), np.full(len(cause.names), np.inf))
