"""Stiffness and damping over speed of every bearing of the plugin library, each with its example."""

import numpy as np

from rotorstudy.authoring.invariants.bench import bench_structure, typical_term
from rotorstudy.errors import RotorstudyError
from rotorstudy.model.bearings import dynamic_stiffness
from rotorstudy.model.registry import registry
from rotorstudy.presentation.plots import COLOURS, figure, finished, save_figure
from rotorstudy.store import provenance, save
from rotorstudy.studies.common import results

SPEEDS = np.linspace(50.0, 400.0, 71)  # rad/s: from slow roll to beyond the first critical speed of a test rig
SHOWN = (("stiffness", 1e-6, "MN/m"), ("damping", 1e-3, "kN s/m"))
LINES = {"xx": "-", "xy": "-.", "yx": ":", "yy": "--"}  # distinguishable where they coincide


def bearing_coefficients(plugins, speeds=SPEEDS):
    """A Dataset of synchronous coefficients of the plugins' examples over speed; NaN where a bearing refuses it."""
    terms = {plugin.name: typical_term(plugin, bench_structure()) for plugin in plugins}

    def at(name, speed):
        try:
            stiffness = dynamic_stiffness(terms[name], [speed], [1])[0, 0].ravel()
        except RotorstudyError:
            return {}
        return {"stiffness": stiffness.real, "damping": stiffness.imag / speed}

    title, given = "Stiffness and damping of every bearing over speed", {"bearing": list(terms), "speed": speeds}
    return results("bearings", title, tuple(given), at, **given, direction=list(LINES))


def plot_bearing_coefficients(data):
    """A figure with a row for each bearing: stiffness in MN/m and damping in kN s/m over speed."""
    picture, axes = figure(rows=data.sizes["bearing"], columns=2, height=1.6, sharex=True)
    for row, name in zip(axes, data.bearing.values, strict=True):
        for panel, (quantity, scale, unit) in zip(row, SHOWN, strict=True):
            for d, (direction, line) in enumerate(LINES.items()):
                values = data[quantity].sel(bearing=name, direction=direction) * scale
                panel.plot(data.speed, values, line, color=COLOURS[d], label=direction)
            panel.set(ylabel=f"{quantity} ({unit})", title=name.replace("_", " "))
    for panel in axes[-1]:
        panel.set_xlabel("spin speed (rad/s)")
    picture.align_ylabels()
    told = "Coefficients of every bearing plugin: only some depend on the speed"
    return finished(picture, told, legend=4, title="force along, motion along; x down, at 1X")


def write_bearings(data, pictures):
    """Write the coefficients of all bearings, and their figure, to paths."""
    plugins = [plugin for kind, plugin in registry() if kind == "bearing"]  # which state their examples
    found = bearing_coefficients(plugins)
    save(found.assign_attrs(provenance({"speed_rad_s": SPEEDS.tolist()}, plugins)), data)
    save_figure(plot_bearing_coefficients(found), *pictures)
