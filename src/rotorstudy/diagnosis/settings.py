"""What a diagnosis assumes, stated: priors, model error, and from which probability on a cause is named."""

from pydantic import Field

from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.registry import registry


def stated_nuisance():
    """Effect -> standard deviation of its amplitude, of those that say they are in every measuring chain."""
    return {name: effect.nuisance for name, effect in registry().plugins["effect"].items() if effect.nuisance}


class Settings(Strict):
    """Assumptions of a diagnosis.

    uncertainty          : of base parameters, standard deviation relative to their value, by name; "default" for the
                           others
    model_error          : share of each harmonic within which the model is trusted (a coarse mesh, a short series)
    model_floor          : the same as a share of the rms vibration at a sensor and a speed: a harmonic that is nearly
                           zero is not known to a share of itself
    covariance_error     : share by which the stated variances may be too small: they come from a few blocks of a record
    nuisance             : effects of the measuring chain, never quite zero -> standard deviation of each amplitude
    prior_width          : standard deviation of the amplitude of a cause before anything is measured, in typical sizes
    hold_out_rad_s       : speeds held out of every fit; None: about a quarter of them, from the middle
    significance         : p-value of the residual below which something is missing
    naming_probability   : posterior probability from which a cause is named alone
    most_causes          : at once
    candidates_per_round : candidates fitted fully a round
    leave_out            : effects that are not considered
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


def read_settings(rig, where):
    """The Settings in the section `diagnosis:` of a rig dict; unknown keys are errors with the near miss."""
    given = rig.get("diagnosis") or {}
    if not isinstance(given, dict):
        raise RotorstudyError(f"{where}, diagnosis: expected keys and values, found {type(given).__name__}")
    return check_config(Settings, given, f"{where}, diagnosis")


def check_names(settings, model, where):
    """Every name the settings use exists; an unknown one is an error with the near miss."""
    known = {"default"}
    for term in model.terms:
        known |= {name for p in term.parameters for name in (p.name, term.full_name(p))}
    for name, share in settings.uncertainty.items():
        if name not in known:
            raise unknown_name("parameter", name, known, f"{where}.uncertainty")
        if share < 0:
            raise RotorstudyError(f"uncertainty of {name} = {share:g} in {where}: must not be negative; 0 holds it")
    for name, std in settings.nuisance.items():
        if not registry().get("effect", name, f"{where}.nuisance").acts_on_output:
            raise RotorstudyError(f"nuisance '{name}' in {where}: must be an effect of the measuring chain")
        if not std > 0:
            raise RotorstudyError(f"nuisance {name} = {std:g} in {where}: must be positive; leave it out to have none")
    for name in settings.leave_out:
        registry().get("effect", name, f"{where}.leave_out")
