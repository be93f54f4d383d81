from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


def static_preload(structure, node: int | None = None):
    """Constant force (belt, gear mesh, misaligned bearing line): a deflection at 0X."""
    here = structure.unit(node)
    usual = 0.25 * structure.scales.force
    return [Parameter("static_preload", "N", (Entry(here, on="one"),), typical=usual, is_complex=True)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "static_preload",
        static_preload,
        source="Newton",
        checked="0X of a Jeffcott rotor is F / k to 1e-12, no other harmonic changes",
    )
