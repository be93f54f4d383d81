"""Configuration of the blind tests."""

from typing import Annotated

from pydantic import Field, model_validator

from rotorstudy.blind.machines.draw import MACHINES
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.response.coupling import check_harmonics
from rotorstudy.yaml_file import read_yaml

KINDS = ("clean", "single", "form", "two", "chain", "outside")
Share = Annotated[float, Field(ge=0, le=1)]
PositiveNumber = Annotated[float, Field(gt=0)]
ENDS = Field(min_length=2, max_length=2)  # of a range


class BlindConfig(Strict):
    """Settings of the blind tests."""

    title: str
    cases: int = Field(ge=1)
    seed: int = Field(ge=0)
    shares: dict[str, Share]  # of KINDS, sum 1; `form`: of another form than the library's, `outside`: not in it
    machines: dict[str, Share]
    elements: Annotated[list[int], ENDS]
    speeds: Annotated[list[int], ENDS]
    harmonics: list[int]
    size: Annotated[list[PositiveNumber], ENDS]  # of effects, in standard deviations of what the rig cannot absorb
    rig_error: float = Field(ge=0, le=10)  # over the usual (modulus 0.5 %, bearings 2 %, unbalance 5 %), as stated
    records: int = Field(ge=0)  # number of cases whose records are kept as NetCDF

    @model_validator(mode="after")
    def _sensible(self):
        if set(self.shares) != set(KINDS) or abs(sum(self.shares.values()) - 1) > 1e-9:
            raise ValueError(f"shares must name {', '.join(KINDS)} and sum to 1")
        if not set(self.machines) <= set(MACHINES) or abs(sum(self.machines.values()) - 1) > 1e-9:
            raise ValueError(f"machines must be of {', '.join(MACHINES)} and sum to 1")
        for name, least in (("elements", 2), ("speeds", 3), ("size", 0)):
            low, high = getattr(self, name)
            if not least <= low <= high:
                raise ValueError(f"{name} = {low:g} to {high:g}: must begin at {least} or more and not fall")
        return self


def load_blind(path):
    """A BlindConfig from a YAML file; a mistake raises a one-line RotorstudyError."""
    config = check_config(BlindConfig, read_yaml(path), str(path))
    check_harmonics(config.harmonics)
    return config
