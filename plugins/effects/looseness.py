import numpy as np

from rotorstudy.plugins import Effect, Feared, NonlinearForce, Parameter, Positive, at_supports, mean_overlap


def places(structure, sensors):
    """Every bearing, and what it stands on where that moves."""
    return at_supports(structure, sensors) + [{"foundation": node} for node in structure.housings]


@Effect(
    source="bilinear support as in Chu and Tang 2001; Muszynska and Goldman 1995; Greenwood and Williamson 1966",
    places=places,
    shape={
        "lift_m": (-3.0, 3.0, "vibration"),
        "direction_rad": (-np.pi, np.pi),
        "play_m": (0.05, 10.0, "vibration"),
        "gap_spread_m": (0.01, 3.0, "vibration"),
    },
    example={"lift_m": 0.0},
    positive=True,
    switches=True,
    feared=Feared("stiffness_lost_in_lift", 10.0),
    checked="time integration to 2e-3 of its effect; no force below the lift to 1e-12; the mean rises",
    form_error=0.2,  # feet and bolts do not lift off at once
    confounders={
        "support_loss": "a support that lifts depends on the amplitude and gives multiples of 1X",
        "support_stiffness": "looseness gives multiples of 1X and depends on the amplitude",
    },
)
def looseness(
    structure,
    node: int | None = None,
    foundation: int | None = None,
    lift_m: float = 5e-6,
    direction_rad: float = 0.0,
    play_m: Positive | None = None,
    gap_spread_m: Positive | None = None,
):
    """Support that lifts off: where the lift s from the static deflection exceeds l, force -k min(s - l, p) d.

    d, at direction_rad from x (gravity points along +x), is the direction in which the shaft presses on its support,
    and s = -d . r. k is the part of the modelled stiffness that is lost beyond the lift l, until after a play p the
    bolts hold; by default they never do. l is negative where the support has lifted off already at rest. gap_spread_m:
    standard deviation of the lift and the play over the seat: it lifts, and is held, gradually; without it, suddenly.
    foundation is the node of a bearing in place of its own: what it stands on lifts, such as a foot, by the motion of
    its housing.
    """
    own, motion = (node, "translation") if foundation is None else (foundation, "housing")
    here = structure.against_casing(node) if foundation is None else structure.unit(foundation, "housing")
    along = np.exp(1j * direction_rad)

    def lifted(displacement, velocity, deflection):
        lift = -((displacement - deflection) * along.conj()).real - lift_m
        held = 0.0 if play_m is None else mean_overlap(lift - play_m, gap_spread_m)
        return -(mean_overlap(lift, gap_spread_m) - held) * along

    usual = 0.13 * structure.scales.stiffness(own, motion)
    return [Parameter("stiffness_lost_in_lift", "N/m", (), typical=usual, force=NonlinearForce(here[None], lifted))]
