"""A crack as a term: the breathing function of a plugin times the stiffness loss stated by the rotor.

In the rotating frame, r = z e^{-ja} with a = wt + the angular position of the crack, the shaft loses the stiffness
dK [[s_xi, s_xe], [s_xe, s_eta]](a). The force on z is therefore

    dK e^{ja} (m(a) r + d(a) conj r),   m = (s_xi + s_eta) / 2,   d = (s_xi - s_eta) / 2 + j s_xe.

The Fourier series of m and d give entries m_k on z with shift k and d_k on conj(z) with shift k + 2; an entry of shift
n is multiplied by e^{jn*angle}.

Under weight dominance z is replaced by the static deflection (thesis Eqs. 2.16 to 2.20, for a breathing function along
xi alone). Breathing functions are stated for a shaft that the weight stretches below; where it stretches the upper side
(`Structure.tension_side`), m and d are those of a + pi, so that m_k and d_k are multiplied by (-1)^k.

Where the loss is stated by the depth, the open crack is a hinge of compliance c: a bending moment M adds the angle c M.
With crack and disc at mid-span of a simply supported shaft of length L, a force F on the disc gives M = F L / 4 and the
additional deflection c L^2 / 16 F: k' = k / (1 + k c L^2 / 16), stiffness loss k - k'.
"""

from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import CannotAct, PluginError, RotorstudyError
from rotorstudy.model.entries import Entry
from rotorstudy.model.options import Positive, check_options, option_names
from rotorstudy.model.registry import registry
from rotorstudy.model.terms import NonlinearForce, Parameter

SERIES_ORDER = 15  # doubling it changes the first harmonics of a switching crack by 0.3 % at most
SAMPLES = 2**14  # per revolution; coefficients are accurate to 1e-4 of a jump, 1e-8 of a kink, else to round-off
NOTHING = 1e-13  # coefficients below this are round-off
STIFFER = 1.01  # a simply supported shaft cannot be stiffer than this multiple of 48 E I / L^3


def breathing_function(crack, angle, options=None):
    """Shares (direction, ...) of the stiffness loss along xi, along eta, and xi-eta at shaft angles (...), rad."""
    angle = np.asarray(angle, float)
    found = crack.function(angle.copy(), **(options or {}))  # which it may change
    if np.iscomplexobj(found):
        raise PluginError(f"crack '{crack.name}' ({crack.file}) gives complex numbers; shares of a loss are real")
    try:
        found = np.asarray(found, float)
        shape = found.shape
    except (TypeError, ValueError):
        shape = type(found).__name__ if not isinstance(found, (list, tuple)) else [np.shape(part) for part in found]
    if shape not in (angle.shape, (3, *angle.shape)):
        raise PluginError(
            f"crack '{crack.name}' ({crack.file}) gives a breathing function of shape {shape} for angles of shape "
            f"{angle.shape}; it must be that shape, or {(3, *angle.shape)} for xi, eta and xi-eta"
        )
    if not np.isfinite(found).all():
        where = np.broadcast_to(angle, found.shape)[~np.isfinite(found)][0]
        told = f"NaN or infinity, first at an angle of {where:.4g} rad"
        raise PluginError(f"crack '{crack.name}' ({crack.file}) gives {told}")
    return found if shape != angle.shape else np.stack([found, 0 * found, 0 * found])


def crack_series(crack, order, options=None):
    """Fourier coefficients {k: (3,)} of the shares xi, eta, xi-eta, |k| <= order: the plugin's own, else by a DFT."""
    if crack.series:
        given = crack.series(order, **(options or {}))
        _check_series(crack, given)
        return {k: np.append(s, [0, 0]) if np.ndim(s) == 0 else np.asarray(s) for k, s in given.items()}
    return _transformed(crack, order, tuple(sorted((options or {}).items())))


@lru_cache(maxsize=64)  # a diagnosis asks for the same one at every place and angle
def _transformed(crack, order, options):
    """Coefficients {k: (3,)} above round-off of a breathing function, by a discrete Fourier transform."""
    angle = (np.arange(SAMPLES) + 0.5) * 2 * np.pi / SAMPLES  # jumps at fractions of a revolution lie between samples
    transform = np.fft.fft(breathing_function(crack, angle, dict(options))) / SAMPLES
    found = {k: transform[:, k] * np.exp(-1j * k * angle[0]) for k in range(-order, order + 1)}
    return {k: s for k, s in found.items() if np.abs(s).max() > NOTHING}


def _check_series(crack, given):
    """Raise PluginError unless a plugin's own series is {k: s_k} or {k: (xi, eta, xi-eta)}, finite."""
    who = f"the series of crack '{crack.name}'" + (f" ({crack.file})" if crack.function else "")
    if not isinstance(given, dict) or not given:
        raise PluginError(f"{who} is a {type(given).__name__} or empty; it must be {{k: s_k}} or {{k: (3,)}}")
    for k, s in given.items():
        if np.shape(s) not in ((), (3,)) or not np.isfinite(s).all():
            told = f"for k = {k} the coefficient {s!r}"
            raise PluginError(f"{who} has {told}; it must be a finite number, or three for xi, eta, xi-eta")


def _on_z_and_conj(coefficients):
    xi, eta, both = coefficients
    return (xi + eta) / 2, (xi - eta) / 2 + 1j * both if both else (xi - eta) / 2


def participation_factors(crack, harmonics, order=None, options=None):
    """Participation factors (harmonic,), p_n = m_n + d_{n-2}, of the weight-dominant crack force (thesis Eq. 2.20)."""
    order = max(abs(int(n)) for n in harmonics) + 2 if order is None else order
    acting = {k: _on_z_and_conj(s) for k, s in crack_series(crack, order, options).items()}
    return np.array([acting.get(int(n), (0, 0))[0] + acting.get(int(n) - 2, (0, 0))[1] for n in harmonics])


def crack_parameters(
    crack,
    structure,
    weight_dominance=True,
    order=SERIES_ORDER,
    node=None,
    element=None,
    angle_rad=0.0,
    isotropic=False,
    by_deflection=False,
    **options,
):
    """Parameters of a crack plugin, one for each stiffness loss that the rotor states.

    isotropic     : with a second amplitude each, of a loss alike in all directions. As neither is negative, the shaft
                    loses most along xi, which is the only direction that an open crack has.
    by_deflection : the direction in which the shaft is bent at that instant opens the crack, not that of the weight
    """
    losses = structure.stiffness_loss_at(node, element)  # refuses a place that does not exist
    if by_deflection:
        return _by_deflection(crack, structure, losses, angle_rad, isotropic, options)
    parameters, on = [], ("static", "static conj") if weight_dominance else ("z", "conj")
    side = structure.tension_side(element)
    series = crack_series(crack, order, options)
    acting = [("", {k: _on_z_and_conj(s) for k, s in series.items()})]
    if isotropic:
        acting.append(("_isotropic", {k: _on_z_and_conj((s[0], s[0], 0.0)) for k, s in series.items()}))
    for (name, (pattern, unit, typical)), (which, shares) in product(losses.items(), acting):
        entries = []
        for k, factors in shares.items():
            for source, shift, factor in zip(on, (k, k + 2), factors, strict=True):
                turned = (side**k) * factor * np.exp(1j * shift * angle_rad) if angle_rad else (side**k) * factor
                entries.append(Entry(pattern * turned, on=source, shift=shift))
        parameters.append(Parameter(name + which, unit, tuple(entries), typical, default=0.0 if which else None))
    return parameters


def _by_deflection(crack, structure, losses, angle_rad, isotropic, options):
    """Parameters of a crack that the deflection z of a rotor with one coordinate opens: s(-arg r), r as above."""
    if len(structure.dofs) > 1:
        raise CannotAct("opened_by: deflection needs a rotor with one coordinate; this one has more")
    ((name, (_, unit, typical)),) = losses.items()

    def force_of(is_isotropic):
        def lost(displacement, velocity, deflection, shaft_angle):
            turned = np.exp(1j * (shaft_angle + angle_rad))
            r = displacement / turned
            xi, eta, both = breathing_function(crack, -np.angle(r), options)
            found = xi * r if is_isotropic else xi * r.real + both * r.imag + 1j * (both * r.real + eta * r.imag)
            return found * turned

        return NonlinearForce(np.eye(1), lost, takes_angle=True, takes_velocity=False)

    parameters = [Parameter(name, unit, (), typical, force=force_of(False))]
    if isotropic:
        parameters.append(Parameter(f"{name}_isotropic", unit, (), typical, force=force_of(True), default=0.0))
    return parameters


class Loss(NamedTuple):
    """Stiffness loss by the open crack along its weak direction xi and across it (eta), N/m."""

    xi: float
    eta: float


def compliance(depth, depth_ratio, where="the depth of the crack", **options):
    """Hinge compliance (2,) of a crack in xi and eta, rad/(N m); a depth outside the plugin's range is an error."""
    low, high = depth.valid
    if not low <= depth_ratio <= high:
        raise RotorstudyError(
            f"depth_ratio = {depth_ratio:g} in {where}: '{depth.name}' is valid from {low:g} to {high:g} times the "
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


def keys_from_depth(item, crack, structure, given, where):
    """Keys of a crack item that follow from its depth; given : its other keys, one that contradicts is an error."""
    place = f"{where}, depth"
    if not isinstance(item, dict) or not isinstance(item.get("kind"), str):
        raise RotorstudyError(f"depth = {item!r} in {where}: must be keys and values, with 'kind' naming a plugin")
    plugin = registry().get("depth", item["kind"], place)

    def measures(depth_ratio: float, span_m: Positive):
        """Options of every depth."""

    item = {key: value for key, value in item.items() if key != "kind"}
    options = check_options((measures, plugin.function), item, place)
    depth_ratio, span_m = options.pop("depth_ratio"), options.pop("span_m")
    losses = structure.stiffness_loss_at(given.get("node"), given.get("element"))
    if len(structure.dofs) > 1 or [unit for _, unit, _ in losses.values()] != ["N/m"]:
        raise RotorstudyError(
            f"{place}: the loss follows from the depth only for a disc and a crack at mid-span, a rotor with one "
            f"coordinate; this one has {len(structure.dofs)}: give the loss itself ({', '.join(losses)})"
        )
    stiffness = float(structure.stiffness[0, 0])
    _check_span(stiffness, span_m, options["diameter_m"], options["youngs_modulus_Pa"], place)
    loss = stiffness_loss(plugin, depth_ratio, stiffness, span_m, place, **options)
    ((name, (_, unit, typical)),) = losses.items()
    key, follows = Parameter(name, unit, (), typical).key, {"depth_ratio": depth_ratio}
    if loss.xi:
        follows["eta_share"] = loss.eta / loss.xi
    follows = {key: loss.xi, **{k: v for k, v in follows.items() if k in option_names(crack.function)}}
    for clash in (k for k in (key, "depth_ratio") if k in follows and given.get(k, follows[k]) != follows[k]):
        told = f"but its depth gives {follows[clash]:g}; give only one of the two"
        raise RotorstudyError(f"{clash} = {given[clash]!r} in {where}, {told}")
    return follows


def _check_span(stiffness, span_m, diameter_m, youngs_modulus_Pa, where):
    """Raise if the rotor is stiffer than a simply supported shaft can be."""
    most = 48 * youngs_modulus_Pa * np.pi / 64 * diameter_m**4 / span_m**3
    if stiffness > STIFFER * most:
        raise RotorstudyError(
            f"span_m = {span_m:g}, diameter_m = {diameter_m:g} in {where}: a simply supported shaft has at most "
            f"48 E I / L^3 = {most:.4g} N/m, but the rotor has {stiffness:.4g} N/m; correct one of them"
        )
