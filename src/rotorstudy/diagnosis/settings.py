"""What a diagnosis assumes, stated: priors, model error, and how sure is sure."""

from pydantic import Field

from rotorstudy.model.configuration import Strict
from rotorstudy.model.registry import registry


def stated_nuisance():
    """Effect -> standard deviation of its amplitude, of those that say they are in every measuring chain."""
    return {name: effect.nuisance for name, effect in registry().plugins["effect"].items() if effect.nuisance}


class Settings(Strict):
    """Assumptions of a diagnosis.

    uncertainty     : of base parameters, standard deviation relative to their value, by name; "default" for the others
    model_error     : share of each harmonic that the model is not trusted to hit (a coarse mesh, a short series)
    model_floor     : the same as a share of the rms vibration at a sensor and a speed: what is nearly zero is not known
                      to a share of itself
    covariance_error : share by which the stated variances may be too small: they come from a few blocks of a record
    nuisance        : effects of the measuring chain that are never quite zero -> standard deviation of each amplitude
    prior_width: standard deviation of the amplitude of a cause before anything is measured, in its typical sizes
    hold_out_rad_s  : speeds that no fit sees; None: about a quarter of them, from the middle
    significance    : chance of a residual this large by noise alone, below which something is missing
    naming_probability: confidence from which a cause is named alone
    most_causes     : at once
    candidates_per_round: candidates fitted fully a round
    leave_out       : effects that are not considered
    """

    uncertainty: dict[str, float] = {"default": 0.1}
    model_error: float = Field(default=2e-3, ge=0, lt=0.5)
    model_floor: float = Field(default=2e-4, ge=0, lt=0.5)
    covariance_error: float = Field(default=0.1, ge=0, lt=1)
    nuisance: dict[str, float] = Field(default_factory=stated_nuisance)
    prior_width: float = Field(default=10.0, gt=0)
    hold_out_rad_s: list[float] | None = None
    significance: float = Field(default=1e-3, gt=0, lt=0.5)
    naming_probability: float = Field(default=0.9, gt=0.5, lt=1)
    most_causes: int = Field(default=2, ge=1)
    candidates_per_round: int = Field(default=10, ge=1)
    leave_out: list[str] = []
