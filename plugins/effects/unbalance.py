from rotorstudy.plugins import Effect, Entry, Parameter, Positive


@Effect(
    source="thesis Eq. (2.7)",
    place_rate=lambda structure, node: structure.mass_share(node),  # every part of the mass may be off centre
    # four of ten changes: deposits, losses, a disc put on again; a bent shaft is one of a hundred (Buscarello,
    # Practical Solutions to Machinery and Maintenance Vibration Problems, chapter 1)
    change_rate=20.0,
    at_discs=True,
    checked="whirl e eta^2 / |1 - eta^2| of a Jeffcott rotor to 1e-12",
)
def unbalance(structure, node: int | None = None, mass_kg: Positive | None = None):
    """Mass centre at a distance e from the shaft centre, at angle phi: force m e w^2 e^{j(wt + phi)}.

    mass_kg: by default that of the node; phi is measured from the shaft's reference line.
    """
    here = structure.unit(node)
    mass = here @ structure.mass @ here if mass_kg is None else mass_kg
    entry = Entry(mass * here, on="one", shift=1, gain=lambda speed: speed**2)
    scales = structure.scales
    usual = 0.4 * scales.length * (scales.mass / mass if mass else 1.0)  # the same unbalance at a light node
    also = {"unbalance": ("kg m", 1 / mass)} if mass else {}
    return [Parameter("eccentricity", "m", (entry,), usual, is_complex=True, also=also)]
