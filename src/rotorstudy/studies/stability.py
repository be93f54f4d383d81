"""Instability by internal damping."""

import numpy as np

from rotorstudy.response.stability import eigenvalues, stability_threshold
from rotorstudy.response.whirl import time_invariant, without_damping
from rotorstudy.store import dataset


def damping_along_x(unknown):
    """Largest force along x, N, of a unit amplitude at a velocity of 1 m/s along x; 0 without damping there."""
    rates = [entry.matrix for entry in unknown.entries if entry.reads_motion and entry.order == 1]
    return np.abs(np.real(sum(rates, np.zeros((1, 1))))).max()


def stability(config, ratios=(0.5, 1.0, 2.0, 5.0), up_to=8.0):
    """A Dataset of growth rate and threshold of the uncracked rig for ratios of external to internal damping."""
    model = time_invariant(config.rig(config.main_rig))
    internal = model.position(["internal_damping"])[0]
    external = sum(
        value * damping_along_x(unknown)
        for unknown, value in zip(model.rotor_unknowns, model.theta[: len(model.rotor_unknowns)], strict=True)
        if unknown.name != "internal_damping"
    )
    undamped = np.abs(eigenvalues(model, [1.0], without_damping(model)).imag).min()
    relative = np.linspace(0.05, up_to, 160)
    growth, threshold = [], []
    for ratio in ratios:
        theta = model.theta.copy()
        theta[internal] = external / ratio
        growth.append(eigenvalues(model, relative * undamped, theta).real.max(axis=-1))
        found = stability_threshold(model, up_to * undamped, theta)
        threshold.append(np.nan if found is None else found)
    coordinates = {
        "damping_ratio": (np.array(ratios), "1", "external over internal damping"),
        "relative_speed": (relative, "1", "speed over natural frequency"),
    }
    variables = {
        "growth_rate": (tuple(coordinates), np.array(growth), "1/s", "largest real part of the eigenvalues"),
        "threshold": (("damping_ratio",), np.array(threshold), "rad/s", "speed where a whirl mode stops decaying"),
        "natural_frequency": ((), undamped, "rad/s", "undamped natural frequency"),
    }
    return dataset(variables, coordinates, title=f"{config.title}: stability")
