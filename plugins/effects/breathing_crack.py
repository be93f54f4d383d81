from typing import Literal

import numpy as np

from rotorstudy.plugins import CannotAct, Effect, crack_parameters, registry


@Effect(
    source="thesis Eqs. (2.16) to (2.18); Gasch 1993",
    # of a solid shaft: transverse_crack
    places=lambda structure, sensors: [] if structure.is_solid else structure.crack_places(),
    shape={"crack_angle_rad": (-np.pi, np.pi)},
    alternatives={
        "crack": lambda: sorted(registry().plugins["crack"]),
        "opened_by": lambda: ("weight", "deflection"),
    },
    hypothesis={"isotropic": True},
    positive=True,
    checked="force in time is sigma dk times the motion along the crack, to 1e-12; integrated x-y motion to 1e-6",
    form_error=0.2,  # published laws of breathing differ
    confounders={
        "shaft_asymmetry": "under gravity a constant asymmetry gives 2X only, a breathing crack 1X and 3X too; an "
        "open crack also lowers the mean stiffness",
        "parallel_misalignment": "a misaligned coupling acts at its own node and has no 0X related to 2X; run the "
        "rotor uncoupled",
        "looseness": "the force of a loose support depends on the amplitude: change the unbalance",
    },
)
def breathing_crack(
    structure,
    crack: str = "switching",
    crack_angle_rad: float = 0.0,
    node: int | None = None,
    element: int | None = None,
    isotropic: bool = False,
    opened_by: Literal["weight", "deflection"] = "weight",
):
    """Crack whose stiffness loss acts on the total motion (time-varying), opened by the weight or by the deflection.

    crack: name of a crack plugin, which gives the breathing function; "open" is a notch.  crack_angle_rad: angle of the
    middle of the crack edge from the reference line of the shaft, in the direction of rotation.  isotropic: with
    an amplitude for a loss alike in all directions, too, beside that along xi.  opened_by: the weight
    alone, or the deflection at each instant, vibration included (only of a rotor with one coordinate).
    """
    by_deflection = opened_by == "deflection"
    if crack == "open" and by_deflection:
        raise CannotAct("a notch is always open; nothing opens it")
    if crack != "open" and not by_deflection and not np.any(structure.static_load):
        raise CannotAct("no weight opens and closes a crack here; only one that stays open can be")
    law = registry().get("crack", crack, "breathing_crack")
    place = {"node": node, "element": element, "angle_rad": crack_angle_rad}
    return crack_parameters(law, structure, False, isotropic=isotropic, by_deflection=by_deflection, **place)
