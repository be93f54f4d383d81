"""Figures of a rotordynamic analysis. Each function takes results and returns a matplotlib figure."""

from itertools import pairwise

import numpy as np

from rotorstudy.measurement.conventions import read_conventions
from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, phase_lag
from rotorstudy.presentation.probe_figures import probe_picture
from rotorstudy.store import as_complex

RPM = 60 / (2 * np.pi)
MIXED = 0.5  # of the direction: between the two signs of it, the whirl is called elliptic
SHAPES = 4  # modes drawn
TURN = np.linspace(0, 2 * np.pi, 60)


def rotor_figures(rig, analysis, measured=None):
    """All figures, {name: figure}.

    Parameters
    ----------
    rig : RigFile
    analysis : RotorAnalysis
    measured : (speed, probe), optional
        rad/s (speed,) and 1X of the probes of the analysis (speed, probe), complex, m.
    """
    found = {
        "campbell": campbell(analysis),
        "bode": bode(analysis, measured),
        "polar": polar(analysis, measured),
        "stability": stability(analysis),
    }
    if rig.model.structure.node_positions:
        found = {"rotor": rotor(rig), **found}
        if np.isfinite(analysis.data.frequency.values[-1]).any():
            found["mode_shapes"] = mode_shapes(rig.model.structure, analysis)
    conventions = read_conventions(rig.given, str(rig.path))
    if conventions.probes:
        found["probes"] = probe_picture(conventions, rig.model.structure.nodes, rig.model.structure.labels)
    return found


def rotor(rig):
    """The rotor to scale, with discs, bearings, probes and cracks."""
    from matplotlib.patches import Polygon, Rectangle

    model, given = rig.model, rig.given
    structure = model.structure
    places = structure.node_positions
    picture, axes = figure(1, 1, height=2.2, width=7.0)
    panel = axes[0, 0]
    nodes, ends = list(places), list(places.values())
    radius = {}
    for first, last in pairwise(ends):
        section = structure.section_at((first + last) / 2)
        radius[first] = max(section.outer_diameter_m, section.sleeve_diameter_m) / 2
        panel.add_patch(
            Rectangle((first, -radius[first]), last - first, 2 * radius[first], facecolor="0.85", edgecolor="0.5")
        )
    thickest = max([*radius.values(), *(disc.radius for disc in structure.discs)])
    for disc in structure.discs:
        thick = max(disc.thickness, 0.01 * structure.length)
        corner = (places[disc.node] - thick / 2, -disc.radius)
        panel.add_patch(Rectangle(corner, thick, 2 * disc.radius, facecolor=COLOURS[5], edgecolor="k", alpha=0.8))
    shaft = max(radius.values())
    for node in structure.bearing_nodes:
        x, wide = places[node], 0.015 * structure.length
        corners = [(x, -shaft), (x - wide, -shaft - 0.25 * thickest), (x + wide, -shaft - 0.25 * thickest)]
        panel.add_patch(Polygon(corners, facecolor=COLOURS[2], edgecolor="k"))
    for node in model.sensors:
        top = max([shaft, *(disc.radius for disc in structure.discs if disc.node == node)])
        arrow = {"arrowstyle": "->", "color": "k"}
        panel.annotate("", (places[node], top), (places[node], top + 0.35 * thickest), arrowprops=arrow)
    for position in crack_positions(given, places):
        panel.plot([position] * 2, [-1.3 * shaft, 1.3 * shaft], color=COLOURS[1], linewidth=2)
    for node in nodes:
        panel.text(places[node], -1.35 * thickest, str(node), ha="center", va="top", fontsize=6)
    panel.set(
        xlim=(-0.03 * structure.length, 1.03 * structure.length),
        ylim=(-1.7 * thickest, 1.4 * thickest),
        xlabel="position along the shaft (m); node numbers below the rotor",
        ylabel="radius (m)",
    )
    panel.set_aspect("equal" if structure.length < 12 * thickest else "auto")
    panel.grid(False)
    return picture


def crack_positions(rig, places):
    """Positions (m) of the cracks that a rig dict states: the middle of a cracked element, or `position_m`."""
    items = [*(rig.get("cracks") or []), *(rig.get("effects") or [])]
    found = [item["position_m"] for item in items if "depth_ratio" in item and "position_m" in item]
    elements = [item["element"] for item in rig.get("cracks") or [] if "element" in item]
    return found + [(places[element] + places[element + 1]) / 2 for element in elements]


def campbell(analysis):
    """Damped whirl frequency over speed, forward, backward and elliptic told apart, with 1X and the critical speeds."""
    data = analysis.data
    picture, axes = figure(1, 1, height=3.0, width=5.0)
    panel, speed = axes[0, 0], data.speed.values * RPM
    frequency, direction = data.frequency.values / (2 * np.pi), data.direction.values
    kinds = (
        ("forward whirl", direction > MIXED),
        ("elliptic whirl", np.abs(direction) <= MIXED),
        ("backward whirl", direction < -MIXED),
    )
    speeds = np.broadcast_to(speed[:, None], frequency.shape)
    for i, (label, chosen) in enumerate(kinds):
        if chosen.any():
            panel.plot(speeds[chosen], frequency[chosen], ".", color=COLOURS[(0, 4, 1)[i]], markersize=2.5, label=label)
    panel.plot(speed, speed / 60, ":", color="0.4", label="1X")
    marks = np.array([one.speed for one in analysis.resonant]) * RPM
    if len(marks):
        panel.plot(marks, marks / 60, MARKERS[0], color="k", fillstyle="none", label="critical speed", zorder=3)
    shown = frequency[np.isfinite(frequency)]
    top = min(shown.max(), 2.5 * speed[-1] / 60) if len(shown) else speed[-1] / 60
    panel.set(xlabel="speed (rpm)", ylabel="damped whirl frequency (Hz)", xlim=(0, speed[-1]), ylim=(0, 1.05 * top))
    panel.set_title(
        f"{len(marks)} critical speeds: {', '.join(f'{mark:.0f}' for mark in marks)} rpm"
        if len(marks)
        else f"No critical speed up to {speed[-1]:.0f} rpm"
    )
    panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return picture


def bode(analysis, measured=None):
    """Amplitude and phase lag of 1X over speed, for the probes of each node."""
    data = analysis.data
    response, speed = as_complex(data.unbalance_response), data.response_speed.values * RPM
    nodes = probes_by_node(data)
    picture, axes = figure(2, len(nodes), height=1.9, width=2.6, sharex=True)
    for column, (node, probes) in enumerate(nodes.items()):
        for i, (position, name) in enumerate(probes):
            amplitude, lag = 2e6 * np.abs(response[:, position]), phase_lag(response[:, position])
            axes[0, column].plot(speed, amplitude, color=COLOURS[i], label=name)
            axes[1, column].plot(speed, lag, color=COLOURS[i])
            if measured:
                points, shown = measured[1][:, position], measured[0] * RPM
                style = {"color": COLOURS[i], "marker": MARKERS[i], "linestyle": "", "fillstyle": "none"}
                axes[0, column].plot(shown, 2e6 * np.abs(points), **style)
                axes[1, column].plot(shown, _near(phase_lag(points), np.interp(shown, speed, lag)), **style)
        axes[0, column].set_title(f"node {node}")
        axes[0, column].legend()
        axes[1, column].set_xlabel("speed (rpm)")
    axes[0, 0].set_ylabel("1X (µm peak to peak)")
    axes[1, 0].set_ylabel("lag from the mark (°)")
    return picture


def polar(analysis, measured=None):
    """1X of each node's probes in the complex plane: each resonance a circle."""
    data = analysis.data
    response = as_complex(data.unbalance_response)
    nodes = probes_by_node(data)
    picture, axes = figure(1, len(nodes), height=2.8, width=2.8, subplot_kw={"projection": "polar"})
    for panel, (node, probes) in zip(axes[0], nodes.items(), strict=True):
        for i, (position, name) in enumerate(probes):
            one = response[:, position]
            panel.plot(-np.angle(one), 2e6 * np.abs(one), color=COLOURS[i], label=name)
            if measured:
                points = measured[1][:, position]
                panel.plot(-np.angle(points), 2e6 * np.abs(points), MARKERS[i], color=COLOURS[i], fillstyle="none")
        panel.set_title(f"node {node}")
        panel.set_rlabel_position(_emptiest(response[:, [position for position, _ in probes]]))
        panel.yaxis.get_major_locator().base.set_params(nbins=4)
    handles = max((panel.get_legend_handles_labels()[0] for panel in axes[0]), key=len)
    named = [dict.fromkeys(one[i][1] for one in nodes.values() if i < len(one)) for i in range(len(handles))]
    picture.legend(handles, [" / ".join(names) for names in named], loc="outside lower center", ncols=4)
    picture.suptitle("1X (µm peak to peak) over phase lag", fontsize=9)
    return picture


def _emptiest(vectors):
    """Phase lag, degrees, in the middle of the eighth of a turn that vectors (..., complex) reach into least."""
    middles = np.arange(22.5, 360, 45)
    lag = -np.angle(vectors.ravel(), deg=True)
    away = np.abs((lag - middles[:, None] + 180) % 360 - 180)
    return middles[np.where(away < 30, np.abs(vectors.ravel()), 0).max(axis=1).argmin()]


def mode_shapes(structure, analysis):
    """The lowest mode shapes at the highest speed: the plane of the largest motion, and its envelope."""
    data = analysis.data.isel(speed=-1)
    places = structure.node_positions
    moves = [(i, node) for i, (node, motion) in enumerate(structure.dofs) if motion == "translation"]
    at = np.array([places[node] for _, node in moves])
    rows = [i for i, _ in moves]
    count = min(SHAPES, int(np.isfinite(data.frequency.values).sum()))
    picture, axes = figure(1, count, height=2.0, width=2.2, sharey=True)
    forward, backward = as_complex(data.forward_shape)[:, rows], as_complex(data.backward_shape)[:, rows]
    for mode, panel in enumerate(axes[0]):
        orbit = forward[mode][:, None] * np.exp(1j * TURN) + backward[mode][:, None] * np.exp(-1j * TURN)
        largest = np.abs(orbit).max(axis=1)
        instant = np.abs(orbit[largest.argmax()]).argmax()
        line = orbit[:, instant] * np.exp(-1j * np.angle(orbit[largest.argmax(), instant]))
        panel.plot(at, largest / largest.max(), ":", color="0.5")
        panel.plot(at, -largest / largest.max(), ":", color="0.5")
        panel.plot(at, line.real / largest.max(), MARKERS[0] + "-", color=COLOURS[0], markersize=3)
        panel.axhline(0, color="k", linewidth=0.6)
        frequency, ratio = float(data.frequency[mode]) / (2 * np.pi), float(data.damping_ratio[mode])
        panel.set_title(f"{frequency:.3g} Hz, {whirl_name(float(data.direction[mode]))},\ndamping ratio {ratio:.2g}")
        panel.set_xlabel("position (m)")
    axes[0, 0].set_ylabel("motion over its largest (1)")
    return picture


def stability(analysis):
    """Growth rate of the fastest growing free motion over speed."""
    data = analysis.data
    picture, axes = figure(1, 1, height=2.2, width=5.0)
    panel, speed = axes[0, 0], data.growth_speed.values * RPM
    panel.plot(speed, data.growth_rate, color=COLOURS[0])
    panel.axhline(0, color="k", linewidth=0.8)
    title = f"Stable up to {speed[-1]:.0f} rpm"
    if analysis.threshold:
        panel.axvline(analysis.threshold * RPM, color=COLOURS[1], linestyle="--")
        title = f"Unstable from {analysis.threshold * RPM:.0f} rpm"
    panel.set(xlabel="speed (rpm)", ylabel="growth rate (1/s)", title=title, xlim=(0, speed[-1]))
    return picture


def whirl_name(direction):
    """The whirl of a direction of -1 to 1 in words."""
    return "elliptic" if abs(direction) <= MIXED else "forward" if direction > 0 else "backward"


def probes_by_node(data):
    """{node: [(position among the probes, name)]} of the data of an analysis."""
    found = {}
    for position, (node, name) in enumerate(zip(data.probe_node.values, data.probe.values, strict=True)):
        found.setdefault(int(node), []).append((position, str(name).split(" at ")[0]))
    return found


def _near(lag, curve):
    """Phase lags in degrees moved by whole revolutions to where they are nearest to those of a curve."""
    return lag + 360 * np.round((curve - lag) / 360)
