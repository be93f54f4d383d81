"""Runs that do not agree with one machine: which of them, and whether its stated masses or its records are to blame."""

from collections.abc import Sequence

import numpy as np

from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.fit import chi_square_p_value
from rotorstudy.inference.joint import JointFit, Run, fit_runs
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.findings import Finding
from rotorstudy.units import number, p_value, percent, quantity

FAR = 5.0  # standard deviations of the prior
MOST_NAMED = 3
TOLD_APART = ("known mass contradicted", "another machine")  # findings that say what is wrong
ADDED = "added "  # label of a term that a run adds


def contradictions(joint: JointFit, shared: Prior, significance: float, width: float, sense: float) -> list[Finding]:
    """Findings on runs that the machine with what was added does not explain.

    If all runs agree once the stated masses of one run are free, these are contradicted; if they agree without one run,
    that is of another machine, or of another state of it. Where neither helps, every run not explained is told.

    shared : of the parameters that the runs share;  significance : p-value below which a run is not explained
    width  : standard deviation of a mass that is set free, in typical sizes;  sense : 1 or -1, of the user's angles
    """
    rejected = _unexplained(joint, significance)
    if not rejected:
        return []
    for run in joint.runs:
        freed = _with_free_masses(run, width)
        other = freed and _refitted([freed if one is run else one for one in joint.runs], shared)
        if other and not _unexplained(other, significance):
            return [_contradicted(other, run, freed, sense)]
    other = _other_machines(joint, shared, significance)
    if other:
        return [other]
    return [_not_explained(joint, name, p) for name, p in rejected.items()] + _moved_far(joint)


def is_implausible(joint: JointFit, significance: float) -> bool:
    """Whether a run is not explained, or only with values of the parameters less likely than `significance`."""
    return bool(_unexplained(joint, significance)) or _p_value_of_parameters(joint) < significance


def exceeds_noise(joint: JointFit) -> bool:
    """Whether a run leaves more than noise does on average, or the parameters are farther off than their priors say."""
    over = any(cost > rows for cost, rows in joint.misfits.values())
    return over or joint.posterior.penalty > len(joint.prior.names)


def not_plausible(joint: JointFit) -> Finding:
    """The Finding that the runs are explained only with values that are implausibly far from those stated."""
    off = np.abs(joint.posterior.free - joint.prior.mean) / joint.prior.std
    far = np.argsort(-off)[:MOST_NAMED]
    named = ", ".join(f"{joint.prior.names[i]} by {number(float(off[i]), 2)}" for i in far)
    text = (
        f"the runs are explained only with values far from the stated ones ({p_value(_p_value_of_parameters(joint))}): "
        f"{named} times the stated standard deviation. They may imitate what the rig lacks; state how well more of its "
        "numbers are known, such as those of its bearings and pedestals"
    )
    return Finding("warning", "far from the rig", "all runs", text)


def larger_error(share: float, stated: float) -> Finding:
    """The Finding that the intervals include a larger error of the model than stated; both are fractions."""
    text = (
        f"all runs agree with a model error of {percent(share)} of each harmonic instead of {percent(stated)}; the "
        "values and intervals are those with it. An error that is alike at many speeds may still exceed them"
    )
    return Finding("warning", "larger model error", "all runs", text)


def unstated_forces() -> Finding:
    """The Finding that an unbalance or a bow that the rig does not state explains the runs."""
    text = (
        "all runs agree with an unbalance at other nodes or a bow, alike in all of them, that the rig does not state; "
        "the values and intervals are those with it. List it under 'effects:' to have it estimated"
    )
    return Finding("warning", "unstated unbalance or bow", "all runs", text)


def _p_value_of_parameters(joint):
    return chi_square_p_value(joint.posterior.penalty, len(joint.prior.names))


def _unexplained(joint, significance):
    """Name -> p-value of the runs that are not explained."""
    p_values = {name: chi_square_p_value(cost, rows) for name, (cost, rows) in joint.misfits.items()}
    return {name: p for name, p in p_values.items() if p < significance}


def _refitted(runs: Sequence[Run], shared: Prior) -> JointFit | None:
    try:
        return fit_runs(runs, shared)
    except NoSteadyState:
        return None


def _with_free_masses(run, width):
    """The run with its stated unbalances free; None if it states none."""
    known = _stated_masses(run)
    if not known:
        return None
    kept = run.own.part([name for name in run.own.names if name not in known])
    return run._replace(own=kept.plus(Prior.independent({name: (0.0, width * u.typical) for name, u in known.items()})))


def _stated_masses(run):
    """Name -> unknown of the unbalances that a run adds with a stated size, exact or with a standard deviation."""
    added = [t for t in run.model.terms if t.kind == "unbalance" and t.label.startswith(ADDED)]
    return {
        unknown.name: unknown
        for term in added
        for unknown, value in zip(term.unknowns, term.theta, strict=True)
        if np.isfinite(value)
    }


def _contradicted(joint, run, freed, sense):
    """The Finding on stated masses that the records contradict, with those that they show."""
    names = list(_stated_masses(run))
    theta, covariance = joint.of([freed.joint_name(name) for name in names])
    stated = dict(zip(run.model.names, run.model.stated, strict=True))
    factor = {
        f"{term.full_name(p)}_real": p.also["unbalance"][1]
        for term in run.model.terms
        for p in term.parameters
        if "unbalance" in p.also
    }

    def told(parts, name, std=None):
        size, angle = np.hypot(*parts) / factor[name], sense * np.arctan2(parts[1], parts[0]) % (2 * np.pi)
        return f"{quantity(size, 'kg m', std)} at {quantity(angle, 'rad')}"

    texts = []
    for i in range(0, len(names), 2):
        std = float(np.sqrt(covariance[i, i])) / factor[names[i]]
        given = [stated[name] for name in names[i : i + 2]]
        texts.append(f"{told(given, names[i])} is stated, and the records show {told(theta[i : i + 2], names[i], std)}")
    text = f"{'; '.join(texts)}: correct it, or give it a (larger) 'std_g_mm:'"
    return Finding("warning", "known mass contradicted", f"run '{run.name}'", text)


def _other_machines(joint, shared, significance):
    """A Finding on the run without which the others agree, or on all such runs if it may be any of several; or None."""
    odd = []
    for run in joint.runs if len(joint.runs) > 2 else ():
        rest = _refitted([one for one in joint.runs if one is not run], shared)
        if rest and not _unexplained(rest, significance):
            odd.append(run.name)
    if not odd:
        return None
    text = (
        "the other runs agree with one machine, and not with this one: it is of another machine, or something else was"
    )
    if len(odd) > 1:
        text = (
            "without one of these runs the others agree with one machine; the records do not tell which of them is of "
            "another machine, or in which something else was"
        )
    text += " changed; leave it out, or state what was under 'effects:' or 'own:'"
    return Finding("warning", "another machine", ", ".join(f"run '{name}'" for name in odd), text)


def _moved_far(joint):
    """A Finding on the parameters that the fit had to move farthest, if any is implausibly far from the rig."""
    off = (joint.posterior.free - joint.prior.mean) / joint.prior.std
    far = [i for i in np.argsort(-np.abs(off)) if np.abs(off[i]) > FAR]
    if not far:
        return []
    named = ", ".join(f"{joint.prior.names[i]} by {number(float(abs(off[i])), 2)}" for i in far[:MOST_NAMED])
    more = f" and {len(far) - MOST_NAMED} more" if len(far) > MOST_NAMED else ""
    text = (
        f"the fit moves {named}{more} times the stated standard deviation: these values only imitate what the rig "
        "lacks. List the residual unbalance and the runout as effects with realistic uncertainties, correct the "
        "numbers of the rig, or state a larger 'diagnosis: model_error:'"
    )
    return [Finding("warning", "far from the rig", "all runs", text)]


def _not_explained(joint, name, p):
    cost, rows = joint.misfits[name]
    text = (
        f"misfit {number(cost / rows)} per component of the spectrum ({p_value(p)}): the runs and what is said of them "
        "do not agree with one machine, and the stated intervals are not valid; check the masses, angles and records "
        "of the runs, or state what else may differ under 'own:'"
    )
    return Finding("warning", "not explained", f"run '{name}'", text)
