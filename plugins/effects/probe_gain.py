import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, probe_axis, sensor_unit


@Effect(
    source="API 670 (incremental scale factor within 5 %)",
    acts_on="output",
    nuisance=5e-3,
    checked="x (1 + g + m) and y (1 + g - m) in time to 1e-12",
    confounders={
        "unbalance": "a wrong gain scales every harmonic, an unbalance only 1X",
        "support_anisotropy": "a mismatch mirrors the same share of every harmonic, anisotropy does not",
        "reversed_probe": "a reversed probe mirrors the entire signal, a gain mismatch a few per cent of it",
    },
)
def probe_gain(sensors, structure, node: int | None = None):
    """Gain errors of the probes, g + m of x and g - m of y: z is measured as (1 + g) z + m conj(z).

    x and y are along the probes, at an angle a to those of the rotor: there conj(z) is e^{2ja} conj(z).

    The static deflection is multiplied only where displacements count from the unloaded line.
    """
    here, mirrored = np.diag(sensor_unit(sensors, node)), probe_axis(structure, sensors, node) ** 2
    return [
        Parameter("gain_error", "1", (Entry(here),), typical=0.05),
        Parameter("gain_mismatch", "1", (Entry(mirrored * here, on="conj"),), typical=0.05),
    ]
