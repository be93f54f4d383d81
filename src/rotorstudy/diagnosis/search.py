"""The search for causes: screen all candidates, fit the promising ones, compare their odds, add, swap, drop."""

from collections import Counter
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rotorstudy.diagnosis.candidates import (
    SCALES,
    Candidate,
    Screened,
    candidates,
    log_possible,
    log_scales,
    screen,
    shape_ranges,
    with_shape,
    with_vibration,
)
from rotorstudy.diagnosis.settings import Settings, base_rate
from rotorstudy.diagnosis.shape_scan import can_be_scanned, scan
from rotorstudy.errors import NoSteadyState, PluginError
from rotorstudy.inference.fit import HYPOTHESIS, Fit, fit
from rotorstudy.inference.linear import invert
from rotorstudy.inference.prediction import predicted
from rotorstudy.inference.prior import Prior, prior_of, with_rotor
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import blamed, registry
from rotorstudy.model.rig import make_term
from rotorstudy.model.rotor_numbers import with_rotor_numbers

TRIAL_STEPS = 5  # of a fit, after which it is decided whether to finish it
FITTED_FULLY = 4  # least number of explanations per round that are fitted to convergence
CLOSE = 15.0  # excess over the lowest cost of a round (likelihood ratio e^-7.5) beyond which a fit is not finished
STRAINED = 3.0  # mean square distance of the base parameters from their priors; 1 is expected
LEAST_LOG_ODDS = 2.0  # log posterior odds that an explanation needs: seven to one that something is missing
WORTH_FITTING = 0.1  # of what the best candidate explains when linearised, which is inaccurate for large effects
THRESHOLD_STEPS = 20  # of a fixed-point iteration that converges quickly
LEAST_LOG_PROBABILITY = -700.0  # keeps posterior probabilities from underflow to zero
LEFT_BY_SHAPE = 0.05  # of what a cause explains, if its shape is half a step of those tried from the true one
RESCANS = 4  # of the shape of a cause, each at its last fit
SHAPE_STEPS = 8  # of the shape options of a cause
SHAPE_DIFFERENCE = 1e-4  # of the range of a shape option, for its derivative
SHAPE_GAIN = 0.25  # convergence tolerance of the shape, in log posterior odds
SHARES_OF_STEP = (1.0, 0.3, 0.1)


NOT_SCREENED = Screened(0.0, -np.inf, np.zeros(0), np.zeros(0))


@dataclass(frozen=True)
class Explanation:
    """A set of causes, fitted; log_posterior_odds : natural logarithm of its odds against the base model alone."""

    causes: tuple[Candidate, ...]
    fit: Fit
    log_posterior_odds: float

    @property
    def named(self):
        """Names of the causes in a verdict, without their shapes."""
        return frozenset(cause.cause for cause in self.causes)


def _odds(explanation):
    return explanation.log_posterior_odds


@dataclass(frozen=True)
class Search:
    """A search under way, and its outcome.

    model, spectrum : with the nuisance terms; with the model error
    prior           : Prior of the parameters that are free in every fit;  base : Fit of these alone
    candidates      : list of Candidate;  screened : Screened of each, at the base fit
    found           : labels of the causes -> Explanation, for every one fitted
    faults          : effect -> one line with file and place, for plugins that failed; the rest was searched
    upheld          : whether the best explanation keeps its odds with the held-out speeds
    """

    model: Model
    spectrum: Spectrum
    settings: Settings
    prior: Prior
    base: Fit
    candidates: list
    screened: list = field(default_factory=list)
    found: dict = field(default_factory=dict)
    faults: dict = field(default_factory=dict)
    upheld: bool = True

    @property
    def broken(self):
        """One line for each effect whose plugin failed and that was therefore not considered, or not throughout."""
        return list(self.faults.values())

    @property
    def explanations(self):
        """Every Explanation that was fitted."""
        return list(self.found.values())

    @property
    def best(self):
        """The explanation with the highest posterior odds; that without causes if they are too low or not upheld."""
        best = max(self.explanations, key=_odds)
        return best if best.log_posterior_odds > LEAST_LOG_ODDS and self.upheld else self.found[frozenset()]

    def prior_odds(self, cause: Candidate) -> float:
        """Prior odds of a cause: the base rate of its effect in the library, divided among its places and shapes."""
        return self._prior_odds[cause.effect]

    @cached_property
    def _prior_odds(self):
        """Effect -> prior odds of each of its candidates."""
        count = Counter(c.effect for c in self.candidates)
        rates = {effect: base_rate(effect, self.settings) for effect in count}
        total = sum(rates.values())
        return {effect: rate / (total * count[effect]) for effect, rate in rates.items()}

    def even_odds_gain(self, cause: Candidate) -> float:
        """Decrease of the cost at which a cause has even posterior odds: it offsets prior odds and Occam factor.

        With the prior width of highest evidence, which is about the amplitude itself, the Occam factor depends on the
        decrease of the cost; hence the fixed-point iteration.
        """
        absent = cause.parameter[-1]  # all parameters but one
        widths = 0 if cause.fixed else np.log(len(SCALES)) + (absent + 1) * np.log(2) * (absent > 0)
        given = -2 * np.log(self.prior_odds(cause)) + 2 * widths
        count, gain = max(np.bincount(cause.parameter)) * (not cause.fixed), given
        for _ in range(THRESHOLD_STEPS):
            gain = given + count * np.log1p(gain / max(count, 1))
        return float(gain)

    def posterior(self) -> list[tuple[Explanation, float]]:
        """(explanation, posterior probability), most probable first; of each set of causes its best shape."""
        best = {}
        for e in self.explanations:
            if e.named not in best or _odds(e) > _odds(best[e.named]):
                best[e.named] = e
        found = sorted(best.values(), key=_odds, reverse=True)
        odds = np.array([_odds(e) for e in found])
        probability = np.exp(np.maximum(odds - np.logaddexp.reduce(odds), LEAST_LOG_PROBABILITY))
        return list(zip(found, probability.tolist(), strict=True))


def base_model(model: Model, settings: Settings) -> tuple[Model, Prior]:
    """The model with its nuisance terms, and the Prior of the parameters that are free in every fit.

    Parameters
    ----------
    model : Model
        With a value for every amplitude.
    settings : Settings

    Returns
    -------
    Model
    Prior

    Raises
    ------
    RotorstudyError
        If an amplitude has no value.
    """
    terms = []
    for kind in settings.nuisance:
        places = registry().get("effect", kind, "nuisance").places(model.structure, model.sensors)
        terms += [
            make_term("effect", {"kind": kind, **place, "label": f"calibration {i}"}, model.structure, model.sensors)
            for i, place in enumerate(places)
        ]
    known = {unknown.name: (0.0, settings.nuisance[term.kind]) for term in terms for unknown in term.unknowns}
    uncertainty = with_rotor(settings.uncertainty, model.structure)
    model = with_rotor_numbers(model, (name for name, share in uncertainty.items() if share))
    return model.plus(*terms), prior_of(model, uncertainty).plus(Prior.independent(known))


def search(model: Model, spectrum: Spectrum, settings: Settings) -> Search:
    """Explanations of a spectrum by up to `most_causes` candidates, found by adding, swapping and dropping.

    Parameters
    ----------
    model : Model
        With a value for every amplitude.
    spectrum : Spectrum
        Its covariance with the model error.
    settings : Settings

    Returns
    -------
    Search

    Raises
    ------
    RotorstudyError
        If the base model cannot be fitted. A broken plugin of the library raises nothing: see `Search.broken`.
    """
    model = with_vibration(model, spectrum)
    whole, prior = base_model(model, settings)
    base = fit(whole, spectrum, prior)
    every, faults = candidates(model, settings)
    work = Search(whole, spectrum, settings, prior, base, every, faults=faults)
    work.screened.extend(_screen(work, base, every))
    current = work.found[frozenset()] = Explanation((), base, 0.0)
    fits = [base]
    if base.penalty > STRAINED * len(
        prior.names
    ):  # the parameters imitate what is missing: screen at the stated ones too
        fits.append(fit(whole, spectrum, prior, steps=0))
    while len(current.causes) < settings.most_causes:
        tried = _add(work, model, current, fits if not current.causes else None)
        better = max((_refine(work, model, e) for e in _to_refine(tried, current.fit.cost)), key=_odds, default=current)
        if _odds(better) <= _odds(current):
            break
        current = better
        if len(current.causes) > 1:
            current = _swap(work, model, current)
    return work


def _screen(work, fitted, chosen):
    """`screen`; a candidate whose plugin fails is recorded as broken and explains nothing."""
    try:
        return screen(fitted, work.spectrum, chosen)
    except Exception:  # of some plugin; screening one at a time shows of which
        return [_screen_alone(work, fitted, one) for one in chosen]


def _screen_alone(work, fitted, one):
    try:
        return screen(fitted, work.spectrum, [one])[0]
    except NoSteadyState:
        pass
    except Exception as error:
        _note_broken(work, [one], error)
    return Screened(0.0, -np.inf, np.zeros(len(one.names)), np.full(len(one.names), np.inf))


def _note_broken(work, causes, error):
    """Record the plugin that raised an exception; an exception from elsewhere is raised again."""
    line = blamed(error) or (str(error) if isinstance(error, PluginError) else "")
    if not line:
        raise error
    guilty = [c.effect for c in causes if registry().get("effect", c.effect).file in line]
    work.faults.setdefault(guilty[-1] if guilty else causes[-1].effect, line)


def _to_refine(tried, before):
    """The best explanation, and those that a better shape of their last cause may bring near its cost.

    before : cost of the explanation that they extend
    """
    if not tried:
        return []
    best = max(tried, key=_odds)
    shaped = sorted((e for e in tried if e.causes[-1].shape and e is not best), key=_odds, reverse=True)
    reach = max(CLOSE, LEFT_BY_SHAPE * (before - best.fit.cost))
    near = [e for e in shaped if e.fit.cost < best.fit.cost + reach]
    if not near and best.fit.cost > len(best.fit.residual):
        near = shaped[:1]
    return [best, *near]


def _explain(work, causes, starts=None):
    """The Explanation by some causes; None if no fit succeeds.

    starts : list of (parameter,) of the extended model, by default the stated values; tried in turn until a fit leaves
             no more than noise
    """
    key = frozenset(c.label for c in causes)
    if key not in work.found:
        extended, known, fresh = _extension(work, causes)
        fitted = None
        for start in starts or [fresh]:
            found = _fit(work, causes, extended, known, start)
            fitted = min((f for f in (fitted, found) if f), key=lambda f: f.cost, default=None)
            if fitted and fitted.cost < len(fitted.residual):
                break
        if fitted is None:
            return None
        work.found[key] = Explanation(tuple(causes), fitted, _log_posterior_odds(work, causes, fitted))
    return work.found[key]


def _log_posterior_odds(work, causes, fitted):
    """Log posterior odds of fitted causes against the base alone: Bayes factor times prior odds."""
    odds = fitted.evidence - work.base.evidence
    for cause in causes:
        place = [fitted.names.index(name) for name in cause.names]
        width = fitted.prior.std[place]
        covariance = fitted.covariance[np.ix_(place, place)]
        odds += np.log(work.prior_odds(cause))
        limited = np.isin(cause.names, cause.positive)
        odds += np.sum(log_possible(fitted.free[place], np.sqrt(np.diag(covariance)))[limited])
        if not cause.fixed:
            odds += log_scales(fitted.free[place] / width, covariance / np.outer(width, width), cause.parameter)
    return float(odds)


def _trial_fit(work, causes, start=None):
    """Fit of an explanation after a few steps, by default from the stated values; None if it fails."""
    found = work.found.get(frozenset(c.label for c in causes))
    extended, known, fresh = _extension(work, causes)
    return found.fit if found else _fit(work, causes, extended, known, fresh if start is None else start, TRIAL_STEPS)


def _extension(work, causes):
    """Extended model, Prior of its free parameters, and a start at the stated values."""
    extended = work.model.plus(*(c.term for c in causes))
    known = work.prior.plus(Prior.independent({name: prior for c in causes for name, prior in c.prior.items()}))
    before = _before(work, causes)  # earlier causes start at their fit, the base at its stated values
    values = dict(zip(known.names, known.mean, strict=True))
    values |= {
        name: value
        for name, value in zip(before.model.names, before.theta, strict=True)
        if name not in work.prior.names
    }
    return extended, known, _theta(extended, values, values.values())


def _before(work, causes):
    """The fit of all causes but the last."""
    known = work.found.get(frozenset(c.label for c in causes[:-1]))
    return known.fit if known else work.base


def _fit(work, causes, extended, known, start, steps=HYPOTHESIS.steps):
    """The Fit of an extended model, None if it has no steady state or a plugin fails."""
    try:
        return fit(extended, work.spectrum, known, start=start, steps=steps)
    except NoSteadyState:
        return None
    except Exception as error:
        _note_broken(work, causes, error)
        return None


def _promising(work, chosen, screenings, most):
    """Candidates worth a fit, {index: Screened}: the best of each screening in turn, each cause in its best shape."""
    lists = []
    for screened in screenings:
        odds = [one.evidence + np.log(work.prior_odds(cause)) for one, cause in zip(screened, chosen, strict=True)]
        order, seen = sorted(range(len(chosen)), key=lambda i: -odds[i]), set()
        order = [i for i in order if not (chosen[i].cause in seen or seen.add(chosen[i].cause))]
        best = max((one.explained for one in screened), default=0.0)
        worth = [max(WORTH_FITTING * best, 0.5 * work.even_odds_gain(chosen[i])) for i in order]
        lists.append([(i, screened[i]) for i, low in zip(order, worth, strict=True) if screened[i].explained >= low])
    found = {}
    for rank in range(max(map(len, lists), default=0)):
        for one in lists:
            if rank < len(one) and len(found) < most * len(lists):
                found.setdefault(*one[rank])
    return found


def _add(work, model, current, fits=None, most=None):
    """Explanations with one more cause, of the candidates worth a fit.

    fits : list of Fit of the current explanation at which candidates are screened, by default its own
    """
    named, fits = current.named, fits or [current.fit]
    chosen = [c for c in work.candidates if c.cause not in named]
    screenings = [work.screened if f is work.base else _screen(work, f, chosen) for f in fits]
    if not most and current.fit.cost > len(current.fit.residual):  # more than noise is left
        chosen, screenings = _with_scanned(work, model, chosen, screenings, fits)
    promising = _promising(work, chosen, screenings, most or work.settings.candidates_per_round)
    looked, starts = {}, {}
    for i, screened in promising.items():
        causes = (*current.causes, chosen[i])
        extended, _, fresh = _extension(work, causes)
        starts[i] = _theta(extended, current.fit.model.names, current.fit.theta, screened.start)
        at_scan = _theta(extended, fits[-1].model.names, fits[-1].theta, screened.start)
        looked[i] = _trial_fit(work, causes, at_scan if can_be_scanned(chosen[i]) else fresh)
    order = sorted((i for i in looked if looked[i]), key=lambda i: looked[i].cost)
    tried = []
    for rank, i in enumerate(order):
        lowest = looked[order[0]].cost
        reach = LEFT_BY_SHAPE * max(current.fit.cost - lowest, 0) if chosen[i].shape else 0
        if rank >= FITTED_FULLY and looked[i].cost > lowest + max(CLOSE, reach):
            continue
        tried.append(_explain(work, (*current.causes, chosen[i]), [looked[i].theta, starts[i]]))
    return [e for e in tried if e]


def _with_scanned(work, model, chosen, screenings, fits):
    """Candidates and their screenings, with those added whose shape a scan at each fit has found."""
    first = list({c.cause: c for c in reversed(chosen)}.values())
    for number, fitted in enumerate(fits):
        try:
            scanned = scan(fitted, work.spectrum, model, first, work.settings.prior_width)
        except NoSteadyState:
            continue
        chosen = chosen + [one.cause for one in scanned]
        screenings = [
            [*rows, *(one.screened if i == number else NOT_SCREENED for one in scanned)]
            for i, rows in enumerate(screenings)
        ]
    return chosen, screenings


def _swap(work, model, current):
    """Try to drop each cause, and to replace it by the best other one; the most probable result."""
    for cause in current.causes:
        less = _explain(work, tuple(c for c in current.causes if c.label != cause.label))
        if less is None:
            continue
        if _odds(less) > _odds(current):
            return less
        current = max([current, *_add(work, model, less, most=FITTED_FULLY)], key=_odds)
    return current


def _refine(work, model, explanation):
    """The explanation with the best shape of its last cause; unchanged if that shape cannot be varied."""
    try:
        return _best_of_all_shapes(work, model, explanation)
    except NoSteadyState:
        return explanation
    except Exception as error:
        _note_broken(work, explanation.causes, error)
        return explanation


def _best_of_all_shapes(work, model, explanation):
    """The explanation with the shape options of its last cause optimised by Gauss-Newton steps.

    Options are scaled to their range. The linearised columns of a contact depend
    strongly on its shape and may select a wrong one: where more than noise is left, all shapes are tried first.
    """
    explanation = _best_shape(work, model, explanation)
    *rest, last = explanation.causes
    ranges = shape_ranges(last.effect, model.structure)

    def explain(place, theta):
        shape = {name: ranges[name].value(x) for name, x in zip(ranges, place, strict=True)}
        moved = with_shape(model, last, shape, work.settings.prior_width)
        return _explain(work, (*rest, moved), [theta])

    best = explanation
    place = [ranges[name].place(last.shape[name]) if name in last.shape else 0.5 for name in ranges]
    if ranges and set(ranges) != set(last.shape):
        best = explain(place, best.fit.theta) or best
    for _ in range(SHAPE_STEPS if set(ranges) == set(best.causes[-1].shape) and ranges else 0):
        normal, right = _shape_equations(work, model, best, place, ranges)
        step, moved = np.split(invert(normal) @ right, [len(right) - len(ranges)])
        tried = None
        for share in SHARES_OF_STEP:
            ahead = [ends.place(ends.value(x)) for ends, x in zip(ranges.values(), place + share * moved, strict=True)]
            theta = best.fit.theta.copy()
            theta[best.fit.model.position(best.fit.names)] += share * step
            tried = explain(ahead, theta)
            if tried and _odds(tried) > _odds(best):
                break
        if not tried or _odds(tried) <= _odds(best):
            break
        gained, best, place = _odds(tried) - _odds(best), tried, ahead
        if gained < SHAPE_GAIN:
            break
    best = max(best, explanation, key=_odds)
    last = best.causes[-1]
    if ranges and set(ranges) == set(last.shape):  # the amplitude is correlated with the shape
        place = [ranges[name].place(last.shape[name]) for name in ranges]
        normal, _ = _shape_equations(work, model, best, place, ranges)
        free, covariance = len(best.fit.names), invert(normal)
        std = zip(ranges, np.sqrt(np.diag(covariance)[free:]), strict=True)
        known = last._replace(shape_std={name: ranges[name].slope(last.shape[name]) * x for name, x in std})
        best = replace(best, causes=(*rest, known), fit=replace(best.fit, covariance=covariance[:free, :free]))
        work.found[frozenset(c.label for c in best.causes)] = best
    return best


def _best_shape(work, model, explanation):
    """The explanation with the last cause in the best of the shapes tried."""
    *rest, last = explanation.causes
    if not last.shape or explanation.fit.cost < len(explanation.fit.residual):
        return explanation
    if can_be_scanned(last):
        return _rescanned(work, model, explanation)
    looked = []
    for cause in _shapes_worth_a_fit(work, rest, last):
        fitted = _trial_fit(work, (*rest, cause))
        looked += [(fitted.cost, (*rest, cause), fitted.theta)] if fitted else []
    _, causes, theta = min(looked, key=lambda one: one[0])
    return max(explanation, _explain(work, causes, [theta]) or explanation, key=_odds)


def _rescanned(work, model, explanation):
    """The explanation with the shape of its last cause scanned at its own fit, as long as that improves it."""
    for _ in range(RESCANS):
        *rest, last = explanation.causes
        without, known, _ = _extension(work, rest)
        own = dict(zip(explanation.fit.model.names, explanation.fit.theta, strict=True))
        at = fit(without, work.spectrum, known, start=np.array([own[name] for name in without.names]), steps=0)
        found = scan(at, work.spectrum, model, [last], work.settings.prior_width)
        causes = (*rest, found[0].cause)
        start = _theta(work.model.plus(*(c.term for c in causes)), without.names, at.theta, found[0].screened.start)
        tried = _explain(work, causes, [start])
        if not tried or _odds(tried) <= _odds(explanation):
            break
        gained, explanation = _odds(tried) - _odds(explanation), tried
        if gained < SHAPE_GAIN:
            break
    return explanation


def _shapes_worth_a_fit(work, rest, last):
    """The shapes of a cause: all of them, or of each alternative (where it has some) the best when linearised."""
    same = [cause for cause in work.candidates if cause.cause == last.cause]
    if not last.variant:
        return same
    best = {}
    for cause, screened in zip(same, _screen(work, _before(work, (*rest, last)), same), strict=True):
        best.setdefault(tuple(cause.variant.values()), []).append((screened.evidence, cause.label, cause))
    return [max(shapes, key=lambda one: one[:2])[-1] for shapes in best.values()]


def _shape_equations(work, model, explanation, place, ranges):
    """Normal matrix and right side of a Gauss-Newton step: parameters, then shape options scaled to their range."""
    *rest, last = explanation.causes
    fitted, columns = explanation.fit, []
    for i, (name, ends) in enumerate(ranges.items()):
        off = SHAPE_DIFFERENCE if place[i] < 0.5 else -SHAPE_DIFFERENCE
        moved = with_shape(model, last, {**last.shape, name: ends.value(place[i] + off)}, work.settings.prior_width)
        extended = work.model.plus(*(c.term for c in (*rest, moved)))
        shown = predicted(extended, work.spectrum, fitted.theta)
        left = work.spectrum.whitened(work.spectrum.amplitude - shown)
        columns.append((fitted.residual - left) / off)
    data = np.column_stack([fitted.jacobian, *columns])
    free, count = len(fitted.names), len(data.T)
    rows, distance = (
        np.eye(count),
        np.zeros(count),
    )  # of the priors; that of a shape is centred between its ends
    rows[:free, :free] = fitted.prior.whitener
    distance[:free] = fitted.prior.whitener @ (fitted.prior.mean - fitted.free)
    distance[free:] = [0 if ends.goes_around else 0.5 - x for ends, x in zip(ranges.values(), place, strict=True)]
    return data.T @ data + rows.T @ rows, data.T @ fitted.residual + rows.T @ distance


def _theta(extended, names, values, start=None):
    """(parameter,) of an extended model: known values by name, and a start for the others."""
    known = dict(zip(names, values, strict=True))
    theta = np.array([known.get(name, 0.0) for name in extended.names])
    if start is not None:
        new = [i for i, name in enumerate(extended.names) if name not in known]
        theta[new] = start
    return theta
