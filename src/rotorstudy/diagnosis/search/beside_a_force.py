"""One cause sought beside a free force at a node, which does whatever another fault there does; then that fault.

Where two causes are needed, each is judged wrongly as long as the other is missing, and two others that imitate both
are found. A force at a node that is free at every measured harmonic and speed takes the part of a fault there, of any
law and shape. Beside it the other cause shows alone: every candidate, an added mass with its unbalance, and cracks in
many shapes. The best few are kept at the values found, with the rig as stated, since wrong causes have strained it, and
what acts at the node of the force is sought beside them.
"""

from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.contained import is_allowed
from rotorstudy.diagnosis.search.crack_beside import cracks_over_their_ranges
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.free_forces import free_force_columns
from rotorstudy.diagnosis.search.odds import Explanation
from rotorstudy.diagnosis.search.parts import causes_with_what_they_bring
from rotorstudy.diagnosis.search.screening import Projected, Projection, screen, screen_each
from rotorstudy.diagnosis.search.shape_scan import can_be_scanned, is_sought_everywhere, scan
from rotorstudy.diagnosis.search.shapes import refine_in_turn
from rotorstudy.diagnosis.search.trials import Option, best_of_each_shape, fit_closest

TRIED = 2  # causes beside a force for which another one is sought
AT_THE_NODE = 4  # causes at the node of the force that are fitted with each of these
REFINED = 3  # of these fits whose shapes are refined
LEAST_ORBITS = 2  # of a single one a free force leaves nothing


class _Beside(NamedTuple):
    """A cause (its parts) beside a free force at a node.

    odds   : logarithm, up to a constant that all causes beside one force at a node share
    values : of its amplitudes, by name
    """

    odds: float
    node: int
    parts: tuple[Candidate, ...]
    values: dict[str, float]


def with_causes_beside_a_force(work: Search, current: Explanation) -> list[Explanation]:
    """Explanations by two causes in their best shapes, the first found beside a free force at the node of the second.

    current : whose motion is that of the records, more or less, though its causes may be wrong
    """
    if len(work.spectrum.sensors) < LEAST_ORBITS or work.settings.most_causes < 2:
        return []
    options = [two for one in _most_probable(_beside_forces(work, current)) for two in _at_the_node(work, one)]
    found = best_of_each_shape(fit_closest(work, options))[:REFINED]
    return [refine_in_turn(work, e, again=False) for e in found]


def _at_the_node(work, beside):
    """Options of a cause with the best few others at the node of the force, each in the best shape of a scan."""
    held = work.held(beside.parts, beside.values)
    if not held:
        return []
    there = [c for c in work.candidates if c.where.get("node") == beside.node]
    there = [c for c in there if is_allowed(work, (*beside.parts, c))]
    scanned = scan(work, held, list({c.cause: c for c in reversed(there)}.values()))
    others = [c for c in there if not can_be_scanned(c)]
    judged = [((c,), one) for c, one in [*scanned, *zip(others, work.screen(held, others), strict=True)]]
    projected, _ = work.project(held, others)
    judged += [(parts, screen(projected, *parts)) for parts in causes_with_what_they_bring(others)]
    judged.sort(key=lambda one: -one[1].evidence - work.prior_odds.log_odds(one[0]))
    best = {}
    for parts, screened in judged:
        names = [name for c in parts for name in c.names]
        start = beside.values | dict(zip(names, screened.start, strict=True))
        best.setdefault(frozenset(c.cause for c in parts), Option((*beside.parts, *parts), start))
    return list(best.values())[:AT_THE_NODE]


def _most_probable(found):
    """The best one of each of the few most probable effects, and the best crack.

    An effect of many amplitudes is as good at many places. A crack is judged too low, as none of its shapes is the true
    one.
    """
    best = {}
    for one in sorted(found, key=lambda one: -one.odds):
        best.setdefault(one.parts[0].effect, one)
    few, others = list(best.values())[:TRIED], list(best.values())[TRIED:]
    return few + [one for one in others if is_sought_everywhere(one.parts[0])][:1]


def _beside_forces(work, current):
    """Every _Beside of the nodes of the rotor, judged at the motion of an explanation without its causes."""
    projection = Projection(current.fit, work.spectrum, tuple(n for c in current.causes for n in c.names))
    alone = [*work.candidates, *cracks_over_their_ranges(work)]
    together = causes_with_what_they_bring(work.candidates)
    projected = projection.of(alone)
    nodes = dict.fromkeys(node for node, motion in work.rig.structure.dofs if motion == "translation")
    rows = [work.rig.structure.unit(node) for node in nodes]
    found = []
    for node, taken in zip(nodes, free_force_columns(projection.near, work.spectrum, rows), strict=True):
        beside = _without(projected, projection.left(_of_all_speeds(taken)))
        base = -0.5 * float(beside.residual @ beside.residual)
        judged = [*zip(screen_each(beside, alone), ((c,) for c in alone), strict=True)]
        judged += [(screen(beside, *parts), parts) for parts in together]
        for screened, parts in judged:
            names = [name for c in parts for name in c.names]
            values = dict(zip(names, screened.start, strict=True))
            odds = base + screened.evidence + work.prior_odds.log_odds(parts)
            found.append(_Beside(odds, node, parts, values))
    return found


def _of_all_speeds(columns):
    """The columns (component, force) in all data of a force (speed, component, force) at each speed."""
    speeds, components, forces = columns.shape
    found = np.zeros((speeds, components, speeds, forces))
    found[range(speeds), :, range(speeds)] = columns
    return found.reshape(speeds * components, speeds * forces)


def _without(projected: Projected, taken: np.ndarray) -> Projected:
    """What columns (component, taken) leave of others and of the residual."""
    size = np.linalg.norm(taken, axis=0)
    basis, _ = np.linalg.qr(taken[:, size > 0] / size[size > 0])
    columns = np.column_stack([projected.residual, *projected.columns.values()])
    residual, *columns = (columns - basis @ (basis.T @ columns)).T
    return Projected(residual, dict(zip(projected.columns, columns, strict=True)), projected.theta)
