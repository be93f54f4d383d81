"""Figures of a rotordynamic analysis. Each function takes results and returns a matplotlib figure."""

from itertools import pairwise

import numpy as np

from rotorstudy.measurement.conventions import read_conventions
from rotorstudy.presentation.bode_figures import bode, polar
from rotorstudy.presentation.plots import COLOURS, MARKERS, figure
from rotorstudy.presentation.probe_figures import probe_picture
from rotorstudy.store import as_complex
from rotorstudy.studies.stability_margin import LEAST_DECREMENT, first_forward, log_decrement
from rotorstudy.units import shown_speed

MIXED = 0.5  # of the direction: between the two signs of it, the whirl is called elliptic
SHAPES = 4  # modes drawn
TURN = np.linspace(0, 2 * np.pi, 60)


def rotor_figures(rig, analysis, measured=None, operating=None):
    """All figures, {name: figure}; measured : speeds, rad/s, and 1X of the probes (speed, probe), m."""
    data = analysis.data
    speed, curves = data.response_speed.values, by_probe(data, as_complex(data.unbalance_response))
    points = by_probe(analysis.data, measured[1]) if measured else None
    marks = [one.speed for one in analysis.resonant], [operating] if operating else []
    found = {
        "campbell": campbell(analysis, marks[1]),
        "bode": bode(speed, curves, points, measured and measured[0], *marks),
        "polar": polar(speed, curves, points),
        "stability": stability(analysis),
    }
    if analysis.centrelines:
        found["centreline"] = centreline(analysis.centrelines, rig.model.structure)
    if len(rig.model.structure.node_positions) > 1:  # else nothing is known of the shaft between nodes
        found = {"rotor": rotor(rig), **found}
        highest = operating[1] if operating else analysis.data.speed[-1]
        modes = analysis.data.sel(speed=highest, method="nearest")
        if np.isfinite(modes.frequency.values).any():
            found["mode_shapes"] = mode_shapes(rig.model.structure, modes, rig.model.sensors)
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
        size, style = (last - first, 2 * radius[first]), {"facecolor": "0.85", "edgecolor": "0.5"}
        panel.add_patch(Rectangle((first, -radius[first]), *size, **style))
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
    for node in (structure.casings.get(node, node) for node in model.sensors):
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


def whirl_kinds(data):
    """[(name, (speed, mode) bool)] of the whirl of each mode of the data of an analysis."""
    direction = data.direction.values
    return (
        ("forward whirl", direction > MIXED),
        ("elliptic whirl", np.abs(direction) <= MIXED),
        ("backward whirl", direction < -MIXED),
    )


def campbell(analysis, bands=()):
    """Damped whirl frequency over speed, forward, backward and elliptic told apart, with 1X and the critical speeds."""
    data, (unit, per) = analysis.data, shown_speed()
    picture, axes = figure(1, 1, height=3.0, width=5.0)
    panel, speed = axes[0, 0], data.speed.values
    frequency = data.frequency.values / (2 * np.pi)
    speeds = np.broadcast_to(per * speed[:, None], frequency.shape)
    for i, (label, chosen) in enumerate(whirl_kinds(data)):
        if chosen.any():
            panel.plot(speeds[chosen], frequency[chosen], ".", color=COLOURS[(0, 2, 1)[i]], markersize=2.5, label=label)
    panel.plot(per * speed, speed / (2 * np.pi), ":", color="0.4", label="1X")
    marks = np.array([one.speed for one in analysis.resonant])
    if len(marks):
        style = {"color": "k", "fillstyle": "none", "label": "critical speed", "zorder": 3}
        panel.plot(per * marks, marks / (2 * np.pi), MARKERS[0], **style)
    for i, (low, high) in enumerate(bands):
        label = "operating speeds" if i == 0 else None
        panel.axvspan(per * low, per * high, color="0.5", alpha=0.15, linewidth=0, label=label)
    shown = frequency[np.isfinite(frequency)]
    highest = speed[-1] / (2 * np.pi)
    top = min(shown.max(), 2.5 * highest) if len(shown) else highest
    panel.set(xlabel=f"speed ({unit})", ylabel="damped whirl frequency (Hz)")
    panel.set(xlim=(0, per * speed[-1]), ylim=(0, 1.05 * top))
    panel.set_title(
        f"{len(marks)} critical speeds: {', '.join(f'{per * mark:.0f}' for mark in marks)} {unit}"
        if len(marks)
        else f"No critical speed up to {per * speed[-1]:.0f} {unit}"
    )
    panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return picture


def mode_shapes(structure, data, sensors=()):
    """The lowest mode shapes at the speed of `data`: the plane of the largest motion, and its envelope."""
    places = structure.node_positions
    moves = [(i, node) for i, (node, motion) in enumerate(structure.dofs) if motion == "translation"]
    at = np.array([places[node] for _, node in moves])
    rows = [i for i, _ in moves]
    count = min(SHAPES, int(np.isfinite(data.frequency.values).sum()))
    columns = min(2, count)  # readable in a narrow window
    picture, axes = figure(-(-count // columns), columns, height=2.0, width=2.8, sharey=True)
    for empty in axes.flat[count:]:
        empty.set_visible(False)
    forward, backward = as_complex(data.forward_shape)[:, rows], as_complex(data.backward_shape)[:, rows]
    for mode, panel in enumerate(axes.flat[:count]):
        orbit = forward[mode][:, None] * np.exp(1j * TURN) + backward[mode][:, None] * np.exp(-1j * TURN)
        largest = np.abs(orbit).max(axis=1)
        instant = np.abs(orbit[largest.argmax()]).argmax()
        line = orbit[:, instant] * np.exp(-1j * np.angle(orbit[largest.argmax(), instant]))
        panel.plot(at, largest / largest.max(), ":", color="0.5")
        panel.plot(at, -largest / largest.max(), ":", color="0.5")
        panel.plot(at, line.real / largest.max(), MARKERS[0] + "-", color=COLOURS[0], markersize=3)
        panel.axhline(0, color="k", linewidth=0.6)
        held = [places[node] for node in structure.bearing_nodes]
        panel.plot(held, [-1.15] * len(held), "^", color=COLOURS[2])
        probed = [places[structure.casings.get(node, node)] for node in sensors]
        panel.plot(probed, [1.15] * len(probed), "v", color="k", markersize=3)
        panel.set_ylim(-1.3, 1.3)
        frequency, ratio = float(data.frequency[mode]) / (2 * np.pi), float(data.damping_ratio[mode])
        panel.set_title(f"{frequency:.3g} Hz, {whirl_name(float(data.direction[mode]))},\ndamping ratio {ratio:.2g}")
        panel.set_xlabel("position (m)")
    for panel in axes[:, 0]:
        panel.set_ylabel("motion over its largest (1)")
    unit, per = shown_speed()
    picture.suptitle(f"At {float(data.speed) * per:.0f} {unit}")
    return picture


def stability(analysis):
    """Growth rate of the fastest growing free motion over speed, and the decrement of the first forward mode."""
    data = analysis.data
    unit, per = shown_speed()
    modes = data.frequency.values, data.damping_ratio.values, data.direction.values
    chosen = [first_forward(*one, w) for *one, w in zip(*modes, data.speed.values, strict=True)]
    decrement = np.array([np.nan if i is None else log_decrement(modes[1][k, i]) for k, i in enumerate(chosen)])
    picture, axes = figure(1 + bool(np.isfinite(decrement).any()), 1, height=2.2, width=5.0, sharex=True)
    panel, speed = axes[0, 0], data.growth_speed.values * per
    panel.plot(speed, data.growth_rate, color=COLOURS[0])
    title = f"Stable up to {speed[-1]:.0f} {unit}"
    if analysis.threshold:
        title = f"Unstable from {analysis.threshold * per:.0f} {unit}"
    panel.set(ylabel="growth rate (1/s)", title=title, xlim=(0, speed[-1]))
    if len(axes) > 1:
        axes[1, 0].plot(data.speed.values * per, decrement, ".", color=COLOURS[0], markersize=3)
        axes[1, 0].axhline(LEAST_DECREMENT, color="0.4", linestyle=":", label=f"API 617: {LEAST_DECREMENT:g}")
        axes[1, 0].set_ylabel("logarithmic decrement,\nfirst forward mode (1)")
        largest = max([LEAST_DECREMENT, *decrement[decrement < 1]])
        axes[1, 0].set_ylim(0 if (decrement[np.isfinite(decrement)] > 0).all() else None, 1.1 * largest)
        axes[1, 0].legend()
    for panel in axes[:, 0]:
        panel.axhline(0, color="k", linewidth=0.8)
        if analysis.threshold:
            panel.axvline(analysis.threshold * per, color=COLOURS[1], linestyle="--")
    axes[-1, 0].set_xlabel(f"speed ({unit})")
    return picture


def centreline(lines, structure):
    """The path of each journal in the circle of its clearance, gravity downward, with the measured positions."""
    picture, axes = figure(1, len(lines), height=2.6, width=2.6)
    turn = 1j ** np.linspace(0, 4, 100)
    for one, panel in zip(lines, axes[0], strict=True):
        for path, style in (
            (turn, {"color": "k", "linewidth": 0.8}),
            (one.predicted / one.clearance, {"color": COLOURS[0]}),
            (one.predicted[:1] / one.clearance, {"color": COLOURS[0], "marker": "o", "markersize": 4}),
            (one.measured / one.clearance, {"color": COLOURS[1], "marker": "x", "linestyle": "none", "markersize": 4}),
        ):
            panel.plot(path.imag, -path.real, **style)
        panel.plot(0, 0, "+", color="0.4")
        panel.set(title=structure.labels.get(one.node, f"node {one.node}"), xlabel="across (clearance)")
        panel.set_aspect("equal")
    axes[0, 0].set_ylabel("up (clearance)")
    return picture


def whirl_name(direction):
    """The whirl of a direction of -1 to 1 in words."""
    return "elliptic" if abs(direction) <= MIXED else "forward" if direction > 0 else "backward"


def by_probe(data, vectors):
    """{node: {probe: (speed,) complex}} of vectors (speed, probe) of the data of an analysis."""
    found = {}
    for i, (node, name) in enumerate(zip(data.probe_node.values, data.probe.values, strict=True)):
        found.setdefault(int(node), {})[str(name).split(" at ")[0]] = vectors[:, i]
    return found
