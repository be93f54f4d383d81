"""The search for causes: screen every candidate, fit the promising ones, score, add, swap, drop."""

from dataclasses import dataclass, field

import numpy as np

from rotorstudy.diagnosis.candidates import SHAPES_TRIED, Candidate, candidate, candidates, screen
from rotorstudy.diagnosis.fit import STEPS, Fit, fit
from rotorstudy.errors import RotorstudyError
from rotorstudy.rig import make_term

FIRST_LOOK = 5  # steps of a fit before it is known whether it is worth more
FITTED_FULLY = 4  # explanations a round at least, and all
CLOSE = 15.0  # above the cost of the best: e^-7 of its belief
BENT = 3.0  # mean square of the priors' deviations from which a base fit is bent; 1 is expected
ENOUGH = 0.05  # chance of a residual by noise alone from which no further cause is looked for
WORTH_FITTING = 0.1  # of what the best candidate explains by its columns: a large effect bends them


@dataclass(frozen=True)
class Explanation:
    """A set of causes, fitted; score : fall of the cost, less what its parameters and the choice among many cost."""

    causes: tuple[Candidate, ...]
    fit: Fit
    score: float

    @property
    def labels(self):
        return frozenset(cause.label for cause in self.causes)

    @property
    def named(self):
        """The causes as they are named, shapes apart."""
        return frozenset(cause.cause for cause in self.causes)


@dataclass(frozen=True)
class Search:
    """Outcome: base fit, every explanation fitted, candidates with their first screening."""

    base: Fit
    explanations: list
    candidates: list
    screened: list
    prior: dict = field(default_factory=dict)

    @property
    def best(self):
        return max(self.explanations, key=lambda e: e.score)


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
    from rotorstudy.plugins import registry

    return registry().get("effect", kind, "nuisance").places(model.structure, model.sensors)


def search(model, spectrum, settings):
    """Explanations of a spectrum by up to `most_causes` candidates, best found by adding, swapping and dropping."""
    whole, prior = base_model(model, settings)
    base = fit(whole, spectrum, prior)
    every = candidates(model, settings.leave_out)
    rows = 2 * spectrum.amplitude.size
    found = {frozenset(): Explanation((), base, 0.0)}

    def explain(causes, start=None, steps=None):
        """The Explanation by some causes; steps: a first look, which is not kept."""
        key = frozenset(c.label for c in causes)
        if key in found:
            return found[key]
        extended = whole.plus(*(c.term for c in causes))
        free = [name for c in causes for name in c.names]
        before = base_of(causes)
        here = _theta(extended, before.model.names, before.theta, start)
        means = {**dict(zip(before.model.names, before.theta, strict=True)), **{n: m for n, (m, _) in prior.items()}}
        fresh = _theta(extended, means, means.values())  # a base bent by what it lacks is no place to start from
        if steps is not None:
            fitted = attempt(extended, free, fresh, steps)
            return None if fitted is None else fitted.cost
        fitted = min(
            (f for f in (attempt(extended, free, s) for s in (fresh, here)) if f), key=lambda f: f.cost, default=None
        )
        if fitted is None:
            return None
        price = sum(_price(len(c.names), rows, len(every)) for c in causes)
        found[key] = Explanation(tuple(causes), fitted, base.cost - fitted.cost - price)
        return found[key]

    def attempt(extended, free, start, steps=STEPS):
        try:
            return fit(extended, spectrum, prior, free, start=start, steps=steps)
        except (RotorstudyError, np.linalg.LinAlgError):
            return None

    def base_of(causes):
        """The fit of all causes but the last: where a new one starts."""
        return found.get(frozenset(c.label for c in causes[:-1]), found[frozenset()]).fit

    # a base bent by what it lacks would bend the columns too: then they are taken at the stated parameters
    bent = base.penalty > BENT * len(prior)
    screened = screen(fit(whole, spectrum, prior, steps=0) if bent else base, spectrum, prior, every)
    current = found[frozenset()]

    def refined(explanation):
        return _refine(explanation, model, explain) if any(c.shape for c in explanation.causes) else explanation

    while len(current.causes) < settings.most_causes and not (current.causes and _is_enough(current, rows)):
        better = _step(current, every, spectrum, prior, settings, explain, screened if not current.causes else None)
        if better is None or better.score <= current.score:
            break
        current = refined(better)
        if len(current.causes) > 1:
            current = _swap(current, every, spectrum, prior, settings, explain, found)
    return Search(base, list(found.values()), every, screened, prior)


def _is_enough(explanation, rows):
    """Whether noise explains what is left, so that looking for a further cause is idle."""
    from scipy.stats import chi2

    return chi2.sf(explanation.fit.cost, rows) > ENOUGH


def _price(parameters, rows, library):
    """What a cause costs: ln n for each parameter (BIC), and twice the logarithm of the library it was chosen from."""
    return parameters * np.log(rows) + 2 * np.log(library)


def _step(current, every, spectrum, prior, settings, explain, screened):
    """The best explanation with one cause more."""
    chosen = [c for c in every if c.cause not in current.named]
    screened = screen(current.fit, spectrum, prior, chosen) if screened is None else screened
    order = sorted(range(len(chosen)), key=lambda i: -screened[i].explained)
    seen = set()  # of each cause the shape that explains most
    order = [i for i in order if not (chosen[i].cause in seen or seen.add(chosen[i].cause))]
    rows = 2 * spectrum.amplitude.size
    most = screened[order[0]].explained if order else 0.0
    looked = []
    for i in order[: settings.tried]:
        price = _price(len(chosen[i].names), rows, len(every))
        if screened[i].explained < max(WORTH_FITTING * most, 0.5 * price):
            break
        causes = (*current.causes, chosen[i])
        cost = explain(causes, steps=FIRST_LOOK)
        if cost is not None:
            looked.append((cost.fit.cost if isinstance(cost, Explanation) else cost, i))
    looked.sort()
    looked = [one for rank, one in enumerate(looked) if rank < FITTED_FULLY or one[0] < looked[0][0] + CLOSE]
    tried = [explain((*current.causes, chosen[i]), screened[i].start) for _, i in looked]
    tried = [e for e in tried if e is not None]
    return max(tried, key=lambda e: e.score, default=None)


def _swap(current, every, spectrum, prior, settings, explain, found):
    """Drop each cause, and put the best other one in its place, while that is better."""
    for cause in current.causes:
        rest = tuple(c for c in current.causes if c.label != cause.label)
        less = explain(rest)
        if less is None:
            continue
        if less.score > current.score:
            return less
        other = _step(less, every, spectrum, prior, replace_tried(settings, 4), explain, None)
        if other is not None and other.score > current.score:
            current = other
    return current


SHAPE_STEPS = 12  # evaluations of a shape option


def _refine(explanation, model, explain):
    """Shape options of the last cause moved, one after the other, to where the fit is best."""
    from scipy.optimize import minimize_scalar

    from rotorstudy.plugins import registry

    *rest, last = explanation.causes
    best = [explanation]
    for name, (low, high) in registry().get("effect", last.effect).shape.items():
        logarithmic = low > 0

        def cost(value, name=name, logarithmic=logarithmic):
            shape = {**best[0].causes[-1].shape, name: float(np.exp(value)) if logarithmic else float(value)}
            tried = explain((*rest, candidate(model, last.effect, last.where, shape, last.term.label)))
            if tried is None:
                return np.inf
            best[0] = max(best[0], tried, key=lambda e: e.score)
            return -tried.score

        middle = best[0].causes[-1].shape.get(name)
        ends = (np.log(low), np.log(high)) if logarithmic else (low, high)
        if middle is not None:
            here, reach = (np.log(middle) if logarithmic else middle), (ends[1] - ends[0]) / SHAPES_TRIED
            ends = (max(ends[0], here - reach), min(ends[1], here + reach))
        minimize_scalar(cost, bounds=ends, method="bounded", options={"maxiter": SHAPE_STEPS})
    return best[0]


def replace_tried(settings, tried):
    return settings.model_copy(update={"tried": min(tried, settings.tried)})


def _theta(extended, names, values, start=None):
    """(parameter,) of an extended model: values known by name, and a start for the rest."""
    known = dict(zip(names, values, strict=True))
    theta = np.array([known.get(name, 0.0) for name in extended.names])
    if start is not None:
        new = [i for i, name in enumerate(extended.names) if name not in known]
        theta[new] = start
    return theta
