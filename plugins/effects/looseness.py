import numpy as np

from rotorstudy.plugins import Effect, NonlinearForce, NonNegative, Parameter, hookimpl


def looseness(structure, node: int | None = None, lift_m: NonNegative = 5e-6):
    """Support that lifts off: beyond a lift l up from its rest it no longer holds back, force -k (-x - l) along x.

    k is the part of the modelled stiffness that is lost in the air; gravity points along +x.
    """
    here = structure.unit(structure.default_node() if node is None else node)[None]

    def lifted(displacement, velocity, deflection):
        return -np.maximum(-(displacement - deflection).real - lift_m, 0) + 0j

    return [Parameter("stiffness_lost_in_lift", "N/m", (), typical=1e5, force=NonlinearForce(here, lifted))]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "looseness",
        looseness,
        source="bilinear support as in Chu and Tang 2001; Muszynska and Goldman 1995",
        shape={"lift_m": (0.0, 1e-4)},
        example={"lift_m": 0.0},
        positive=True,
        checked="as integrated in time to 2e-3 of what it does; nothing below the lift to 1e-12; mean goes up",
        confounders=(
            ("support_stiffness", "looseness gives harmonics of 1X and depends on the size of the motion"),
            ("breathing_crack_weight", "a loose support depends on the size of the motion: change the unbalance"),
            ("rub", "a rub stiffens when the motion is large, looseness softens"),
            ("cubic_stiffness", "looseness softens and pulls one way, cubic stiffness stiffens all ways"),
        ),
    )
