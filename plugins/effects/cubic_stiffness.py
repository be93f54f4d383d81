import numpy as np

from rotorstudy.plugins import Effect, NonlinearForce, Parameter, hookimpl


def cubic_stiffness(structure, node: int | None = None):
    """Support whose stiffness grows with the square of its deflection: force -k |r|^2 r, r from the bearing line."""
    here = structure.unit(node)[None]

    def stiffening(displacement, velocity, deflection):
        return -(np.abs(displacement) ** 2) * displacement

    usual = 0.03 * structure.scales.stiffness(node) / structure.scales.displacement(node) ** 2
    return [Parameter("cubic_stiffness", "N/m3", (), typical=usual, force=NonlinearForce(here, stiffening))]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "cubic_stiffness",
        cubic_stiffness,
        source="Duffing 1918; Yamamoto and Ishida 2001, Linear and Nonlinear Rotordynamics",
        positive=True,
        checked="circular whirl without weight: stiffness k r^2 to 1e-10; 2X due to weight; time integration to 1e-6",
        form_error=0.2,  # supports stiffen by other powers, too
        confounders={
            "support_stiffness": "cubic stiffness depends on the amplitude: change the unbalance",
            "rub": "a rub begins at its clearance and has friction; cubic stiffness always acts",
            "looseness": "looseness softens in one direction, cubic stiffness stiffens in all directions",
        },
    )
