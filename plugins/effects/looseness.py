import numpy as np

from rotorstudy.plugins import Effect, NonlinearForce, NonNegative, Parameter, hookimpl


def looseness(structure, node: int | None = None, lift_m: NonNegative = 5e-6):
    """Support that lifts off: above a lift l from the static deflection it loses stiffness, force -k (-x - l) along x.

    k is the part of the modelled stiffness that is lost; gravity points along +x.
    """
    here = structure.unit(structure.default_node() if node is None else node)[None]

    def lifted(displacement, velocity, deflection):
        return -np.maximum(-(displacement - deflection).real - lift_m, 0) + 0j

    usual = 0.13 * structure.scales.stiffness(node)
    return [Parameter("stiffness_lost_in_lift", "N/m", (), typical=usual, force=NonlinearForce(here, lifted))]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "looseness",
        looseness,
        source="bilinear support as in Chu and Tang 2001; Muszynska and Goldman 1995",
        shape={"lift_m": (0.0, 4.0, "length")},
        example={"lift_m": 0.0},
        positive=True,
        checked="time integration to 2e-3 of its effect; no force below the lift to 1e-12; the mean rises",
        confounders=(
            ("support_stiffness", "looseness gives multiples of 1X and depends on the amplitude"),
            ("breathing_crack_weight", "the force of a loose support depends on the amplitude: change the unbalance"),
            ("rub", "at large amplitudes a rub stiffens, looseness softens"),
            ("cubic_stiffness", "looseness softens in one direction, cubic stiffness stiffens in all directions"),
        ),
    )
