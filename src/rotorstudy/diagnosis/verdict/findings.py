"""Findings of a diagnosis: what is odd about the records, the rig or the search, and what to do about it."""

import numpy as np

from rotorstudy.diagnosis.verdict.cause_words import place
from rotorstudy.inference.fit import residual_share
from rotorstudy.inference.prediction import misfit
from rotorstudy.measurement.findings import Finding
from rotorstudy.units import percent, quantity, spins

CONTRADICTED = 5.0  # stated standard deviations, by which a parameter that moves further contradicts the rig
MOST = 0.1  # of the excess error (rms), which the rig with other values may leave
UNUSUAL = 0.1  # error of form (rms), of what the causes change
CERTAIN = 3.0  # standard deviations of the fitted value, by which it differs from the stated one
OTHER = 1.0  # of the stated size, by which it differs


def far_from_the_rig(found, moved, labels):
    """A warning if the records look like those of a rig with other values: another machine, other units, other speeds.

    They do if the best explanation needs unusual values of the rig, sizes of causes, errors of form or several faults
    at once, and the rig without causes, but with other values, explains most of the excess error. A fault that no
    values explain casts no doubt on the records.

    found  : Search;  labels : {name: readable name} of the parameters
    moved  : list of MovedParameter of the best explanation, or of the rig without causes if none is accepted
    """
    best, settings = found.best, found.settings
    theta = best.fit.values
    said = [
        f"{labels[row.name]} moved by {abs(row.moved_sigma):.0f} stated standard deviations"
        for row in moved
        if abs(row.moved_sigma) > CONTRADICTED
    ]
    said += [
        f"{labels[unknown.name]} would be {quantity(theta[unknown.name], unknown.unit)}"
        for cause in best.causes
        for unknown in cause.term.unknowns
        if not cause.fixed and abs(theta[unknown.name]) > settings.prior_width * unknown.typical
    ]
    if found.form_error > UNUSUAL:
        said.append(f"the model-form error of the best explanation would be {percent(found.form_error)} (rms)")
    if len(best.faults) > 1:
        said.append(f"{len(best.faults)} faults would have to act at once")
    base = found.base
    before, after = (misfit(base.model, found.spectrum, one) for one in (base.stated_theta, base.theta))
    left = residual_share(before, after, len(base.residual))
    if not said or left > MOST:
        return []
    text = (
        f"{'; '.join(said)}. The rig without causes but with other values leaves {percent(left)} of the excess error "
        "(rms). Are these records of this rig, at these speeds, in these units, with this phase mark? If so, check the "
        "sizes of the causes before relying on them, and the values and the 'uncertainty' in the rig file"
    )
    return [Finding("warning", "far from the rig", "records and rig", text)]


def within_uncertainty(found):
    """A note if nothing is missing because a vector of the rig, such as an unbalance, took over what changed.

    Its uncertainty allows that, but a fault of the same kind at the same place would look alike.

    found : Search whose best explanation has no cause
    """
    fitted, prior, said = found.base, found.prior, []
    vectors = [(term.full_name(p), p) for term in found.rig.terms for p in term.parameters if p.is_complex]
    for name, p in vectors if found.rig.before is None else ():
        parts = [f"{name}_real", f"{name}_imag"]
        if not set(parts) <= set(prior.names):
            continue
        at, where = ([names.index(part) for part in parts] for names in (prior.names, fitted.names))
        stated, value = complex(*prior.mean[at]), complex(*fitted.free[where])
        std = float(np.sqrt(np.trace(fitted.covariance[np.ix_(where, where)]) / 2))
        off = abs(value - stated)
        if stated and off > max(OTHER * abs(stated), CERTAIN * std):
            called, (unit, factor) = next(iter(p.also.items()), (p.name, (p.unit, 1.0)))
            both = [f"{quantity(abs(v) / factor, unit)} at {quantity(np.angle(v), 'rad')}" for v in (value, stated)]
            said.append(f"{name.replace(p.name, called)} is {' instead of '.join(both)}")
    if not said:
        return []
    text = (
        f"{'; '.join(said)}, within the uncertainty that the rig states. A fault of that kind and place would look the "
        "same: state a smaller uncertainty of a value that is known, or compare with records of the sound machine "
        "('rotorstudy compare')"
    )
    return [Finding("note", "explained by the rig", "records and rig", text)]


def form_like_another(best):
    """A note if what the best Explanation leaves looks like another cause where it acts."""
    text = (
        f"what it leaves looks like {' and '.join(sorted(best.like))}, but is no larger than the form of such a fault "
        "is uncertain: it may be a model-form error, or a second, smaller fault at the same place. Repair the first, "
        "and measure again"
    )
    return [Finding("note", "model-form error", " and ".join(sorted(best.named)), text)] if best.like else []


def wrong_convention(chain):
    """The warning that a convention seems to be stated wrongly; chain : ChainHypothesis."""
    beside = f" with {place(chain.beside)}" if chain.beside else ""
    text = (
        f"the records look as if {chain.hypothesis}: corrected for that, the rig{beside} explains all but "
        f"{percent(chain.residual_share)} of the excess error (rms), better than any cause (log odds "
        f"{chain.log_odds:.3g}, best causes {chain.log_odds_of_best_causes:.3g}). No cause is named: {chain.remedy}, "
        "then diagnose again"
    )
    return [Finding("warning", "measuring chain", "records and rig", text)]


def stopped_early(found):
    """A note if a Search was stopped before its end."""
    text = (
        f"the search was stopped after {len(found.found) - 1} explanations had been fitted; what is stated is the best "
        "of these, and may be wrong. Diagnose again for a verdict"
    )
    return [Finding("note", "search stopped", "diagnosis", text)] if found.stopped else []


def others_held_out(held):
    """A note if speeds, a Spectrum, are fitted after all, as they show what the others do not."""
    if held is None:
        return []
    text = f"what explains the other speeds does not explain {spins(held.speed)}: these are now fitted, others held out"
    return [Finding("note", "held-out speeds", "diagnosis", text)]
