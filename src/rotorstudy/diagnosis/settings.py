"""The assumptions of a diagnosis: priors, model error and thresholds."""

from typing import Annotated

from annotated_types import Ge, Gt, Len, Lt
from pydantic import Field

from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_numbers import with_numbers


def stated_nuisance():
    """Effect -> standard deviation of its amplitude, for effects that are part of every measuring chain."""
    stated = {name: effect.nuisance for name, effect in registry().plugins["effect"].items()}
    return {name: std for name, std in stated.items() if std and std != "clearance"}


Inadequacy = Annotated[float, Ge(0), Lt(0.5)]


class Settings(Strict):
    """Assumptions of a diagnosis; docs/diagnosis.md explains every key."""

    uncertainty: dict[str, float] = {"default": 0.1}
    model_error: float = Field(default=2e-3, ge=0, lt=0.5)
    model_floor: float = Field(default=2e-4, ge=0, lt=0.5)
    covariance_error: float = Field(default=0.1, ge=0, lt=1)
    nuisance: dict[str, float] = Field(default_factory=stated_nuisance)
    base_rates: dict[str, Annotated[float, Gt(0)]] = {}
    at_discs: list[str] = []
    expected_place: float = Field(default=0.9, ge=0, lt=1)
    prior_width: float = Field(default=10.0, gt=0)
    repeatability: float = Field(default=5e-3, ge=0, lt=0.5)
    run_to_run: list[str] = []
    hold_out_rad_s: list[float] | None = None
    significance: float = Field(default=1e-3, gt=0, lt=0.5)
    naming_probability: float = Field(default=0.9, gt=0.5, lt=1)
    most_causes: int = Field(default=2, ge=1)
    candidates_per_round: int = Field(default=10, ge=1)
    leave_out: list[str] = []
    form_error: float = Field(default=0.05, gt=0, lt=0.5)
    # shares of nearly certain causes that are wrong, where one fault is named and where several are: of first causes by
    # five draws of `benchmarks/foreign.py --families forms` (seeds 7031 to 7035) 4 of 166 and 10 of 60
    model_inadequacy: Annotated[list[Inadequacy], Len(2, 2)] = [0.03, 0.15]


def base_rate(effect, settings):
    """How often an effect is a cause, relative to a usual one: as set by the user, or as its plugin states."""
    return settings.base_rates.get(effect, registry().get("effect", effect).base_rate)


def read_settings(rig, where):
    """The Settings in the section `diagnosis:` of a rig dict; RotorstudyError for unknown keys and bad values."""
    return check_config(Settings, rig.get("diagnosis") or {}, f"{where}, diagnosis")


GROUPS = {"default", "rotor", "bearings"}  # of uncertainties, that are no names of parameters


def check_names(settings, model, where):
    """Raise RotorstudyError unless every parameter and effect that the settings name exists."""
    model = with_numbers(model, settings.uncertainty, f"{where}.uncertainty")
    known = {*GROUPS}
    for term in model.terms:
        known |= {name for p in term.parameters for name in (p.name, term.full_name(p))}
    check_known("parameter", settings.uncertainty, known, f"{where}.uncertainty")
    for name, share in settings.uncertainty.items():
        if share < 0:
            raise RotorstudyError(
                f"uncertainty of {name} = {share:g} in {where}: must not be negative; 0 holds it fixed"
            )
    for name, std in settings.nuisance.items():
        if not registry().get("effect", name, f"{where}.nuisance").acts_on_output:
            raise RotorstudyError(f"nuisance '{name}' in {where}: must be an effect of the measuring chain")
        if not std > 0:
            raise RotorstudyError(f"nuisance {name} = {std:g} in {where}: must be positive; leave it out to have none")
    check_known("parameter", settings.run_to_run, known - GROUPS, f"{where}.run_to_run")
    for key in ("leave_out", "base_rates", "at_discs"):
        for name in getattr(settings, key):
            registry().get("effect", name, f"{where}.{key}")
