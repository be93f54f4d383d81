from rotorstudy.plugins import Effect, Entry, Parameter

SOURCE = "Rayleigh 1877, The Theory of Sound, volume 1, section 97"
CHECKED = "damping ratio {} of the modes of a shaft at standstill"


@Effect(source=SOURCE, candidate=False, positive=True, checked=CHECKED.format("a / (2 w)"))
def mass_proportional_damping(structure):
    """Damping to ground in proportion to the mass of the rotor: force -a M dz/dt (the first part of Rayleigh's)."""
    usual = 0.02 * structure.scales.frequency
    return [Parameter("mass_proportional_damping", "1/s", (Entry(-structure.mass, order=1),), typical=usual)]


@Effect(source=SOURCE, candidate=False, positive=True, checked=CHECKED.format("b w / 2"))
def stiffness_proportional_damping(structure):
    """Damping to ground in proportion to the stiffness of the rotor: force -b K dz/dt (the second part of Rayleigh's).

    It does not rotate, as in other programs; damping of the shaft itself does, see `shaft_damping`.
    """
    usual = 0.02 / structure.scales.frequency
    return [Parameter("stiffness_proportional_damping", "s", (Entry(-structure.stiffness, order=1),), typical=usual)]
