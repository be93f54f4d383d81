from rotorstudy.plugins import Effect, Entry, Parameter, outer


@Effect(
    source="thesis Eq. (2.7)",
    positive=True,
    checked="-c dz/dt in time to 1e-12",
    confounders={
        "seal": "equal without swirl, which gives a cross force at 0X; change the pressure drop or the pre-swirl",
        "internal_damping": "internal damping has no force at +1X and gives a static cross force at 0X",
        "shaft_damping": "shaft damping has no force at +1X and gives a static cross force at 0X",
        "phase_reference": "a wrong mark also shifts the phase far from resonance, where damping does little",
    },
)
def external_damping(structure, node: int | None = None):
    """Viscous damping to ground: force -c dz/dt."""
    here = structure.unit(node)
    usual = 0.04 * structure.scales.critical_damping(node)
    return [Parameter("external_damping", "N s/m", (Entry(-outer(here), order=1),), typical=usual)]
