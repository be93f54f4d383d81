from rotorstudy.plugins import Effect, Parameter, at_supports, outer, planar_entries

DIRECTIONS = ("xx", "xy", "yx", "yy")


@Effect(
    places=at_supports,
    base_rate=0.02,  # eight numbers describe what a simpler effect explains too
    source="Lund 1964; Friswell, Penny, Garvey and Lees 2010, Dynamics of Rotating Machines, 5.5",
    checked="response equal to that of a rotor on a linear bearing with the sum of the coefficients, to 1e-11",
    confounders={
        "support_stiffness": "one stiffness in all directions, without damping; change the film: speed, oil, load",
        "support_anisotropy": "two stiffnesses, without damping; change the film: speed, oil, load",
        "support_loss": "a loss is along one direction, without damping; change the speed, hence the film",
        "external_damping": "one damping in all directions, without stiffness; change the film: speed, oil, load",
        "cross_coupling": "a fluid that swirls has equal and opposite cross stiffnesses; change its swirl",
        "seal": "equal at one speed; the cross stiffness of a seal grows with the speed",
        "pedestal_resonance": "constant coefficients have no resonance of their own; tap the pedestal",
    },
)
def bearing_coefficients(structure, node: int | None = None):
    """Errors of the eight linear coefficients of a bearing or an oil film: force -(K r + C dr/dt), r = (x, y).

    -K_xy is the force along x due to a unit displacement along y; K_xy = -K_yx > 0 drives a forward whirl.
    """
    here = outer(structure.unit(node))
    stiffness, damping = 0.03 * structure.scales.stiffness(node), 0.04 * structure.scales.critical_damping(node)
    return [
        Parameter(f"bearing_{name}_error_{direction}", unit, planar_entries(direction, -here, order), typical)
        for name, unit, order, typical in (("stiffness", "N/m", 0, stiffness), ("damping", "N s/m", 1, damping))
        for direction in DIRECTIONS
    ]
