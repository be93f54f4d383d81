"""A crack together with any other cause: shapes and partners judged at once, at the motion of an explanation.

Where a second cause is missing, neither a crack nor the other one explains much alone, and both are passed over for
causes of many amplitudes that imitate them together. Their motion is close to the true one all the same. So many shapes
of a crack along the shaft are paired with every cause without a shape, by their columns at that motion.
"""

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.contained import is_allowed
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation
from rotorstudy.diagnosis.search.screening import Projection, screen, screen_pairs
from rotorstudy.diagnosis.search.shape_fit import ranges_of, reshaped
from rotorstudy.diagnosis.search.shape_scan import is_sought_everywhere
from rotorstudy.diagnosis.search.trials import Option, fit_closest, law_and_side
from rotorstudy.errors import CannotAct

SHAPES = 256  # of each opening law
PAIRS = 6  # that are fitted
PAIRS_OF_A_CAUSE = 2  # of these, with the same other cause


def with_a_crack(work: Search, current: Explanation) -> list[Explanation]:
    """Explanations by a crack and one other cause, the pairs that explain most at the motion of an explanation.

    Parameters
    ----------
    work : Search
    current : Explanation

    Returns
    -------
    list of Explanation
    """
    laws = {tuple(c.variant.values()): c for c in work.candidates if is_sought_everywhere(c)}
    cracks = [shape for law in laws.values() for shape in _over_its_ranges(work, law)]
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


def _over_its_ranges(work, crack):
    """A crack in many shapes over the ranges of its options, without those in which it cannot act."""
    from scipy.stats import qmc

    found = []
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
