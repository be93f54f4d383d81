"""The probability that the true cause is none of those stated: the library lacks it, or the search missed it.

Posterior probabilities compare the effects of the library with one another. How often the true cause is not among them
was learned from records of an independent simulator, diagnosed with the true effect in the library and without it
(`benchmarks/outside.py`, which writes `outside.yaml`): a logistic regression on what the verdict itself shows.
"""

from functools import cache
from importlib.resources import files

import numpy as np

from rotorstudy.diagnosis.verdict.result import Verdict

LEAST_SHARE = 1e-3  # of the excess error that is left; less tells no more
ORDINARY = 0.05  # p-value that is usual under noise alone; a larger one tells no more
LEAST_P_VALUE = 1e-10
LIKELY = 0.5  # probability above which a verdict is unknown: the true cause is more likely another one
# Log Bayes factor of several causes that one force does not replace: so are 36 of 39 right pairs and 5 of 12 imitations
UNLIKE_ONE_FORCE = np.log(5 / 12) - np.log(36 / 39)
LEAST_DOUBT = 1e-4  # probability of other causes; less tells no more


def _below_ordinary(p_value):
    """By how many powers of ten a p-value lies below an ordinary one."""
    return np.log10(ORDINARY / np.clip(p_value, LEAST_P_VALUE, ORDINARY))


def _held_out_share(gain):
    """Error at the held-out speeds over what it is without the causes, a thousandth at least, noise not counted."""
    return np.clip(max(gain.after_sigma, 1) / max(gain.before_sigma, 1), 1e-3, 1)


def _amplitudes(verdict):
    """Number of amplitudes and shape options of each cause."""
    return [sum(p.part != "phase" for p in cause.parameters.values()) for cause in verdict.causes]


FEATURES = {
    "residual_share": lambda v: np.log10(max(v.residual_share, LEAST_SHARE) / LEAST_SHARE),
    "residual_p_value": lambda v: _below_ordinary(v.residual_p_value.after),
    "parameter_p_value": lambda v: _below_ordinary(v.parameter_p_value),
    "cause_error": lambda v: v.cause_error / v.settings.cause_error if v.settings.cause_error else 0.0,
    "further_causes": lambda v: len(v.causes) - 1,
    "further_amplitudes": lambda v: np.log2(sum(_amplitudes(v))),
    "amplitudes_beside": lambda v: np.log2(1 + sum(sorted(_amplitudes(v))[:-1])),  # the cause that has most
    "corrects_model": lambda v: v.corrects_model,
    "held_out_error": lambda v: np.log10(np.clip(v.gain.after_sigma, 1, 100)) if v.gain else 0.0,
    "held_out_share": lambda v: 3 + np.log10(_held_out_share(v.gain)) if v.gain else 3.0,
    "doubt": lambda v: np.log10(max(1 - min(c.posterior_probability for c in v.causes), LEAST_DOUBT) / LEAST_DOUBT),
}


def features(verdict: Verdict) -> np.ndarray:
    """What a verdict shows, in the order of `FEATURES`; larger values speak against its causes.

    verdict : with causes
    returns : (feature,)
    """
    return np.array([float(of(verdict)) for of in FEATURES.values()])


def outside_probability(verdict: Verdict, unlike_one_force: bool = False, further_log_odds: float = 0.0) -> float:
    """The probability that the true cause is none of those that a verdict states.

    verdict          : with causes
    unlike_one_force : whether they are several, and it was tested that no force at one place explains the records
    further_log_odds : of other evidence for it
    """
    from scipy.special import expit

    learned = _learned()
    weights = [learned["coefficients"][name] for name in FEATURES]
    further = UNLIKE_ONE_FORCE * unlike_one_force + further_log_odds
    return float(expit(learned["intercept"] + features(verdict) @ weights + further))


def with_outside(verdict: Verdict, unlike_one_force: bool = False, further_log_odds: float = 0.0) -> Verdict:
    """The verdict with the probability that the true cause is none of those stated: unknown, where that is likely.

    verdict : without that probability;  the others : as of `outside_probability`
    returns : unchanged unless it states causes
    """
    if verdict.verdict not in ("cause", "ambiguous"):
        return verdict
    probability = outside_probability(verdict, unlike_one_force, further_log_odds)
    kind = "unknown" if probability > LIKELY else verdict.verdict
    return verdict.model_copy(update={"verdict": kind, "outside_probability": probability})


@cache
def _learned():
    """Content of outside.yaml."""
    import yaml

    return yaml.safe_load(files("rotorstudy.diagnosis.verdict").joinpath("outside.yaml").read_text(encoding="utf-8"))
