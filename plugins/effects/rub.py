import numpy as np

from rotorstudy.plugins import CannotAct, Effect, Feared, NonlinearForce, NonNegative, Parameter, Positive


@Effect(
    source="Choy and Padovan 1987, J. Sound Vib.; Muszynska 2005, Rotordynamics",
    shape={
        "clearance_m": (0.02, 5.0, "vibration"),
        "friction_ratio": (0.0, 0.5),
        "offset_ratio": (0.0, 0.98),
        "contact_angle_rad": (-np.pi, np.pi),
    },
    example={"clearance_m": 2e-6},
    positive=True,
    feared=Feared("rub_stiffness", 10.0, {"clearance_m": (0.8, "vibration")}),
    checked="full annular rub in closed form to 1e-9; partial rub by time integration to 2e-3 of its effect",
    form_error=0.2,  # contact stiffness grows with the depth, friction falls with the slip
    confounders={"looseness": "at large amplitudes a rub stiffens, looseness softens"},
)
def rub(
    structure,
    node: int | None = None,
    clearance_m: Positive = 1e-4,
    friction_ratio: NonNegative = 0.1,
    offset_ratio: NonNegative = 0.0,
    contact_angle_rad: float = 0.0,
):
    """Contact with a ring: force -k (|s| - R) (1 + j mu) s / |s| where the distance s from its centre exceeds R.

    clearance_m is the least gap to the shaft at rest, that is at its static deflection, on the side contact_angle_rad
    from x. The centre of the ring is away from that side by offset_ratio of its radial clearance R: 0 if concentric,
    near 1 for a stop on one side. The shaft slips, so that friction acts against its rotation. The ring moves with the
    block of the foundation around it.
    """
    if offset_ratio >= 1:
        raise CannotAct(f"rub: offset_ratio = {offset_ratio:g}; must be below 1, or the ring touches the shaft at rest")
    here = structure.against_casing(node)[None]
    radial = clearance_m / (1 - offset_ratio)
    centre = -offset_ratio * radial * np.exp(1j * contact_angle_rad)

    def contact(displacement, velocity, deflection):
        offset = displacement - deflection - centre
        distance = np.abs(offset)
        depth = np.maximum(distance - radial, 0)
        return -(1 + 1j * friction_ratio) * depth * offset / np.where(depth > 0, distance, 1)

    usual = 0.13 * structure.scales.stiffness(node)
    return [Parameter("rub_stiffness", "N/m", (), typical=usual, force=NonlinearForce(here, contact))]
