"""Invariants of a bearing: finite coefficients that carry the rotor, and the claimed damping and symmetry."""

from dataclasses import replace

import numpy as np

from rotorstudy.authoring.invariants.base import ROUND_OFF, SPEEDS, BrokenInvariant, claimed, require
from rotorstudy.authoring.invariants.bench import bench_structure, typical_term
from rotorstudy.errors import NoSteadyState
from rotorstudy.model.bearings import dynamic_stiffness
from rotorstudy.model.model import Model
from rotorstudy.model.rig_numbers import number_paths, path_pattern
from rotorstudy.response.statics import static_deflection

BEARING_HARMONICS = [1, 2, 3]


def bearing_numbers_exist(plugin):
    """has the numbers among the options of its example that it states to be uncertain"""
    known = number_paths(typical_term(plugin, bench_structure()).options)
    for path, share in plugin.uncertain.items():
        there = any(map(path_pattern(path).fullmatch, known))
        require(there, f"uncertain: '{path}' is no number of its example; known: {known}")
        require(0 < share < 1, f"uncertain: {path} has the relative standard deviation {share!r}; give 0.1 for 10 %")


def bearing_is_finite(plugin):
    """is finite at speeds of a laboratory rotor"""
    _stiffness(plugin)  # an entry with a matrix or a gain that is not finite is refused


def _stiffness(plugin):
    """Dynamic stiffness (speed, harmonic, force direction, motion direction), N/m, on the bench."""
    return dynamic_stiffness(typical_term(plugin, bench_structure()), SPEEDS, BEARING_HARMONICS)


def bearing_carries(plugin):
    """carries the weight of a free shaft with a finite downward deflection"""
    structure = replace(bench_structure(), stiffness=np.zeros((1, 1)))
    model = Model(structure, (typical_term(plugin, structure),))
    try:
        deflection = static_deflection(model, SPEEDS, model.theta).value
    except NoSteadyState:
        spring = "give it a spring of entries, or make its nonlinear force an effect beside a linear bearing"
        raise BrokenInvariant(f"it has no static stiffness and does not carry the shaft; {spring}") from None
    down = np.real(deflection @ structure.static_load)
    require((down > 0).all(), f"the shaft rises against its weight at {np.array(SPEEDS)[down <= 0]} rad/s")


@claimed("positive_damping")
def bearing_takes_energy(plugin):
    """dissipates energy in every motion by its damping"""
    loss = _stiffness(plugin).imag
    least = np.linalg.eigvalsh(loss + np.swapaxes(loss, -1, -2)).min()
    taken = "gains" if least < 0 else "loses no"
    require(least > 0, f"a motion {taken} energy from its damping: {least / 2:.3g} N/m in quadrature")


@claimed("symmetric")
def bearing_is_symmetric(plugin):
    """has symmetric coefficients, so that no cross-coupling drives a whirl"""
    found = _stiffness(plugin)
    off = np.abs(found - np.swapaxes(found, -1, -2)).max()
    require(off <= ROUND_OFF * np.abs(found).max(), f"xy and yx differ by {off:.3g} N/m: they drive a whirl")
