"""A crack together with any other cause: shapes and partners judged at once, at the motion of an explanation.

Where a second cause is missing, neither a crack nor the other one explains much alone, and both are passed over for
causes of many amplitudes that imitate them together. Their motion is close to the true one all the same. So many shapes
of a crack along the shaft are paired with every cause without a shape, by their columns at that motion.

Where the crack is found with a wrong cause beside it, that has made its shape wrong too. Other causes are then compared
while the shape may change, to first order, and refined with it.
"""

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.contained import is_allowed
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation
from rotorstudy.diagnosis.search.screening import Projection, screen, screen_each, screen_pairs
from rotorstudy.diagnosis.search.shape_equations import shape_columns
from rotorstudy.diagnosis.search.shape_fit import ranges_of, reshaped
from rotorstudy.diagnosis.search.shape_scan import is_sought_everywhere
from rotorstudy.diagnosis.search.shapes import refine_in_turn
from rotorstudy.diagnosis.search.trials import Option, fit_closest, law_and_side
from rotorstudy.errors import CannotAct, NoSteadyState

SHAPES = 256  # of each opening law
PAIRS = 6  # that are fitted
PAIRS_OF_A_CAUSE = 2  # of these, with the same other cause
EXCHANGED = 3  # causes beside a crack that are fitted instead of another one


def with_a_crack(work: Search, current: Explanation) -> list[Explanation]:
    """Explanations by a crack and one other cause, the pairs that explain most at the motion of an explanation."""
    cracks = cracks_over_their_ranges(work)
    others = [c for c in work.candidates if not c.shape and not c.fixed]
    if not cracks or not others or not is_allowed(work, (cracks[0], others[0])):
        return []
    projection = Projection(current.fit, work.spectrum, tuple(n for c in current.causes for n in c.names))
    projected = projection.of([*cracks, *others])
    gain = 0.5 * screen_pairs(projected, cracks, others)
    gain += np.array([np.log(work.prior_odds.of(c)) for c in others])
    options, taken = [], {}
    for place in np.argsort(-gain, axis=None):
        i, j = np.unravel_index(place, gain.shape)
        side, partner = (others[j].cause, law_and_side(cracks[i])), others[j].cause
        if side in taken or taken.get(partner, 0) == PAIRS_OF_A_CAUSE:
            continue
        taken[side], taken[partner] = 1, taken.get(partner, 0) + 1
        options.append(_option(projected, others[j], cracks[i]))
        if len(options) == PAIRS:
            break
    return fit_closest(work, options)


def with_others_beside_a_crack(work: Search, current: Explanation) -> list[Explanation]:
    """Explanations by the crack of one, in another shape, with other causes instead of the one beside it.

    returns : none for an explanation without a crack or without a second cause
    """
    cracks = tuple(c for c in current.causes if is_sought_everywhere(c))
    beside = tuple(c for c in current.causes if c not in cracks)
    if len(cracks) != 1 or not beside:
        return []
    try:
        _, free = shape_columns(work, current.causes, current.fit, cracks[0])
    except NoSteadyState:  # of a shape next to it
        return []
    chosen = [c for c in work.candidates if is_allowed(work, (*cracks, c)) and c.cause not in current.named]
    names = tuple(n for c in beside for n in c.names)
    projected, usable = work.project(current.fit, chosen, names, free)
    ranked = sorted(
        zip(screen_each(projected, usable), usable, strict=True),
        key=lambda one: -one[0].evidence - work.prior_odds.log_odds((*cracks, one[1])),
    )
    best, found = {}, []
    for screened, cause in ranked:
        best.setdefault(cause.cause, (screened, cause))
    for screened, cause in list(best.values())[:EXCHANGED]:
        causes = (*cracks, cause)
        start = projected.theta | dict(zip(cause.names, screened.start, strict=True))
        fitted = work.explain(causes, [work.start(causes, start)])
        found += [refine_in_turn(work, fitted, again=False)] if fitted else []
    return found


def cracks_over_their_ranges(work: Search) -> list[Candidate]:
    """Cracks of every opening law in many shapes."""
    laws = {tuple(c.variant.values()): c for c in work.candidates if is_sought_everywhere(c)}
    return [shape for law in laws.values() for shape in _over_its_ranges(work, law)]


def _over_its_ranges(work, crack):
    """A crack in many shapes over the ranges of its options, without those in which it cannot act; formed once."""
    from scipy.stats import qmc

    name = "over its ranges", crack.cause, *crack.variant.items()
    if name in work.shapes:
        return work.shapes[name]
    found = work.shapes[name] = []
    for number, point in enumerate(qmc.Sobol(len(ranges_of(work, crack)), scramble=False).random(SHAPES)):
        try:
            found.append(reshaped(work, crack, point, f"{crack.term.label} {number}"))
        except CannotAct:  # in a hollow part of the shaft
            continue
    return found


def _option(projected, other: Candidate, crack: Candidate) -> Option:
    """A pair to be fitted, the crack last, whose shape is then refined."""
    both = (other, crack)
    start = screen(projected, *both).start
    return Option(both, projected.theta | dict(zip([n for c in both for n in c.names], start, strict=True)))
