from functools import partial

import numpy as np

from rotorstudy.plugins import Effect, NonlinearForce, Parameter


@Effect(
    source="Duffing 1918; Yamamoto and Ishida 2001, Linear and Nonlinear Rotordynamics",
    hypothesis={"quadratic": True, "axes": True},
    positive=("cubic_stiffness", "quadratic_stiffness"),
    checked="circular whirl without weight: stiffness k r^2 to 1e-10; 2X due to weight; time integration to 1e-6",
    form_error=0.2,  # supports stiffen by other powers, too
    confounders={
        "support_stiffness": "cubic stiffness depends on the amplitude: change the unbalance",
        "rub": "a rub begins at its clearance and has friction; cubic stiffness always acts",
        "looseness": "looseness softens in one direction, cubic stiffness stiffens in all directions",
    },
)
def cubic_stiffness(structure, node: int | None = None, quadratic: bool = False, axes: bool = False):
    """Support whose stiffness grows with the square of its deflection: force -k |r|^2 r, r from the bearing line.

    quadratic: with an amplitude for a stiffness that grows with the deflection, force -q |r| r. axes: with amplitudes
    for supports that stiffen more along an angle alpha than across it, by the potential a cos 2 (phi - alpha) |r|^4 / 4
    (of q: |r|^3 / 3), where phi is the angle of r: a cos 2 alpha, and a sin 2 alpha.
    """
    here, size = structure.unit(node)[None], structure.scales.displacement(node)
    powers = {"cubic": 2} | ({"quadratic": 1} if quadratic else {})
    directions = {"stiffness": 0} | ({"stiffness_0_deg": 1, "stiffness_45_deg": 1j} if axes else {})

    def stiffening(power, axis, displacement, velocity, deflection):
        distance = np.abs(displacement)
        if not axis:
            return -(distance**power) * displacement
        across = axis * displacement.conj()
        along = (across * displacement.conj()).real / np.where(distance > 0, distance, 1) ** 2  # cos 2 (phi - alpha)
        return -(distance**power) * (power * along * displacement + 2 * across) / (power + 2)

    return [
        Parameter(
            f"{name}_{direction}",
            f"N/m{power + 1}",
            (),
            typical=0.03 * structure.scales.stiffness(node) / size**power,
            force=NonlinearForce(here, partial(stiffening, power, axis)),
            default=None if (power, axis) == (2, 0) else 0.0,
        )
        for name, power in powers.items()
        for direction, axis in directions.items()
    ]
