import numpy as np

from rotorstudy.plugins import Effect, NonlinearForce, NonNegative, Parameter, Positive, hookimpl


def rub(structure, node: int | None = None, clearance_m: Positive = 1e-4, friction_ratio: NonNegative = 0.1):
    """Contact with a ring of clearance c: force -k (|r| - c) (1 + j mu) r / |r| where |r| > c.

    r is measured from the static deflection; the shaft slips, so that friction acts against its rotation.
    """
    here = structure.unit(structure.default_node() if node is None else node)[None]

    def contact(displacement, velocity, deflection):
        offset = displacement - deflection
        distance = np.abs(offset)
        depth = np.maximum(distance - clearance_m, 0)
        return -(1 + 1j * friction_ratio) * depth * offset / np.where(depth > 0, distance, 1)

    usual = 0.13 * structure.scales.stiffness(node)
    return [Parameter("rub_stiffness", "N/m", (), typical=usual, force=NonlinearForce(here, contact))]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "rub",
        rub,
        source="Choy and Padovan 1987, J. Sound Vib.; Muszynska 2005, Rotordynamics",
        shape={"clearance_m": (0.04, 40.0, "length"), "friction_ratio": (0.0, 0.5)},
        example={"clearance_m": 2e-6},
        positive=True,
        checked="full annular rub in closed form to 1e-9; partial rub by time integration to 2e-3 of its effect",
        confounders=(
            ("cubic_stiffness", "a rub begins at its clearance and has friction; cubic stiffness always acts"),
            ("looseness", "at large amplitudes a rub stiffens, looseness softens"),
        ),
    )
