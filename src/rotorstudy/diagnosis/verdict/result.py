"""The result of a diagnosis as data: the content of verdict.json, from which pages, texts and figures are made.

Values are in SI; `std` is one standard deviation.
"""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict

from rotorstudy.diagnosis.settings import Settings
from rotorstudy.measurement.findings import Finding

FORMAT_VERSION = 3  # of verdict.json and verdict.nc
ACTS_BY = {"force": "a force", "moment": "a moment", "bending": "bending moments"}  # such a fault


class Result(BaseModel):
    """Frozen data; numbers that are not finite become null in JSON."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def _without_numpy(where):
    return {key: value.item() if isinstance(value, np.generic) else value for key, value in where.items()}


class Place(Result):
    """An effect of the library at a place.

    where : options of the place, like {"node": 2}, lists for several parts
    label : what the rig calls the disc or bearing there, or empty
    """

    effect: str
    where: Annotated[dict[str, Any], BeforeValidator(_without_numpy)]
    label: str = ""

    @classmethod
    def of(cls, effect, where, structure, **more):
        """That of an effect on a Structure; more : other fields."""
        return cls(effect=effect, where=where, label=structure.label_at(where), **more)


class ParameterEstimate(Result):
    """A parameter of a cause.

    part : an "amplitude", the "magnitude" or "phase" of a complex one, or an option of the "shape", which has its unit
           in its name and a standard deviation if it was fitted
    interval_95 : its ends, where they are not 1.96 standard deviations from the value
    """

    value: float | None
    std: float | None
    unit: str
    part: Literal["amplitude", "magnitude", "phase", "shape"]
    interval_95: tuple[float, float] | None = None


class Cause(Place):
    """A possible cause.

    parameters : by name, a complex amplitude `x` as `x` and `x_phase`; the shape is that over all its forms
    usual_form : its shape in the usual form, where it may have others; the extended rig has it
    variant    : which of its alternatives fits best, like {"crack": "breathing"}
    other_variants : those that the records do not exclude, most probable first
    """

    parameters: dict[str, ParameterEstimate]
    usual_form: dict[str, ParameterEstimate] = {}
    variant: dict[str, str] = {}
    other_variants: list[dict[str, str]] = []
    posterior_probability: float  # of this effect at this place, among all explanations that were fitted
    probability: float  # the same, less the share of such causes that are wrong (`Settings.model_inadequacy`)


class SeparatingMeasurement(Result):
    """A measurement that separates two causes, of which effect and place are given."""

    causes: tuple[Place, Place]
    measurement: str


class NextRun(Result):
    """A further run that would separate the causes.

    speed : rad/s;  trial : the disc with a trial unbalance, at the shaft's reference line, of `trial_unbalance`, kg m
    expected_log_odds : natural logarithm of the posterior odds of the true cause against its closest rival, on average,
                        where odds above 1000 count as 1000
    decision_probability : that only one cause remains
    """

    speed: float
    trial: Place | None = None
    trial_unbalance: float | None = None
    expected_log_odds: float
    decision_probability: float


class Excluded(Result):
    """Another effect that the records exclude, by the most probable explanation with it.

    log_odds : natural logarithm of the posterior odds of the verdict against it
    harmonic, node, sigma : where it leaves most beyond what the verdict leaves, and the rms residual there in standard
                            deviations; None if it leaves hardly more, but needs values that are less probable
    """

    cause: Place
    log_odds: float
    harmonic: int | None
    node: int | None
    sigma: float | None


class Unexplained(Result):
    """A harmonic at a node with a significant residual; share : of the mean square, sigma : rms residual."""

    harmonic: int
    node: int
    share: float
    sigma: float


class OnePlace(Result):
    """A place at which one force, free at every speed and harmonic, explains the records whatever its cause.

    where : {"node": 4}, {"element": 3} or, on a foundation that moves, {"bearing": 4} or {"foundation": 4}
    motion : a force, a moment, or bending moments of an element
    p_value : of what it leaves
    """

    where: Annotated[dict[str, Any], BeforeValidator(_without_numpy)]
    motion: Literal["force", "moment", "bending"]
    p_value: float


class PValues(Result):
    """Probability of a residual this large by noise alone, of the base model and with the causes added."""

    before: float
    after: float


class ChainHypothesis(Result):
    """A convention that seems to be stated wrongly, because correcting it explains the records better than any cause.

    hypothesis, remedy : what the records look like, and what to state instead
    beside : cause on the rotor that the corrected records need as well, or None; the next diagnosis judges it
    log_odds : natural logarithm of its odds against the stated conventions without causes; the same of the best causes
    residual_p_value, residual_share : as in `Verdict`, after the correction
    """

    hypothesis: str
    remedy: str
    beside: Place | None = None
    log_odds: float
    log_odds_of_best_causes: float
    residual_p_value: PValues
    residual_share: float


class Resultant(Result):
    """What the unbalances of several discs are together, where the records do not tell how they are split.

    discs : Places;  weights : of each disc in the sum, the largest one 1
    size, angle : of the sum, kg m and rad;  std_of_each : standard deviation of each part of each disc alone, kg m
    """

    discs: tuple[Place, ...]
    weights: tuple[float, ...]
    size: ParameterEstimate
    angle: ParameterEstimate
    std_of_each: tuple[float, ...]


class Gain(Result):
    """Error (rms) at the held-out speeds (rad/s), in m and in standard deviations; ratio : of the errors in m.

    rise_probability : probability that the error in m rises by noise although the causes are right
    """

    speeds: tuple[float, ...]
    before_m: float
    after_m: float
    ratio: float
    before_sigma: float
    after_sigma: float
    rise_probability: float = 0.0


class DetectionLimit(Place):
    """The smallest amplitude of a parameter, in unit, that is detected with a probability of 95 %.

    part : of a complex parameter;  of_typical : ratio to the typical size that its plugin states
    """

    parameter: str
    part: Literal["amplitude", "real", "imaginary"]
    amplitude: float | None
    unit: str
    of_typical: float | None


class Hidden(Place):
    """A fault that operators fear: the size of a parameter, in unit, that is seen with a probability of 95 %.

    size : None if none is seen, with what to measure then
    """

    parameter: str
    size: float | None
    unit: str
    measure: str = ""


class MovedParameter(Result):
    """A parameter of the rig that the fit moved by more than two of its stated standard deviations (moved_sigma).

    name, unit : of the parameter;  stated, stated_std : in the rig;  value, std : as fitted
    """

    name: str
    unit: str
    stated: float
    stated_std: float
    value: float
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
    """The content of verdict.json, in the order of the file.

    verdict, summary : the kind of verdict; the same in sentences
    causes, ambiguous_with : the causes that are named; others that cannot be ruled out
    resultant : of unbalances of several discs that look alike in these records
    separating_measurement : for pairs of causes
    next_runs : up to three further runs that would decide an ambiguous verdict, the most decisive one first
    excluded : up to four other effects, the most probable first
    not_considered : effects that look like a named cause but are not tried: no candidates, or left out by the settings
    broken_plugins : a line for each plugin that failed, with file and line
    unexplained : harmonics and nodes with a significant residual
    residual_p_value, residual_share : of the residual; the share of the excess error (rms) that is left
    form_error : expected standard deviation of the error of the form of the causes, relative to what they change
    log_posterior_odds : natural logarithm of the odds of the best causes against the base alone, whether or not they
        are named; None if no cause was fitted
    parameter_p_value : probability under the prior that the parameters lie as far from their stated values as the fit
        needs, all together or the farthest one, times their number; below `significance` the fit is rejected
    one_place : of the verdict unknown, places at which a fault that the library lacks may act (99 %)
    outside_probability : of such a fault; above one half the verdict is unknown
    detection_limit, hidden : what is detected with a probability of 95 %: each effect, and each feared fault
    gain : at the held-out speeds; None if there are none
    base_parameters, identifiability : of the rig: those that moved far, and those that the data do not tell
    candidates : how many causes were considered
    settings, findings, provenance : what was assumed; the findings on the records; versions and files
    measuring_chain : the convention that seems to be stated wrongly, if any
    """

    format_version: Literal[3] = FORMAT_VERSION
    verdict: Literal["nothing", "cause", "ambiguous", "unknown"]
    summary: str = ""
    causes: tuple[Cause, ...]
    ambiguous_with: tuple[Cause, ...]
    resultant: Resultant | None = None
    separating_measurement: tuple[SeparatingMeasurement, ...]
    next_runs: tuple[NextRun, ...] = ()
    excluded: tuple[Excluded, ...] = ()
    not_considered: tuple[str, ...]
    broken_plugins: tuple[str, ...]
    unexplained: tuple[Unexplained, ...]
    residual_p_value: PValues
    residual_share: float
    form_error: float
    log_posterior_odds: float | None
    parameter_p_value: float
    one_place: tuple[OnePlace, ...] = ()
    outside_probability: float = 0.0
    detection_limit: tuple[DetectionLimit, ...]
    hidden: tuple[Hidden, ...] = ()
    gain: Gain | None
    base_parameters: tuple[MovedParameter, ...]
    identifiability: Identifiability
    candidates: int
    settings: Settings
    measuring_chain: ChainHypothesis | None = None
    findings: tuple[Finding, ...] = ()
    provenance: dict[str, str] = {}
