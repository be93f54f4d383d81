"""Which further run would decide between the causes that a diagnosis cannot tell apart, and how likely it does.

Each explanation predicts the harmonics y of a run not yet made, with a density p_i(y). Measuring them multiplies the
posterior odds of i against j by p_i(y) / p_j(y). If i is true, the logarithm of that ratio is on average the divergence
of the two densities; how often it suffices follows from drawing such runs.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.verdict.result import NextRun, Place
from rotorstudy.errors import NoSteadyState, RotorstudyError
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.prediction import predicted, with_cause_error, with_model_error
from rotorstudy.inference.predictive import decision_probability, expected_log_odds, predictive
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.rig_items import make_term
from rotorstudy.model.terms import Term
from rotorstudy.response.stability import check_stable

SPEEDS = 30  # of the grid of possible runs
SLOW_ROLL, BEYOND = 0.25, 1.3  # times the lowest and the highest measured speed: between these a run may be possible
TRIAL = 0.5  # of the largest vibration measured, by which a trial unbalance changes it
GAIN = 0.05  # in the probability of a decision, that makes a trial unbalance worth its trouble
BEARABLE = 2.0  # times the largest vibration measured: runs in which any explanation expects more are not proposed
MOST = 5  # explanations that are compared, the most probable ones
PROPOSED = 3  # runs


def next_runs(found: Search, measured: Spectrum, held: Spectrum | None, decided: float) -> list[NextRun]:
    """Further runs, at other speeds than those held out, that separate the explanations best, with or without a trial.

    measured : without the model error;  decided : posterior probability from which on an explanation counts as decided
    """
    fits, weights = explanations_in_question(found, decided)
    if len(fits) < 2:
        return []
    top = measured.speed.max()
    grid = np.linspace(SLOW_ROLL * measured.speed.min(), BEYOND * top, SPEEDS)
    apart = 0.5 * (grid[1] - grid[0])
    grid = np.array([w for w in grid if held is None or (np.abs(w - held.speed) > apart).all()])
    ranges = [part for part in (grid[grid <= top], grid[grid > top]) if len(part)]
    trials, runs = _trials(found, measured), []
    for speeds in ranges:
        plain, *others = (_best_run(found, measured, fits, weights, decided, speeds, one) for one in trials)
        least = plain.decision_probability + GAIN if plain else 0.0
        runs += [plain] if plain else []
        runs += [run for run in others if run and run.decision_probability >= least]
    return sorted(runs, key=lambda run: (-run.decision_probability, -run.expected_log_odds))[:PROPOSED]


def explanations_in_question(found: Search, decided: float) -> tuple[list[Fit], np.ndarray]:
    """Fits of a credible set but those that add to the best, at most `MOST`, and their probabilities, of sum one."""
    best = found.best
    chosen = [e for e in found.credible(decided) if e[0] is best or not (best.causes and best.named <= e[0].named)]
    weights = np.array([weight for _, weight in chosen[:MOST]])
    return [explanation.fit for explanation, _ in chosen[:MOST]], weights / weights.sum()


class _Trial(NamedTuple):
    """A trial unbalance of a further run, kg m; without a place none."""

    place: Place | None = None
    term: Term | None = None
    unbalance: float | None = None


def _trials(found, measured):
    """A _Trial without an unbalance, then one at each disc that changes the vibration by `TRIAL` of the largest."""
    structure, trials, base = found.rig.structure, [_Trial()], found.base
    discs = structure.nodes if len(structure.nodes) == 1 else {disc.node for disc in structure.discs}
    for node in sorted(discs):
        item = {"kind": "unbalance", "node": node, "label": "trial of a further run"}
        term = make_term("effect", item, structure, found.rig.sensors, "trial unbalance")
        (parameter,) = term.parameters
        usual = with_term(base, replace(term, values={parameter.name: complex(parameter.typical)}))
        change = predicted(usual.model, measured, usual.theta) - predicted(base.model, measured, base.theta)
        change = measured.shown(change)
        if not change.any():  # no 1X was measured
            continue
        size = TRIAL * _vibration(measured, measured.amplitude) / _vibration(measured, change) * parameter.typical
        term, place = replace(term, values={parameter.name: complex(size)}), {"node": node}
        trials.append(_Trial(Place.of("unbalance", place, structure), term, size / parameter.also["unbalance"][1]))
    return trials


def _vibration(spectrum, amplitude):
    """The largest harmonic, 0X apart, which may be a probe gap, m."""
    return np.abs(amplitude[..., spectrum.harmonics != 0, :]).max(initial=0)


def _best_run(found, measured, fits, weights, decided, speeds, trial):
    """The NextRun with a trial at the speed that separates the explanations best, or None if there is none."""
    base, *fits = (with_term(fitted, trial.term) if trial.term else fitted for fitted in (found.base, *fits))
    spectrum, each = further_run(found, measured, base, fits, weights, speeds)
    bearable = BEARABLE * _vibration(measured, measured.amplitude)
    within = [i for i in range(len(spectrum.speed)) if _vibration(measured, each[:, i]) <= bearable]
    if not within:
        return None
    runs = predictive(fits, spectrum.at_speeds(within))
    expected = np.array([expected_log_odds(one, weights) for one in runs])
    for best in np.argsort(-expected):
        speed = float(spectrum.speed[within[best]])
        try:
            for fitted in fits:
                check_stable(fitted.model, [speed], fitted.theta)
        except NoSteadyState:
            continue
        likely = decision_probability(runs[best], weights, decided)
        row = {"speed": speed, "expected_log_odds": expected[best], "decision_probability": likely}
        return NextRun(**row, trial=trial.place, trial_unbalance=trial.unbalance)
    return None


def with_term(fitted: Fit, term: Term) -> Fit:
    """A fit with a term, with a value for every parameter, added to its model."""
    return replace(fitted, model=fitted.model.plus(term))


def further_run(found, measured, base, fits, weights, speeds):
    """The Spectrum expected of a run at those of some speeds where all explanations have a steady state, and of each.

    Its covariance is the mean one of the speeds measured, with the error of the model and of a cause.
    """
    covariance = np.broadcast_to(measured.covariance.mean(axis=0), (len(speeds), *measured.covariance.shape[1:]))
    blank = np.zeros((len(speeds), *measured.amplitude.shape[1:]), complex)
    spectrum = replace(measured, amplitude=blank, speed=speeds, covariance=covariance)
    shown = np.array([_predicted_where_steady(fitted, spectrum) for fitted in (base, *fits)])
    steady = np.isfinite(shown).all(axis=(0, 2, 3))
    spectrum, (of_base, *each) = spectrum.at_speeds(steady), shown[:, steady]
    mean = np.tensordot(weights, each, 1)
    spectrum = with_model_error(spectrum.with_amplitude(spectrum.shown(mean)), found.settings)
    return with_cause_error(spectrum, mean - of_base, found.form_error_by_harmonic), spectrum.shown(np.array(each))


def _predicted_where_steady(fitted, spectrum):
    """What a fit predicts, NaN at speeds without a steady state, or which its plugins do not cover."""
    try:
        return predicted(fitted.model, spectrum, fitted.theta)
    except RotorstudyError:  # a table of a bearing may end
        if len(spectrum.speed) == 1:
            return np.full(spectrum.amplitude.shape, np.nan)
    halves = np.array_split(np.arange(len(spectrum.speed)), 2)
    return np.concatenate([_predicted_where_steady(fitted, spectrum.at_speeds(half)) for half in halves])
