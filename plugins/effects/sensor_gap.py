from rotorstudy.plugins import Effect, Entry, Parameter, sensor_unit


@Effect(
    source="thesis section 3.4",
    acts_on="output",
    candidate=False,
    nuisance="clearance",
    checked="a constant at 0X to 1e-12",
    confounders={"static_preload": "a preload deflects all sensors in a known shape, a gap is independent at each"},
)
def sensor_gap(sensors, structure, node: int | None = None):
    """Gap between probes and shaft: a constant added to the measured displacement."""
    entry = Entry(sensor_unit(sensors, node), on="one")
    return [Parameter("sensor_gap", "m", (entry,), typical=40 * structure.scales.length, is_complex=True)]
