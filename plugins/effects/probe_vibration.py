from typing import Literal

from rotorstudy.plugins import Effect, Entry, Parameter, probe_axis, sensor_unit


@Effect(
    source="API 670 (brackets of probes are rigid); Bently and Hatch 2002",
    acts_on="output",
    candidate=False,  # a runout, forward and backward, of one probe: one cause, one name
    places=lambda structure, sensors: [{"node": n, "probe": probe} for n in sensors for probe in ("x", "y")],
    checked="the reading of one probe in time to 1e-12",
    confounders={"runout": "both probes see a runout; a bracket that vibrates is seen by one probe"},
)
def probe_vibration(sensors, structure, node: int | None = None, probe: Literal["x", "y"] = "x"):
    """One probe moves on its bracket, or picks up a disturbance: its reading gets c cos wt - s sin wt at all speeds.

    That is d (c + js) / 2 forward and d (c - js) / 2 backward, d the direction of the probe.
    """
    here = sensor_unit(sensors, node) * probe_axis(structure, sensors, node) * (0.5 if probe == "x" else 0.5j)
    cosine = (Entry(here, on="one", shift=1), Entry(here, on="one", shift=-1))
    sine = (Entry(1j * here, on="one", shift=1), Entry(-1j * here, on="one", shift=-1))
    usual = 0.04 * structure.scales.length
    return [
        Parameter("probe_vibration_cosine", "m", cosine, usual),
        Parameter("probe_vibration_sine", "m", sine, usual),
    ]
