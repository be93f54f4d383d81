import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, sensor_unit


@Effect(
    source="API 670 (scale factor within 5 %, probes 90 degrees apart within 5); rotation of axes",
    acts_on="output",
    shape={"direction_rad": (-np.pi / 2, np.pi / 2)},
    checked="one probe of two, at 75 degrees, with gain 1.25 and turned by 15 degrees, in time to 1e-12",
    confounders={
        "probe_gain": "equal for the gain of a probe along x or y; exchange the probes, and the error moves along",
        "support_anisotropy": "a wrong probe mirrors the same share of every harmonic, anisotropy does not",
        "reversed_probe": "a reversed probe mirrors the entire signal, a wrong gain a part of it",
    },
)
def probe_error(sensors, node: int | None = None, direction_rad: float = 0.0):
    """One wrong probe of a pair: r = (x, y) is measured as r + d (p d . r + q e . r).

    d, at direction_rad from x, is perpendicular to the other probe; e is 90 degrees ahead of d. If the probes are at
    right angles, the wrong one is along d, and with its gain g and the error a of its angle p = g cos a - 1 and
    q = g sin a exactly.
    """
    here, turned = np.diag(sensor_unit(sensors, node)) / 2, np.exp(2j * direction_rad)
    along = (Entry(here), Entry(turned * here, on="conj"))
    across = (Entry(-1j * here), Entry(1j * turned * here, on="conj"))
    return [
        Parameter("probe_error_along", "1", along, typical=0.05),
        Parameter("probe_error_across", "1", across, typical=0.05),
    ]
