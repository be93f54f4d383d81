"""One cause instead of several, where one force explains the records.

That speaks for one fault. So every cause that acts at the place of the force is tried in every shape, at the motion
that was found. If one of the several causes acts there, the others may be no more than the error of its form: if it
leaves no more than noise with as much error as published formulas differ by, it is the only one.
"""

from dataclasses import replace

from rotorstudy.diagnosis.search.alternatives import one_instead_of_all
from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation, faults_of
from rotorstudy.diagnosis.search.search import drop_impossible, settled_with_least_error
from rotorstudy.diagnosis.search.shapes import refine_in_turn
from rotorstudy.diagnosis.search.trials import best_of_each_shape
from rotorstudy.diagnosis.verdict.form_error import FORM_ERROR, have_a_law
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import predicted, with_cause_error
from rotorstudy.model.structure import Structure

COMPARED = 4  # other single causes


def with_one_fault(work: Search, nodes: list[int]) -> Search:
    """The search with one cause instead of several, if there is one; otherwise as it is.

    work  : whose best explanation has several causes
    nodes : at which one force explains the records as well
    """
    best = work.best
    for node in nodes:
        one_instead_of_all(work, best, node)
    drop_impossible(work)
    if len(work.best.faults) == 1:
        return work
    for parts in faults_of(best.causes).values():
        if have_a_law(parts) and any(act_at(parts, node, work.rig.structure) for node in nodes):
            found = _alone(work, best, tuple(parts))
            if found:
                return found
    return work


def act_at(causes: list[Candidate], node: int, structure: Structure) -> bool:
    """Whether all causes act at a node, or on an element that ends there."""
    return all(_acts_at(cause, node, structure.node_positions) for cause in causes)


def _acts_at(cause, node, positions):
    if "position_m" in cause.shape:
        beside = sorted(positions, key=lambda other: abs(positions[other] - cause.shape["position_m"]))[:2]
        return node in beside
    if "element" in cause.where:
        return cause.where["element"] <= node <= cause.where.get("last_element", cause.where["element"]) + 1
    return cause.where.get("node") == node


def _alone(work, best, parts):
    """The search by single faults, with as much error of their form as they need; None if one of them needs too much.

    best : Explanation by that one, of these parts, and others
    """
    stated = work.stated
    missing = stated.amplitude - predicted(work.base.model, stated, work.base.theta)
    widened = with_cause_error(stated, missing, FORM_ERROR)
    base = fit(work.model, widened, work.prior, start=work.base.theta)
    wide = replace(work, spectrum=widened, base=base, found={}, equations={}, cause_error=FORM_ERROR)
    wide.found[frozenset()] = Explanation((), base, 0.0)
    one = wide.explain(parts, [wide.start(parts, best.fit.values)])
    if one is None or refine_in_turn(wide, one, again=False).fit.excess:
        return None
    for e in best_of_each_shape(e for e in work.explanations if len(e.faults) == 1)[:COMPARED]:
        wide.explain(e.causes, [e.fit.theta])
    found = settled_with_least_error(wide, stated, missing, wide.best)
    drop_impossible(found)
    return found
