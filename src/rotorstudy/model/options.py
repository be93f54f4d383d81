"""Check the options of a configuration against the annotated arguments of a plugin function."""

from contextlib import suppress
from difflib import get_close_matches
from functools import lru_cache
from math import isfinite
from typing import Annotated, Literal, TypeVar, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MinLen, MultipleOf
from typing_extensions import TypedDict as TypedDict  # for plugins: pydantic takes no other before Python 3.12
from typing_extensions import is_typeddict

from rotorstudy.errors import RotorstudyError, check_known, unknown_name
from rotorstudy.yaml_file import LARGEST_WHOLE

Positive = Annotated[float, Gt(0)]
NonNegative = Annotated[float, Ge(0)]
Fraction = Annotated[float, Gt(0), Lt(1)]
PoissonsRatio = Annotated[float, Ge(0), Le(0.5)]
DepthRatio = Annotated[float, Gt(0), Le(0.5)]
Share = Annotated[float, Ge(0), Le(1)]
Whole = Annotated[int, Ge(1), Le(1000)]
Even = Annotated[int, Ge(2), Le(1000), MultipleOf(2)]
TYPES = ("int", "float", "str", "bool")  # of several that a value may have, said by pydantic beside the keys
AtLeastOne = Annotated[list[TypeVar("Item")], MinLen(1)]


def plain(given):
    """Options with numbers and lists of Python for those of numpy; a whole number that no file may have is refused."""
    if isinstance(given, int) and abs(given) > LARGEST_WHOLE:
        raise RotorstudyError(f"whole number beyond {LARGEST_WHOLE:.0e}")
    if isinstance(given, dict):
        return {plain(key): plain(value) for key, value in given.items()}
    if isinstance(given, (list, tuple)):
        return [plain(value) for value in given]
    return given.tolist() if hasattr(given, "tolist") else given


def option_names(function, given_by_engine=()):
    """Names of the options of a plugin function."""
    return [name for name in _arguments(function) if name not in given_by_engine]


@lru_cache(maxsize=1024)
def _arguments(function):
    """{name: inspect.Parameter} of a function."""
    import inspect

    return dict(inspect.signature(function).parameters)


def annotations(function):
    """{name: type} of the arguments of a plugin function."""
    return {name: argument.annotation for name, argument in _arguments(function).items()}


def choices(function):
    """{option: its possible values} of the options of a plugin function that take one of several."""
    return {name: get_args(one) for name, one in annotations(function).items() if get_origin(one) is Literal}


def check_options(functions, given, where, given_by_engine=(), left=()):
    """Validated options of one function or several; an error may name a key of `left` as a missing option misspelt."""
    functions = functions if isinstance(functions, tuple) else (functions,)
    return dict(check_config(_options_model(functions, tuple(given_by_engine)), given, where, left))


def check_config(model, given, where, left=()):
    """An instance of a pydantic model from a dict; unknown or missing keys and invalid values are one-line errors."""
    from pydantic import ValidationError

    if not isinstance(given, dict):
        raise RotorstudyError(f"{where}: expected keys and values, found {type(given).__name__}")
    check_known("key", given, model.model_fields, where)
    try:
        return model(**given)
    except ValidationError as error:
        message = validation_message(error, where, model)
        lacks = [name for name in model.model_fields if name not in given and name in message]
        hint = [f"; '{one}' is none of its keys" for name in lacks for one in get_close_matches(name, left, n=1)]
        raise RotorstudyError(message + "".join(hint)) from None


@lru_cache(maxsize=1024)
def _options_model(functions, given_by_engine):
    """The pydantic model of the options of functions, which checks them."""
    from pydantic import ConfigDict, create_model

    fields = {}
    for name, argument in (one for function in functions for one in _arguments(function).items()):
        if name not in given_by_engine:
            annotation = float if argument.annotation is argument.empty else argument.annotation
            fields[name] = (annotation, ... if argument.default is argument.empty else argument.default)
    return create_model("Options", __config__=ConfigDict(extra="forbid", strict=True, allow_inf_nan=False), **fields)


def named_keys(annotation, loc=()):
    """Keys of the TypedDict or class at a place (keys and list positions) of a type; empty if there is none."""
    fields = annotation.__annotations__ if is_typeddict(annotation) else None
    if fields is None and hasattr(annotation, "model_fields"):
        fields = {name: field.annotation for name, field in annotation.model_fields.items()}
    if fields is None:  # a list, a dict with names of its own, or one of several types
        parts = get_args(annotation)
        deeper = loc[1:] if get_origin(annotation) in (list, dict, tuple) else loc
        return next(filter(None, (named_keys(part, deeper) for part in parts)), [])
    return list(fields) if len(loc) < 2 else named_keys(fields.get(loc[0]), loc[1:])


def validation_message(error, where, model):
    """A pydantic error of a model in one line: key, value, what is allowed."""
    messages = []
    for problem in error.errors():
        loc = [part for part in problem["loc"] if part not in TYPES and "[" not in str(part)]
        path = [f"[{part}]" if isinstance(part, int) else f".{part}" for part in loc]
        first = max((i for i, part in enumerate(loc) if i and isinstance(loc[i - 1], int)), default=0)
        key, inside = "".join(path[first:]).removeprefix("."), "".join(path[:first])  # as in rig.yaml, probes[0]
        place = where + (inside if ", " in where else inside.replace(".", ", ", 1))
        if problem["type"] == "missing":
            messages.append(f"key '{key}' is missing in {place}")
        elif problem["type"] == "extra_forbidden":
            known = [key.removesuffix(loc[-1]) + name for name in named_keys(model, loc)]
            messages.append(str(unknown_name("key", key, known, place)) if known else f"unknown key '{key}' in {place}")
        elif problem["type"] == "invalid_key":
            messages.append(
                f"{place}: {loc[-1]!r} is no key; a number is written with a decimal point, 0.35 and not 0,35"
            )
        else:
            said = problem["msg"].removeprefix("Value error, ").replace(" after validation", "")
            said = said[0].lower() + said[1:]
            messages.append(f"{key} = {problem['input']!r} in {place}: {said}{number_hint(problem['input'])}")
    return "; ".join(messages)


def number_hint(value):
    """What to do about a number that a YAML file gives as text, or an empty string."""
    if not isinstance(value, str):
        return ""
    for text, hint in ((value, "write it without quotes"), (value.replace(",", "."), "write it with a decimal point")):
        with suppress(ValueError):
            if isfinite(float(text)):  # YAML reads nan as a text
                return f" ({hint})"
    return ""
