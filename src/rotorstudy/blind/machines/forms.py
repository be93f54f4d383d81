"""Faults whose form is not the textbook's: `FORMS[name](draw)` adds one and returns what it is, as in `faults`."""

import numpy as np

from rotorstudy.blind.machines import contacts, cracks, faults
from rotorstudy.blind.machines.cracks import dimensionless_compliance
from rotorstudy.blind.machines.draw import between

DEPTHS = (0.04, 0.3)  # over the diameter, of the straight front that has the same flexibility on average
RATIOS = (0.05, 0.6)  # flexibility along the front over that across
EXTENTS = {"section": 0.5, "length": 0.25, "element": 0.25}  # how often a crack is of each
LAWS = {"energy": 0.3, "whole": 0.3, "flexibility_by_angle": 0.2, "stiffness_by_angle": 0.2}


def _choice(rng, shares):
    return str(rng.choice(list(shares), p=list(shares.values())))


def _compliance(draw):
    """Compliance (2, 2) of a crack around and off fracture mechanics, rad/(N m)."""
    rng, rotor = draw.rng, draw.rotor
    part = rotor.elements[0] if rotor.elements else rotor
    scale = (1 - part.poissons_ratio**2) / (np.pi * rotor.youngs_modulus * (rotor.diameter / 2) ** 3)
    across = dimensionless_compliance(2 * between(rng, *DEPTHS))[0] * np.exp(0.3 * rng.normal())
    ratio = between(rng, *RATIOS)
    coupling = rng.uniform(-0.3, 0.3) * np.sqrt(ratio) if rng.random() < 0.4 else 0.0
    return draw.severity * scale * across * np.array([[1.0, coupling], [coupling, ratio]])


def _share(draw, law):
    """Open share by the angle, and what it is in words."""
    rng, lag = draw.rng, 0.0
    if rng.random() < 0.3:
        lag = np.deg2rad(rng.uniform(-30, 30))
    if law in cracks.BY_MOMENT:
        lag, width = 0.3 * lag, between(rng, 0.02, 1.0)
        return cracks.smooth_contact(width, lag), f"contact of width {width:.2g}, lag {np.rad2deg(lag):.0f}"
    kind = str(rng.choice(["cosine", "contact", "trapezoid"], p=[0.5, 0.25, 0.25]))
    if kind == "cosine":
        power = float(rng.choice([1.0, 1.0, 0.7, 1.5, 2.0]))
        return cracks.cosine(power, lag), f"cosine to {power:g}, lag {np.rad2deg(lag):.0f}"
    if kind == "contact":
        width = between(rng, 0.1, 1.0)
        return cracks.smooth_contact(width, lag), f"contact of width {width:.2g}, lag {np.rad2deg(lag):.0f}"
    half_open, ramp = rng.uniform(0.3, 1.2), rng.uniform(0.5, 1.5)
    return cracks.trapezoid(half_open, ramp, lag), f"trapezoid {half_open:.2g} {ramp:.2g}, lag {lag:.2g}"


def _extent(draw, extent):
    """Position (m) and length (m) of a crack."""
    rng, rotor = draw.rng, draw.rotor
    if not rotor.elements:
        return (rotor.first if rotor.first == rotor.second else rotor.length * rng.uniform(0.15, 0.85)), 0.0
    element = draw.element()
    start, part = rotor.positions[element], rotor.elements[element]
    if extent == "element":
        return float(start + part.length / 2), part.length
    length = rotor.diameter * between(rng, 0.2, 3.0) if extent == "length" else 0.0
    return float(start + part.length * rng.uniform(0.1, 0.9)), length


def add_crack(draw, position, length, compliance, law, share, angle, closing=0.0):
    """A crack of a form on the machine of a draw; what it is in plain numbers."""
    cracks.add_form(draw.machine, position, cracks.Form(compliance, law, share, closing), angle, length)
    what = {"position_m": float(position), "softened_m": float(length), "phase_rad": angle, "law": law}
    what["length_m"] = float(draw.rotor.length)
    names, turn = ("across", "along", "coupling"), np.linspace(-np.pi, np.pi, 721)
    opened = compliance * (np.max(share(turn)) if share else 1.0)  # as far as it ever does
    numbers = a, b, both = opened[0, 0], opened[1, 1], opened[0, 1]
    if law == "open":  # no record shows another direction than that in which it yields most
        what["phase_rad"] = float(angle + np.arctan2(2 * both, a - b) / 2)
        numbers = *np.linalg.eigvalsh(opened)[::-1], 0.0
    what |= {f"{name}_rad_per_N_m": float(value) for name, value in zip(names, numbers, strict=True)}
    if draw.rotor.elements:
        element = int(np.searchsorted(draw.rotor.positions, position, side="right"))
        return what | {"element": min(element, len(draw.rotor.elements))}
    return what


def crack_form(draw):
    """A crack that opens and closes."""
    rng = draw.rng
    law, extent = _choice(rng, LAWS), _choice(rng, EXTENTS)
    (position, length), compliance, angle = _extent(draw, extent), _compliance(draw), draw.angle()
    (share, words), closing = _share(draw, law), 0.0
    if law in cracks.BY_MOMENT and length == 0 and rng.random() < 0.2:
        closing = rng.uniform(-0.4, 0.4) * cracks.static_moment(draw.machine, position)
    what = add_crack(draw, position, length, compliance, law, share, angle, closing)
    return what | {"extent": extent, "share": words, "closing_N_m": float(closing)}


def open_crack_form(draw):
    """A crack that never closes, of a length as a rule."""
    rng = draw.rng
    extent = _choice(rng, {"section": 0.2, "length": 0.4, "element": 0.4})
    (position, length), compliance = _extent(draw, extent), _compliance(draw)
    return add_crack(draw, position, length, compliance, "open", None, draw.angle()) | {"extent": extent}


def looseness_form(draw):
    """A foot that lifts over a smooth transition."""
    rng, angle = draw.rng, draw.angle()
    node, stiffness = draw.support()
    loss = min(draw.severity * between(rng, 0.1, 0.7), 0.85) * stiffness
    swing, towards = draw.swing(node), np.array([np.cos(angle), np.sin(angle)])
    rest = float(draw.rest(node) @ towards)
    start, width = rest + swing * rng.uniform(-0.8, 0.7), swing * between(rng, 0.05, 0.6)
    gap = swing * between(rng, 0.5, 10.0)
    opening = str(rng.spawn(1)[0].choice(list(contacts.OPENINGS)))  # by numbers of its own: the rest of a draw stays
    gradual = {"start": start, "width": width, "opening": opening}
    contacts.add_one_sided_loss(draw.machine, node, loss, angle, gap, **gradual)
    what = {"node": node + 1, "angle_rad": angle, "loss_N_per_m": loss, "gap_m": gap}
    return what | {"start_m": start, "width_m": width, "opening": opening}


def clearance_form(draw):
    """A support with clearance."""
    rng, angle = draw.rng, draw.angle()
    node, stiffness = draw.support()
    loss, swing = min(draw.severity * between(rng, 0.1, 0.6), 0.85) * stiffness, draw.swing(node)
    clearance = swing * between(rng, 0.3, 2.0)
    centre = draw.rest(node) - rng.uniform(0.0, 1.5) * clearance * np.array([np.cos(angle), np.sin(angle)])
    of_form = rng.spawn(1)[0]
    width, oval = clearance * between(of_form, 0.02, 0.2), of_form.uniform(0.0, (0.2, np.pi)).tolist()
    opening = str(of_form.choice(list(contacts.OPENINGS)))
    contacts.add_clearance(draw.machine, node, loss, clearance, width, centre, oval, opening)
    what = {"node": node + 1, "loss_N_per_m": loss, "clearance_m": clearance, "centre_m": centre.tolist()}
    return what | {"width_m": width, "oval": oval, "opening": opening}


def stiffening_form(draw):
    """A support whose stiffness grows with the deflection, by its square, its cube, or both."""
    rng = draw.rng
    node, stiffness = draw.support()
    u = draw.healthy.displacement[:, :, 4 * node : 4 * node + 2]
    far = float(np.max(np.linalg.norm(u, axis=2)))
    size, share = draw.severity * stiffness * between(rng, 0.05, 0.5), rng.choice([0.0, rng.uniform(), 1.0])
    quadratic, cubic, ratio = share * size / far, (1 - share) * size / far**2, float(rng.uniform(0.6, 1.0))
    contacts.add_stiffening(draw.machine, node, quadratic, cubic, ratio)
    return {"node": node + 1, "quadratic_N_per_m2": quadratic, "cubic_N_per_m3": cubic, "ratio": ratio}


def rub_form(draw):
    """A rub with another contact law and with friction that falls with the slip."""
    return faults.rub(draw, 3.0, 0.4, 4, draw.severity, 0.01, ("hertz", "quadratic", "smooth"))


def coupling_form(draw):
    """A coupling whose forces at 1X to 4X are ellipses, some growing with the speed, and its constant force."""
    rng, node = draw.rng, 0
    kind = "parallel" if not draw.rotor.elements else str(rng.choice(["parallel", "angular"]))
    size = 0.05 * draw.severity * between(rng, 0.1, 3.0) * draw.stiffness * max(map(draw.swing, draw.unbalance))
    if kind == "angular":
        size = size * draw.rotor.length / 4
    fall, forces = rng.uniform(1.5, 3.0), {}
    for k, usual in ((0, 0.7), (1, 0.5), (2, 1.0), (3, 1 / fall), (4, 1 / fall**2)):
        power = int(k == 1 and rng.random() < 0.3)
        forward, backward = usual * size * (rng.normal(size=2) + 1j * rng.normal(size=2)) / draw.frequency**power
        forces[k, power] = forward, 0.0 if k == 0 else 0.7 * backward
    contacts.add_elliptic_forces(draw.machine, node, forces, kind == "angular")
    unit = "N_m" if kind == "angular" else "N"
    return {"node": node + 1, "kind": kind, f"size_{unit}": size}


def dry_friction_form(draw):
    """Dry friction against the vibration at a support."""
    rng = draw.rng
    node, _ = draw.support()
    size = 0.1 * draw.severity * between(rng, 0.1, 3.0) * draw.stiffness * max(map(draw.swing, draw.unbalance))
    slow = 0.1 * draw.swing(node) * draw.frequency
    contacts.add_dry_friction(draw.machine, node, size, slow)
    return {"node": node + 1, "force_N": size, "slow_m_per_s": slow}


FORMS = {
    form.__name__: form
    for form in (
        crack_form, open_crack_form, looseness_form, clearance_form, stiffening_form, rub_form, coupling_form,
        dry_friction_form,
    )
}  # fmt: skip
