from rotorstudy.plugins import Effect, Entry, Parameter, Whole, sensor_unit


@Effect(
    source="API 670",
    acts_on="output",
    hypothesis={"highest": 4},
    base_rate=1e-5,  # its many numbers describe what the runout of one plane explains too
    checked="the same harmonics at every speed to 1e-12",
    confounders={
        "runout": "that of one plane is zero at the others",
        "unbalance": "a runout is the same at all speeds, also at slow roll and at the critical speed",
        "bow": "equal at slow roll; a bow is amplified at the critical speed, a runout is not",
        "parallel_misalignment": "a runout is not amplified where harmonic n meets a natural frequency",
    },
)
def shaft_runout(sensors, structure, highest: Whole = 1):
    """Surface of the shaft measured as motion at all probes: each harmonic up to the highest the same at all speeds.

    One cause, as every shaft has it in every plane; `runout` is that of one plane.
    """
    return [
        Parameter(
            f"runout_{harmonic}X_at_node_{node}",
            "m",
            (Entry(sensor_unit(sensors, node), on="one", shift=harmonic),),
            0.04 * structure.scales.length,
            is_complex=True,
        )
        for node in sensors
        if node not in structure.casings
        for order in range(1, highest + 1)
        for harmonic in (order, -order)
    ]
