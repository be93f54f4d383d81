"""The numbers among the options of a plugin, named by their path: `radial_clearance_m`, `discs[0].mass_kg`."""

import re


def number_paths(options: object, path: str = "") -> list[str]:
    """Paths of the numbers other than zero among options; whole ones are counts and nodes.

    options : as a plugin takes them
    path    : of the options themselves
    """
    if isinstance(options, dict):
        inside = [(f"{path}.{key}" if path else key, value) for key, value in options.items()]
    elif isinstance(options, (list, tuple)):
        inside = [(f"{path}[{i}]", value) for i, value in enumerate(options)]
    else:
        return [path] if isinstance(options, float) and options else []
    return [found for here, value in inside for found in number_paths(value, here)]


def path_pattern(name: str) -> re.Pattern:
    """Pattern of the paths meant by a name: that of a number, or of what holds several, at any depth."""
    keys = (re.escape(key) if key.endswith("]") else re.escape(key) + r"(\[\d+\])?" for key in name.split("."))
    return re.compile(r"(.*\.)?" + r"\.".join(keys) + r"(\..*)?")


def scaled(options: object, pattern: re.Pattern, factor: float, path: str = "") -> object:
    """The options with the numbers whose path matches a pattern multiplied by a factor.

    path : of the options themselves
    """
    if isinstance(options, dict):
        return {k: scaled(v, pattern, factor, f"{path}.{k}" if path else k) for k, v in options.items()}
    if isinstance(options, (list, tuple)):
        return [scaled(value, pattern, factor, f"{path}[{i}]") for i, value in enumerate(options)]
    return options * factor if isinstance(options, float) and pattern.fullmatch(path) else options
