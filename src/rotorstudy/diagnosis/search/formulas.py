"""Published formulas of a cause, tried where the laws of its physics do not explain the records.

A crack is often computed with a stiffness that varies with the angle of the shaft alone, although the stress opens it.
Such a formula is close to the physics, and would be named instead of it where it fits by chance. What the physics
leaves of a record made by a formula may also be taken for a second cause.
"""

from rotorstudy.diagnosis.search.candidates import candidate, formulas_of
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation, odds_of
from rotorstudy.diagnosis.search.shapes import refine
from rotorstudy.diagnosis.search.trials import Option, best_of_each_shape, explains_much, fit_closest

STARTS = 3  # shapes in which the laws explain most, each with another law or facing another side


def with_formulas(work: Search, best: Explanation) -> Explanation:
    """The best explanation after the formulas of causes that explain much alone were fitted in place of their laws.

    best    : of the search without them
    returns : the same one if it is a single cause, and noise and the stated model error explain what it leaves
    """
    alone = [e for e in work.explanations if len(e.causes) == 1 and formulas_of(e.causes[0].effect)]
    alone = best_of_each_shape(e for e in alone if explains_much(e.fit.cost, best.fit.cost, work.base.cost))
    if not alone or not (len(best.causes) > 1 or work.is_rejected_as_stated(best)):
        return best
    options = []
    for known in alone[:STARTS]:
        (cause,) = known.causes
        theta = known.fit.values
        place = work.rig, cause.effect, cause.where, cause.shape, cause.term.label, work.settings.prior_width
        options += [Option((candidate(*place, one),), theta) for one in formulas_of(cause.effect)]
    stepped = [refine(work, e, again=False) for e in best_of_each_shape(fit_closest(work, options))]
    return max([best, *stepped], key=odds_of)
