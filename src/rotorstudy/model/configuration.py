"""Configuration files: classes that reject unknown keys, and one-line errors."""

from pydantic import BaseModel, ConfigDict, ValidationError

from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.model.options import named_keys, validation_message


class Strict(BaseModel):
    """A section of a configuration file; unknown keys and values of another type are errors."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


def check_config(config_class, given, where):
    """A pydantic configuration from a dict; unknown or missing keys and invalid values are one-line errors."""
    for key in given:
        if key not in config_class.model_fields:
            raise unknown_name("key", key, config_class.model_fields, where)
    try:
        return config_class(**given)
    except ValidationError as error:
        raise RotorstudyError(validation_message(error, where, lambda loc: named_keys(config_class, loc))) from None
