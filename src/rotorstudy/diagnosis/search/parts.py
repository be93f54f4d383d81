"""Faults of several parts (the nodes of a bow, the harmonics of a runout): which parts the data support together."""

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.screening import Projected, screen, screen_each
from rotorstudy.model.registry import registry

PLACES_OF_BROUGHT = 2  # at which a cause is tried together with what it brings

# of each fault two parts or more, and the values by name of all parameters from which to start a fit
Starts = list[tuple[tuple[Candidate, ...], dict[str, float]]]


def faults_of_several_parts(work: Search, projected: Projected, chosen: list[Candidate]) -> Starts:
    """The parts of each fault that explain most together, added one by one as long as that increases their odds.

    projected : columns of the candidates;  chosen : those that are allowed
    """
    faults = {}
    for cause in chosen:
        if cause.fault != cause.cause:
            faults.setdefault(cause.fault, []).append(cause)
    return _together(work, projected, faults.values())


def faults_at_several_discs(work: Search, projected: Projected, chosen: list[Candidate]) -> Starts:
    """The discs that an effect of `Settings.at_discs` is at together; see `faults_of_several_parts`."""
    discs = {disc.node for disc in work.rig.structure.discs}
    every = [[c for c in chosen if c.effect == name and c.where["node"] in discs] for name in work.settings.at_discs]
    return _together(work, projected, every)


def faults_with_what_they_bring(work: Search, projected: Projected, chosen: list[Candidate]) -> Starts:
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
    """Of each fault (a list of its parts) those that explain most together, and where to start a fit; best first."""
    found = []
    for parts in (one for one in faults if len(one) > 1):
        together = _supported(work, projected, parts)
        if len(together) > 1:
            screened = screen(projected, *together)
            names = [name for cause in together for name in cause.names]
            start = projected.theta | dict(zip(names, screened.start, strict=True))
            found.append((screened.evidence, together, start))
    return [(together, start) for _, together, start in sorted(found, key=lambda one: -one[0])]


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
