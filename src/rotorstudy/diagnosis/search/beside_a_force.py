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
from rotorstudy.diagnosis.search.one_more import with_one_more
from rotorstudy.diagnosis.search.parts import causes_with_what_they_bring
from rotorstudy.diagnosis.search.screening import Projected, Projection, screen, screen_each

TRIED = 3  # causes beside a force for which another one is sought
OF_A_CAUSE = 2  # of these, the same cause beside forces at different nodes
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
    """Explanations by two causes, the first found beside a free force at the node of the second.

    current : whose motion is that of the records, more or less, though its causes may be wrong
    """
    if len(work.spectrum.sensors) < LEAST_ORBITS or work.settings.most_causes < 2:
        return []
    found = []
    for one in _most_probable(_beside_forces(work, current)):
        held = work.held(one.parts, one.values)
        there = [c for c in work.candidates if c.where.get("node") == one.node and is_allowed(work, (*one.parts, c))]
        found += with_one_more(work, Explanation(one.parts, held, 0.0), values=held, chosen=there)
    return found


def _most_probable(found):
    """The few best ones, each cause beside a force at no more than some nodes."""
    best, taken = [], {}
    for one in sorted(found, key=lambda one: -one.odds):
        name = one.parts[0].cause
        if len(best) < TRIED and (one.node, name) not in taken and taken.get(name, 0) < OF_A_CAUSE:
            best.append(one)
            taken[name], taken[one.node, name] = taken.get(name, 0) + 1, 1
    return best


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
