"""Sections of configuration files, which reject unknown keys."""

from pydantic import BaseModel, ConfigDict

from rotorstudy.model.options import check_config as check_config


class Strict(BaseModel):
    """A section of a configuration file; unknown keys and values of another type are errors."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)
