"""Findings of a diagnosis: what is odd about the records, the rig or the search, and what to do about it."""

from functools import partial

import numpy as np

from rotorstudy.diagnosis.search.impossible import unstable_rig
from rotorstudy.diagnosis.verdict.cause_words import place
from rotorstudy.diagnosis.verdict.evidence import moved_parameters
from rotorstudy.diagnosis.verdict.wide_ranges import wide_ranges
from rotorstudy.inference.fit import residual_share
from rotorstudy.inference.prediction import misfit
from rotorstudy.measurement import findings
from rotorstudy.units import percent, quantity, spins

# severity: name (which of its kind): words, also of findings on two states or several runs
TABLE = """
warning: far from the rig: {said}. The rig without causes but with other values leaves {left} of the excess error (rms).
    Are these records of this rig, at these speeds, in these units, with this phase mark? If so, check the sizes of the
    causes before relying on them, and the values and the 'uncertainty' in the rig file
note: explained by the rig: {said}, within the uncertainty that the rig states. A fault of that kind and place would
    look the same: state a smaller uncertainty of a value that is known, or compare with records of the sound machine
    ('rotorstudy compare')
note: model-form error: what it leaves looks like {others}, but is no larger than the form of such a fault is uncertain:
    it may be a model-form error, or a second, smaller fault at the same place. Repair the first, and measure again
warning: form of the cause: {odd}: {cause} {has} another form than those of the library, and {size}
warning: measuring chain: the records look as if {chain.hypothesis}: corrected for that, the rig{beside} explains all
    but {left} of the excess error (rms), better than any cause (log odds {chain.log_odds:.3g}, best causes
    {chain.log_odds_of_best_causes:.3g}). No cause is named: {chain.remedy}, then diagnose again
note: free parts of the rig: {said}
note: held-out speeds: what explains the other speeds does not explain {speeds}: these are now fitted, others held out
note: search stopped: the search was stopped after {count} explanations had been fitted; what is stated is the best of
    these, and may be wrong. Diagnose again for a verdict
note: limits stopped: stopped before every feared fault had its limit: those without one may hide. Diagnose again for
    all
warning: probe of one state: node {nodes} has two probes in one state and one in the other: only the motion along the
    probe that works in both is compared
warning: speeds of one state: {speeds} were measured in one state only and are not compared; {count} others are
warning: state before not explained: the rig explains the state before only with an error of {share} of each harmonic;
    what changed is predicted with that error too, and named less certainly. {remedy} (rotorstudy identify)
warning: phase mark moved: harmonic n of the later state is that of the earlier one turned by n times {angle}, with the
    runout, and nothing else changed: the phase mark or its sensor was moved, its other edge was taken, or all that is
    unbalanced was turned on the shaft. The later state is turned back; correct 'mark_angle_deg' for it
warning: phase mark moved (and the rotor): harmonic n of the later state is turned by n times {angle}, with the runout,
    beside a change of the rotor: the phase mark or its sensor was moved, or its other edge was taken. The later state
    is turned back, and what else changed follows from that; correct 'mark_angle_deg' for it
warning: known mass contradicted: {said}: correct it, or give it a (larger) 'std_g_mm:'
warning: another machine: the other runs agree with one machine, and not with this one: it is of another machine, or
    something else was changed; leave it out, or state what was under 'effects:' or 'own:'
warning: another machine (one of several): without one of these runs the others agree with one machine; the records do
    not tell which of them is of another machine, or in which something else was changed; leave it out, or state what
    was under 'effects:' or 'own:'
warning: not explained: misfit {misfit} per component of the spectrum ({p}): the runs and what is said of them do not
    agree with one machine, and the stated intervals are not valid; check the masses, angles and records of the runs, or
    state what else may differ under 'own:'
warning: far from the rig (not explained): the fit moves {moved} times the stated standard deviation: these values only
    imitate what the rig lacks. List the residual unbalance and the runout as effects with realistic uncertainties,
    correct the numbers of the rig, or state a larger 'diagnosis: model_error:'
warning: far from the rig (explained): the runs are explained only with values far from the stated ones ({p}): {moved}
    times the stated standard deviation. They may imitate what the rig lacks; state how well more of its numbers are
    known, such as those of its bearings and pedestals
warning: larger model error: all runs agree with a model error of {share} of each harmonic instead of {stated}; the
    values and intervals are those with it. An error that is alike at many speeds may still exceed them
warning: unstated unbalance or bow: all runs agree with an unbalance at other nodes or a bow, alike in all of them, that
    the rig does not state; the values and intervals are those with it. List it under 'effects:' to have it estimated
"""
told = partial(findings.told, table=findings.words_of(TABLE))
CONTRADICTED = 5.0  # stated standard deviations, by which a parameter that moves further contradicts the rig
MOST = 0.1  # of the excess error (rms), which the rig with other values may leave
UNUSUAL = 0.1  # error of form (rms), of what the causes change
CERTAIN = 3.0  # standard deviations of the fitted value, by which it differs from the stated one
OTHER = 1.0  # of the stated size, by which it differs


def findings_of(one, kind, labels):
    """Each Finding on a Sought with a verdict of some kind; labels : {name: readable name} of the parameters."""
    found, chain, best = one.judged, one.chain, one.judged.best
    if chain:
        beside = f" with {place(chain.beside)}" if chain.beside else ""
        left = percent(chain.residual_share)
        yield told("measuring chain", "records and rig", chain=chain, beside=beside, left=left)
    elif kind == "nothing":
        yield from _within_uncertainty(found)
    else:
        yield from _far_from_the_rig(found, found.base if kind == "unknown" else best.fit, labels)
    if found.stopped:
        yield told("search stopped", "diagnosis", count=len(found.found) - 1)
    elif kind == "unknown" and found.rig.before is None:
        free = wide_ranges(found.rig, found.spectrum, found.settings, found.base)
        yield from [told("free parts of the rig", "records and rig", said=free)] if free else []
    if one.surprised is not None:
        yield told("held-out speeds", "diagnosis", speeds=spins(one.surprised.speed))
    if best.like:
        yield told("model-form error", " and ".join(sorted(best.named)), others=" and ".join(sorted(best.like)))
    yield from unstable_rig(found.unstable, best.fit, found.spectrum.speed)


def _far_from_the_rig(found, fitted, labels):
    """A warning if the records look like those of a rig with other values: another machine, other units, other speeds.

    The best explanation then needs unusual values of the rig, as `fitted`, sizes of causes, errors of form or several
    faults at once, and the rig without causes, but with other values, explains most of the excess error.
    """
    best, settings = found.best, found.settings
    theta = best.fit.values
    said = [
        f"{labels[row.name]} moved by {abs(row.moved_sigma):.0f} stated standard deviations"
        for row in moved_parameters(fitted, found.prior.by_name)
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
    if said and left <= MOST:
        yield told("far from the rig", "records and rig", said="; ".join(said), left=percent(left))


def _within_uncertainty(found):
    """A note if nothing is missing because a vector of the rig, such as an unbalance, took over what changed."""
    fitted, prior, said = found.base, found.prior, []
    vectors = [(term.full_name(p), p) for term in found.rig.terms for p in term.parameters if p.is_complex]
    for name, p in vectors if found.rig.before is None else ():
        parts = [f"{name}_real", f"{name}_imag"]
        if not set(parts) <= set(prior.names):
            continue
        stated, (free, covariance) = complex(*prior.part(parts).mean), fitted.of(parts)
        value, std = complex(*free), float(np.sqrt(np.trace(covariance) / 2))
        off = abs(value - stated)
        if stated and off > max(OTHER * abs(stated), CERTAIN * std):
            called, (unit, factor) = next(iter(p.also.items()), (p.name, (p.unit, 1.0)))
            both = [f"{quantity(abs(v) / factor, unit)} at {quantity(np.angle(v), 'rad')}" for v in (value, stated)]
            said.append(f"{name.replace(p.name, called)} is {' instead of '.join(both)}")
    if said:
        yield told("explained by the rig", "records and rig", said="; ".join(said))
