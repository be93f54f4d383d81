"""An error of form that is like another law of the library.

What a fault does beyond the form that the library gives it need not be smooth over the speeds, as in `form.py`: what a
worn seat does beyond a gap may look like a softer support there. So a second cause that acts where a first one does,
and changes no more than the form of that may be wrong, has two readings: another fault, or the error of the form of the
first. The odds of the first one alone include the second reading. Only forces that depend on the motion err so.
"""

from dataclasses import replace

import numpy as np

from rotorstudy.diagnosis.search.candidates import SCALES as WIDTHS
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.form import LEAK, SCALES, acted_on, changes_of
from rotorstudy.diagnosis.search.form_fit import WITHIN
from rotorstudy.diagnosis.search.odds import faults_of, odds_of
from rotorstudy.errors import NoSteadyState

# prior odds of such an error of form against a smooth one, whichever law it is like: of a hundred faults of another
# form by the independent simulator about seven err so
BY_LAW = 0.1


def with_other_laws(found: Search) -> Search:
    """The Search with the odds of each fault alone including an error of its form that is like another law."""
    every, weighed = found.explanations, {}
    least = max(map(odds_of, every)) - WITHIN
    pairs = sorted((e for e in every if len(e.faults) == 2 and odds_of(e) > least), key=odds_of)
    for one in (e for e in every if len(e.faults) == 1):
        like = [(odds_of(pair) + _relative_odds(found, pair, one), pair) for pair in pairs if _is_in(one, pair)]
        odds = [odds_of(one), *(log_odds for log_odds, _ in like)]
        most = like[int(np.argmax(odds[1:]))][1].named - one.named if like and max(odds) > odds[0] else frozenset()
        weighed[one.kind] = replace(one, log_posterior_odds=float(np.logaddexp.reduce(odds)), like=most)
    return replace(found, found=found.found | weighed)


def _is_in(one, pair):
    """Whether an explanation by one fault is a part of one by two; what another fault brings is no fault of its own."""
    return one.named < pair.named and one.faults < pair.faults


def _relative_odds(found, pair, one):
    """Log odds that one fault of a pair has an error of form like the law of the other, against both; -inf if none."""
    faults, (own,) = faults_of(pair.causes), one.faults
    parts, (others,) = faults.pop(own), faults.values()
    place = acted_on(parts)
    is_there = _acts_at(others, place) or _are_neighbours(parts[0], others[0])
    if not is_there or any(c.term.acts_on_output for c in pair.causes):
        return -np.inf
    forces, fitted, usual = found.local_forces, pair.fit, found.settings.form_error
    try:
        motion = forces.motion(fitted.model, fitted.theta)
    except NoSteadyState:
        return -np.inf
    changes, others = (changes_of(some, fitted.values, motion, forces, usual) for some in (parts, others))
    inexact, by_other = [change for change in changes if change.of_motion], sum(change.change for change in others)
    if not inexact or not np.any(by_other) or not np.any(found.spectrum.whitened(by_other)):
        return -np.inf
    size = _relative_size(found.spectrum, sum(change.change for change in inexact), by_other)
    laws = {c.effect for c in found.candidates if not c.term.acts_on_output and _acts_at([c], place)}
    std = usual * max(change.inexactness for change in inexact) * SCALES[1:]
    of_form = np.mean(np.exp(-0.5 * (size / std) ** 2) * np.sqrt(2 / np.pi) / std)  # density of the size
    of_fault = 1 / (size * np.log(WIDTHS[0] / WIDTHS[-1]))  # any size is equally likely, by order of magnitude
    prior = found.prior_odds.log_odds(one.causes) - found.prior_odds.log_odds(pair.causes) + np.log(BY_LAW / len(laws))
    with np.errstate(divide="ignore"):
        return float(prior + np.log(of_form / of_fault))


def _acts_at(parts, place):
    """Whether the parts of a fault act on some coordinates of a place, and on no others."""
    return bool(acted_on(parts)) and acted_on(parts) <= place


def _are_neighbours(cause, other):
    """Whether two causes are one effect at nodes beside each other: what acts over a length shows at both."""
    nodes = [one.where.get("node", np.inf) for one in (cause, other)]
    return cause.effect == other.effect and abs(nodes[0] - nodes[1]) == 1


def _relative_size(spectrum, change, other):
    """Rms of another change over a change (speed, harmonic, sensor) with its `LEAK`, where the other one shows."""
    own, squares = (np.sum(np.abs(x) ** 2, axis=(0, 2)) for x in (change, other))
    each = np.eye(len(own))[:, None, :, None] * other  # harmonic, ...
    shown = np.sum(spectrum.whitened(each) ** 2, axis=-1)
    return float(np.sqrt(np.average(squares / (own + LEAK**2 * own.sum()), weights=shown)))
