from rotorstudy.plugins import AtLeastOne, Effect, Entry, Feared, Parameter, across, couples_a_driver, outer, spacers

HARMONICS = (1, 2)
ALL_HARMONICS = (1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 0)


@Effect(
    source="harmonics as in Sekhar and Prabhu 1995, J. Sound Vib. 185; Xu and Marangoni 1994, J. Sound Vib. 176",
    places=lambda structure, sensors: [
        *({"node": node} for node, motion in structure.dofs if motion == "tilt"),
        *spacers(structure),
    ],
    place_rate=couples_a_driver,
    positive=("coupling_stiffness",),
    feared=Feared("misalignment_moment_2X", 10.0),
    hypothesis={"harmonics": list(ALL_HARMONICS), "coupled": True},
    checked="equal to two opposite parallel forces l apart with moment F l to 5e-3",
    # its moments change with the torque, which grows with up to the square of the speed
    form_error={f"misalignment_moment_{n}X": 0.3 for n in ALL_HARMONICS},
    confounders={
        "couple_unbalance": "a couple grows with the square of the speed; that of a coupling does not, and has 2X",
        "parallel_misalignment": "a force and a moment at the same node: a second measuring plane separates them",
    },
)
def angular_misalignment(
    structure,
    node: int | None = None,
    element: int | None = None,
    harmonics: AtLeastOne[int] = HARMONICS,
    coupled: bool = False,
):
    """Angular misalignment of a coupling: moments at multiples of the spin speed, independent of the speed.

    They act at a node, or, for a coupling modelled by an element, at both its ends in opposite directions. Each
    harmonic has its own amplitude and phase, backward ones (-1, -2, -3) and a constant one (0) included; the axial
    motion at 1X, invisible to radial probes, is not modelled. coupled: the bending stiffness of the coupling, which the
    rig lacks, acts on the tilt too; its asymmetry k_d, which rotates with the coupling, adds the moment
    -k_d e^{2jwt} conj(dz/ds), which gives 2X.
    """
    tilt, scales = across(structure, node, element, "tilt"), structure.scales
    end = node if element is None else element
    usual = 0.05 * scales.force * scales.lever(end)
    entries = {n: (Entry(tilt, on="one", shift=n),) for n in harmonics}
    moments = [Parameter(f"misalignment_moment_{n}X", "N m", e, usual, is_complex=True) for n, e in entries.items()]
    if not coupled:
        return moments
    pattern, usual = outer(tilt), 0.05 * scales.stiffness(end, "tilt")
    return [
        *moments,
        Parameter("coupling_stiffness", "N m", (Entry(-pattern),), usual),
        Parameter("coupling_asymmetry", "N m", (Entry(-pattern, on="conj", shift=2),), usual, is_complex=True),
    ]
