"""The figure of a comparison: orbits and 1X vectors of both states."""

import numpy as np

from rotorstudy.presentation.charts import deviations, speed_view
from rotorstudy.presentation.plots import COLOURS, figure, plot_orbit
from rotorstudy.response.series import synthesize
from rotorstudy.units import shown_unit, spin

MOST_NODES = 3
REACH = 2.45  # standard deviations of a 95 % circle of a complex number, each of its parts with one


def two_states(before, after, difference, mark=0.0):
    """Orbits at the speed of the largest change, and 1X at all speeds, a row per node, of two Spectra; mark : rad."""
    moving = difference.harmonics != 0
    change = np.sum(np.abs(difference.amplitude[:, moving]) ** 2, axis=1)  # (speed, sensor)
    speed = int(change.sum(axis=1).argmax())
    nodes = np.sort(np.argsort(-change.sum(axis=0))[:MOST_NODES])
    first = difference.harmonics.tolist().index(1)
    variance = np.diagonal(difference.covariance, axis1=-2, axis2=-1)  # (speed, sensor, component)
    unit, factor = shown_unit("m")
    reach = factor * REACH * np.sqrt(variance[..., first])
    w = float(after.speed[speed])
    time = (mark + np.linspace(0, 2 * np.pi, 400)) / w
    picture, axes = figure(len(nodes), 2, height=3.0, width=3.4)
    for row, node in enumerate(nodes):
        orbit, vectors = axes[row]
        for one, name, index, line in ((before, "before", 1, "--"), (after, "after", 0, "-")):
            motion = np.where(moving, one.amplitude[speed, :, node], 0)
            signal = synthesize(motion, w, one.harmonics, time)
            plot_orbit(signal, orbit, index=index, label=name, linestyle=line, mark=True)
            vector = factor * one.amplitude[:, first, node]
            vectors.plot(vector.real, vector.imag, "o" if index else "s", color=COLOURS[index], label=name)
        _changes(vectors, before, difference, first, node, reach[:, node])
        orbit.set_title(f"node {after.sensors[node]}: orbits at {spin(w)}")
        vectors.set_title("1X at all speeds, arrow: its change")
        vectors.set_aspect("equal", adjustable="datalim")
        vectors.set_xlabel(f"real part of 1X ({unit})")
        vectors.set_ylabel(f"imaginary part of 1X ({unit})")
        if row == 0:
            orbit.legend(loc="best")
            vectors.legend(loc="best")
    return picture


def both_states(before, after, axes):
    """Charts of both states side by side; axes : of `charts.axes_of`."""
    amplitude = {name: one.amplitude.transpose(0, 2, 1) for name, one in (("before", before), ("after", after))}
    change = np.abs(amplitude["after"] - amplitude["before"])[..., after.harmonics != 0].sum(axis=2)
    return speed_view(
        "states",
        after.speed,
        after.sensors,
        after.harmonics,
        {"before": ("before", 1, amplitude["before"]), "after": ("after", 0, amplitude["after"])},
        {"before": deviations(before), "after": deviations(after)},
        tuple(map(int, np.unravel_index(change.argmax(), change.shape))),
        axes,
    )


def _changes(axes, before, difference, first, node, reach):
    """An arrow from each vector of the state before along its change, and the 95 % circle of the change at its end."""
    from matplotlib.patches import Circle

    factor = shown_unit("m")[1]
    for start, change, radius in zip(
        factor * before.amplitude[:, first, node], factor * difference.amplitude[:, first, node], reach, strict=True
    ):
        end = start + change
        arrow = {"arrowstyle": "->", "color": COLOURS[2], "linewidth": 0.8}
        axes.annotate("", (end.real, end.imag), (start.real, start.imag), arrowprops=arrow)
        axes.add_patch(Circle((end.real, end.imag), radius, fill=False, color=COLOURS[2], linewidth=0.6))
