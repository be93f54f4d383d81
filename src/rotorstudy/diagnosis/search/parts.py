"""Faults of several parts (the nodes of a bow, the harmonics of a runout): which parts the data support together."""

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.screening import Projected, Screened, screen, screen_each
from rotorstudy.model.registry import registry

PLACES_OF_BROUGHT = 2  # at which a cause is tried together with what it brings

# of each fault two parts or more, judged together
Together = list[tuple[tuple[Candidate, ...], Screened]]


def faults_of_several_parts(work: Search, projected: Projected, chosen: list[Candidate]) -> Together:
    """The parts of each fault that explain most together, added one by one as long as that increases their odds.

    projected : columns of the candidates;  chosen : those that are allowed
    """
    faults = {}
    for cause in chosen:
        if cause.fault != cause.cause:
            faults.setdefault(cause.fault, []).append(cause)
    return _together(work, projected, faults.values())


def faults_at_several_discs(work: Search, projected: Projected, chosen: list[Candidate]) -> Together:
    """The discs that an effect of `Settings.at_discs` is at together; see `faults_of_several_parts`."""
    discs = {disc.node for disc in work.rig.structure.discs}
    every = [[c for c in chosen if c.effect == name and c.where["node"] in discs] for name in work.settings.at_discs]
    return _together(work, projected, every)


def faults_with_what_they_bring(work: Search, projected: Projected, chosen: list[Candidate]) -> Together:
    """Causes with the effects that they bring (an added mass with its unbalance), at the places that explain most.

    Beside a second fault neither part alone may explain enough to be found. See `faults_of_several_parts`.
    """
    effects, known = registry().plugins["effect"], {(c.effect, *c.where.items()): c for c in chosen}
    faults = []
    for cause in chosen:
        brought = [known.get((name, *cause.where.items())) for name in effects[cause.effect].brings]
        faults += [[cause, *brought]] if all(brought) else []
    return _together(work, projected, faults)[:PLACES_OF_BROUGHT]


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
