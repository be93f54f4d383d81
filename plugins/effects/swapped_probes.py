import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, probe_axis, sensor_unit


@Effect(
    source="Bently and Hatch 2002, Fundamentals of Rotating Machinery Diagnostics",
    acts_on="output",
    fixed=True,
    checked="with 1, x and y exchanged in time to 1e-12",
)
def swapped_probes(sensors, structure, node: int | None = None):
    """Cables of x and y swapped: z is measured as j conj(z), forward as backward; 1 is swapped, 0 is not.

    x and y are along the probes, at an angle a to those of the rotor: there conj(z) is e^{2ja} conj(z).
    """
    here, mirrored = np.diag(sensor_unit(sensors, node)), probe_axis(structure, sensors, node) ** 2
    return [Parameter("swapped_probes", "1", (Entry(-here), Entry(1j * mirrored * here, on="conj")), typical=1.0)]
