from functools import partial

import numpy as np

from rotorstudy.plugins import Effect, NonlinearForce, Parameter, hookimpl


def cubic_stiffness(structure, node: int | None = None, quadratic: bool = False):
    """Support whose stiffness grows with the square of its deflection: force -k |r|^2 r, r from the bearing line.

    quadratic: with an amplitude for a stiffness that grows with the deflection, force -q |r| r.
    """
    here, size = structure.unit(node)[None], structure.scales.displacement(node)
    powers = {"cubic_stiffness": 2} | ({"quadratic_stiffness": 1} if quadratic else {})

    def stiffening(power, displacement, velocity, deflection):
        return -(np.abs(displacement) ** power) * displacement

    return [
        Parameter(
            name,
            f"N/m{power + 1}",
            (),
            typical=0.03 * structure.scales.stiffness(node) / size**power,
            force=NonlinearForce(here, partial(stiffening, power)),
            default=0.0 if power == 1 else None,
        )
        for name, power in powers.items()
    ]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "cubic_stiffness",
        cubic_stiffness,
        source="Duffing 1918; Yamamoto and Ishida 2001, Linear and Nonlinear Rotordynamics",
        hypothesis={"quadratic": True},
        positive=True,
        checked="circular whirl without weight: stiffness k r^2 to 1e-10; 2X due to weight; time integration to 1e-6",
        form_error=0.2,  # supports stiffen by other powers, too
        confounders={
            "support_stiffness": "cubic stiffness depends on the amplitude: change the unbalance",
            "rub": "a rub begins at its clearance and has friction; cubic stiffness always acts",
            "looseness": "looseness softens in one direction, cubic stiffness stiffens in all directions",
        },
    )
