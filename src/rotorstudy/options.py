"""Options of a plugin are the annotated arguments of its function; here they are checked against a configuration."""

from functools import lru_cache
from typing import Annotated, TypeVar, get_args

from annotated_types import Ge, Gt, Le, Lt, MinLen, MultipleOf
from typing_extensions import TypedDict as TypedDict  # for plugins: pydantic takes no other before Python 3.12
from typing_extensions import is_typeddict

from rotorstudy.errors import RotorstudyError, unknown_name

Positive = Annotated[float, Gt(0)]
NonNegative = Annotated[float, Ge(0)]
Fraction = Annotated[float, Gt(0), Lt(1)]
PoissonsRatio = Annotated[float, Ge(0), Le(0.5)]
DepthRatio = Annotated[float, Gt(0), Le(0.5)]
Share = Annotated[float, Ge(0), Le(1)]
Whole = Annotated[int, Ge(1)]
Even = Annotated[int, Ge(2), MultipleOf(2)]
AtLeastOne = Annotated[list[TypeVar("Item")], MinLen(1)]


def option_names(function, given_by_engine=()):
    """Names of the options of a plugin function."""
    import inspect

    return [name for name in inspect.signature(function).parameters if name not in given_by_engine]


def check_options(function, given, where, given_by_engine=()):
    """Options as the function wants them, or an error naming key, value, place and what is allowed."""
    from pydantic import ValidationError

    fields, model = _options_model(function, tuple(given_by_engine))
    for key in given:
        if key not in fields:
            raise unknown_name("key", key, fields, where)
    try:
        return dict(model(**given))
    except ValidationError as error:
        nested = {name: _named_keys(annotation) for name, (annotation, _) in fields.items()}
        raise RotorstudyError(validation_message(error, where, nested)) from None


@lru_cache(maxsize=1024)
def _options_model(function, given_by_engine):
    """Fields (annotation, default) of a plugin's options, and the pydantic model that checks them."""
    import inspect

    from pydantic import ConfigDict, create_model

    fields = {}
    for name, parameter in inspect.signature(function).parameters.items():
        if name not in given_by_engine:
            annotation = float if parameter.annotation is parameter.empty else parameter.annotation
            fields[name] = (annotation, ... if parameter.default is parameter.empty else parameter.default)
    return fields, create_model(
        "Options", __config__=ConfigDict(extra="forbid", strict=True, allow_inf_nan=False), **fields
    )


def _named_keys(annotation):
    """Keys of the TypedDict inside an annotation; empty if there is none."""
    if is_typeddict(annotation):
        return list(annotation.__annotations__)
    return next(filter(None, map(_named_keys, get_args(annotation))), [])


def validation_message(error, where, nested=None):
    """One line out of a pydantic error: key, value, what is allowed; nested: option -> keys of the dicts in it."""
    messages = []
    for problem in error.errors():
        key = ".".join(str(part) for part in problem["loc"])
        if problem["type"] == "missing":
            messages.append(f"key '{key}' is missing in {where}")
        elif problem["type"] == "extra_forbidden":
            place = key.removesuffix(str(problem["loc"][-1]))
            known = [place + name for name in (nested or {}).get(problem["loc"][0], ())]
            messages.append(str(unknown_name("key", key, known, where)) if known else f"unknown key '{key}' in {where}")
        else:
            said = problem["msg"][0].lower() + problem["msg"][1:]
            messages.append(f"{key} = {problem['input']!r} in {where}: {said}{number_hint(problem['input'])}")
    return "; ".join(messages)


def number_hint(value):
    """Why a number in a YAML file may have arrived as text, or an empty string."""
    try:
        float(value)
    except (TypeError, ValueError):
        return ""
    if not isinstance(value, str):
        return ""
    return " (YAML wants a sign in the exponent: 2.5e+5)" if "e" in value.lower() else " (write it without quotes)"
