"""The response to unbalance: how a rotor is unbalanced, at which speeds its 1X is computed, and what probes show."""

import numpy as np

from rotorstudy.model.rig_items import make_term
from rotorstudy.response.whirl import Peak

BALANCE_GRADE = 2.5e-3  # m/s, grade G 2.5 of ISO 21940-11: residual unbalance of a rig that states none
ABOUT_A_RESONANCE = np.sinh(np.linspace(-3, 3, 61)) / np.sinh(3)  # further speeds about a critical one, dense at it
RESONANCE_WIDTHS = 12  # half their range, in half-power half-widths
NARROWEST = 1e-4  # damping ratio of the narrowest resonance that is resolved
UNDAMPED = 1e-6  # damping ratio that is round-off: the response at such a critical speed has no bound
SAME = 1e-6  # relative distance of a speed from that of an undamped mode, at which there is no response


def with_unbalance(model, highest):
    """The model, if nothing rotates with it, with an unbalance of G 2.5 at its heaviest node, and that in words."""
    acting = [term for term in model.terms if not term.acts_on_output]
    turning = [t for t in acting for u in t.unknowns for e in u.entries if e.is_constant and e.shift == 1]
    if any(np.any(term.theta) for term in turning):
        return model, f"as stated in the rig ({', '.join(sorted({term.kind for term in turning}))})"
    structure = model.structure
    mass = float(structure.along @ structure.mass @ structure.along)
    node = max(structure.nodes, key=lambda n: structure.mass[structure.index(n), structure.index(n)])
    item = {"kind": "unbalance", "node": node, "label": "G 2.5", "mass_kg": mass}
    item["eccentricity_m"] = BALANCE_GRADE / highest
    text = (
        f"none is stated in the rig; it has grade G 2.5 (ISO 21940-11) for {60 * highest / (2 * np.pi):.0f} rpm, "
        f"{1e6 * mass * BALANCE_GRADE / highest:.3g} g mm, at node {node}"
    )
    return model.plus(make_term("effect", item, structure, model.sensors)), text


def finer_speeds(speeds, criticals):
    """Speeds with more of them about the critical ones, as a lightly damped resonance is narrow."""
    widths = [(c.speed, max(c.damping_ratio, NARROWEST)) for c in criticals if abs(c.damping_ratio) > UNDAMPED]
    around = [speed * (1 + RESONANCE_WIDTHS * width * ABOUT_A_RESONANCE) for speed, width in widths]
    found = np.unique(np.concatenate([speeds, *around]))
    for one in criticals:
        if abs(one.damping_ratio) < UNDAMPED:
            found = found[np.abs(found - one.speed) > SAME * one.speed]
    return found[(found >= speeds[0]) & (found <= speeds[-1])]


def unbounded(peak, criticals, speeds):
    """The peak; that of an undamped mode, which lies beside it between two speeds, without bound."""
    at = np.searchsorted(speeds, peak.speed)
    below, above = speeds[max(at - 1, 0)], speeds[min(at + 1, len(speeds) - 1)]
    for one in criticals:
        if below <= one.speed <= above and abs(one.damping_ratio) < UNDAMPED:
            return Peak(one.speed, np.inf, np.inf)
    return peak


def probe_vectors(of_node, reading):
    """Probes [(node, name)], and their 1X (speed, probe), complex, m, phase leading, from (1X, -1X) of nodes."""
    each = {node: along_directions(reading.probes_at(node), reading.mark_rad, *both) for node, both in of_node.items()}
    found = {(node, name): one for node, probes in each.items() for name, one in probes.items()}
    return list(found), np.stack(list(found.values()), axis=-1)


def along_directions(directions, mark_rad, forward, backward):
    """{probe: 1X (speed,), complex, phase leading} along directions {probe: rad}, from 1X and -1X (speed,)."""
    mark, turned = np.exp(1j * mark_rad), {probe: np.exp(-1j * at) for probe, at in directions.items()}
    return {probe: (turn * forward + np.conj(turn * backward)) * mark for probe, turn in turned.items()}
