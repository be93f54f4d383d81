"""The search for causes: screen every candidate, fit the promising ones, score, add, swap, drop."""

from dataclasses import dataclass, field, replace

import numpy as np

from rotorstudy.diagnosis.candidates import SCALES, Candidate, candidate, candidates, log_possible, log_scales, screen
from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.fit import STEPS, Fit, fit, inverse, predicted
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import make_term

FIRST_LOOK = 5  # steps of a fit before it is known whether it is worth more
FITTED_FULLY = 4  # explanations a round at least, and all
CLOSE = 15.0  # above the cost of the best: e^-7 of its belief
BENT = 3.0  # mean square of the priors' deviations from which a base fit is bent; 1 is expected
ACCUSES = 4.0  # score an explanation needs: odds of seven to one that something is missing at all
WORTH_FITTING = 0.1  # of what the best candidate explains by its columns: a large effect bends them
PRICE_STEPS = 20
LEAST = -700.0  # logarithm of the least share of belief, so that none becomes zero by rounding
SHAPE_STEPS = 8  # of the shape options of a cause
SHAPE_DIFFERENCE = 1e-4  # of the range of a shape option, for its derivative
SHAPE_GAIN = 0.5  # of the score, below which a shape is good enough
SHARES_OF_STEP = (1.0, 0.3, 0.1)


@dataclass(frozen=True)
class Explanation:
    """A set of causes, fitted; score : twice the logarithm of its odds against the base alone."""

    causes: tuple[Candidate, ...]
    fit: Fit
    score: float

    @property
    def named(self):
        """The causes as they are named, shapes apart."""
        return frozenset(cause.cause for cause in self.causes)


@dataclass(frozen=True)
class Search:
    """A search under way, and its outcome.

    model, spectrum : with the nuisance terms; with the model error
    prior           : name -> (mean, std) of all that moves in every fit;  base : Fit of it alone
    candidates      : every one;  screened : of each, by the columns at the base fit
    found           : labels -> Explanation, every one fitted
    upheld          : whether what no fit has seen leaves the best of them standing
    """

    model: object
    spectrum: object
    settings: object
    prior: dict
    base: Fit
    candidates: list
    screened: list
    found: dict = field(default_factory=dict)
    upheld: bool = True

    @property
    def explanations(self):
        return list(self.found.values())

    @property
    def best(self):
        """The explanation with the highest score; none of them if the base alone is nearly as good."""
        best = max(self.explanations, key=lambda e: e.score)
        return best if best.score > ACCUSES and self.upheld else self.found[frozenset()]

    def share(self, cause):
        """Prior odds of a cause: every effect of the library alike, its places and shapes share what it has."""
        effects = len({c.effect for c in self.candidates})
        return 1 / (effects * sum(c.effect == cause.effect for c in self.candidates))

    def price(self, cause):
        """Fall of the cost at which a cause is as likely as not: what its width, its sign and the choice cost."""
        given = -2 * np.log(self.share(cause)) + (0 if cause.fixed else 2 * np.log(len(SCALES)))
        count, price = len(cause.names) * (not cause.fixed), given
        for _ in range(PRICE_STEPS):  # the width that serves best is that of the amplitude itself
            price = given + count * np.log1p(price / max(count, 1))
        return float(price)

    def shares(self):
        """(explanation, share of belief), most believed first; of each set of causes its best shape."""
        best = {}
        for e in self.explanations:
            if e.named not in best or e.score > best[e.named].score:
                best[e.named] = e
        found = sorted(best.values(), key=lambda e: -e.score)
        score = np.array([e.score for e in found]) / 2
        weight = np.exp(np.maximum(score - np.logaddexp.reduce(score), LEAST))
        return list(zip(found, weight.tolist(), strict=True))


def base_model(model, settings):
    """The model with its nuisance terms, and the priors (mean, std) of all that moves in every fit."""
    terms = []
    for kind in settings.nuisance:
        item = {"kind": kind, "label": "calibration"}
        places = _places(kind, model)
        terms += [
            make_term("effect", {**item, **place, "label": f"calibration {i}"}, model.structure, model.sensors)
            for i, place in enumerate(places)
        ]
    prior = {}
    shares = settings.uncertainty
    for term in model.terms:
        for parameter in term.parameters:
            value = term.values.get(parameter.name)
            if value is None:
                raise RotorstudyError(f"{term.full_name(parameter)} has no value; the rig needs one to be diagnosed")
            full = term.full_name(parameter)
            share = shares.get(full, shares.get(parameter.name, shares.get("default", 0.1)))
            std = share * (abs(value) or parameter.typical)
            if std == 0:
                continue
            if parameter.is_complex:
                prior |= {f"{full}_real": (value.real, std), f"{full}_imag": (value.imag, std)}
            else:
                prior[full] = (float(value), std)
    for term in terms:
        for unknown in term.unknowns:
            prior[unknown.name] = (0.0, settings.nuisance[term.kind])
    return model.plus(*terms), prior


def _places(kind, model):
    return registry().get("effect", kind, "nuisance").places(model.structure, model.sensors)


def search(model, spectrum, settings):
    """Explanations of a spectrum by up to `most_causes` candidates, best found by adding, swapping and dropping."""
    whole, prior = base_model(model, settings)
    base = fit(whole, spectrum, prior)
    every = candidates(model, settings)
    work = Search(whole, spectrum, settings, prior, base, every, screen(base, spectrum, every))
    current = work.found[frozenset()] = Explanation((), base, 0.0)
    screenings = [work.screened]
    if base.penalty > BENT * len(prior):  # bent by what it lacks; columns at the stated parameters may serve better
        screenings.append(screen(fit(whole, spectrum, prior, steps=0), spectrum, every))
    while len(current.causes) < settings.most_causes:
        tried = _add(work, current, screenings if not current.causes else None)
        better = max((_refine(work, model, e) for e in _worth_refining(tried)), key=lambda e: e.score, default=current)
        if better.score <= current.score:
            break
        current = better
        if len(current.causes) > 1:
            current = _swap(work, current)
    return work


def _worth_refining(tried):
    """The best of explanations; if it leaves more than noise does, also the best whose last cause has a shape."""
    if not tried:
        return []
    best = max(tried, key=lambda e: e.score)
    shaped = [e for e in tried if e.causes[-1].shape and best.fit.cost > len(best.fit.residual)]
    other = max(shaped, key=lambda e: e.score, default=best)
    return [best] if other is best else [best, other]


def _explain(work, causes, starts=None):
    """The Explanation by some causes; None if no fit succeeds.

    starts : list of (parameter,) of the extended model, by default the stated values; the later ones are tried only if
             the earlier do not leave as little as noise does
    """
    key = frozenset(c.label for c in causes)
    if key not in work.found:
        extended, known, fresh = _extension(work, causes)
        fitted = None
        for start in starts or [fresh]:
            found = _fit(work, extended, known, start)
            fitted = min((f for f in (fitted, found) if f), key=lambda f: f.cost, default=None)
            if fitted and fitted.cost < len(fitted.residual):
                break
        if fitted is None:
            return None
        work.found[key] = Explanation(tuple(causes), fitted, _score(work, causes, fitted))
    return work.found[key]


def _score(work, causes, fitted):
    """Twice the logarithm of the odds of some causes, fitted, against the base alone."""
    odds = fitted.evidence - work.base.evidence
    for cause in causes:
        place = [fitted.names.index(name) for name in cause.names]
        width = fitted.std[place]
        covariance = fitted.covariance[np.ix_(place, place)]
        odds += np.log(work.share(cause))
        limited = np.isin(cause.names, cause.positive)
        odds += np.sum(log_possible(fitted.free[place], np.sqrt(np.diag(covariance)))[limited])
        if not cause.fixed:
            odds += log_scales(fitted.free[place] / width, covariance / np.outer(width, width))
    return float(2 * odds)


def _first_look(work, causes):
    """Fit of an explanation after a few steps, None if there is none."""
    found = work.found.get(frozenset(c.label for c in causes))
    return found.fit if found else _fit(work, *_extension(work, causes), steps=FIRST_LOOK)


def _extension(work, causes):
    """Extended model, what is known of its parameters, and a start at the stated values."""
    extended = work.model.plus(*(c.term for c in causes))
    known = work.prior | {name: prior for c in causes for name, prior in c.prior.items()}
    before = _before(work, causes)  # causes before keep their size; the base starts where it is stated, not bent
    values = {name: mean for name, (mean, _) in known.items()}
    values |= {
        name: value for name, value in zip(before.model.names, before.theta, strict=True) if name not in work.prior
    }
    return extended, known, _theta(extended, values, values.values())


def _before(work, causes):
    """The fit of all causes but the last."""
    known = work.found.get(frozenset(c.label for c in causes[:-1]))
    return known.fit if known else work.base


def _fit(work, extended, known, start, steps=STEPS):
    try:
        return fit(extended, work.spectrum, known, start=start, steps=steps)
    except (RotorstudyError, np.linalg.LinAlgError):
        return None


def _promising(work, chosen, screenings, most):
    """Candidates worth a fit, {index: Screened}: of each screening the first, in turn, each cause in its best shape."""
    lists = []
    for screened in screenings:
        odds = [one.evidence + np.log(work.share(cause)) for one, cause in zip(screened, chosen, strict=True)]
        order, seen = sorted(range(len(chosen)), key=lambda i: -odds[i]), set()
        order = [i for i in order if not (chosen[i].cause in seen or seen.add(chosen[i].cause))]
        best = max((one.explained for one in screened), default=0.0)
        worth = [max(WORTH_FITTING * best, 0.5 * work.price(chosen[i])) for i in order]
        lists.append([(i, screened[i]) for i, low in zip(order, worth, strict=True) if screened[i].explained >= low])
    found = {}
    for rank in range(max(map(len, lists), default=0)):
        for one in lists:
            if rank < len(one) and len(found) < most * len(lists):
                found.setdefault(*one[rank])
    return found


def _add(work, current, screenings=None, most=None):
    """Explanations with one cause more, those worth a fit."""
    named = current.named
    chosen = [c for c in work.candidates if c.cause not in named]
    screenings = screenings or [screen(current.fit, work.spectrum, chosen)]
    promising = _promising(work, chosen, screenings, most or work.settings.candidates_per_round)
    looked = {i: _first_look(work, (*current.causes, chosen[i])) for i in promising}
    order = sorted((i for i in looked if looked[i]), key=lambda i: looked[i].cost)
    tried = []
    for rank, i in enumerate(order):
        if rank >= FITTED_FULLY and looked[i].cost > looked[order[0]].cost + CLOSE:
            break
        columns = _theta(looked[i].model, current.fit.model.names, current.fit.theta, promising[i].start)
        tried.append(_explain(work, (*current.causes, chosen[i]), [looked[i].theta, columns]))
    return [e for e in tried if e]


def _swap(work, current):
    """Drop each cause, and put the best other one in its place, while that is better."""
    for cause in current.causes:
        less = _explain(work, tuple(c for c in current.causes if c.label != cause.label))
        if less is None:
            continue
        if less.score > current.score:
            return less
        current = max([current, *_add(work, less, most=FITTED_FULLY)], key=lambda e: e.score)
    return current


def _refine(work, model, explanation):
    """Shape options of the last cause moved to where the fit is best, by steps of Gauss and Newton.

    They count in units of their range, logarithmic where it does not begin at zero. A contact bends its own columns, so
    that these may choose the wrong shape: where more than noise is left, all shapes are looked at first.
    """
    explanation = _best_shape(work, explanation)
    *rest, last = explanation.causes
    ranges = registry().get("effect", last.effect).shape

    def explain(place, theta):
        shape = {name: _value(x, *ranges[name]) for name, x in zip(ranges, place, strict=True)}
        moved = candidate(model, last.effect, last.where, shape, last.term.label, work.settings.prior_width)
        return _explain(work, (*rest, moved), [theta])

    best = explanation
    place = [_place(last.shape[name], *ranges[name]) if name in last.shape else 0.5 for name in ranges]
    if ranges and set(ranges) != set(last.shape):
        best = explain(place, best.fit.theta) or best
    for _ in range(SHAPE_STEPS if set(ranges) == set(best.causes[-1].shape) and ranges else 0):
        normal, right = _shape_equations(work, model, best, place, ranges)
        step, moved = np.split(inverse(normal) @ right, [len(right) - len(ranges)])
        tried = None
        for share in SHARES_OF_STEP:
            ahead = np.clip(place + share * moved, 0, 1)
            theta = best.fit.theta.copy()
            theta[best.fit.model.position(best.fit.names)] += share * step
            tried = explain(ahead, theta)
            if tried and tried.score > best.score:
                break
        if not tried or tried.score <= best.score:
            break
        gained, best, place = tried.score - best.score, tried, ahead
        if gained < SHAPE_GAIN:
            break
    best = max(best, explanation, key=lambda e: e.score)
    last = best.causes[-1]
    if ranges and set(ranges) == set(last.shape):  # the amplitude is known as well as the shape lets it be
        place = [_place(last.shape[name], *ranges[name]) for name in ranges]
        normal, _ = _shape_equations(work, model, best, place, ranges)
        free = len(best.fit.names)
        best = replace(best, fit=replace(best.fit, covariance=inverse(normal)[:free, :free]))
        work.found[frozenset(c.label for c in best.causes)] = best
    return best


def _best_shape(work, explanation):
    """The explanation with the last cause in the best of the shapes tried."""
    *rest, last = explanation.causes
    if not last.shape or explanation.fit.cost < len(explanation.fit.residual):
        return explanation
    looked = []
    for cause in work.candidates:
        if cause.cause == last.cause:
            fitted = _first_look(work, (*rest, cause))
            looked += [(fitted.cost, (*rest, cause), fitted.theta)] if fitted else []
    _, causes, theta = min(looked, key=lambda one: one[0])
    return max(explanation, _explain(work, causes, [theta]) or explanation, key=lambda e: e.score)


def _place(value, low, high):
    """Where in its range (0 to 1) the value of a shape option lies."""
    return np.log(value / low) / np.log(high / low) if low > 0 else value / high


def _value(place, low, high):
    return float(low * (high / low) ** place if low > 0 else place * high)


def _shape_equations(work, model, explanation, place, ranges):
    """Normal matrix and right side, of first order, for the parameters and then the shape options in their range."""
    *rest, last = explanation.causes
    fitted, columns = explanation.fit, []
    for i, name in enumerate(ranges):
        off = SHAPE_DIFFERENCE if place[i] < 0.5 else -SHAPE_DIFFERENCE
        shape = {**last.shape, name: _value(place[i] + off, *ranges[name])}
        moved = candidate(model, last.effect, last.where, shape, last.term.label, work.settings.prior_width)
        extended = work.model.plus(*(c.term for c in (*rest, moved)))
        shown = predicted(extended, work.spectrum, fitted.theta)
        left = work.spectrum.whitened(work.spectrum.amplitude - shown)
        columns.append((fitted.residual - left) / off)
    data = np.column_stack([fitted.jacobian, *columns])
    known = np.diag(np.concatenate([1 / fitted.std, np.ones(len(ranges))]))
    pull = np.concatenate([(fitted.mean - fitted.free) / fitted.std, 0.5 - np.array(place)])
    normal, right = data.T @ data + known**2, data.T @ fitted.residual + known @ pull
    return normal, right


def _theta(extended, names, values, start=None):
    """(parameter,) of an extended model: values known by name, and a start for the rest."""
    known = dict(zip(names, values, strict=True))
    theta = np.array([known.get(name, 0.0) for name in extended.names])
    if start is not None:
        new = [i for i, name in enumerate(extended.names) if name not in known]
        theta[new] = start
    return theta
