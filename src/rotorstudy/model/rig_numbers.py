"""The numbers of a rig (modulus, masses, clearances) as parameters of its model, each a relative change."""

from collections.abc import Iterable

from rotorstudy.model.bearing_numbers import is_bearing_number, with_bearing_numbers
from rotorstudy.model.model import Model
from rotorstudy.model.rotor_numbers import is_rotor_number, with_rotor_numbers


def is_number(name: str) -> bool:
    """Whether the name of a parameter is that of a number of the rotor or of its bearings."""
    return is_rotor_number(name) or is_bearing_number(name)


def with_numbers(model: Model, names: Iterable[str], where: str = "the rig") -> Model:
    """The model with numbers of its rotor and of its bearings among its parameters.

    model  : built from a rig
    names  : names of parameters; only those of numbers are added
    where  : where the names come from, for error messages
    raises : RotorstudyError if the rotor or the bearings have no such number, or the rotor does not depend on it
    """
    names = list(names)
    return with_bearing_numbers(with_rotor_numbers(model, names, where), names, where)
