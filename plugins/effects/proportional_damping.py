from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


def mass_proportional_damping(structure):
    """Damping to ground in proportion to the mass of the rotor: force -a M dz/dt (the first part of Rayleigh's)."""
    usual = 0.02 * structure.scales.frequency
    return [Parameter("mass_proportional_damping", "1/s", (Entry(-structure.mass, order=1),), typical=usual)]


def stiffness_proportional_damping(structure):
    """Damping to ground in proportion to the stiffness of the rotor: force -b K dz/dt (the second part of Rayleigh's).

    It does not rotate, as in other programs; damping of the shaft itself does, see `shaft_damping`.
    """
    usual = 0.02 / structure.scales.frequency
    return [Parameter("stiffness_proportional_damping", "s", (Entry(-structure.stiffness, order=1),), typical=usual)]


@hookimpl
def rotorstudy_effect():
    return [
        Effect(
            function.__name__,
            function,
            source="Rayleigh 1877, The Theory of Sound, volume 1, section 97",
            candidate=False,
            positive=True,
            checked=f"damping ratio {ratio} of the modes of a shaft at standstill",
        )
        for function, ratio in ((mass_proportional_damping, "a / (2 w)"), (stiffness_proportional_damping, "b w / 2"))
    ]
