from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


def shaft_asymmetry(structure):
    """Shaft with two bending stiffnesses (keyway, flat, open crack): force -epsilon K e^{2jwt} conj(q).

    Stiffer by the share epsilon in a direction that rotates with the shaft, softer across; the phase of the amplitude
    is twice its angle. Gravity causes 2X.
    """
    entry = Entry(-structure.stiffness, on="conj", shift=2)
    return [Parameter("shaft_asymmetry", "1", (entry,), typical=0.02, is_complex=True)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "shaft_asymmetry",
        shaft_asymmetry,
        source="Tondl 1965; Gasch, Nordmann, Pfuetzner, Rotordynamik, unround shaft",
        fold=2,
        checked="0X and 2X from gravity to closed form to 1e-12; no 1X without unbalance",
        confounders=(
            ("support_anisotropy", "fixed anisotropy couples n with -n, rotating asymmetry n with 2 - n"),
            (
                "breathing_crack",
                "under gravity a constant asymmetry gives 2X only, a breathing crack 1X and 3X too; an open crack also "
                "lowers the mean stiffness",
            ),
            (
                "transverse_crack",
                "under gravity a constant asymmetry gives 2X only, a breathing crack 1X and 3X too; an open crack also "
                "lowers the mean stiffness",
            ),
            (
                "parallel_misalignment",
                "the 2X of an asymmetric shaft is caused by gravity and remains when the shaft is uncoupled",
            ),
        ),
    )
