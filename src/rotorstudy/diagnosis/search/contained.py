"""Which causes may be named together: the force of none may be a special case of that of another."""

from itertools import permutations

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate

ROUND_OFF = 1e-9  # of the largest coefficient


def is_allowed(work, causes):
    """Whether causes are no more faults than allowed, each named once and none a special case of another."""
    several = len(work.prior_odds.together(causes)) > work.settings.most_causes
    if several or len({c.cause for c in causes}) < len(causes):
        return False
    return not any(is_contained(one, other) for one, other in permutations(causes, 2))


def is_contained(cause: Candidate, other: Candidate) -> bool:
    """Whether some amplitudes of another cause at the same place give the force of a cause, whatever the motion.

    A stiffness lost along one direction is among the four stiffnesses of a bearing, a constant force among those of a
    coupling. The two cannot be told apart, and where both are named, one only takes a share of the other.

    returns : False for forces in time, and for gains that depend on the speed, which are not compared
    """
    if cause.where != other.where or cause.effect == other.effect:
        return False
    own, known = ([_coefficients(unknown) for unknown in c.term.unknowns] for c in (cause, other))
    places = list(dict.fromkeys(place for one in known if one for place in one))
    if not all(own) or not all(place in places for one in own for place in one):
        return False
    own, known = (np.array([[one.get(p, 0.0) for p in places] for one in part if one]).T for part in (own, known))
    own, known = (np.concatenate([part.real, part.imag]) for part in (own, known))  # amplitudes are real
    size = np.abs(known).max(axis=0)
    left = own - known / size @ np.linalg.lstsq(known / size, own, rcond=None)[0]
    return bool(np.abs(left).max() <= ROUND_OFF * np.abs(own).max())


def _coefficients(unknown):
    """{(kind of entry, row, column): value} of an unknown; empty if it cannot be compared."""
    if unknown.force or unknown.exact or any(entry.gain is not None for entry in unknown.entries):
        return {}
    found = {}
    for entry in unknown.entries:
        for row, column, value in zip(*(part.tolist() for part in entry.nonzero), strict=True):
            place = (entry.kind, row, column)
            found[place] = found.get(place, 0.0) + value
    return found
