import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl, sensor_unit


def swapped_probes(sensors, node: int | None = None):
    """Cables of x and y exchanged: z shows j conj(z), so forward looks backward; 1 is swapped, 0 is not."""
    here = np.diag(sensor_unit(sensors, node))
    return [Parameter("swapped_probes", "1", (Entry(-here), Entry(1j * here, on="conj")), typical=1.0)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "swapped_probes",
        swapped_probes,
        source="Bently and Hatch 2002, Fundamentals of Rotating Machinery Diagnostics",
        acts_on="output",
        fixed=True,
        checked="with 1, x and y exchanged in time to 1e-12",
        confounders=(
            ("probe_angle", "swapped probes mirror the whole signal, a skew a few per cent"),
            (
                "reversed_probe",
                "they differ by a quarter turn, which weight-driven harmonics or a tap on the shaft tell",
            ),
        ),
    )
