"""Explanations under trial: sets of causes fitted with their shapes and an error of their form, and their odds."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate, with_priors
from rotorstudy.diagnosis.search.form import LocalForces
from rotorstudy.diagnosis.search.form_fit import fitted_with_form
from rotorstudy.diagnosis.search.free_force import FreeForce
from rotorstudy.diagnosis.search.odds import (
    FURTHER_FAULT,
    LEAST_LOG_PROBABILITY,
    Explanation,
    PriorOdds,
    kind_of,
    odds_of,
)
from rotorstudy.diagnosis.search.screening import Projected, Projection, Screened, screen_each
from rotorstudy.diagnosis.search.shape_fit import point_of
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import CannotAct, NoSteadyState
from rotorstudy.inference.fit import Fit, fit, parameter_p_value
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import blamed, registry, said

log = logging.getLogger(__name__)

LIKELY_OUTSIDE = 0.5  # probability of a fault that the library lacks, above which a verdict is unknown
LEAST_LOG_ODDS = 2.0  # log posterior odds that an explanation needs: seven to one that something is missing
NEAR = 0.05  # of the range of an option of a shape: fits from there end alike


@dataclass(frozen=True)
class Search:
    """A search under way, and its outcome."""

    rig: Model  # without the nuisance terms
    model: Model  # with them
    spectrum: Spectrum  # with the model error, without an error of causes
    settings: Settings
    prior: Prior  # of the parameters that are free in every fit
    base: Fit  # of these alone
    candidates: list  # of Candidate
    # FreeForce at each place, the most likely first: what a fault that the library lacks may do
    free_forces: tuple[FreeForce, ...] = ()
    screened: list = field(default_factory=list)  # Screened of each, at the base fit
    # `kind_of` the causes -> Explanation, the best one of each kind that was fitted
    found: dict = field(default_factory=dict)
    # the same kinds -> shapes from which, and at which, a fit was made; shapes beside which others were exchanged
    starts: dict = field(default_factory=dict)
    rests: dict = field(default_factory=dict)
    impossible: dict = field(default_factory=dict)  # the same of those that cannot be true, but may lead to others
    # names of causes that were not fitted -> (names of those of the same faults that were, log of their relative odds)
    unfitted: dict = field(default_factory=dict)
    # `place_key` -> Candidate there, in its first shape or made anew; None if it cannot act there
    at_places: dict = field(default_factory=dict)
    # effect -> one line with file and line number, for plugins that failed; the rest was searched
    failures: dict = field(default_factory=dict)
    # (speed,) bool, where a free motion of the rig without causes grows; None during the search
    unstable: np.ndarray | None = None
    upheld: bool = True  # whether the best explanation keeps its odds with the held-out speeds
    stopped: bool = False  # whether the search was stopped before its end

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
    def nothing(self) -> Explanation:
        """The explanation without causes."""
        return self.found[frozenset()]

    @property
    def best(self) -> Explanation:
        """The explanation with the highest posterior odds; that without causes if they are too low or not upheld."""
        best = max(self.explanations, key=odds_of)
        return best if odds_of(best) > LEAST_LOG_ODDS and self.upheld else self.nothing

    @property
    def is_rejected(self) -> bool:
        """Whether records, stated values, or a fault that the library lacks speak against the best explanation."""
        best, significance = self.best, self.settings.significance
        if best.fit.is_rejected(significance) or parameter_p_value(best.fit, self.prior.by_name) < significance:
            return True
        return bool(best.causes) and self.outside_probability > LIKELY_OUTSIDE

    @property
    def is_doubtful(self) -> bool:
        """Whether a better explanation is to be expected than the best one that was found.

        It is rejected; or what it leaves, together with the volume of its error of form, costs more than noise on
        average, by more than the prior odds of one more fault.
        """
        one = self.best
        excess = one.fit.misfit - len(one.fit.residual) + (one.spectrum.log_shared_volume if one.spectrum else 0.0)
        return bool(self.is_rejected or 0.5 * excess > -np.log(FURTHER_FAULT))

    @property
    def form_error(self) -> float:
        """Expected standard deviation of the error of the form of the best causes, relative to what they change."""
        return self.best.form.mean_std if self.best.form else 0.0

    @property
    def form_error_by_harmonic(self) -> np.ndarray | float:
        """(harmonic,) that of each."""
        return self.best.form.std if self.best.form else 0.0

    @cached_property
    def prior_odds(self) -> PriorOdds:
        """Of the candidates."""
        return PriorOdds(self.candidates, self.settings, self.rig.structure)

    @cached_property
    def local_forces(self) -> LocalForces:
        """Of the rig with the best free force, whose values are those of the rig without the fault."""
        fits = [one.fitted for one in self.free_forces if one.fitted is not None]
        return LocalForces(fits[0] if fits else self.base, self.spectrum, self.rig.structure)

    @property
    def log_outside(self) -> float:
        """Log odds of a fault that the library lacks, at any place."""
        return float(np.logaddexp.reduce([one.log_odds for one in self.free_forces], initial=-np.inf))

    @property
    def outside_probability(self) -> float:
        """Posterior probability of a fault that the library lacks."""
        every = np.logaddexp.reduce([self.log_outside, *(odds for _, odds in self._of_sets())])
        return float(np.exp(self.log_outside - every))

    def outside_places(self, share: float) -> list[FreeForce]:
        """The places where a fault that the library lacks acts with a probability of `share`, if there is one."""
        total, found = 0.0, []
        for one in self.free_forces:
            if total >= share:
                break
            total += np.exp(one.log_odds - self.log_outside)
            found.append(one)
        return found

    def posterior(self, prior_odds: PriorOdds | None = None) -> list[tuple[Explanation, float]]:
        """(explanation, posterior probability), most probable first; of each set of causes its best shape.

        They sum to one with `outside_probability`.

        prior_odds : instead of those of the settings
        """
        own, other = self.prior_odds.log_odds, (prior_odds or self.prior_odds).log_odds
        found = [(e, odds + other(e.causes) - own(e.causes)) for e, odds in self._of_sets()]
        every = np.logaddexp.reduce([self.log_outside, *(odds for _, odds in found)])
        found = [(e, float(np.exp(max(odds - every, LEAST_LOG_PROBABILITY)))) for e, odds in found]
        return sorted(found, key=lambda one: one[1], reverse=True)

    def credible(self, share: float) -> list[tuple[Explanation, float]]:
        """Those of `posterior` of which one is true with a probability of `share`, also if all change equally often.

        If it is not a fault that the library lacks, which is told beside them.

        How often an effect is what changed (`Effect.change_rate`) tells which one is likely, but not that the records
        exclude another. Rates that the user states count.
        """
        effects, stated = registry().plugins["effect"], self.settings.base_rates.items()
        stated = {name: rate for name, rate in stated if rate != effects[name].change_rate}
        alike = PriorOdds(self.candidates, self.settings.model_copy(update={"base_rates": stated}), self.rig.structure)
        needed = set()
        for found in (self.posterior(), self.posterior(alike)):
            before = np.cumsum([0.0, *(weight for _, weight in found)])
            needed |= {e.named for (e, _), less in zip(found, before, strict=False) if less < share * before[-1]}
        return [(e, weight) for e, weight in self.posterior() if e.named in needed]

    def _of_sets(self):
        """(best explanation, log odds) of each set of causes, with the same faults at places that were not fitted."""
        best = {e.named: e for e in sorted(self.explanations, key=odds_of)}
        odds = {named: [odds_of(e)] for named, e in best.items()}
        impossible = {e.named for e in self.impossible.values()}
        for named, (like, relative) in self.unfitted.items():
            if named not in impossible | best.keys() and like in best:
                odds[like].append(odds_of(best[like]) + relative)
        return [(e, float(np.logaddexp.reduce(odds[named]))) for named, e in best.items()]

    def tried(self, causes: Sequence[Candidate], step: Callable, *given: Any, otherwise: Any = None):
        """What a step with some causes returns; else if they cannot act, there is no steady state, or a plugin fails.

        An effect that cannot be computed, as its plugin fails or what it gives cannot be solved, is noted as broken.
        """
        try:
            return step(*given)
        except (NoSteadyState, CannotAct):
            return otherwise
        except Exception as error:
            if not causes:
                raise
            line, effects = blamed(error), [registry().get("effect", c.effect) for c in causes]
            guilty = next((one for one in reversed(effects) if one.file in line), effects[-1])
            self.failures.setdefault(guilty.name, line or f"effect '{guilty.name}' ({guilty.file}): {said(error)}")
            return otherwise

    def project(self, fitted: Fit, chosen: list[Candidate], without=(), free=()) -> tuple[Projected, list[Candidate]]:
        """Columns of candidates, and those of which they could be computed; a plugin that fails is recorded as broken.

        without, free : as of `Projection`
        """
        projection = Projection(fitted, self.spectrum, without, free)
        try:
            return projection.of(chosen), chosen
        except Exception:  # of some plugin; one at a time shows of which
            usable = [one for one in chosen if self.tried([one], projection.of, [one])]
            return projection.of(usable), usable

    def screen(self, fitted: Fit, chosen: list[Candidate]) -> list[Screened]:
        """Screened of each candidate at a fit; one whose columns cannot be computed explains nothing."""
        projected, usable = self.project(fitted, chosen)
        known = dict(zip((cause.label for cause in usable), screen_each(projected, usable), strict=True))
        return [known.get(cause.label) or _nothing(cause) for cause in chosen]

    def explain(self, causes: Sequence[Candidate], values: dict) -> Explanation | None:
        """The explanation by some causes, from their shapes and values of amplitudes by name; None if no fit succeeds.

        The best one of its kind is kept and returned.
        """
        log.debug("fitting %s (%d explanations)", " and ".join(c.cause for c in causes), len(self.found) - 1)
        self.note(self.starts, causes)
        one = self.tried(causes, self._fitted, tuple(causes), values)
        if one is None:
            return None
        self.note(self.starts, one.causes)
        known = self.found.get(one.kind)
        if known is None or odds_of(one) > odds_of(known):
            self.found[one.kind] = known = one
        return known

    def _fitted(self, causes, values):
        """`fitted_with_form`; where no step leads to a steady motion, forces in time begin as small as is usual."""
        in_time = (c for c in causes if any(p.force for p in c.term.parameters))
        usual = values | {name: mean for c in in_time for name, (mean, _) in c.prior.items()}
        try:
            return fitted_with_form(self, causes, values)
        except NoSteadyState:
            if usual == values:
                raise
        return fitted_with_form(self, causes, usual)

    def note(self, tried: dict, causes: Sequence[Candidate]) -> None:
        """Keep the shapes of causes in `starts` or `rests`."""
        tried.setdefault(kind_of(causes), []).append(_fractions(self, causes))

    def was_tried(self, tried: dict, causes: Sequence[Candidate]) -> bool:
        """Whether the same causes were kept in nearly these shapes, from which a step leads to the same end.

        Not of causes without a shape: where a fit of these ends depends on the values of the rig from which it begins.
        """
        here, known = _fractions(self, causes), tried.get(kind_of(causes), ())
        return len(here) > 0 and any(np.abs(here - other).max() < NEAR for other in known)

    def held(self, causes, values: dict, steps: int = 0, needed: float = np.inf) -> Fit | None:
        """The model with some causes at given values by name, base parameters included, or after some steps of a fit.

        needed  : as of `fit`
        returns : None without a steady state, or if a plugin fails
        """
        extended, known = self.model.plus(*(c.term for c in causes)), with_priors(self.prior, causes)
        stated = dict(zip(self.model.names, self.model.stated, strict=True))
        stated |= dict(zip(self.prior.names, self.prior.mean, strict=True)) | values
        start = np.array([stated.get(name, 0.0) for name in extended.names])
        return self.tried(causes, lambda: fit(extended, self.spectrum, known, start, steps, needed=needed))

    def allows(self, causes: Sequence[Candidate]) -> bool:
        """Whether causes are no more faults than allowed, each named once."""
        several = len(self.prior_odds.together(causes)) > self.settings.most_causes
        return not several and len({c.cause for c in causes}) == len(causes)


def _fractions(work, causes):
    """Shapes of causes as fractions (option,) of their ranges, in an order that is always the same."""
    return np.concatenate([[], *(point_of(work, c) for c in sorted(causes, key=lambda c: c.cause))])


def _nothing(cause):
    return Screened(0.0, -np.inf, np.zeros(len(cause.names)), np.full(len(cause.names), np.inf))
