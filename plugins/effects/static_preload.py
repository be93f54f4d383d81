from rotorstudy.plugins import Effect, Entry, Parameter


@Effect(
    source="Newton",
    checked="0X of a Jeffcott rotor is F / k to 1e-12, no other harmonic changes; films integrated in time to 2e-3",
)
def static_preload(structure, node: int | None = None):
    """Constant force (belt, gear mesh, misaligned bearing line): a deflection at 0X, and another load of oil films.

    Where films carry the rotor, their coefficients show it also without 0X; a load and its opposite give the same film.
    At 0X the journals move by the stiffness of their films at the new load.
    """
    here = structure.unit(node)
    usual = 0.25 * structure.scales.force
    return [Parameter("static_preload", "N", (Entry(here, on="one"),), typical=usual, is_complex=True)]
