"""Checks of what plugins of a rig give: its structure, and the parameters of its terms."""

import numpy as np

from rotorstudy.errors import PluginError
from rotorstudy.model.entries import Entry
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import Parameter


def check_structure(structure, plugin, where):
    """Raise PluginError unless a rotor plugin returned a Structure whose matrices fit its coordinates."""
    who = f"rotor '{plugin.name}' ({plugin.file}) in {where}"
    if not isinstance(structure, Structure):
        raise PluginError(f"{who} gives {type(structure).__name__}; it must give a Structure, see rotorstudy.plugins")
    size = len(structure.dofs)
    for name in ("mass", "stiffness", "gyroscopic", "static_load"):
        matrix, needed = getattr(structure, name), (size,) if name == "static_load" else (size, size)
        if np.shape(matrix) != needed:
            raise PluginError(
                f"{who} gives {name} of shape {np.shape(matrix)}; it must be {needed} for its {size} coordinates"
            )
        if not np.isfinite(matrix).all():
            raise PluginError(f"{who} gives {name} with NaN or infinite values")


def check_parameters(found, plugin, where):
    """The parameters returned by a plugin as a tuple, or PluginError unless each is a Parameter with entries."""
    found = [found] if isinstance(found, Parameter) else found
    who = f"plugin '{plugin.name}' ({plugin.file}) in {where}"
    if not isinstance(found, (list, tuple)) or not all(isinstance(one, Parameter) for one in found):
        inside = f" of {type(found[0]).__name__}" if isinstance(found, (list, tuple)) and found else ""
        raise PluginError(f"{who} gives {type(found).__name__}{inside}; it must give a list of Parameter")
    for parameter in found:
        if not parameter.unit:
            raise PluginError(f"{who}: '{parameter.name}' has no unit; write it as 'N s/m', or '1' for a pure number")
        if not isinstance(parameter.entries, (list, tuple)) or not all(isinstance(e, Entry) for e in parameter.entries):
            raise PluginError(
                f"{who}: the entries of '{parameter.name}' are {type(parameter.entries).__name__}; they must be a "
                "tuple of Entry, a single one written with a comma: (Entry(...),)"
            )
    return tuple(found)


def check_shapes(parameters, size, plugin, where):
    """Raise PluginError unless the matrices of a plugin fit the rotor and are finite."""
    who = f"plugin '{plugin.name}' ({plugin.file}) in {where}"
    for parameter in parameters:
        local = parameter.force
        if local and (
            parameter.is_complex
            or parameter.entries
            or getattr(plugin, "acts_on", "rotor") != "rotor"
            or np.shape(local.matrix)[1:] != (size,)
        ):
            raise PluginError(
                f"{who}: '{parameter.name}' multiplies a force in time: it must be real, act on the rotor, and have no "
                f"entries and a matrix (coordinate, {size}) here"
            )
        for i, entry in enumerate(parameter.entries):
            needed = (size,) if entry.is_constant else (size, size)
            if np.shape(entry.matrix) != needed:
                raise PluginError(
                    f"{who}: entry {i} of '{parameter.name}' has a matrix of shape {np.shape(entry.matrix)}; on "
                    f"'{entry.on}' it must be {needed} here"
                )
            if not np.isfinite(entry.nonzero[-1]).all():
                raise PluginError(f"{who}: entry {i} of '{parameter.name}' is not finite")
