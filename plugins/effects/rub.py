import numpy as np

from rotorstudy.plugins import Effect, NonlinearForce, NonNegative, Parameter, Positive, hookimpl


def rub(structure, node: int | None = None, clearance_m: Positive = 1e-4, friction_ratio: NonNegative = 0.1):
    """Shaft that hits a ring around its rest: force -k (|r| - c) (1 + j mu) r / |r| while it is beyond the clearance c.

    r counts from the static deflection; the shaft turns forward and slips, so that friction pushes backward.
    """
    here = structure.unit(structure.default_node() if node is None else node)[None]

    def contact(displacement, velocity, deflection):
        offset = displacement - deflection
        distance = np.abs(offset)
        depth = np.maximum(distance - clearance_m, 0)
        return -(1 + 1j * friction_ratio) * depth * offset / np.where(depth > 0, distance, 1)

    return [Parameter("rub_stiffness", "N/m", (), typical=1e5, force=NonlinearForce(here, contact))]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "rub",
        rub,
        source="Choy and Padovan 1987, J. Sound Vib.; Muszynska 2005, Rotordynamics",
        shape={"clearance_m": (1e-6, 1e-3), "friction_ratio": (0.0, 0.5)},
        example={"clearance_m": 2e-6},
        positive=True,
        checked="circular full annular rub to closed form to 1e-9; partial rub as in time to 2e-3 of what it does",
        confounders=(
            ("cubic_stiffness", "a rub starts at its clearance and has friction; cubic stiffness is always there"),
            ("looseness", "a rub stiffens when the motion is large, looseness softens"),
        ),
    )
