"""Faults of several parts (the nodes of a bow, the harmonics of a runout): which parts the data support together."""

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.screening import Projected, Screened, screen, screen_each
from rotorstudy.model.registry import registry

PLACES_OF_BROUGHT = 2  # at which a cause is tried together with what it brings


def faults_of_several_parts(
    work: Search, projected: Projected, chosen: list[Candidate]
) -> list[tuple[tuple[Candidate, ...], Screened]]:
    """The parts of each fault that explain most together, two or more, added one by one as long as their odds rise.

    They are the numbered parts of an effect, the discs that one of `Settings.at_discs` is at, or a cause with what it
    brings (an added mass with its unbalance), at the places that explain most: beside a second fault neither alone may
    explain enough to be found.

    projected : columns of the candidates;  chosen : those that are allowed
    """
    discs, effects, numbered = {disc.node for disc in work.rig.structure.discs}, registry().plugins["effect"], {}
    known, with_brought = {(c.effect, *c.where.items()): c for c in chosen}, []
    for cause in chosen:
        if cause.fault != cause.cause:
            numbered.setdefault(cause.fault, []).append(cause)
        brought = [known.get((name, *cause.where.items())) for name in effects[cause.effect].brings]
        with_brought += [[cause, *brought]] if all(brought) else []
    at_discs = [[c for c in chosen if c.effect == name and c.where["node"] in discs] for name in work.settings.at_discs]
    found = _together(work, projected, [*numbered.values(), *at_discs])
    return found + _together(work, projected, with_brought)[:PLACES_OF_BROUGHT]


def _together(work, projected, faults):
    """Of each fault (a list of its parts) those that explain most together, with their Screened; best first."""
    found = [_supported(work, projected, parts) for parts in faults if len(parts) > 1]
    found = [(parts, screen(projected, *parts)) for parts in found if len(parts) > 1]
    return sorted(found, key=lambda one: -one[1].evidence)


def _supported(work: Search, projected: Projected, parts: list[Candidate]) -> tuple[Candidate, ...]:
    """The parts of a fault with the highest odds, as found by adding one at a time."""
    together, reached = (), float("-inf")
    while parts:
        found = screen_each(projected, parts, together, reached)
        odds = [one.evidence + work.prior_odds.log_odds((*together, c)) for one, c in zip(found, parts, strict=True)]
        best = int(np.argmax(odds))
        if odds[best] <= reached:
            break
        together, reached = (*together, parts[best]), odds[best]
        parts = [cause for cause in parts if cause.cause != parts[best].cause]  # each in one shape
    return together
