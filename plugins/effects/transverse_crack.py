from typing import Literal

import numpy as np

from rotorstudy.plugins import CannotAct, DepthRatio, Effect, Feared, NonNegative, Parameter, Share, crack_at

STRIPS = dict.fromkeys(("cosine", "switching"), "strip_integration")  # depth plugins as published with these laws
ALONG = 0.2  # standard deviation of the flexibility along the front, over that across: published ratios are 0.05 to 0.6
CLOSING = 0.1  # standard deviation of the closing moment by residual stress, over the static moment: an assumption
ELEMENTS_TRIED = 10  # of a long shaft, to say which depth is seen
# (1 - cos) / 2 and sin / 2 of multiples of the angle from the side that the weight stretches
ANGLE = np.deg2rad(np.arange(-90, 91))
TURN = {order: ((1 - np.cos(order * ANGLE)) / 2, np.sin(order * ANGLE) / 2) for order in range(6)}
Breathing = Literal["gradual", "sudden", "turning", "cosine", "switching", "none"]

# parts of a law of breathing -> (which, standard deviation), of what the open crack yields across. Those of "across"
# cover published laws: their root mean square about the nearest law here is 0.16, 0.25, 0.22, 0.02 and 0.10, of a crack
# that opens at once (Gasch 1993), over a width of contact, as (1 + cos) / 2 (Mayes and Davies 1984) or its powers, and
# an eighth of a turn earlier or later
FORM = {
    f"{motion}_{order}": ((motion, order), std)
    for motion, spreads in {
        "across": {1: 0.2, 2: 0.25, 3: 0.2, 4: 0.1, 5: 0.1},
        "along": {0: 0.25, 1: 0.2, 2: 0.2, 3: 0.1, 4: 0.05, 5: 0.05},
        "coupled": {1: 0.1, 2: 0.1, 3: 0.1},
        "skewed": {0: 0.05, 1: 0.05},  # a front that is not symmetric yields most 5 degrees from its middle
        "lagging": {1: 0.15, 2: 0.15, 3: 0.1},
    }.items()
    for order, std in spreads.items()
}


def depth_and_flexibility(
    structure, position_m, depth_ratio, flexibility_factor=1.0, front_aspect_ratio=0.0, breathing="gradual",
    across_1=0.0, across_2=0.0, across_3=0.0, across_4=0.0, across_5=0.0, lagging_1=0.0, lagging_2=0.0, lagging_3=0.0,
):  # fmt: skip
    """The depth in m by the diameter at its position, and how far the open crack yields to the moment that opens it.

    By the angle (turning) it is stated where the crack is widest open; by the moment, where the front is in tension.
    """
    flexibility = STRIPS.get(breathing, "elasticity")
    hinge = crack_at(structure, position_m, depth_ratio, 0.0, flexibility, False, front_aspect_ratio)
    depth, widest = depth_ratio * hinge.section.outer_diameter_m, 1.0
    if breathing == "turning":  # its opening may lag the bending moment
        across, lagging = (across_1, across_2, across_3, across_4, across_5), (lagging_1, lagging_2, lagging_3)
        more = sum(size * TURN[order][0] for order, size in enumerate(across, start=1))
        more += sum(size * TURN[order][1] for order, size in enumerate(lagging, start=1))
        widest = np.max(1 - TURN[1][0] + more)
    return {"depth_m": depth, "flexibility_rad_per_N_m": widest * flexibility_factor * hinge.open_compliance[0]}


def middles_of_elements(structure):
    """The middle of every element; of a long shaft of at most so many, evenly along it."""
    ends = sorted(structure.node_positions.values())
    ends = ends if len(ends) > 1 else [0.0, *ends, structure.length]  # the spans beside a single disc
    elements = np.unique(np.linspace(0, len(ends) - 2, ELEMENTS_TRIED).astype(int))
    return [({"element": int(i) + 1}, {"position_m": (ends[i] + ends[i + 1]) / 2}) for i in elements]


def two_cracks(structure, one, other):
    """Each has the flexibility of a crack alone, a diameter or more away, and is condensed in an element of its own."""
    first, second = sorted((one["position_m"], other["position_m"]))
    diameter = structure.section_at(first).outer_diameter_m
    if second - first < diameter:
        raise CannotAct(
            f"cracks at {first:g} and {second:g} m are nearer than a diameter ({diameter:g} m) and relieve each other, "
            "which is not modelled; state them as one, or further apart"
        )
    ends = sorted(structure.node_positions.values())
    if np.searchsorted(ends, first) == np.searchsorted(ends, second):
        both = f"cracks at {first:g} and {second:g} m"
        raise CannotAct(f"{both} are in the same element; divide it, so that a node is between them")


@Effect(
    source="Papadopoulos and Dimarogonas 1987; Darpe, Gupta, Chawla 2004; Mayes and Davies 1984; Gasch 1993",
    places=lambda structure, sensors: [{}] if structure.section_at else [],  # its position is an option
    shape={"position_m": (0.0, 1.0, "shaft"), "depth_ratio": (0.02, 0.5), "angle_rad": (-np.pi, np.pi)},
    form=(
        {"front_aspect_ratio": (0.0, 1.0)},
        {"any_flexibility": True},
        # errors of the table, of fronts that are no ellipses (an arc as flexible across differs by this along), and
        # of the closing by residual stress
        {
            "flexibility_factor": (1.0, 0.02),
            "excess_flexibility_along": (0.0, 0.001),
            "closing_moment_share": (0.0, CLOSING),
            **{name: (0.0, std) for name, ((motion, _), std) in FORM.items() if motion == "skewed"},
        },
    ),
    stated=depth_and_flexibility,
    alternatives={"breathing": lambda: ("gradual", "sudden", "none")},
    formulas={"breathing": lambda: ("turning", "cosine", "switching")},
    example={"position_m": 0.2},
    positive=("flexibility_factor",),
    fixed=True,
    form_error=0.2,  # laws of opening differ by more where the vibration, not the weight, opens the crack
    any_form=(
        {"any_law": True},
        {
            "excess_flexibility_along": (0.0, ALONG),
            "closing_moment_share": (0.0, CLOSING),
            **{name: (0.0, std) for name, (_, std) in FORM.items()},
        },
        {"breathing": lambda: ("gradual", "turning", "none")},
    ),
    together=two_cracks,
    feared=Feared(
        "depth_ratio",
        0.5,
        worst={"angle_rad": (0.0, np.pi / 2)},
        places=middles_of_elements,
        measure="2X and 3X near a half and a third of a critical speed, or nearer to it",
    ),
    checked="two beams joined by a spring to 1e-9; integrated x-y motion to 5e-3 of its effect; 4 to 40 elements",
)
def transverse_crack(
    structure,
    position_m: NonNegative,
    depth_ratio: DepthRatio = 0.2,
    angle_rad: float = 0.0,
    breathing: Breathing = "gradual",
    opened_by: Literal["moment", "weight"] = "moment",
    flexibility: str | None = None,
    front_aspect_ratio: Share = 0.0,
    closing_moment_N_m: float = 0.0,
    any_flexibility: bool = False,
    any_law: bool = False,
):
    """Crack across a solid shaft: a hinge that yields to the bending moment that opens it.

    position_m: from node 1, or from the first bearing of an offset disc.  depth_ratio: depth over the diameter.
    angle_rad: of the middle of the crack edge from the reference line of the shaft, in the direction of rotation.
    breathing: gradual, by the part of the front in tension;
    sudden, open or closed as a whole; turning, its flexibility as (1 + cos) / 2 of its angle to the side that the
    weight stretches; cosine and switching, by the same angle, with (1 + cos) / 2 of its loss of stiffness, or all of it
    on that side; none, a notch that never closes.  opened_by: the instantaneous moment, or that of the weight alone.
    flexibility: name of a depth plugin, by default elasticity, for cosine and switching strip_integration, as
    published.  front_aspect_ratio: depth over half the width of the ellipse that the front is a part of, 0 is a
    straight front.  closing_moment_N_m: residual stress that closes it, as the bending moment that just opens it;
    negative where it holds the crack open at rest.  any_flexibility: with amplitudes for more flexibility along the
    front, for a residual stress as a share of the static moment, and for a front that is not symmetric.  any_law: with
    amplitudes for other laws of breathing, another flexibility along the front and a lag, of which zero is the law
    stated.
    """
    by_moment = breathing in ("gradual", "sudden") and opened_by == "moment"
    if closing_moment_N_m and not by_moment:
        raise CannotAct("closing_moment_N_m needs a crack that opens and closes by the instantaneous moment")
    if not by_moment and breathing != "none" and not np.any(structure.static_load):
        raise CannotAct("no weight opens and closes a crack here; breathing: gradual or sudden by the moment, or none")
    flexibility = flexibility or STRIPS.get(breathing, "elasticity")
    place = position_m, depth_ratio, angle_rad
    hinge = crack_at(structure, *place, flexibility, breathing == "sudden", front_aspect_ratio)
    jumps = breathing in ("sudden", "switching")
    law = "weight" if breathing in ("gradual", "sudden") else breathing
    found, flexibilities = [], {"flexibility_factor": False}
    if (any_flexibility or any_law) and breathing != "sudden":
        flexibilities["excess_flexibility_along"] = True
    for name, along in flexibilities.items():
        force = hinge.force(closing_moment_N_m, along=along) if by_moment else None
        entries, default = () if by_moment else hinge.entries(law, along), 0.0 if along else None
        found.append(Parameter(name, "1", entries, typical=1.0, force=force, default=default, jumps=jumps))
    if (any_flexibility or any_law) and by_moment and hinge.static_moment:
        force = hinge.force_of_closing()
        found.append(Parameter("closing_moment_share", "1", (), typical=1.0, force=force, default=0.0))
    parts = {
        name: (motion, order)
        for name, ((motion, order), _) in FORM.items()
        if (any_law or (any_flexibility and motion == "skewed")) and not (breathing == "none" and order > 0)
    }
    tables = [()] * len(parts) if by_moment else hinge.entries_of_forms((*parts.values(),), law)
    for (name, which), entries in zip(parts.items(), tables, strict=True):
        force = hinge.force_of_form(*which) if by_moment else None
        found.append(Parameter(name, "1", entries, typical=1.0, force=force, default=0.0))
    return found
