from rotorstudy.plugins import Effect, Feared, Parameter, changeable_numbers, number_slope


@Effect(
    source="of a film: Friswell, Penny, Garvey and Lees 2010, Dynamics of Rotating Machines, 5.5",
    places=changeable_numbers,
    changes_bearing=True,
    feared=Feared(
        "bearing_change",
        10.0,
        places=lambda structure: [(w,) * 2 for w in changeable_numbers(structure) if "node" in w],
    ),
    checked="response equal to that of a rotor on a bearing built with the other number to 1e-12",
    confounders={"bearing_coefficients": "a film changes with the speed as its number says, free coefficients do not"},
)
def bearing_change(structure, number: str, node: int | None = None):
    """A number of a bearing is another one than the rig states: a worn or cleaned film, hot or thin oil.

    number: such as radial_clearance_m or viscosity_Pa_s. The amplitude is its relative change; bearings are not linear
    in it, so they are built anew with it. Without a node all bearings change that have it, as with their oil.
    """
    return [Parameter("bearing_change", "1", number_slope(structure, node, number), typical=0.1)]
