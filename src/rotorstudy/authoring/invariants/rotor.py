"""Invariants of a rotor: matrices of a mechanical system, weight, and the stiffness losses of a crack."""

import re

import numpy as np

from rotorstudy.authoring.invariants.base import ROUND_OFF, require
from rotorstudy.model.model import Model
from rotorstudy.model.options import option_names
from rotorstudy.model.rig import build_model
from rotorstudy.model.rig_numbers import depends_on, numbers, uncertain_numbers


def _example_structure(plugin):
    return build_model({"rotor": {"kind": plugin.name, **plugin.example}}).structure


def rotor_is_mechanical(plugin):
    """has real symmetric matrices, positive mass and no negative stiffness"""
    structure = _example_structure(plugin)
    for name in ("mass", "stiffness", "gyroscopic"):
        matrix = getattr(structure, name)
        require(np.isrealobj(matrix), f"{name} is not real")
        require(np.array_equal(matrix, matrix.T), f"{name} is not symmetric")
    require(np.linalg.eigvalsh(structure.mass).min() > 0, "the mass matrix is not positive definite")
    least, *_, most = [0.0, *np.linalg.eigvalsh(structure.stiffness)]
    require(least >= -ROUND_OFF * most, f"the stiffness matrix has the negative eigenvalue {least:.3g}")


def rotor_weighs(plugin):
    """has a downward static load"""
    load = _example_structure(plugin).static_load
    require(load.sum() > 0, "the static load is zero or upward; gravity points along +x")


def rotor_losses_take_away(plugin):
    """states stiffness losses that reduce the stiffness, with unit and typical size"""
    structure = _example_structure(plugin)
    size = len(structure.dofs)
    for node in structure.nodes if callable(structure.stiffness_loss) else (None,):
        for name, (pattern, unit, typical) in structure.stiffness_loss_at(node).items():
            require(pattern.shape == (size, size), f"{name} has a pattern of shape {pattern.shape}")
            require(np.linalg.eigvalsh(pattern).min() >= 0, f"{name} adds stiffness")
            require(unit and typical > 0, f"{name} lacks its unit or typical size")


def rotor_numbers_move(plugin):
    """has numbers that change its matrices; those it states to be uncertain are among its options"""
    structure, options = _example_structure(plugin), option_names(plugin.function)
    for path, share in plugin.uncertain.items():
        require(re.split(r"[.\[]", path)[0] in options, f"uncertain: '{path}' is no option; known: {options}")
        require(0 < share < 1, f"uncertain: {path} has the relative standard deviation {share!r}; give 0.005 for 0.5 %")
    model = Model(structure)
    moving = [name for name in numbers(model) if depends_on(model, name)]
    require(moving, f"none of its numbers {numbers(model)} changes a matrix: pass numbers as float options")
    if plugin.uncertain:
        moving = uncertain_numbers(model, "rotor")
        require(moving, "none of the numbers that are uncertain changes a matrix of its example")
