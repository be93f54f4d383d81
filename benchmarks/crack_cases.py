"""Random cracked machines of the independent simulator (blind.machines), measured in two planes at seven speeds.

The cracks are those of three-dimensional elasticity with unilateral contact, but with fronts that the library does not
have: arcs of a circle of any curvature (`blind.machines.elastic_crack`).
"""

from dataclasses import replace

import numpy as np

from rotorstudy.blind.machines.cases import RUNOUT, Case, draw_case, swing_of
from rotorstudy.blind.machines.elastic_crack import CURVATURES, arc_form
from rotorstudy.blind.machines.faults import FAMILIES
from rotorstudy.blind.machines.form_cracks import add_form
from rotorstudy.blind.machines.measuring import Probe, record, surface_runout

SPEEDS = 7
MOST_ELEMENTS = 8
DEPTHS = (0.05, 0.4)  # over the diameter
NOISE = 0.01  # standard deviation of each sample over the rms of a channel
KINDS = {"crack": ("gradual",), "slot": ("open",)}


def drawn(seed: int, kind: str) -> Case:
    """A random machine with one crack that opens and closes, or with a slot that never closes.

    The probes and the run-to-run scatter are of ordinary quality (`foreign.cases.draw_chain`), the noise is white.

    Parameters
    ----------
    seed : int
    kind : str
        Of `KINDS`.

    Returns
    -------
    Case
    """
    family = f"{kind} of any depth"
    FAMILIES[family] = cracked(KINDS[kind])
    rng = np.random.default_rng([seed, 13])
    case = draw_case(seed, family, speeds=SPEEDS, count=int(rng.integers(2, MOST_ELEMENTS + 1)))
    nodes = two_planes(rng, case.rotor)
    swing = swing_of(case.healthy, nodes)
    angles = [probe.angle for probe in next(iter(case.probes.values()))]
    probes = {node: _probes(rng, angles, swing) for node in nodes}
    chain = replace(case.chain, noise=NOISE * swing / 2**0.5, coloured_noise=0.0, quantum=0.0)
    return replace(
        case,
        nodes=nodes,
        probes=probes,
        chain=chain,
        records=record(rng, case.steady, nodes, probes, chain, case.zero),
    )


def cracked(kinds):
    """Family of machines with one crack of one of the kinds."""

    def family(draw):
        rng, element = draw.rng, draw.element()
        share, depth, curvature = (float(rng.uniform(*ends)) for ends in ((0.1, 0.9), DEPTHS, CURVATURES))
        angle, kind = draw.angle(), str(rng.choice(kinds))
        part = draw.rotor.elements[element]
        position = float(draw.rotor.positions[element] + share * part.length)
        add_form(draw.machine, position, arc_form(part, depth, curvature, kind), angle)
        place = {"element": element + 1, "position_in_element": share, "curvature": curvature}
        return {**place, "depth_over_radius": 2 * depth, "phase_rad": angle, "breathing": kind}

    return family


def two_planes(rng, rotor):
    """A node with a disc and another one, from 0."""
    first = int(rng.choice([disc.node for disc in rotor.discs]))
    return sorted([first, int(rng.choice([node for node in range(rotor.nodes) if node != first]))])


def _probes(rng, angles, swing):
    """Two probes: gain to 0.5 %, angle to 0.5 degrees, runout 1 % of the usual vibration."""
    runout = surface_runout(rng, angles, swing * RUNOUT)
    return tuple(
        Probe(angle, gain=1 + 5e-3 * rng.normal(), angle_error=np.deg2rad(0.5) * rng.normal(), runout=profile)
        for angle, profile in zip(angles, runout, strict=True)
    )


def truth_of(case: Case) -> dict:
    """Position from the first node (m), depth over the diameter, angle (rad), breathing and element of the crack."""
    (one,) = case.effects
    lengths = np.array([element.length for element in case.rotor.elements])
    start = lengths[: one["element"] - 1].sum()
    return {
        "position_m": float(start + one["position_in_element"] * lengths[one["element"] - 1]),
        "depth_ratio": one["depth_over_radius"] / 2,
        "angle_rad": one["phase_rad"],
        "breathing": one["breathing"],
        "curvature": one["curvature"],
        "element": one["element"],
        "length_m": float(lengths.sum()),
    }
