"""Campbell diagram and critical speeds of every rig of a study."""

import numpy as np

from rotorstudy.stability import eigenvalues
from rotorstudy.store import dataset
from rotorstudy.studies.config import SPEED
from rotorstudy.whirl import critical_speeds, time_invariant

ORDERS = (1, 2, 3, -1)


def whirl(config, up_to=6.0):
    """Whirl of the uncracked rotor without damping over speed.

    up_to   : times the lowest natural frequency
    returns : frequency (rig, speed, mode) rad/s, positive forward; critical_speed (rig, order, critical) rad/s, NaN
              where there are fewer; natural_frequency (rig) rad/s
    """
    models = {}
    for name in config.rigs:
        model = time_invariant(config.rig(name))
        damping = [u.kind for u in model.terms if u.kind.endswith("_damping")]
        models[name] = model.without(damping)
    natural = [np.abs(eigenvalues(model, [1e-3]).imag).min() for model in models.values()]
    highest = up_to * max(natural)
    speeds = np.linspace(highest / 300, highest, 300)
    frequency = np.array([eigenvalues(model, speeds).imag for model in models.values()])
    found = [[critical_speeds(model, highest, order) for order in ORDERS] for model in models.values()]
    most = max(len(values) for rig in found for values in rig)
    critical = np.full((len(models), len(ORDERS), most), np.nan)
    for r, rig in enumerate(found):
        for o, values in enumerate(rig):
            critical[r, o, : len(values)] = values
    coordinates = {
        "rig": (list(models), "1", "rig"),
        "speed": (speeds, *SPEED),
        "mode": (np.arange(frequency.shape[-1]), "1", "whirl mode, by frequency"),
        "order": (list(ORDERS), "1", "multiple of the spin speed"),
        "critical": (np.arange(most), "1", "number of the critical speed"),
    }
    variables = {
        "frequency": (("rig", "speed", "mode"), frequency, "rad/s", "whirl frequency, positive forward"),
        "critical_speed": (("rig", "order", "critical"), critical, "rad/s", "critical speed"),
        "natural_frequency": (("rig",), np.array(natural), "rad/s", "lowest natural frequency at rest"),
    }
    return dataset(variables, coordinates, title=f"{config.title}: whirl")
