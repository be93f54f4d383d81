"""Stiffness loss of the shaft from the depth of a crack, and the inverse.

The open crack is a hinge of compliance c: a bending moment M adds the angle c M. With crack and disc at mid-span of a
simply supported shaft of length L, a force F on the disc gives M = F L / 4 and the additional deflection c L^2 / 16 F:

    k' = k / (1 + k c L^2 / 16),   stiffness loss k - k'.
"""

from typing import NamedTuple

import numpy as np

from rotorstudy.errors import PluginError, RotorstudyError, unknown_name
from rotorstudy.model.options import Positive, check_options, option_names
from rotorstudy.model.registry import registry
from rotorstudy.model.terms import Parameter

STIFFER = 1.01  # a simply supported shaft cannot be stiffer than this multiple of 48 E I / L^3


class Loss(NamedTuple):
    """Stiffness loss by the open crack along its weak direction xi and across it (eta), N/m."""

    xi: float
    eta: float


def compliance(depth, depth_ratio, where="the depth of the crack", **options):
    """Hinge compliance (2,) of a crack in xi and eta, rad/(N m); a depth outside the plugin's range is an error."""
    low, high = depth.valid
    if not low <= depth_ratio <= high:
        raise RotorstudyError(
            f"depth_ratio = {depth_ratio!r} in {where}: '{depth.name}' is valid from {low:g} to {high:g} times the "
            "diameter; use another kind, or give the stiffness loss itself"
        )
    found = depth.function(depth_ratio, **options)
    if np.shape(found) != (2,) or not np.isfinite(found).all():
        raise PluginError(
            f"depth '{depth.name}' ({depth.file}) in {where} gives {found!r} for depth_ratio {depth_ratio:g}; it must "
            "be two finite compliances, along xi and eta, in rad/(N m)"
        )
    return np.array(found)


def stiffness_loss(depth, depth_ratio, stiffness, span_m, where="the depth of the crack", **options):
    """`Loss` of a simply supported shaft (stiffness in N/m, span in m) with crack and disc at mid-span."""
    softer = stiffness * compliance(depth, depth_ratio, where, **options) * span_m**2 / 16
    return Loss(*(stiffness * softer / (1 + softer)))


def depth_ratio_of(depth, loss_xi, stiffness, span_m, **options):
    """Depth ratio for which the stiffness loss along xi is `loss_xi`, N/m: the inverse of `stiffness_loss`."""
    from scipy.optimize import brentq

    def off(depth_ratio):
        return stiffness_loss(depth, depth_ratio, stiffness, span_m, **options).xi - loss_xi

    low, high = depth.valid
    if off(low) > 0 or off(high) < 0:
        raise RotorstudyError(
            f"a stiffness loss of {loss_xi:g} N/m is outside the range of '{depth.name}', {off(low) + loss_xi:g} to "
            f"{off(high) + loss_xi:g} N/m for {low:g} to {high:g} times the diameter"
        )
    return float(brentq(off, low, high, xtol=1e-14))


def keys_from_depth(item, crack, structure, given, where):
    """Keys of a crack item that follow from its depth; given : its other keys, one that contradicts is an error."""
    place = f"{where}, depth"
    if not isinstance(item, dict) or not isinstance(item.get("kind"), str):
        raise RotorstudyError(f"depth = {item!r} in {where}: must be keys and values, with 'kind' naming a plugin")
    plugin = registry().get("depth", item["kind"], place)

    def measures(depth_ratio: float, span_m: Positive):
        """Options of every depth."""

    item = {key: value for key, value in item.items() if key != "kind"}
    every, known = option_names(measures), option_names(plugin.function)
    for key in item:
        if key not in {*every, *known}:
            raise unknown_name("key", key, {*every, *known}, place)
    general = check_options(measures, {key: value for key, value in item.items() if key in every}, place)
    own = {key: value for key, value in item.items() if key not in every}
    options = check_options(plugin.function, own, place, ("depth_ratio",))
    losses = structure.stiffness_loss_at(given.get("node"), given.get("element"))
    if len(structure.dofs) > 1 or [unit for _, unit, _ in losses.values()] != ["N/m"]:
        raise RotorstudyError(
            f"{place}: the loss follows from the depth only for a disc and a crack at mid-span, a rotor with one "
            f"coordinate; this one has {len(structure.dofs)}: give the loss itself ({', '.join(losses)})"
        )
    stiffness = float(structure.stiffness[0, 0])
    _check_span(stiffness, general["span_m"], options["diameter_m"], options["youngs_modulus_Pa"], place)
    loss = stiffness_loss(plugin, general["depth_ratio"], stiffness, general["span_m"], place, **options)
    ((name, (_, unit, typical)),) = losses.items()
    key, follows = Parameter(name, unit, (), typical).key, {"depth_ratio": general["depth_ratio"]}
    if loss.xi:
        follows["eta_share"] = loss.eta / loss.xi
    follows = {key: loss.xi, **{k: v for k, v in follows.items() if k in option_names(crack.function)}}
    for clash in (k for k in (key, "depth_ratio") if k in follows and given.get(k, follows[k]) != follows[k]):
        raise RotorstudyError(
            f"{clash} = {given[clash]!r} in {where}, but its depth gives {follows[clash]:g}; give only one of the two"
        )
    return follows


def _check_span(stiffness, span_m, diameter_m, youngs_modulus_Pa, where):
    """Raise if the rotor is stiffer than a simply supported shaft can be."""
    most = 48 * youngs_modulus_Pa * np.pi / 64 * diameter_m**4 / span_m**3
    if stiffness > STIFFER * most:
        raise RotorstudyError(
            f"span_m = {span_m:g}, diameter_m = {diameter_m:g} in {where}: a simply supported shaft has at most "
            f"48 E I / L^3 = {most:.4g} N/m, but the rotor has {stiffness:.4g} N/m; correct one of them"
        )
