from rotorstudy.plugins import AtLeastOne, Effect, Entry, Feared, Parameter, across, couples_a_driver, outer

HARMONICS = (2, 1, 3)
ALL_HARMONICS = (1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 0)


def nodes_and_elements(structure, sensors):
    """Each node, and each element between two nodes that can translate."""
    nodes = structure.nodes
    return [{"node": node} for node in nodes] + [{"element": node} for node in nodes if node + 1 in nodes]


@Effect(
    source="harmonics as in Sekhar and Prabhu 1995, J. Sound Vib. 185; Xu and Marangoni 1994, J. Sound Vib. 176",
    places=nodes_and_elements,
    place_rate=couples_a_driver,
    positive=("coupling_stiffness",),
    feared=Feared(
        "misalignment_force_2X", 10.0, places=lambda structure: [({"node": n},) * 2 for n in structure.nodes]
    ),
    hypothesis={"harmonics": list(ALL_HARMONICS), "coupled": True},
    checked="whirl F_n / |k - m n^2 w^2| of a Jeffcott rotor to 1e-12",
    # its forces change with the torque, which grows with up to the square of the speed
    form_error={f"misalignment_force_{n}X": 0.3 for n in ALL_HARMONICS},
    confounders={
        "unbalance": "a misaligned coupling does not grow with the square of the speed, and has 2X",
        "bow": "equal at 1X on a rotor of one coordinate; a misaligned coupling has 2X and acts at its own node",
        "runout": "a runout is not amplified where harmonic n meets a natural frequency",
        "shaft_asymmetry": "the 2X of an asymmetric shaft is caused by gravity and remains on the uncoupled shaft",
        "transverse_crack": "a misaligned coupling acts at its own node and has no 0X related to 2X; run the "
        "rotor uncoupled",
    },
)
def parallel_misalignment(
    structure,
    node: int | None = None,
    element: int | None = None,
    harmonics: AtLeastOne[int] = HARMONICS,
    coupled: bool = False,
):
    """Parallel misalignment of a coupling: forces at multiples of the spin speed, independent of the speed.

    They act at a node, or, for a coupling modelled by an element, at both its ends in opposite directions. Each
    harmonic has its own amplitude and phase, since couplings differ; 2X usually dominates. A force that is not circular
    has backward harmonics (-1, -2, -3) too, and a shaft that is bent into line has a constant force (0). coupled: the
    stiffness of the coupling, which the rig lacks, acts on the motion too; its asymmetry k_d, which rotates with the
    coupling, adds the force -k_d e^{2jwt} conj(z), which gives 2X.
    """
    here, scales = across(structure, node, element, "translation"), structure.scales
    local = scales.stiffness(node) if element is None else scales.softest
    usual = 0.05 * local * scales.length  # an offset of the usual length, times a share of the stiffness there
    entries = {n: (Entry(here, on="one", shift=n),) for n in harmonics}
    forces = [Parameter(f"misalignment_force_{n}X", "N", e, usual, is_complex=True) for n, e in entries.items()]
    if not coupled:
        return forces
    pattern, usual = outer(here), 0.05 * local
    return [
        *forces,
        Parameter("coupling_stiffness", "N/m", (Entry(-pattern),), usual),
        Parameter("coupling_asymmetry", "N/m", (Entry(-pattern, on="conj", shift=2),), usual, is_complex=True),
    ]
