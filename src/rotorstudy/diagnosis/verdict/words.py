"""A verdict in sentences, and what to do after it. ± is one standard deviation."""

from itertools import groupby

import numpy as np

from rotorstudy.diagnosis.search.explanations import LIKELY_OUTSIDE
from rotorstudy.diagnosis.verdict.cause_words import cause_in_words, force_in_words, place, readable, without_unit
from rotorstudy.diagnosis.verdict.findings import CONTRADICTED
from rotorstudy.model.registry import registry
from rotorstudy.units import number, p_value, percent, quantity, spin, spins

OF_DIAMETER = "of the diameter"  # unit of the depth of a crack
FEW = 3  # detection limits, unexplained harmonics, or values of the rig, in a sentence
SEVERAL = 6  # other possible causes in a sentence
SAME_WEIGHT = 0.05  # difference of the weights of two discs in a sum that is not worth saying
WORTH_SAYING = 0.05  # probability that the true cause is not among those stated
MOST_ODDS = 100  # power of ten; what is left out of account is far more probable than that
LARGE_LOG_ODDS = 7.0  # from which on odds are said as a power of ten
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


def summary(verdict, of_change=False):
    """The verdict as a few plain sentences; of_change : whether it is on the difference between two states."""
    said = [_said(verdict, of_change)]
    if verdict.verdict == "unknown" and (far := _moved_far(verdict.base_parameters)):
        said.append(f"The fit moved these values of the rig far; check them first: {', '.join(far)}.")
    if verdict.resultant:
        said.append(resultant_in_words(verdict.resultant))
    if verdict.not_considered:
        alike = ", ".join(map(readable, verdict.not_considered))
        said.append(f"Not considered, although it would look similar: {alike}.")
    if verdict.broken_plugins:
        said.append(f"Broken plugins, not or not fully considered: {len(verdict.broken_plugins)}.")
    if found := doubts(verdict):
        said.append(f"Check the records first: {found}.")
    return " ".join(said)


def _moved_far(moved):
    """'gain mismatch of disc 1 (by 30 stated standard deviations)' of the values of the rig that moved furthest."""
    furthest = {}
    for row in moved:
        name = row.name.removesuffix("_real").removesuffix("_imag")
        furthest[name] = max(furthest.get(name, 0.0), abs(row.moved_sigma))
    far = sorted(((size, name) for name, size in furthest.items() if size > CONTRADICTED), reverse=True)
    said = [(readable(name).replace("[", " of ").removesuffix("]"), size) for size, name in far[:FEW]]
    return [f"{name} (by {size:.0f} stated standard deviations)" for name, size in said]


def excluded_in_words(verdict):
    """One line for each effect that the records exclude."""
    lines = []
    for one in verdict.excluded:
        why = "it leaves hardly more, but needs less probable values"
        if one.harmonic is not None:
            why = f"it leaves {one.sigma:.3g} standard deviations (rms) of {one.harmonic}X at node {one.node}"
        lines.append(f"{place(one.cause)}: odds 1 to {_odds(one.log_odds)}; {why}")
    return lines


def _odds(log_odds):
    """'85', or '10^12' where it is large, up to a largest power."""
    power = log_odds / np.log(10)
    if power > MOST_ODDS:
        return f"more than 10^{MOST_ODDS}"
    return f"{np.exp(log_odds):.2g}" if log_odds < LARGE_LOG_ODDS else f"10^{power:.0f}"


def resultant_in_words(found):
    """A sentence on what the unbalances of several discs are together, and that their split is not known."""
    names = (one.label or f"node {one.where['node']}" for one in found.discs)
    weights = (f"{number(w, 2)} × " * (abs(w - 1) > SAME_WEIGHT) for w in found.weights)
    parts = map("".join, zip(weights, names, strict=True))
    size, angle = (quantity(one.value, one.unit, one.std) for one in (found.size, found.angle))
    each = ", ".join(quantity(std, "kg m", digits=2) for std in found.std_of_each)
    return (
        f"The unbalances of the discs look alike in these records: their sum ({' + '.join(parts)}) is {size} at "
        f"{angle}; how it is split between them is not known (standard deviation of each: {each})."
    )


def doubts(verdict):
    """Names of the warnings on the records, as a text."""
    return ", ".join(dict.fromkeys(f.name for f in verdict.findings if f.severity == "warning"))


def _said(verdict, of_change):
    residual = f"residual: {p_value(verdict.residual_p_value.before)}"
    if any(finding.name == "search stopped" for finding in verdict.findings):
        near = " together with ".join(map(place, verdict.causes)) or "none"
        return f"The search was stopped before its end ({residual}). The closest explanation so far: {near}."
    something = "Something changed" if of_change else "Something is missing"
    if verdict.verdict == "nothing":
        why = "missing: noise and the stated model error explain the residual"
        nothing = "changed beyond the noise and the repeatability of the records" if of_change else f"is {why}"
        found, what = smallest_detected(verdict), "changes" if of_change else "sizes"
        limits = f" Smallest {what} detected with a probability of 95 %: {', '.join(found)}." if found else ""
        hides = "".join(f" {sentence}" for sentence in hidden_in_words(verdict))
        return f"Nothing {nothing} ({residual}).{limits}{hides}"
    if verdict.measuring_chain:
        chain = verdict.measuring_chain
        beside = f" together with {place(chain.beside)}" if chain.beside else ""
        return (
            f"The records look as if {chain.hypothesis}. That{beside} explains them better than any cause in the "
            f"records as stated, so none is named. Remedy: {chain.remedy}. Then diagnose again."
        )
    is_far = verdict.verdict == "unknown" and verdict.parameter_p_value < verdict.settings.significance
    implausible = f"parameters implausibly far from their stated values ({p_value(verdict.parameter_p_value)})" * is_far
    if not verdict.causes:
        why = f": the fit needs {implausible}" if implausible else f" ({residual})"
        return f"{something}, and no effect of the library explains it{why}."
    if verdict.verdict == "cause":
        likely, named = _named(verdict.causes)
        text = f"{something}, and it is most likely {named}; {likely}."
        text += f" The intervals include a model-form error of {percent(verdict.form_error, 2)} (standard deviation)."
    elif verdict.verdict == "ambiguous":
        text = f"{_ambiguous(verdict, something)} {_not_ruled_out(verdict)}"
    else:
        text = _said_of_unknown(verdict, something, implausible)
    if verdict.verdict != "unknown" and verdict.outside_probability > WORTH_SAYING:
        likely = percent(verdict.outside_probability, 2)
        text += f" With a probability of {likely} the true cause is one that the library lacks."
    return f"{text} {gain_in_words(verdict)}"


def _named(causes):
    """The least probability of causes, and the causes with their sizes, as texts."""
    likely = percent(min(cause.probability for cause in causes))
    return f"probability {likely}", " together with ".join(map(cause_in_words, causes))


def _ambiguous(verdict, something):
    """The most likely causes of an ambiguous verdict; first those that are in doubt beside no other."""
    sure = [cause for cause in verdict.causes if cause.posterior_probability >= verdict.settings.naming_probability]
    likely, what = _named([cause for cause in verdict.causes if cause not in sure] or verdict.causes)
    if not 0 < len(sure) < len(verdict.causes):
        return f"{something}. The most likely cause ({likely}) is {what}."
    sure_of, known = _named(sure)
    return f"{something}: {known} ({sure_of}) and another cause, most likely ({likely}) {what}."


def _not_ruled_out(verdict):
    """A sentence on the other causes of an ambiguous verdict."""
    others = list(dict.fromkeys(map(place, verdict.ambiguous_with)))
    if len(others) < 2:
        return f"But {others[0]} cannot be ruled out." if others else "It is not certain."
    more = [f"and {len(others) - SEVERAL} more"] if len(others) > SEVERAL else []
    return f"But these cannot be ruled out: {'; '.join([*others[:SEVERAL], *more])}."


def _said_of_unknown(verdict, something, implausible):
    """The closest explanation, without its sizes, which would mislead, and why it is no cause."""
    near = " together with ".join(map(place, verdict.causes))
    if verdict.outside_probability > LIKELY_OUTSIDE:
        return (
            f"{something}, and with a probability of {percent(verdict.outside_probability, 2)} it is an effect that "
            f"the library lacks: {where_it_acts(verdict) or 'a force of another law explains the records better.'} The "
            f"closest explanation of the library is {near}."
        )
    left = percent(verdict.residual_share)
    closest = f"The closest explanation is {near}, which leaves {left} of the excess error (rms)"
    if verdict.residual_share > 1:  # large changes that cancel, whose error of form covers what they leave
        closest = f"The most probable explanation, {near}, leaves more than the rig does"
    closest += f" and needs {implausible}" * bool(implausible)
    where = f" {where_it_acts(verdict).capitalize()}" * bool(verdict.one_place)
    return f"{something} that no effect of the library explains. {closest}.{where}"


def where_it_acts(verdict):
    """A sentence on the places at which one force explains the records, or nothing."""
    if not verdict.one_place:
        return ""
    first, *others = map(force_in_words, verdict.one_place)
    more = ["others, which the records do not tell apart"] if len(others) > SEVERAL else []
    also = f"; so do {' or '.join([*others[:SEVERAL], *more])}" if others else ""
    return f"{first} alone, free at every speed and harmonic, explains the records{also}."


def hidden_in_words(verdict):
    """A sentence on each fault that operators fear: where it is seen from which size on, and where it could hide."""
    rows, said = {}, []
    for row in verdict.hidden:
        alone = {key: value for key, value in row.where.items() if key != "number"}
        place_alone = row.model_copy(update={"effect": "", "where": alone})
        rows.setdefault((row.effect, row.where.get("number", "")), []).append(place_alone)
    for (effect, number_of_bearing), places in rows.items():
        name = readable(effect) + f" ({without_unit(number_of_bearing)})" * bool(number_of_bearing)
        seen = sorted((row for row in places if row.size is not None), key=lambda row: row.size)
        facts = []
        if seen:
            ends = [f"{_hidden_size(row)} ({place(row)})" for row in (seen[:1] + seen[1:][-1:])]
            facts.append(f"seen with 95 % probability above {' to '.join(ends)}")
        if blind := [row for row in places if row.size is None]:
            where, instead = _all_of(blind), blind[0].measure
            facts.append(f"not observable with these probes and speeds {where}: measure {instead}")
        said.append(f"{name[0].upper()}{name[1:]} is {'; '.join(facts)}.")
    return said


def _hidden_size(row):
    """Of a feared fault: a share as a percentage, else with its unit."""
    if row.unit in ("1", OF_DIAMETER):
        return f"{percent(row.size, 2)} {row.unit}".removesuffix(" 1")
    return quantity(row.size, row.unit)


def _all_of(rows):
    """The places of rows as text, nodes or elements in ranges (all of one have one distance to their index)."""
    said, numbered = [], {"node": [], "element": []}
    for row in rows:
        if len(row.where) == 1 and (kind := next(iter(row.where))) in numbered:
            numbered[kind].append(row.where[kind])
        else:
            said.append(place(row))
    for kind, values in numbered.items():
        grouped = groupby(enumerate(sorted(values)), lambda one: one[1] - one[0])
        runs = [[value for _, value in run] for _, run in grouped]
        listed = ", ".join(f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(map(str, run)) for run in runs)
        said += [f"{'at' if kind == 'node' else 'in'} {kind}{'s' * (len(values) > 1)} {listed}"] * bool(values)
    return ", ".join(said)


def gain_in_words(verdict):
    """What adding the causes gains at the held-out speeds, as a sentence."""
    gain, several = verdict.gain, len(verdict.causes) > 1
    its = {"ambiguous": f"the most likely {'causes' if several else 'cause'}", "unknown": "the best explanation tried"}
    it = its.get(verdict.verdict, "them" if several else "it")
    if gain is None:
        return f"No speed was held out, so the gain from adding {it} is not known."
    change = "lowers" if gain.ratio < 1 else "raises"
    told = (
        f"Adding {it} {change} the error at {spins(gain.speeds)}, held out of every fit, from "
        f"{quantity(gain.before_m, 'm')} to {quantity(gain.after_m, 'm')} rms ({gain.before_sigma:.3g} to "
        f"{gain.after_sigma:.3g} standard deviations)."
    )
    if gain.ratio < 1:
        return told
    likely = percent(gain.rise_probability, 2)
    return f"{told} Even if the model with {it} is right, noise alone raises it with a probability of {likely}."


def detection_limits(verdict):
    """Limits of what has a size, the most sensitive first; the larger one of real and imaginary part."""
    effects = registry().plugins["effect"]
    limits = [row for row in verdict.detection_limit if not effects[row.effect].fixed]
    # sorted, so that the larger one comes last
    largest = {(place(row), row.parameter): row for row in limits}
    return sorted(largest.values(), key=lambda row: row.of_typical)


def smallest_detected(verdict):
    """The most sensitive detection limits as short texts, one for each effect and place."""
    limits = {place(row): row for row in reversed(detection_limits(verdict))}
    return [f"{name} {quantity(row.amplitude, row.unit)}" for name, row in reversed(limits.items())][:FEW]


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
        lower = "longer records, or speeds nearer to resonance, lower the limits"
        steps.append(f"None, unless effects below the detection limits matter: {lower}.")
    if kind == "ambiguous":
        steps += runs_in_words(verdict)
        steps += [f"{text.rstrip('.')}." for text in separated(verdict)]
        if verdict.gain and verdict.gain.before_sigma < HARDLY:
            steps.append("What is missing hardly exceeds the noise: take longer records, or more of them.")
    if kind == "unknown":
        rest = ", ".join(f"{row.harmonic}X at node {row.node}" for row in verdict.unexplained[:FEW])
        steps.append(REPEAT if of_change else CHECK)
        steps.append("Measure at further speeds: causes that look alike at these differ there.")
        lacking = "Physics that the library lacks can be added as an effect (docs/adding_a_model.md)."
        steps.append(f"Examine what remains: {rest}. " * bool(rest) + lacking)
    for name in verdict.not_considered:
        hints = (registry().confounders(cause.effect).get(name) for cause in verdict.causes)
        steps.append(f"Rule out {readable(name)}, which was not considered: {next(filter(None, hints))}.")
    if kind == "cause":
        command = "rotorstudy simulate extended_rig.yaml --speeds ..."
        steps.append(f"Measure one more speed and compare: '{command}' predicts it.")
    if verdict.gain is None and kind != "nothing":
        steps.append("Hold out a speed ('--hold-out') to measure the gain.")
    return steps
