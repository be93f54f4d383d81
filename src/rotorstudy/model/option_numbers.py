"""The numbers of a rig among the options of its rotor and bearings, named by their path.

`rotor.discs[0].mass_kg` is that of the first disc. `bearings[left].radial_clearance_m` is that of the bearing labelled
"left"; one without a label is named by its place in the list, from 0. A path that fits several numbers scales them
together: `rotor.outer_diameter_m` every outer diameter, `rotor.discs` masses and moments of all discs,
`bearings.viscosity_Pa_s` the viscosity of all bearings that have one.
"""

import re
from dataclasses import dataclass
from functools import cached_property, lru_cache

NAME = re.compile(r"(?P<section>rotor|bearings)(\[(?P<which>[^\]]*)\])?\.(?P<path>.+)")


def is_number(name: str) -> bool:
    """Whether the name of a parameter is that of a number of the rotor or of its bearings."""
    return NAME.fullmatch(name) is not None


def is_of(section: str, name: str) -> bool:
    """Whether it is that of a number of the section `rotor` or `bearings`."""
    return is_number(name) and NAME.fullmatch(name)["section"] == section


def number_paths(options: object, path: str = "") -> list[str]:
    """Paths of the numbers other than zero among options of a plugin; whole ones are counts and nodes."""
    if isinstance(options, dict):
        inside = [(f"{path}.{key}" if path else key, value) for key, value in options.items()]
    elif isinstance(options, (list, tuple)):
        inside = [(f"{path}[{i}]", value) for i, value in enumerate(options)]
    else:
        return [path] if isinstance(options, float) and options else []
    return [found for here, value in inside for found in number_paths(value, here)]


@lru_cache(maxsize=1024)
def path_pattern(name: str) -> re.Pattern:
    """Pattern of the paths meant by a name: that of a number, or of what holds several, at any depth."""
    keys = (re.escape(key) if key.endswith("]") else re.escape(key) + r"(\[\d+\])?" for key in name.split("."))
    return re.compile(r"(.*\.)?" + r"\.".join(keys) + r"(\..*)?")


def scaled(options: object, pattern: re.Pattern, factor: float, path: str = "") -> object:
    """The options with the numbers whose path matches a pattern multiplied by a factor."""
    if isinstance(options, dict):
        return {k: scaled(v, pattern, factor, f"{path}.{k}" if path else k) for k, v in options.items()}
    if isinstance(options, (list, tuple)):
        return [scaled(value, pattern, factor, f"{path}[{i}]") for i, value in enumerate(options)]
    return options * factor if isinstance(options, float) and pattern.fullmatch(path) else options


@dataclass(frozen=True, eq=False)
class Holder:
    """What has numbers: the rotor (`which` is empty), or a bearing by its label, else its place in the list.

    options : of its plugin, in SI;  uncertain : path -> relative standard deviation, as the plugin states
    """

    section: str
    which: str
    options: dict
    uncertain: dict

    @cached_property
    def paths(self) -> list[str]:
        """Of all its numbers."""
        return number_paths(self.options)

    def name(self, path: str) -> str:
        """The name of its number at a path."""
        return f"{self.section}[{self.which}].{path}" if self.which else f"{self.section}.{path}"

    def pattern(self, name: str) -> re.Pattern | None:
        """Pattern of the paths of its numbers that a name means; None if nothing matches."""
        section, which, path = NAME.fullmatch(name).group("section", "which", "path")
        if section != self.section or which not in (None, self.which):
            return None
        return path_pattern(path) if any(map(path_pattern(path).fullmatch, self.paths)) else None

    def meant(self, names) -> list[str]:
        """The names, of numbers, that mean numbers of it."""
        return [name for name in names if self.pattern(name)]

    def changed(self, changes: dict[str, float]) -> dict:
        """Its options with some of its numbers changed; changes : name -> relative change."""
        options = self.options
        for name in self.meant(name for name, change in changes.items() if change):
            options = scaled(options, self.pattern(name), float(1 + changes[name]))
        return options
