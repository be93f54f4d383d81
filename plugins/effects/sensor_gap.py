from rotorstudy.model import sensor_unit
from rotorstudy.plugins import Effect, hookimpl
from rotorstudy.terms import Entry, Parameter


def sensor_gap(sensors, node: int | None = None):
    """Distance of the probes from the shaft at rest: a constant added to the displacement they show."""
    entry = Entry(sensor_unit(sensors, node), on="one")
    return [Parameter("sensor_gap", "m", (entry,), typical=1e-3, is_complex=True)]


@hookimpl
def rotorstudy_effect():
    return Effect("sensor_gap", sensor_gap, source="thesis section 3.4", acts_on="output")
