from rotorstudy.plugins import Effect, Entry, Parameter


@Effect(
    source="Zorzi and Nelson 1977",
    positive=True,
    checked="-beta K (dq/dt - j w q) in time to 1e-12, so no force at +1X",
)
def shaft_damping(structure):
    """Viscous damping of the rotating shaft, proportional to its stiffness: force -beta K (q' - j w q)."""
    shaft = structure.stiffness
    entries = (Entry(-shaft, order=1), Entry(1j * shaft, gain=lambda speed: speed))
    return [Parameter("shaft_damping", "s", entries, typical=0.02 / structure.scales.frequency)]
