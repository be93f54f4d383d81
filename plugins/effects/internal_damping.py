from rotorstudy.plugins import Effect, Entry, Parameter, outer


def where_the_shaft_is_damped(structure, sensors):
    """The node of a rotor that has only one, on a shaft carried rigidly; else each stretch of elements.

    Damping of the whole shaft is `shaft_damping`.
    """
    if len(structure.nodes) == 1:
        return [{"node": structure.nodes[0]}]
    return structure.stretches()


@Effect(
    source="Tondl 1965; thesis Eq. (2.7)",
    places=where_the_shaft_is_damped,
    positive=True,
    checked="-c (dz/dt - j w z) in time to 1e-12; onset at w_n (1 + c_e / c_i) in tests/physics/test_threshold.py",
    confounders={
        "seal": "equal with external damping on a rotor of one coordinate; a seal depends on its pressure drop",
        "shaft_damping": "equal on a rotor of one coordinate; internal damping acts in one element",
        "phase_reference": "a wrong mark also shifts the phase far from resonance, where damping does little",
    },
)
def internal_damping(structure, node: int | None = None, element: int | None = None, last_element: int | None = None):
    """Viscous damping in the rotating shaft: force -c (dz/dt - j w z), that is -j (n - 1) w c z_n on harmonic n.

    In an element, or in all up to a last one, c is their stiffness matrix times the amplitude, without a force on a
    rigid-body motion. At a node of a rotor with several it acts between the node and the ground, as in the thesis.
    """
    if element is not None:
        here = structure.stiffness_of(element, last_element)
        unit, typical = "s", 0.05 / structure.scales.frequency
    else:
        at = structure.unit(node)
        here, unit, typical = outer(at), "N s/m", 0.008 * structure.scales.critical_damping(node)
    entries = (Entry(-here, order=1), Entry(1j * here, gain=lambda speed: speed))
    return [Parameter("internal_damping", unit, entries, typical)]
