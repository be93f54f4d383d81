"""Stiffness and damping over speed of every bearing of the plugin library, each with its example."""

import numpy as np

from rotorstudy.authoring.invariants.bench import bench_structure, typical_term
from rotorstudy.errors import RotorstudyError
from rotorstudy.model.bearings import dynamic_stiffness
from rotorstudy.model.registry import registry
from rotorstudy.store import dataset

SPEEDS = np.linspace(50.0, 400.0, 71)  # rad/s: from slow roll to beyond the first critical speed of a test rig
DIRECTIONS = ("xx", "xy", "yx", "yy")


def all_bearings():
    """Bearing plugins in a fixed order."""
    return [plugin for kind, plugin in registry() if kind == "bearing"]


def bearing_coefficients(plugins, speeds=SPEEDS):
    """Synchronous coefficients of the plugins' examples, every amplitude at its typical size.

    speeds  : (speed,) rad/s
    returns : stiffness, damping (bearing, speed, direction), NaN where a bearing refuses the speed; x is down, and xy
              is the force along x by a motion along y
    """
    found = np.array([[_at(plugin, w) for w in speeds] for plugin in plugins]).reshape(len(plugins), len(speeds), 4)
    coordinates = {
        "bearing": ([plugin.name for plugin in plugins], "1", "bearing plugin"),
        "speed": (speeds, "rad/s", "spin speed"),
        "direction": (list(DIRECTIONS), "1", "of the force, of the motion; x down"),
    }
    variables = {
        "stiffness": (tuple(coordinates), found.real, "N/m", "real part of the dynamic stiffness at +-1X"),
        "damping": (tuple(coordinates), found.imag / speeds[:, None], "N s/m", "its imaginary part over the speed"),
    }
    return dataset(variables, coordinates, title="Stiffness and damping of every bearing over speed")


def _at(plugin, speed):
    """(2, 2) dynamic stiffness at one speed."""
    try:
        return dynamic_stiffness(typical_term(plugin, bench_structure()), [speed], [1])[0, 0]
    except RotorstudyError:
        return np.full((2, 2), np.nan)
