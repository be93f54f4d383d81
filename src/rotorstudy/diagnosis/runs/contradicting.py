"""Runs that do not agree with one machine: which of them, and whether its stated masses or its records are to blame."""

from collections.abc import Sequence

import numpy as np

from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.findings import CONTRADICTED, told
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.inference.fit import chi_square_p_value
from rotorstudy.inference.joint import JointFit, Run, fit_runs
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.findings import Finding
from rotorstudy.units import number, p_value, quantity

MOST_NAMED = 3
TOLD_APART = ("known mass contradicted", "another machine")  # findings that say what is wrong
ADDED = "added "  # label of a term that a run adds


def contradictions(joint: JointFit, shared: Prior, settings: Settings, sense: float) -> list[Finding]:
    """Findings on runs that the machine with what was added does not explain.

    If all runs agree once the stated masses of one run are free, these are contradicted; if they agree without one run,
    that is of another machine, or of another state of it. Where neither helps, every run not explained is told.

    shared : of the parameters that the runs share;  sense : 1 or -1, of the user's angles
    """
    significance = settings.significance
    rejected = _unexplained(joint, significance)
    if not rejected:
        return []
    for run in joint.runs:
        freed = _with_free_masses(run, settings.prior_width)
        other = freed and _refitted([freed if one is run else one for one in joint.runs], shared)
        if other and not _unexplained(other, significance):
            return [_contradicted(other, run, freed, sense)]
    if other := _other_machines(joint, shared, significance):
        return [other]
    misfits = {name: number(cost / rows) for name, (cost, rows) in joint.misfits.items()}
    each = [told("not explained", f"run '{n}'", misfit=misfits[n], p=p_value(p)) for n, p in rejected.items()]
    return each + _moved_far(joint)


def is_implausible(joint: JointFit, significance: float) -> bool:
    """Whether a run is not explained, or only with values of the parameters less likely than `significance`."""
    return bool(_unexplained(joint, significance)) or _p_value_of_parameters(joint) < significance


def exceeds_noise(joint: JointFit) -> bool:
    """Whether a run leaves more than noise does on average, or the parameters are farther off than their priors say."""
    over = any(cost > rows for cost, rows in joint.misfits.values())
    return over or joint.posterior.penalty > len(joint.prior.names)


def not_plausible(joint: JointFit) -> Finding:
    """The Finding that the runs are explained only with values that are implausibly far from those stated."""
    moved = _moved(joint)[0]
    return told("far from the rig (explained)", "all runs", p=p_value(_p_value_of_parameters(joint)), moved=moved)


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
    free = {u.name: (0.0, width * u.typical) for term in _stated_masses(run) for u in term.unknowns}
    kept = run.own.part([name for name in run.own.names if name not in free])
    return run._replace(own=kept.plus(Prior.independent(free))) if free else None


def _stated_masses(run):
    """Terms of the unbalances that a run adds with a stated size, exact or with a standard deviation."""
    added = (term for term in run.model.terms if term.kind == "unbalance" and term.label.startswith(ADDED))
    return [term for term in added if np.isfinite(term.theta).all()]


def _contradicted(joint, run, freed, sense):
    """The Finding on stated masses that the records contradict, with those that they show."""
    texts = []
    for term in _stated_masses(run):
        unit = term.parameters[0].also["unbalance"][1]  # m of 1 kg m
        known = joint.of([freed.joint_name(unknown.name) for unknown in term.unknowns])
        _, found, covariance = magnitude_and_phase(["x_real", "x_imag"], *known)
        each = (np.hypot(*term.theta), np.arctan2(*term.theta[::-1]), None), (*found, np.sqrt(covariance[0, 0]) / unit)
        stated, shown = (
            f"{quantity(size / unit, 'kg m', std)} at {quantity(sense * angle % (2 * np.pi), 'rad')}"
            for size, angle, std in each
        )
        texts.append(f"{stated} is stated, and the records show {shown}")
    return told("known mass contradicted", f"run '{run.name}'", said="; ".join(texts))


def _other_machines(joint, shared, significance):
    """A Finding on the run without which the others agree, or on all such runs if it may be any of several; or None."""
    odd = []
    for run in joint.runs if len(joint.runs) > 2 else ():
        rest = _refitted([one for one in joint.runs if one is not run], shared)
        if rest and not _unexplained(rest, significance):
            odd.append(run.name)
    if not odd:
        return None
    which = " (one of several)" if len(odd) > 1 else ""
    return told(f"another machine{which}", ", ".join(f"run '{name}'" for name in odd))


def _moved(joint, least=0.0):
    """'gain by 7.1, ...': the parameters farthest off, in stated standard deviations; how many are that far."""
    off = np.abs(joint.posterior.free - joint.prior.mean) / joint.prior.std
    far = [i for i in np.argsort(-off) if off[i] >= least]
    return ", ".join(f"{joint.prior.names[i]} by {number(float(off[i]), 2)}" for i in far[:MOST_NAMED]), len(far)


def _moved_far(joint):
    """A Finding on the parameters that the fit had to move farthest, if any is implausibly far from the rig."""
    moved, count = _moved(joint, CONTRADICTED)
    more = f" and {count - MOST_NAMED} more" if count > MOST_NAMED else ""
    return [told("far from the rig (not explained)", "all runs", moved=moved + more)] if count else []
