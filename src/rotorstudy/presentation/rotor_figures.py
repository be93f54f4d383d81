"""Figures of a rotordynamic analysis: its charts as pictures, the rotor to scale, and its mode shapes."""

from itertools import pairwise

import numpy as np

from rotorstudy.measurement.conventions import read_conventions
from rotorstudy.presentation.chart_pictures import bode_pictures, drawn
from rotorstudy.presentation.plots import COLOURS, MARKERS, figure
from rotorstudy.presentation.probe_figures import probe_picture
from rotorstudy.presentation.rotor_charts import whirl_name
from rotorstudy.store import as_complex
from rotorstudy.units import shown_speed

SHAPES = 4  # modes drawn
TURN = np.linspace(0, 2 * np.pi, 60)


def rotor_figures(rig, analysis, charts, operating=None):
    """All figures, {name: figure}; charts : of `rotor_charts`."""
    first = {name: data["views"][0]["charts"] for name, data in charts.items()}
    found = {
        "campbell": drawn([first["campbell"]], 3.0, 5.0),
        **bode_pictures(charts["bode"]),
        "stability": drawn([[one] for one in first["stability"]], 2.2, 5.0, sharex=True),
    }
    if "centreline" in first:
        found["centreline"] = drawn([first["centreline"]], 2.6, 2.6)
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
