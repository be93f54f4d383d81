from rotorstudy.plugins import Effect, Entry, Parameter


@Effect(
    source="Genta 2005, Dynamics of Rotating Systems; ISO 1940-1",
    places=lambda structure, sensors: [{"node": n} for n, motion in structure.dofs if motion == "tilt"],
    place_rate=lambda structure, node: structure.mass_share(node),  # it takes a mass that is inclined
    checked="equal to two opposite unbalances l apart with moment m e l to 5e-3",
    confounders={"unbalance": "a couple tilts the rotor: two measuring planes, or the mode at a critical speed, tell"},
)
def couple_unbalance(structure, node: int | None = None):
    """Principal axis of a disc inclined by tau to the shaft: moment (I_d - I_p) tau w^2 e^{j(wt + beta)}.

    The amplitude is (I_d - I_p) tau, as measured by a balancing machine; the moment acts on the tilt of the node.
    """
    entry = Entry(structure.unit(node, "tilt"), on="one", shift=1, gain=lambda speed: speed**2)
    scales = structure.scales
    usual = 0.3 * scales.length * scales.mass * scales.lever(node)
    return [Parameter("couple_unbalance", "kg m2", (entry,), usual, is_complex=True)]
