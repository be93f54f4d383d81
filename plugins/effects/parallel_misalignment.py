from rotorstudy.plugins import AtLeastOne, Effect, Entry, Parameter, hookimpl

HARMONICS = (2, 1, 3)


def parallel_misalignment(structure, node: int | None = None, harmonics: AtLeastOne[int] = HARMONICS):
    """Offset shafts in a coupling: a force at its node at 2X, 1X and 3X that does not grow with the speed.

    Free amplitude and phase for each harmonic, since couplings differ: 2X leads, 1X and 3X follow. A force that keeps
    to one direction has the backward harmonics too: list them.
    """
    here = structure.unit(structure.default_node() if node is None else node)
    return [
        Parameter(f"misalignment_force_{n}X", "N", (Entry(here, on="one", shift=n),), typical=1.0, is_complex=True)
        for n in harmonics
    ]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "parallel_misalignment",
        parallel_misalignment,
        source="harmonics as in Sekhar and Prabhu 1995, J. Sound Vib. 185; Xu and Marangoni 1994, J. Sound Vib. 176",
        checked="whirl F_n / |k - m n^2 w^2| of a Jeffcott rotor to 1e-12",
        confounders=(
            ("unbalance", "a misaligned coupling does not grow with the square of the speed, and has 2X"),
            (
                "bow",
                "equal at 1X on a rotor of one coordinate; a misaligned coupling has 2X, and its own place",
            ),
            ("runout", "a runout does not resonate where harmonic n meets a natural frequency"),
            (
                "shaft_asymmetry",
                "2X of an asymmetric shaft follows gravity and stays when the shaft is uncoupled",
            ),
            (
                "breathing_crack_weight",
                "a misaligned coupling has its own node and no 0X tied to 2X; an uncoupled run tells",
            ),
            ("angular_misalignment", "a force against a moment at the same node: a second plane tells them apart"),
        ),
    )
