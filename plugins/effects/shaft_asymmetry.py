from rotorstudy.plugins import Effect, Entry, Parameter


@Effect(
    source="Tondl 1965; Gasch, Nordmann, Pfuetzner, Rotordynamik, unround shaft",
    places=lambda structure, sensors: [{}, *structure.stretches()],
    fold=2,
    checked="0X and 2X from gravity to closed form to 1e-12; no 1X without unbalance",
    confounders={
        "support_anisotropy": "fixed anisotropy couples n with -n, rotating asymmetry n with 2 - n",
        "transverse_crack": "under gravity a constant asymmetry gives 2X only, a breathing crack 1X and 3X too; "
        "an open crack also lowers the mean stiffness",
    },
)
def shaft_asymmetry(structure, element: int | None = None, last_element: int | None = None):
    """Shaft with two bending stiffnesses (keyway, flat, open crack): force -epsilon K e^{2jwt} conj(q).

    Stiffer by the share epsilon in a direction that rotates with the shaft, softer across it; the phase of the
    amplitude is twice the angle of that direction. Gravity causes 2X. K is the stiffness of the whole shaft, of an
    element, or of all from that to a last one.
    """
    shaft = structure.stiffness if element is None else structure.stiffness_of(element, last_element)
    entry = Entry(-shaft, on="conj", shift=2)
    return [Parameter("shaft_asymmetry", "1", (entry,), typical=0.02, is_complex=True)]
