from rotorstudy.plugins import AtLeastOne, Effect, Entry, Parameter, hookimpl

HARMONICS = (2, 1, 3)


def parallel_misalignment(structure, node: int | None = None, harmonics: AtLeastOne[int] = HARMONICS):
    """Parallel misalignment of a coupling: a force at its node at 2X, 1X and 3X, independent of the speed.

    Each harmonic has its own amplitude and phase, since couplings differ; 2X usually dominates. A force of fixed
    direction has backward harmonics too: list them.
    """
    here = structure.unit(structure.default_node() if node is None else node)
    usual = 0.05 * structure.scales.force
    return [
        Parameter(f"misalignment_force_{n}X", "N", (Entry(here, on="one", shift=n),), typical=usual, is_complex=True)
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
            ("bow", "equal at 1X on a rotor of one coordinate; a misaligned coupling has 2X and acts at its own node"),
            ("runout", "a runout is not amplified where harmonic n meets a natural frequency"),
            (
                "shaft_asymmetry",
                "the 2X of an asymmetric shaft is caused by gravity and remains when the shaft is uncoupled",
            ),
            (
                "breathing_crack_weight",
                "a misaligned coupling acts at its own node and has no 0X related to 2X; run the rotor uncoupled",
            ),
            ("angular_misalignment", "a force and a moment at the same node: a second measuring plane separates them"),
        ),
    )
