"""Charts of `charts` as pictures, for print and for pages without JavaScript."""

import numpy as np

from rotorstudy.presentation.plots import COLOURS, figure

MARKS = {"circle": "o", "square": "s", "triangle": "^", "cross": "x"}
IN_A_ROW = 3  # polar plots


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
