"""The result of a diagnosis as data: the content of verdict.json, from which pages, texts and figures are made.

Values are in SI; `std` is one standard deviation.
"""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict

from rotorstudy.diagnosis.settings import Settings
from rotorstudy.measurement.findings import Finding

FORMAT_VERSION = 3  # of verdict.json and verdict.nc


class Result(BaseModel):
    """Frozen data; numbers that are not finite become null in JSON."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def _without_numpy(where):
    return {key: value.item() if isinstance(value, np.generic) else value for key, value in where.items()}


class Place(Result):
    """An effect of the library at a place."""

    effect: str
    where: Annotated[dict[str, Any], BeforeValidator(_without_numpy)]  # like {"node": 2}; lists for several parts
    label: str = ""  # what the rig calls the disc or bearing there

    @classmethod
    def of(cls, effect, where, structure, **more):
        """That of an effect on a Structure; more : other fields."""
        return cls(effect=effect, where=where, label=structure.label_at(where), **more)


class ParameterEstimate(Result):
    """A parameter of a cause."""

    value: float | None
    std: float | None  # of an option of the shape if it was fitted
    unit: str  # of an option of the shape it is in its name
    part: Literal["amplitude", "magnitude", "phase", "shape"]  # magnitude and phase of a complex one; option of a shape
    interval_95: tuple[float, float] | None = None  # its ends, where they are not 1.96 standard deviations away


class Cause(Place):
    """A possible cause."""

    parameters: dict[str, ParameterEstimate]  # a complex amplitude `x` as `x` and `x_phase`; the shape over all forms
    usual_form: dict[str, ParameterEstimate] = {}  # its shape in the usual form, if it has others; in the extended rig
    variant: dict[str, str] = {}  # which of its alternatives fits best, like {"crack": "breathing"}
    other_variants: list[dict[str, str]] = []  # those that the records do not exclude, most probable first
    posterior_probability: float  # of this effect at this place, among all explanations that were fitted
    probability: float  # the same, less the share of such causes that are wrong (`Settings.model_inadequacy`)


class SeparatingMeasurement(Result):
    """A measurement that separates two causes, of which effect and place are given."""

    causes: tuple[Place, Place]
    measurement: str


class NextRun(Result):
    """A further run that would separate the causes."""

    speed: float  # rad/s
    trial: Place | None = None  # the disc with a trial unbalance, at the shaft's reference line
    trial_unbalance: float | None = None  # kg m
    expected_log_odds: float  # of the true cause against its closest rival, natural logarithm; odds count up to 1000
    decision_probability: float  # that only one cause remains


class Excluded(Result):
    """Another effect that the records exclude, by the most probable explanation with it.

    Where it leaves most beyond what the verdict leaves; None if it leaves hardly more, but needs less probable values.
    """

    cause: Place
    log_odds: float  # natural logarithm of the posterior odds of the verdict against it
    harmonic: int | None = None
    node: int | None = None
    sigma: float | None = None  # rms residual there, in standard deviations


class Unexplained(Result):
    """A harmonic at a node with a significant residual."""

    harmonic: int
    node: int
    share: float  # of the mean square
    sigma: float  # rms residual


class OnePlace(Result):
    """A place at which one force, free at every speed and harmonic, explains the records whatever its cause."""

    where: Annotated[dict[str, Any], BeforeValidator(_without_numpy)]  # a node, an element, a bearing or a foundation
    motion: Literal["force", "moment", "bending"]  # bending moments of an element
    p_value: float  # of what it leaves


class PValues(Result):
    """Probability of a residual this large by noise alone, of the base model and with the causes added."""

    before: float
    after: float


class ChainHypothesis(Result):
    """A convention that seems to be stated wrongly: correcting it explains the records better than any cause."""

    hypothesis: str  # what the records look like
    remedy: str  # what to state instead
    beside: Place | None = None  # cause that the corrected records need as well; the next diagnosis judges it
    log_odds: float  # natural logarithm of its odds against the stated conventions without causes
    log_odds_of_best_causes: float  # the same of these
    residual_p_value: PValues  # after the correction, as in `Verdict`
    residual_share: float


class Resultant(Result):
    """What the unbalances of several discs are together, where the records do not tell how they are split."""

    discs: tuple[Place, ...]
    weights: tuple[float, ...]  # of each disc in the sum, the largest one 1
    size: ParameterEstimate  # of the sum, kg m
    angle: ParameterEstimate  # rad
    std_of_each: tuple[float, ...]  # of each part of the unbalance of each disc alone, kg m


class Gain(Result):
    """Error (rms) at the held-out speeds, in m and in standard deviations."""

    speeds: tuple[float, ...]  # rad/s
    before_m: float
    after_m: float
    ratio: float  # of the errors in m
    before_sigma: float
    after_sigma: float
    rise_probability: float = 0.0  # that the error in m rises by noise although the causes are right


class DetectionLimit(Place):
    """The smallest amplitude of a parameter that is detected with a probability of 95 %."""

    parameter: str
    part: Literal["amplitude", "real", "imaginary"]  # of a complex parameter
    amplitude: float | None  # in unit
    unit: str
    of_typical: float | None  # ratio to the typical size that its plugin states


class Hidden(Place):
    """A fault that operators fear: the size of a parameter that is seen with a probability of 95 %."""

    parameter: str
    size: float | None  # in unit; None if none is seen
    unit: str
    measure: str = ""  # what to measure then


class MovedParameter(Result):
    """A parameter of the rig that the fit moved by more than two of its stated standard deviations."""

    name: str
    unit: str
    stated: float  # in the rig
    stated_std: float
    value: float  # as fitted
    std: float | None
    moved_sigma: float


class Tradeoff(Result):
    """A pair of parameters that the data can hardly separate, with their correlation."""

    pair: tuple[str, str]
    correlation: float


class Identifiability(Result):
    """Parameters that the data do not determine (dead, or known by the prior alone), or only in combination."""

    dead: tuple[str, ...]
    known_by_prior_alone: tuple[str, ...]
    traded_off: tuple[Tradeoff, ...]


class Verdict(Result):
    """The content of verdict.json, in the order of the file."""

    format_version: Literal[3] = FORMAT_VERSION
    verdict: Literal["nothing", "cause", "ambiguous", "unknown"]  # the kind of verdict
    summary: str = ""  # the same in sentences
    causes: tuple[Cause, ...]  # that are named
    ambiguous_with: tuple[Cause, ...]  # others that cannot be ruled out
    resultant: Resultant | None = None  # of unbalances of several discs that look alike in these records
    separating_measurement: tuple[SeparatingMeasurement, ...]  # for pairs of causes
    # up to three further runs that would decide an ambiguous verdict, the most decisive one first
    next_runs: tuple[NextRun, ...] = ()
    excluded: tuple[Excluded, ...] = ()  # up to four other effects, the most probable first
    # effects that look like a named cause but are not tried: no candidates, or left out by the settings
    not_considered: tuple[str, ...]
    broken_plugins: tuple[str, ...]  # a line for each plugin that failed, with file and line
    unexplained: tuple[Unexplained, ...]  # harmonics and nodes with a significant residual
    residual_p_value: PValues  # of the residual
    residual_share: float  # the share of the excess error (rms) that is left
    # expected standard deviation of the error of the form of the causes, relative to what they change
    form_error: float
    # natural logarithm of the odds of the best causes against the base alone, whether or not they are named; None if no
    # cause was fitted
    log_posterior_odds: float | None
    # probability under the prior that the parameters lie as far from their stated values as the fit needs, all together
    # or the farthest one, times their number; below `significance` the fit is rejected
    parameter_p_value: float
    # of the verdict unknown, places at which a fault that the library lacks may act (99 %)
    one_place: tuple[OnePlace, ...] = ()
    outside_probability: float = 0.0  # of such a fault; above one half the verdict is unknown
    detection_limit: tuple[DetectionLimit, ...]  # what is detected with a probability of 95 % of each effect
    hidden: tuple[Hidden, ...] = ()  # likewise of each feared fault
    gain: Gain | None  # at the held-out speeds; None if there are none
    base_parameters: tuple[MovedParameter, ...]  # of the rig, those that moved far
    identifiability: Identifiability  # of the rig, what the data do not tell
    candidates: int  # how many causes were considered
    settings: Settings  # what was assumed
    measuring_chain: ChainHypothesis | None = None  # the convention that seems to be stated wrongly, if any
    findings: tuple[Finding, ...] = ()  # on the records
    provenance: dict[str, str] = {}  # versions and files
