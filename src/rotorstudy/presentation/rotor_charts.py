"""Charts of a rotordynamic analysis."""

import numpy as np

from rotorstudy.presentation.charts import bode_charts, curve, plot
from rotorstudy.store import as_complex
from rotorstudy.studies.stability_margin import LEAST_DECREMENT, first_forward, log_decrement
from rotorstudy.units import shown_speed, spin

MIXED = 0.5  # of the direction: between the two signs of it, the whirl is called elliptic
HIGHEST = 2.5  # times the highest speed: whirl frequencies shown


def rotor_charts(analysis, structure, operating=None, measured=None):
    """All charts by name; measured : speeds, rad/s, and 1X of the probes (speed, probe), m."""
    data, bands = analysis.data, [operating] if operating else []
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
    data, (unit, per) = analysis.data, shown_speed()
    modes = data.frequency.values, data.damping_ratio.values, data.direction.values
    chosen = [first_forward(*one, w) for *one, w in zip(*modes, data.speed.values, strict=True)]
    decrement = np.array([np.nan if i is None else log_decrement(modes[1][k, i]) for k, i in enumerate(chosen)])
    speed, title = data.growth_speed.values * per, f"Stable up to {data.growth_speed.values[-1] * per:.0f} {unit}"
    edge, across = [{"y": 0}], ("speed", unit)
    if analysis.threshold:
        title, edge = (
            f"Unstable from {analysis.threshold * per:.0f} {unit}",
            [{"y": 0}, {"x": analysis.threshold * per}],
        )
    growth = curve("growth rate", 0, speed, data.growth_rate.values, line=True)
    charts = [plot(title, across, ("growth rate", "1/s"), [growth], lines=edge)]
    if np.isfinite(decrement).any():
        needed = {"y": LEAST_DECREMENT, "label": f"API 617: {LEAST_DECREMENT:g}"}
        top, low = max([LEAST_DECREMENT, *decrement[decrement < 1]]), np.nanmin(decrement)
        of_mode = {"label": "logarithmic decrement", "unit": "1", "range": [min(float(low), 0.0), 1.1 * float(top)]}
        points = curve("first forward mode", 0, data.speed.values * per, decrement, mark="circle", size=1.6)
        charts.append(plot("First forward mode", across, of_mode, [points], lines=[*edge, needed]))
    return charts


def centreline(one, structure):
    """The path of a journal in the circle of its clearance, gravity downward, with the measured positions."""
    path, seen = (places / one.clearance for places in (one.predicted, one.measured))
    series = [
        curve("film of the rig", 0, path.imag, -path.real, line=True),
        curve("lowest speed", 0, path.imag[:1], -path.real[:1], mark="circle", size=4),
        *([curve("measured", 1, seen.imag, -seen.real, mark="cross", size=4)] if len(seen) else []),
    ]
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
