"""What to do after a verdict, and what an unknown one leaves known, as sentences."""

import numpy as np

from rotorstudy.diagnosis.verdict.cause_words import place, readable
from rotorstudy.diagnosis.verdict.result import LIKELY_OUTSIDE
from rotorstudy.diagnosis.verdict.words import FEW, doubts, where_it_acts
from rotorstudy.model.registry import registry
from rotorstudy.units import number, p_value, percent, quantity, spin

LIKELY = 0.1  # probability of a decision below which a run is not worth its trouble
HARDLY = 3.0  # standard deviations (rms) below which a longer record helps to separate causes
REPEAT = (
    "Repeat the later run without touching the machine. If repeats differ by as much, state their scatter "
    "('repeatability', 'run_to_run' in the rig file), and compare again."
)
CHECK = (
    "Check the rig file ('rotorstudy check', 'rotorstudy analyse') and the probes, and state how well its values are "
    "known ('diagnosis: uncertainty:'); records of the sound machine update it ('rotorstudy identify --runs')."
)


def known_and_not(verdict, of_change=False):
    """{heading: sentences} of what an unknown verdict, perhaps `of_change`, leaves known, and what not."""
    changed = "The machine differs between the two states" if of_change else "The machine differs from the rig file"
    known = f"{changed} by more than noise and the errors stated for it ({p_value(verdict.residual_p_value.before)})."
    known += f" {where_it_acts(verdict).capitalize()}" * bool(verdict.one_place)
    if not verdict.causes:
        return {"Known": known, "Not known": "The cause: no effect of the library fits."}
    near = " together with ".join(map(place, verdict.causes))
    explained = percent(max(0.0, 1 - verdict.residual_share), 2)
    known += f" The closest explanation is {near}: it accounts for {explained} of the excess error (rms)."
    if verdict.outside_probability > LIKELY_OUTSIDE:
        why = "a force of another law at one place explains the records better"
    elif verdict.parameter_p_value < verdict.settings.significance:
        why = f"it needs values far from those stated ({p_value(verdict.parameter_p_value)})"
    elif verdict.residual_p_value.after < verdict.settings.significance:
        why = f"it leaves more than noise ({p_value(verdict.residual_p_value.after)})"
    else:
        why = "it does not hold at speeds that no fit has seen"
    return {"Known": known, "Not known": f"Whether that is the cause: {why}. So its size is not stated here."}


def separated(verdict):
    """{measurement: ["a or b", ...]}: what to measure, and the causes that it separates."""
    groups = {}
    for one in verdict.separating_measurement:
        text = one.measurement[:1].upper() + one.measurement[1:]
        groups.setdefault(text, []).append(" or ".join(map(place, one.causes)))
    return groups


def _run(run):
    """'258 rad/s (2464 rpm) with a trial unbalance at node 3 of 30 g mm: expected odds 12 to 1, decided with ...'."""
    trial = f" with a trial {place(run.trial)} of {quantity(run.trial_unbalance, 'kg m')}" if run.trial else ""
    odds = number(np.exp(run.expected_log_odds), 2)
    likely = percent(run.decision_probability, 2)
    return f"{spin(run.speed)}{trial}: expected odds {odds} to 1, decided with a probability of {likely}"


def runs_in_words(verdict):
    """What further runs would decide, as sentences."""
    if not verdict.next_runs:
        return []
    likely = [run for run in verdict.next_runs if run.decision_probability >= LIKELY]
    if not likely:
        return [f"No run at one more speed is likely to decide. The best one is at {_run(verdict.next_runs[0])}."]
    return [f"{'Or run' if i else 'Run'} at {_run(run)}." for i, run in enumerate(likely)]


def next_steps(verdict, of_change=False):
    """Recommended actions and measurements after a verdict, perhaps `of_change`, as sentences."""
    kind, steps = verdict.verdict, []
    if found := doubts(verdict):
        steps.append(f"Check the records first: {found} (see below).")
    if verdict.broken_plugins:
        steps.append("Repair the broken plugins (see below): they were not, or not fully, considered.")
    if kind == "nothing":
        steps.append(
            "None, unless effects below the detection limits matter: longer records, or speeds nearer to resonance, "
            "lower the limits."
        )
    if kind == "ambiguous":
        steps += runs_in_words(verdict)
        steps += [f"{text.rstrip('.')}." for text in separated(verdict)]
        if verdict.gain and verdict.gain.before_sigma < HARDLY:
            steps.append("What is missing hardly exceeds the noise: take longer records, or more of them.")
    if kind == "unknown":
        rest = ", ".join(f"{row.harmonic}X at node {row.node}" for row in verdict.unexplained[:FEW])
        steps.append(REPEAT if of_change else CHECK)
        steps.append("Measure at further speeds: causes that look alike at these differ there.")
        steps.append(
            (f"Examine what remains: {rest}. " if rest else "")
            + "Physics that the library lacks can be added as an effect (docs/adding_a_model.md)."
        )
    for name in verdict.not_considered:
        hints = (registry().confounders(cause.effect).get(name) for cause in verdict.causes)
        steps.append(f"Rule out {readable(name)}, which was not considered: {next(filter(None, hints))}.")
    if kind == "cause":
        steps.append(
            "Measure one more speed and compare: 'rotorstudy simulate extended_rig.yaml --speeds ...' predicts it."
        )
    if verdict.gain is None and kind != "nothing":
        steps.append("Hold out a speed ('--hold-out') to measure the gain.")
    return steps
