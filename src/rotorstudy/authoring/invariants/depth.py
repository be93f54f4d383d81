"""Invariants of a crack depth: compliances that increase with it, and a depth recovered from the loss."""

import numpy as np

from rotorstudy.authoring.invariants.base import BrokenInvariant, require
from rotorstudy.errors import RotorstudyError
from rotorstudy.model.depth import compliance, depth_ratio_of, stiffness_loss

SHAFT = {"stiffness": 7.6e5, "span_m": 0.45}


def _depths(plugin):
    return np.linspace(*plugin.valid, 26)


def depth_is_monotone(plugin):
    """has a compliance that is zero at zero depth and increases with it, larger along xi than along eta"""
    found = np.array([compliance(plugin, depth, **plugin.example) for depth in _depths(plugin)])
    require(found.shape == (26, 2), f"it gives {found.shape[1:]} compliances, not one for xi and one for eta")
    require(np.isfinite(found).all(), "a compliance within its range is not finite")
    if plugin.valid[0] == 0:
        require(np.abs(found[0]).max() == 0, f"at zero depth the compliance is {found[0].max():.3g} rad/(N m)")
    require((np.diff(found, axis=0) > 0).all(), "the compliance does not increase with the depth")
    require(
        (found[1:, 0] >= found[1:, 1]).all(), "the compliance is larger along eta than along xi, the weak direction"
    )


def depth_keeps_to_its_range(plugin):
    """rejects a depth outside its stated range"""
    low, high = plugin.valid
    require(0 <= low < high <= 1, f"{low:g} to {high:g} is not a valid range of the depth ratio")
    for outside in (low - 0.01, high + 0.01, float("nan")):
        try:
            compliance(plugin, outside, **plugin.example)
        except RotorstudyError:
            continue
        raise BrokenInvariant(f"it accepts the depth ratio {outside:g}")


def depth_comes_back(plugin):
    """is recovered from its stiffness loss, which is less than the whole stiffness"""
    for depth in _depths(plugin)[1:-1:4]:
        loss = stiffness_loss(plugin, depth, **SHAFT, **plugin.example)
        require(0 < loss.eta <= loss.xi < SHAFT["stiffness"], f"depth {depth:.3g} gives {loss} of {SHAFT['stiffness']}")
        found = depth_ratio_of(plugin, loss.xi, **SHAFT, **plugin.example)
        require(abs(found - depth) < 1e-9, f"depth {depth:.6g} is recovered as {found:.6g}")


CHECKS = (depth_is_monotone, depth_keeps_to_its_range, depth_comes_back)
