"""Charts of a rotordynamic analysis, the same as pictures, the rotor to scale, and its mode shapes."""

from itertools import pairwise

import numpy as np

from rotorstudy.measurement.conventions import read_conventions
from rotorstudy.presentation.charts import bode_charts, bode_pictures, curve, drawn, plot
from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, finished
from rotorstudy.presentation.probe_figures import probe_picture
from rotorstudy.store import as_complex
from rotorstudy.studies.stability_margin import LEAST_DECREMENT
from rotorstudy.units import shown_speed, spin

MIXED = 0.5  # of the direction: between the two signs of it, the whirl is called elliptic
HIGHEST = 2.5  # times the highest speed: whirl frequencies shown
SHAPES = 4  # modes drawn
TURN = np.linspace(0, 2 * np.pi, 60)


def rotor_charts(analysis, structure, measured=None):
    """All charts by name; measured : speeds, rad/s, and 1X of the probes (speed, probe), m."""
    data, bands = analysis.data, [analysis.operating] if analysis.operating else []
    curves = by_probe(data, as_complex(data.unbalance_response))
    points = {"points": by_probe(data, measured[1]), "points_speed": measured[0]} if measured else {}
    marks = [one.speed for one in analysis.resonant]
    found = {
        "campbell": _view("campbell", campbell(analysis, bands)),
        "bode": bode_charts("bode", data.response_speed.values, curves, lines=marks, bands=bands, **points),
        "stability": _view("stability", *stability(analysis)),
    }
    if analysis.centrelines:
        found["centreline"] = _view("centreline", *(centreline(one, structure) for one in analysis.centrelines))
    return found


def _view(name, *charts):
    return {"name": name, "height": 320, "views": [{"name": "", "charts": charts}]}


def campbell(analysis, bands=()):
    """Damped whirl frequency over speed, forward, backward and elliptic told apart, with 1X and the critical speeds."""
    data, (unit, per) = analysis.data, shown_speed()
    speed, frequency = data.speed.values, data.frequency.values / (2 * np.pi)
    every, last, direction = np.broadcast_to(speed[:, None], frequency.shape), speed[-1], data.direction.values
    series = []
    for colour, label, chosen in (
        (0, "forward whirl", direction > MIXED),
        (2, "elliptic whirl", np.abs(direction) <= MIXED),
        (1, "backward whirl", direction < -MIXED),
    ):
        chosen = chosen & (frequency < HIGHEST * last / (2 * np.pi))
        if chosen.any():
            series.append(curve(label, colour, per * every[chosen], frequency[chosen], mark="circle", size=1.6))
    ends = np.array([speed[0], last])
    series.append(curve("1X", 6, per * ends, ends / (2 * np.pi), line=True, dash=[2, 3]))
    criticals, title = analysis.resonant, f"No critical speed up to {per * last:.0f} {unit}"
    if criticals:
        at = np.array([one.speed for one in criticals])
        told = [f"{spin(one.speed)}, damping ratio {one.damping_ratio:.3g}" for one in criticals]
        style = {"mark": "circle", "hollow": True, "size": 5, "text": told}
        series.append(curve("critical speed", 6, per * at, at / (2 * np.pi), **style))
        title = f"{len(at)} critical speeds: {', '.join(f'{per * one:.0f}' for one in at)} {unit}"
    bands = [[w * per for w in band] for band in bands]
    return plot(title, ("speed", unit), ("damped whirl frequency", "Hz"), series, bands=bands)


def stability(analysis):
    """Growth rate of the fastest growing free motion over speed, and the decrement of the first forward mode."""
    data, (unit, per), decrement = analysis.data, shown_speed(), analysis.data.log_decrement.values
    speed, edge, across = data.growth_speed.values * per, [{"y": 0}], ("speed", unit)
    title = f"Stable up to {speed[-1]:.0f} {unit}"
    if analysis.threshold:
        title = f"Unstable from {analysis.threshold * per:.0f} {unit}"
        edge.append({"x": analysis.threshold * per})
    growth = curve("growth rate", 0, speed, data.growth_rate.values, line=True)
    charts = [plot(title, across, ("growth rate", "1/s"), [growth], lines=edge)]
    if np.isfinite(decrement).any():
        needed = {"y": LEAST_DECREMENT, "label": f"API 617: {LEAST_DECREMENT:g}"}
        top, low = max([LEAST_DECREMENT, *decrement[decrement < 1]]), np.nanmin(decrement)
        of_mode = {"label": "logarithmic decrement", "unit": "", "range": [min(float(low), 0.0), 1.1 * float(top)]}
        points = curve("first forward mode", 0, data.speed.values * per, decrement, mark="circle", size=1.6)
        charts.append(plot("First forward mode", across, of_mode, [points], lines=[*edge, needed]))
    return charts


def centreline(one, structure, states=("measured",), *later):
    """The path of a journal in the circle of its clearance, gravity downward, with the positions measured in states."""
    path = one.predicted / one.clearance
    series = [
        curve("film of the rig", 0, path.imag, -path.real, line=True),
        curve("lowest speed", 0, path.imag[:1], -path.real[:1], mark="circle", size=4),
    ]
    for k, (state, seen) in enumerate(zip(states, (one, *later), strict=True), start=1):
        place = seen.measured / one.clearance
        series += [curve(state, k, place.imag, -place.real, mark="cross", size=4)] if len(place) else []
    title = structure.labels.get(one.node, f"node {one.node}")
    return plot(title, ("across", "clearance"), ("up", "clearance"), series, equal=True, circles=[1])


def whirl_name(direction):
    """The whirl of a direction of -1 to 1 in words."""
    return "elliptic" if abs(direction) <= MIXED else "forward" if direction > 0 else "backward"


def by_probe(data, vectors):
    """{node: {probe: (speed,) complex}} of vectors (speed, probe) of the data of an analysis."""
    found = {}
    for i, (node, name) in enumerate(zip(data.probe_node.values, data.probe.values, strict=True)):
        found.setdefault(int(node), {})[str(name).split(" at ")[0]] = vectors[:, i]
    return found


def rotor_figures(rig, analysis, charts):
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
        highest = analysis.operating[1] if analysis.operating else analysis.data.speed[-1]
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

    structure, sensors = rig.model.structure, rig.model.sensors
    places, length = structure.node_positions, structure.length
    picture, ((panel,),) = figure(height=2.2, width=7.0)
    radius = {}
    for first, last in pairwise(places.values()):
        section = structure.section_at((first + last) / 2)
        radius[first] = max(section.outer_diameter_m, section.sleeve_diameter_m) / 2
        size, style = (last - first, 2 * radius[first]), {"facecolor": "0.85", "edgecolor": "0.5"}
        panel.add_patch(Rectangle((first, -radius[first]), *size, **style))
    shaft = max(radius.values())
    thickest = max([shaft, *(disc.radius for disc in structure.discs)])
    for disc in structure.discs:
        thick = max(disc.thickness, 0.01 * length)
        corner = (places[disc.node] - thick / 2, -disc.radius)
        panel.add_patch(Rectangle(corner, thick, 2 * disc.radius, facecolor=COLOURS[5], edgecolor="k", alpha=0.8))
    for x in (places[node] for node in structure.bearing_nodes):
        wide, low = 0.015 * length, -shaft - 0.25 * thickest
        corners = [(x, -shaft), (x - wide, low), (x + wide, low)]
        panel.add_patch(Polygon(corners, facecolor=COLOURS[2], edgecolor="k"))
    for node in (structure.casings.get(node, node) for node in sensors):
        top = max([shaft, *(disc.radius for disc in structure.discs if disc.node == node)])
        arrow = {"arrowstyle": "->", "color": "k"}
        panel.annotate("", (places[node], top), (places[node], top + 0.35 * thickest), arrowprops=arrow)
    for position in crack_positions(rig.given, places):
        panel.plot([position] * 2, [-1.3 * shaft, 1.3 * shaft], color=COLOURS[1], linewidth=2)
    for node, x in places.items():
        panel.text(x, -1.35 * thickest, str(node), ha="center", va="top", fontsize=6)
    panel.set(xlim=(-0.03 * length, 1.03 * length), ylim=(-1.7 * thickest, 1.4 * thickest))
    panel.set(xlabel="position along the shaft (m); node numbers below the rotor", ylabel="radius (m)")
    panel.set_aspect("equal" if length < 12 * thickest else "auto")
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
    places, count = structure.node_positions, min(SHAPES, int(np.isfinite(data.frequency.values).sum()))
    rows, nodes = zip(*((i, n) for i, (n, motion) in enumerate(structure.dofs) if motion == "translation"), strict=True)
    held = [places[node] for node in structure.bearing_nodes]
    probed = [places[structure.casings.get(node, node)] for node in sensors]
    at, columns = [places[node] for node in nodes], min(2, count)  # readable in a narrow window
    picture, axes = figure(-(-count // columns), columns, height=2.0, width=2.8, sharey=True)
    for empty in axes.flat[count:]:
        empty.set_visible(False)
    forward, backward = (as_complex(shape)[:, rows] for shape in (data.forward_shape, data.backward_shape))
    for mode, panel in enumerate(axes.flat[:count]):
        orbit = forward[mode][:, None] * np.exp(1j * TURN) + backward[mode][:, None] * np.exp(-1j * TURN)
        largest = np.abs(orbit).max(axis=1)
        instant = np.abs(orbit[largest.argmax()]).argmax()
        line = orbit[:, instant] * np.exp(-1j * np.angle(orbit[largest.argmax(), instant]))
        panel.plot(at, largest / largest.max(), ":", color="0.5")
        panel.plot(at, -largest / largest.max(), ":", color="0.5")
        panel.plot(at, line.real / largest.max(), MARKERS[0] + "-", color=COLOURS[0], markersize=3)
        panel.axhline(0, color="k", linewidth=0.6)
        panel.plot(held, [-1.15] * len(held), "^", color=COLOURS[2])
        panel.plot(probed, [1.15] * len(probed), "v", color="k", markersize=3)
        frequency, ratio = float(data.frequency[mode]) / (2 * np.pi), float(data.damping_ratio[mode])
        title = f"{frequency:.3g} Hz, {whirl_name(float(data.direction[mode]))},\ndamping ratio {ratio:.2g}"
        panel.set(ylim=(-1.3, 1.3), title=title, xlabel="position (m)")
    for panel in axes[:, 0]:
        panel.set_ylabel("motion relative to its largest")
    unit, per = shown_speed()
    return finished(picture, f"At {float(data.speed) * per:.0f} {unit}")
