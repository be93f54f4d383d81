"""Next places along the shaft: nodes, and stretches of elements, of which on a fine mesh only some are candidates."""

from contextlib import suppress
from itertools import product

from rotorstudy.diagnosis.search.candidates import Candidate, candidate, place_key
from rotorstudy.errors import CannotAct

REFINED = 6  # stretches from which others are sought: linear columns tell only roughly which is the best


def may_lie_between(work, cause: Candidate) -> bool:
    """Whether a cause is in a stretch of elements and others near it are no candidates."""
    return work.rig.structure.stretch_step > 1 and _is_stretch(work, cause)


def next_places(work, cause: Candidate) -> dict[tuple, Candidate]:
    """{place: the same effect by the same law there}; a stretch may have both ends moved or one."""
    if _is_stretch(work, cause):
        return {tuple(c.where.items()): c for c in _neighbours(work, cause, 1)}
    key = next((key for key in ("element", "node") if key in cause.where), None)
    alike = cause.effect, cause.variant, cause.where | {key: None}
    every = [c for c in work.candidates if key in c.where]
    there = {c.where[key]: c for c in every if (c.effect, c.variant, c.where | {key: None}) == alike}
    own = cause.where.get(key)
    nearest = max((n for n in there if n < own), default=None), min((n for n in there if n > own), default=None)
    return {tuple(there[n].where.items()): there[n] for n in nearest if n is not None}


def between_candidates(work, judge, project, found: list) -> list:
    """Proposals of the best stretches of each effect that are no candidates, found by ever smaller steps.

    project : function of candidates that gives their columns and those that have any, as `Search.project`
    found   : Proposals of candidates, each of one cause beside the same others
    """
    better, largest = [], work.rig.structure.stretch_step // 2
    for effect in sorted(_stretched(work)) if largest else ():
        known = {one.causes[-1].label: one for one in found if one.causes[-1].effect == effect}
        coarse, step = frozenset(known), largest if known else 0
        while step:
            near = [one.causes[-1] for one in _best(known)]
            near = [c for one in near if _is_stretch(work, one) for c in _neighbours(work, one, step)]
            new = {c.label: c for c in near if c.label not in known and work.allows((*judge.rest, c))}
            best = _best(known)[0]
            if new:
                known |= {one.causes[-1].label: one for one in judge.alone(*project([*new.values()]))}
            step = step if _best(known)[0] is not best else step // 2
        better += [one for one in _best(known) if one.causes[-1].label not in coarse]
    return better


def _best(known):
    return sorted(known.values(), key=lambda one: -one.log_odds)[:REFINED]


def _is_stretch(work, cause):
    return "element" in cause.where and cause.effect in _stretched(work)


def _stretched(work):
    """Effects of stretches of elements."""
    return {c.effect for c in work.candidates if "last_element" in c.where}


def _neighbours(work, cause, step):
    """The same effect by the same law with one end or both moved by some elements."""
    first = cause.where["element"]
    last, ways = cause.where.get("last_element", first), product((-step, 0, step), repeat=2)
    every = [_with_ends(work, cause, first + start, last + end) for start, end in ways if start or end]
    return [c for c in every if c]


def _with_ends(work, cause, first, last):
    """The same in other elements, made anew if it is no candidate; None if there is no such place."""
    count = len(work.rig.structure.crack_places())
    if not 1 <= first <= last <= count:
        return None
    rest = {key: value for key, value in cause.where.items() if key not in ("element", "last_element")}
    where = {**rest, "element": first} | ({"last_element": last} if last > first else {})
    there = cause._replace(where=where)
    key = place_key(there)
    if key not in work.at_places:
        work.at_places[key] = None
        if last - first + 1 < count and not cause.shape:  # the whole shaft is a place of its own
            given = work.rig, cause.effect, where, {}, f"cause {there.label}", work.settings.prior_width
            with suppress(CannotAct):
                work.at_places[key] = candidate(*given, cause.variant, cause.freedoms)
    return work.at_places[key]
