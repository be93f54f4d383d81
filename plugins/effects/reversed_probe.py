from typing import Literal

import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, probe_axis, sensor_unit


@Effect(
    source="Bently and Hatch 2002, Fundamentals of Rotating Machinery Diagnostics",
    acts_on="output",
    fixed=True,
    places=lambda structure, sensors: [{"node": n, "probe": probe} for n in sensors for probe in ("x", "y")],
    checked="with 1, x or y negative in time to 1e-12",
    confounders={"swapped_probes": "they differ by 90 degrees: a tap on the shaft, or what the weight causes, tells"},
)
def reversed_probe(sensors, structure, node: int | None = None, probe: Literal["x", "y"] = "x"):
    """One probe with the wrong sign: z is measured as -conj(z) for x, as conj(z) for y; 1 is reversed, 0 is not.

    x and y are along the probes, at an angle a to those of the rotor: there conj(z) is e^{2ja} conj(z).
    """
    here = np.diag(sensor_unit(sensors, node))
    mirrored = probe_axis(structure, sensors, node) ** 2 * (-here if probe == "x" else here)
    return [Parameter(f"reversed_probe_{probe}", "1", (Entry(-here), Entry(mirrored, on="conj")), typical=1.0)]
