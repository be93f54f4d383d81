from rotorstudy.plugins import Effect, Entry, Parameter


@Effect(
    source="Newton",
    places=lambda structure, sensors: [{}] if structure.static_load.any() else [],
    checked="0X of a Jeffcott rotor is j alpha m g / k to 1e-12",
    confounders={
        "static_preload": "equal on a rotor of one coordinate; gravity acts on every mass, a preload on one node",
        "probe_angle": "rotated probes rotate every harmonic, gravity only 0X and what the weight causes",
    },
)
def gravity_direction(structure):
    """Weight inclined from the x axis by alpha towards y: static force j alpha f, linear (1 % error at 8 degrees).

    The direction of a weight-dominant crack force does not change; to rotate everything, rotate the probes.
    """
    return [Parameter("gravity_direction", "rad", (Entry(1j * structure.static_load, on="one"),), typical=0.03)]
