from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


def static_preload(structure, node: int | None = None):
    """Constant force (belt, gear mesh, misaligned bearing line): a deflection at 0X."""
    here = structure.unit(structure.default_node() if node is None else node)
    usual = 0.25 * structure.scales.force
    return [Parameter("static_preload", "N", (Entry(here, on="one"),), typical=usual, is_complex=True)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "static_preload",
        static_preload,
        source="Newton",
        checked="0X of a Jeffcott rotor is F / k to 1e-12, no other harmonic changes",
        confounders=(
            (
                "gravity_direction",
                "equal on a rotor of one coordinate; inclined gravity acts on every mass, a preload on one node",
            ),
            (
                "sensor_gap",
                "a preload deflects the shaft at all sensors in a known shape, a gap is independent at each",
            ),
        ),
    )
