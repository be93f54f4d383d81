"""What the depth of a crack must hold: compliances that grow with it, and a depth that comes back from the loss."""

import numpy as np

from rotorstudy.authoring.invariants.base import BrokenInvariant, require
from rotorstudy.errors import RotorstudyError
from rotorstudy.model.depth import compliance, depth_ratio_of, stiffness_loss

SHAFT = {"stiffness": 7.6e5, "span_m": 0.45}


def _depths(plugin):
    return np.linspace(*plugin.valid, 26)


def depth_is_monotone(plugin):
    """bends the shaft not at all at no depth, and ever more the deeper the crack, most along xi"""
    found = np.array([compliance(plugin, depth, **plugin.example) for depth in _depths(plugin)])
    require(found.shape == (26, 2), f"it gives {found.shape[1:]} compliances, not one for xi and one for eta")
    require(np.isfinite(found).all(), "a compliance within its range is not finite")
    if plugin.valid[0] == 0:
        require(np.abs(found[0]).max() == 0, f"a crack of no depth has the compliance {found[0].max():.3g} rad/(N m)")
    require((np.diff(found, axis=0) > 0).all(), "a deeper crack bends no more")
    require((found[1:, 0] >= found[1:, 1]).all(), "it bends more along eta than along xi, its weak direction")


def depth_keeps_to_its_range(plugin):
    """refuses a depth outside the range it states"""
    low, high = plugin.valid
    require(0 <= low < high <= 1, f"the range {low:g} to {high:g} is none of a depth over the diameter")
    for outside in (low - 0.01, high + 0.01, float("nan")):
        try:
            compliance(plugin, outside, **plugin.example)
        except RotorstudyError:
            continue
        raise BrokenInvariant(f"it takes the depth ratio {outside:g}")


def depth_comes_back(plugin):
    """comes back from the stiffness loss it means, and that is less than the whole stiffness"""
    for depth in _depths(plugin)[1:-1:4]:
        loss = stiffness_loss(plugin, depth, **SHAFT, **plugin.example)
        require(0 < loss.eta <= loss.xi < SHAFT["stiffness"], f"depth {depth:.3g} takes {loss} of {SHAFT['stiffness']}")
        found = depth_ratio_of(plugin, loss.xi, **SHAFT, **plugin.example)
        require(abs(found - depth) < 1e-9, f"depth {depth:.6g} comes back as {found:.6g}")


CHECKS = (depth_is_monotone, depth_keeps_to_its_range, depth_comes_back)
