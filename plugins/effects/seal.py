from rotorstudy.plugins import Effect, Entry, Parameter, Share, outer


@Effect(
    source="Black 1969, J. Mech. Eng. Sci. 11; Childs 1993, Turbomachinery Rotordynamics; Muszynska 2005",
    shape={"swirl_ratio": (0.0, 0.8)},
    base_rate=0.2,  # five numbers describe what a simpler effect explains too
    positive=("seal_damping", "seal_fluid_mass"),
    checked="the forces of Childs' five coefficients along x and y to 1e-12; unstable from w = w_n / lambda",
    confounders={"support_stiffness": "a seal also damps, and its stiffness changes with the pressure drop"},
)
def seal(structure, node: int | None = None, swirl_ratio: Share = 0.45):
    """Annular seal, a fluid that rotates at lambda w: force -K z - C (z' - j lambda w z) - M (d/dt - j lambda w)^2 z.

    Damping and inertia act on the motion relative to the fluid: the direct stiffness is K - lambda^2 M w^2, the cross
    stiffness lambda C w, the cross damping 2 lambda M w. Added to these are a cross stiffness and a cross damping that
    do not depend on the speed, of a swirl at the inlet. K is negative where the pressure drop pulls.
    """
    here, scales = outer(structure.against_casing(node)), structure.scales
    stiffness, damping = scales.stiffness(node), scales.critical_damping(node)
    film = (Entry(-here, order=1), Entry(1j * swirl_ratio * here, gain=lambda speed: speed))
    fluid = (
        Entry(-here, order=2),
        Entry(2j * swirl_ratio * here, order=1, gain=lambda speed: speed),
        Entry(swirl_ratio**2 * here, gain=lambda speed: speed**2),
    )
    return [
        Parameter("seal_damping", "N s/m", film, typical=0.04 * damping),
        Parameter("seal_fluid_mass", "kg", fluid, typical=0.05 * scales.mass),
        Parameter("seal_stiffness", "N/m", (Entry(-here),), typical=0.03 * stiffness),
        Parameter("seal_cross_stiffness", "N/m", (Entry(1j * here),), typical=0.007 * stiffness),
        Parameter("seal_cross_damping", "N s/m", (Entry(1j * here, order=1),), typical=0.004 * damping),
    ]
