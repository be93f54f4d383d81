import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, Share, hookimpl


def seal(structure, node: int | None = None, swirl_ratio: Share = 0.45):
    """Annular seal: force -c (dz/dt - j lambda w z) - m d2z/dt2, the fluid turning at lambda w about the shaft.

    It is the sum of external damping (1 - lambda) c and internal damping lambda c at its node, with the added mass of
    the fluid.
    """
    here = structure.unit(structure.default_node() if node is None else node)
    here = np.outer(here, here)
    usual = 0.04 * structure.scales.critical_damping(node)
    film = (Entry(-here, order=1), Entry(1j * swirl_ratio * here, gain=lambda speed: speed))
    return [
        Parameter("seal_damping", "N s/m", film, typical=usual),
        Parameter("seal_fluid_mass", "kg", (Entry(-here, order=2),), typical=0.05 * structure.scales.mass),
    ]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "seal",
        seal,
        source="Black 1969, J. Mech. Eng. Sci. 11; Childs 1993, Turbomachinery Rotordynamics; Muszynska 2005",
        shape={"swirl_ratio": (0.0, 0.8)},
        positive=True,
        checked="equal to external damping, internal damping and added mass to 1e-12; unstable from w = w_n / lambda",
        confounders=(
            (
                "internal_damping",
                "equal with external damping at the node; only the force of a seal changes with its pressure drop",
            ),
            (
                "external_damping",
                "equal without swirl, which gives a cross force at 0X; change the pressure drop or the pre-swirl",
            ),
            ("cross_coupling", "the cross force of a seal grows with the speed, and a seal also damps"),
            ("added_mass", "the mass of the fluid comes with its damping, and only in the full machine"),
        ),
    )
