"""Campbell diagram and critical speeds of every rig of a study."""

import numpy as np

from rotorstudy.response.stability import eigenvalues
from rotorstudy.response.whirl import critical_speeds, time_invariant, without_damping
from rotorstudy.store import dataset
from rotorstudy.studies.common import SPEED

ORDERS = (1, 2, 3, -1)


def whirl(config, up_to=6.0):
    """A Dataset of the whirl of the uncracked rotor without damping, up to a multiple of its natural frequency."""
    models = {name: time_invariant(config.rig(name)) for name in config.rigs}
    thetas = {name: without_damping(model) for name, model in models.items()}
    natural = [np.abs(eigenvalues(model, [1e-3], thetas[name]).imag).min() for name, model in models.items()]
    highest = up_to * max(natural)
    speeds = np.linspace(highest / 300, highest, 300)
    frequency = np.array([eigenvalues(model, speeds, thetas[name]).imag for name, model in models.items()])
    is_mirrored = np.allclose(frequency, -frequency[..., ::-1], rtol=1e-6, atol=1e-6 * highest)
    if is_mirrored:  # on anisotropic bearings each mode appears at plus and minus its frequency
        frequency = frequency[..., frequency.shape[-1] // 2 :]
    found = [critical_speeds(model, highest, ORDERS, thetas[name]) for name, model in models.items()]
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
