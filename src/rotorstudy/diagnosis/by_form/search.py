"""The search for causes: from the best explanations so far to others, by one cause more, another one, or one less.

Every explanation is fitted with an error of the form of its causes (`form.py`) and judged by its posterior odds, which
are all that counts. The search keeps the best explanation of each set of effects, so that the many places and shapes of
one do not crowd out another, and tries the moves from the best that it has not yet tried, until none is left that could
change a probability.
"""

import logging
from dataclasses import fields, replace

from rotorstudy.diagnosis.by_form.explanations import FormExplanation, FormSearch
from rotorstudy.diagnosis.by_form.moves import additions, exchanges, removals
from rotorstudy.diagnosis.search.candidates import candidates
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.impossible import grows, is_impossible
from rotorstudy.diagnosis.search.odds import odds_of
from rotorstudy.inference.fit import fit

log = logging.getLogger(__name__)

STRAINED = 3.0  # mean square distance of the base parameters from their priors, beyond which they imitate a cause
REACH = 10.0  # log odds below the best, beyond which an explanation cannot change a probability
WORTH_ADDING = -1.0  # change of the log odds that one more cause must promise
EXPANDED = 8  # explanations from which moves are tried
OF_AN_EFFECT = 2  # proposals of the same effects that are fitted from one explanation
FINISHED = 4  # fits of each round that are taken to the end, and all within `REACH` of the best


def search_by_form(begun: Search) -> FormSearch:
    """A search carried out: explanations of a spectrum by up to `most_causes` faults.

    begun   : as `search.begin` returns it
    returns : FormSearch without explanations that are impossible. A broken plugin raises nothing: see `Search.broken`.
    """
    known = {f.name: getattr(begun, f.name) for f in fields(Search)}
    known["candidates"], failures = candidates(begun.rig, begun.settings, any_form=True)
    nothing = FormExplanation((), begun.base, 0.0)
    known |= {"found": {frozenset(): nothing}, "shapes": {}, "screened": [], "failures": begun.failures | failures}
    known["has_form_errors"] = True
    work = FormSearch(**known)
    work = replace(work, unstable=grows(work.base, work.spectrum.speed))
    work.screened.extend(work.screen(work.base, work.candidates))
    log.info("searching %d candidates", len(work.candidates))
    tried, possible = [], {frozenset()}
    while len(tried) < EXPANDED:
        _drop_impossible(work, possible)
        due = [e for e in _best_of_each_set(work) if _is_due(work, e, tried)]
        if not due:
            break
        current = max(due, key=odds_of)
        tried.append(current.named)
        log.info("trying moves from %s (log odds %.1f)", " and ".join(current.named) or "the rig", odds_of(current))
        _fit_best(work, _moves(work, current))
    _drop_impossible(work, possible)
    best = max(work.explanations, key=odds_of)
    return replace(work, cause_error=best.form.mean_std if best.causes else 0.0)


def _is_due(work, explanation, tried):
    """Whether moves from an explanation may lead to one that matters."""
    if not tried:
        return not explanation.causes
    if odds_of(explanation) < 0 and not work.base.is_rejected(work.settings.significance):
        return False
    near = odds_of(explanation) >= max(map(odds_of, work.explanations)) - REACH
    return bool(explanation.causes) and near and not any(one and one <= explanation.named for one in tried)


def _moves(work, current):
    """The Proposals from an explanation."""
    if not current.causes:
        base = work.base
        is_strained = base.penalty > STRAINED * len(base.names)  # its parameters take over what is missing
        fits = [base, fit(base.model, work.spectrum, work.prior, steps=0)] if is_strained else [base]
        return additions(work, current, fits)
    found = removals(current) + exchanges(work, current)
    if len(work.prior_odds.together(current.causes)) < work.settings.most_causes:
        least = odds_of(current) + WORTH_ADDING
        found += [one for one in additions(work, current, [current.fit]) if one.log_odds > least]
    return found


def _fit_best(work, proposals):
    """Fit the most promising proposals: all by a few steps, the best to the end."""
    chosen, often, seen = [], {}, set()
    best = max(map(odds_of, work.explanations))
    for one in sorted(proposals, key=lambda one: -one.log_odds):
        effects = frozenset(c.effect for c in one.causes)
        label = frozenset((c.cause, *c.variant.values()) for c in one.causes)
        if label in seen or often.get(effects, 0) >= OF_AN_EFFECT or one.log_odds < best - REACH:
            continue
        seen.add(label)
        often[effects] = often.get(effects, 0) + 1
        chosen.append(one)
        if len(chosen) == work.settings.candidates_per_round:
            break
    begun = [work.explain(one.causes, one.values, thoroughly=False) for one in chosen]
    begun = {one.kind: one for one in begun if one is not None}
    for number, one in enumerate(sorted(begun.values(), key=odds_of, reverse=True)):
        if number < FINISHED or odds_of(one) >= max(map(odds_of, work.explanations)) - REACH:
            work.explain(one.causes, one.fit.values)


def _best_of_each_set(work):
    """The best explanation of each set of effects."""
    best = {}
    for e in sorted(work.explanations, key=odds_of, reverse=True):
        best.setdefault(frozenset(c.effect for c in e.causes), e)
    return list(best.values())


def _drop_impossible(work, possible):
    """Drop explanations that cannot be true, until the best ones can.

    possible : kinds that were examined, to which more are added
    """
    while True:
        least = odds_of(work.best) - REACH
        near = {key: e for key, e in work.found.items() if key not in possible and odds_of(e) >= least}
        impossible = [key for key, e in near.items() if is_impossible(replace(work, spectrum=e.spectrum), e)]
        for key in impossible:
            del work.found[key]
        possible |= near.keys() - set(impossible)
        if not impossible:
            return
