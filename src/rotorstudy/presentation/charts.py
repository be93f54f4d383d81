"""Charts as plain data, in the reader's units: for zooming (`templates/charts.js`), and drawn for print.

In a page they are drawn by uPlot, which adds 53 kB; the smallest bundle of Plotly has 1.1 MB, that of Bokeh 1.3 MB.
"""

from math import isfinite

import numpy as np

from rotorstudy.presentation.plots import COLOURS, figure, phase_lag
from rotorstudy.studies.unbalance_response import along_directions
from rotorstudy.units import shown_amplitude, shown_speed, shown_unit, spin

MOST_SPEEDS = 120  # of a run-up, evenly spaced
FEWEST_SPEEDS, MOST_POINTS = 8, 400  # of a curve
LABELLED = 6  # speeds written in a polar plot
DIGITS = 4  # significant ones, as a picture shows no more
MARKS = {"circle": "o", "square": "s", "triangle": "^", "cross": "x"}
IN_A_ROW = 3  # polar plots


def plot(title, x, y, series, **more):
    """One chart; x, y : (label, unit) or a dict; more : what `templates/charts.js` says."""
    x, y = (one if isinstance(one, dict) else dict(zip(("label", "unit"), one, strict=True)) for one in (x, y))
    return {"title": title, "x": x, "y": y, "series": series, "hover": "near", **more}


def curve(label, colour, x, y, **style):
    """One curve, or set of marks, of a chart."""
    return {"label": label, "colour": colour, "x": rounded(x), "y": rounded(y), **style}


def bode_charts(name, speed, curves, points=None, lines=(), bands=(), points_speed=None):
    """Bode plots of each node beside the polar plot, 1X along each probe; name : its place on the page.

    speed : (speed,) rad/s;  curves : node -> {probe: (speed,) complex, m}
    points : the same, measured, at `points_speed`;  lines, bands : speeds marked, and ranges shaded
    """
    (unit, factor), (speed_unit, per) = shown_amplitude(), shown_speed()
    together = {"group": name, "hover": "x", "lines": [{"x": w * per} for w in lines]}
    together["bands"] = [[a * per, b * per] for a, b in bands]
    views = []
    for node, probes in curves.items():
        size, lag, vector = [], [], []
        for i, (probe, one) in enumerate(probes.items()):
            drawn, known = [(probe, speed, one, {"line": True})], phase_lag(one)
            if points:
                drawn += [(f"{probe} measured", points_speed, points[node][probe], {"mark": "circle", "hollow": True})]
            for label, at, values, style in drawn:
                kept = thinned(len(at), MOST_POINTS)
                x, values, about = per * at[kept], factor * values[kept], (label, i % 6)
                behind = phase_lag(values)
                behind += 360 * np.round((np.interp(at[kept], speed, known) - behind) / 360)  # beside the curve
                size.append(curve(*about, x, np.abs(values), **style))
                lag.append(curve(*about, x, behind, **style))
                texts = {str(k): f"{x[k]:.0f}" for k in marked(values, LABELLED)} if "line" in style and not i else {}
                vector.append(curve(*about, values.real, -values.imag, speed=rounded(x), texts=texts, **style))
        across, where = ("speed", speed_unit), f"node {node}"
        top = plot(f"Amplitude, {where}", across, ("1X", unit), size, **together)
        low = plot(f"Phase, {where}", across, ("lag from the mark", "°"), lag, **together)
        sides = ("in phase with the mark", unit), ("lagging by 90°", unit)
        title = f"{where}: 1X ({unit}), numbers: {speed_unit}"
        polar = plot(title, *sides, vector, equal=True, polar=True, speed=speed_unit)
        views.append({"name": where, "charts": [top, low, polar]})
    return {"name": name, "height": 280, "views": views}


def marked(vectors, count):
    """Positions of some vectors (speed,), evenly spaced along their curve."""
    length = np.concatenate([[0], np.cumsum(np.abs(np.diff(vectors)))])
    return np.unique(np.searchsorted(length, np.linspace(0, length[-1], count)).clip(0, len(vectors) - 1))


def speed_view(name, speed, node, harmonic, spectra, std, start=(0, 0), axes=None, told=None, sigma=(), signals=None):
    """Orbit, waveform, full spectrum and residual at the speed and node that a reader chooses.

    spectra : name -> (label, colour, (speed, node, harmonic) complex, m), the measured one first;  std : of some, m
    start   : positions of the speed and node shown first;  axes : of `axes_of`;  told : what to say after each speed
    sigma   : [(label, colour, (speed, node, harmonic))], residuals in standard deviations
    signals : position of a speed -> what to show of each node instead of the sum of the harmonics, or None
    """
    unit, factor = shown_unit("m")
    kept, axes = thinned(len(speed), MOST_SPEEDS), axes or {}
    says = [f"{spin(w)}{', ' + text if text else ''}" for w, text in zip(speed, told or [""] * len(speed), strict=True)]
    found = {
        "name": name,
        "unit": unit,
        "speed": [says[i] for i in kept],
        "node": [str(one) for one in node],
        "harmonic": [int(n) for n in harmonic],
        "start": [int(np.argmin(abs(kept - start[0]))), int(start[1])],
        "mark": float(axes.get("mark_rad", 0.0)),
        "clearance": {key: factor * radius for key, radius in axes.get("clearance_m", {}).items()},
        "names": [[key, label, colour] for key, (label, colour, _) in spectra.items()],
        "values": {
            key: {part: rounded(factor * getattr(values[kept], part)) for part in ("real", "imag")}
            for key, (_, _, values) in spectra.items()
        },
        "std": {key: rounded(factor * values[kept]) for key, values in std.items()},
    }
    if sigma:
        found["sigma"] = [[label, colour, rounded(values[kept])] for label, colour, values in sigma]
    if signals:
        found["signals"] = [signals(int(i)) for i in kept]
    return found


def axes_of(model, rig):
    """What charts need of a model and its rig, as plain data: mark, clearances, probes."""
    clearance = {}
    for item in rig.get("bearings") or []:
        if isinstance(radius := item.get("radial_clearance_m"), (int, float)):
            clearance[str(item.get("node", model.structure.nodes[0]))] = radius
    probes = {str(node): model.structure.reading.probes_at(node) for node in model.sensors}
    return {"mark_rad": float(model.structure.reading.mark_rad), "clearance_m": clearance, "probes": probes}


def is_sweep(speed, harmonic):
    """Whether 1X along probes can be drawn over speed."""
    return len(speed) >= FEWEST_SPEEDS and {1, -1} <= set(np.asarray(harmonic).tolist())


def along_probes(axes, node, harmonic, amplitude):
    """{node: {probe: (speed,) complex}} of 1X; axes of `axes_of`, amplitude (speed, harmonic, node)."""
    both = [amplitude[:, list(harmonic).index(n)] for n in (1, -1)]
    directions = [axes["probes"][str(one)] for one in node]
    vectors = (along_directions(d, axes["mark_rad"], *(a[:, i] for a in both)) for i, d in enumerate(directions))
    return dict(zip(node, vectors, strict=True))


def rounded(values):
    """Nested lists of numbers with few significant digits; JSON has no NaN: what is not known is null."""
    values = values if isinstance(values, (list, float)) else np.asarray(values, float).tolist()
    if isinstance(values, list):
        return [rounded(one) for one in values]
    return float(f"{values:.{DIGITS}g}") if isfinite(values) else None


def thinned(count, most):
    """Positions of at most `most` of `count`, evenly spaced."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


def drawn(rows, height, width, **options):
    """A figure of rows of charts, None for an empty place; height, width: of each, inches."""
    picture, axes = figure(len(rows), len(rows[0]), height, width, **options)
    named = {}  # (colour, kind) -> a line of it, and the labels of all such lines
    for chart, panel in zip([chart for row in rows for chart in row], axes.flat, strict=True):
        if chart is None:
            panel.set_visible(False)
            continue
        for series in chart["series"]:
            line = _series(panel, chart, series)
            named.setdefault((series["colour"], line.get_linestyle()), (line, {}))[1][series["label"]] = None
        for low, high in chart.get("bands", ()):
            band = panel.axvspan(low, high, color="0.5", alpha=0.15, linewidth=0)
            named.setdefault("bands", (band, {"operating speeds": None}))
        for place in chart.get("lines", ()):
            across = panel.axhline(place["y"]) if "y" in place else panel.axvline(place["x"])
            across.set(color="0.4", linestyle=":", linewidth=0.9)
            if "label" in place:
                at = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "xytext": (0, 2)}
                panel.annotate(place["label"], (0.01, place["y"]), **at, fontsize=6)
        for radius in chart.get("circles", ()):
            turn = radius * 1j ** np.linspace(0, 4, 100)
            panel.plot(turn.real, turn.imag, color="k", linewidth=0.8)
        _axes(panel, chart)
    for panel in axes[:-1].flat if "sharex" in options else ():
        panel.set_xlabel("")
    lines, labels = zip(*((line, " / ".join(texts)) for line, texts in named.values()), strict=True)
    picture.legend(lines, labels, loc="outside lower center", ncols=4)
    return picture


def _series(panel, chart, series):
    """Draw a curve or a set of marks of a chart: its line."""
    x, y = (np.array(series[axis], float) for axis in "xy")
    if chart.get("polar"):
        x, y = np.arctan2(y, x), np.hypot(x, y)
    line = ":" if series.get("dash") else "-" if series.get("line") else ""
    style = {"color": COLOURS[series["colour"]], "linestyle": line, "markersize": series.get("size", 4)}
    if "mark" in series:
        style |= {"marker": MARKS[series["mark"]], "fillstyle": "none" if series.get("hollow") else "full"}
    (found,) = panel.plot(x, y, **style)
    for i, text in series.get("texts", {}).items():
        place = x[int(i)], y[int(i)]
        panel.plot(*place, "k.", markersize=3)
        panel.annotate(text, place, textcoords="offset points", xytext=(3, 3), fontsize=6)
    return found


def _axes(panel, chart):
    panel.set_title(chart["title"])
    if chart.get("polar"):
        vectors = [np.array(series["x"], float) + 1j * np.array(series["y"], float) for series in chart["series"]]
        panel.set_rlabel_position(_emptiest(np.concatenate(vectors)))
        panel.yaxis.get_major_locator().base.set_params(nbins=4)
        return
    x, y = (chart[axis] for axis in "xy")
    panel.set(xlabel=f"{x['label']} ({x['unit']})", ylabel=f"{y['label']} ({y['unit']})")
    if "range" in y:
        panel.set_ylim(y["range"])
    if chart.get("equal"):
        panel.set_aspect("equal")


def _emptiest(vectors):
    """Angle, degrees, in the middle of the eighth of a turn that vectors (vector,) reach into least."""
    middles = np.arange(22.5, 360, 45)
    away = np.abs((np.angle(vectors, deg=True) - middles[:, None] + 180) % 360 - 180)
    return middles[np.where(away < 30, np.abs(vectors), 0).max(axis=1).argmin()]


def bode_pictures(data):
    """Bode plot, a column a node, and polar plots of `charts.bode_charts`."""
    sizes, lags, polar = zip(*(view["charts"] for view in data["views"]), strict=True)
    count = -(-len(polar) // (-(-len(polar) // IN_A_ROW)))  # in rows of about the same length
    polar += (None,) * (-len(polar) % count)
    rows = [polar[i : i + count] for i in range(0, len(polar), count)]
    return {
        "bode": drawn([sizes, lags], 1.9, 3.4 if len(sizes) < 3 else 2.6, sharex=True),
        "polar": drawn(rows, 3.1, 3.1, subplot_kw={"projection": "polar"}),
    }
