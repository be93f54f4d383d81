"""1X over speed along each probe: Bode and polar plots, in the reader's units.

curves : node -> {probe: (speed,) complex, m};  points : the same, measured, at other speeds (rad/s)
"""

import numpy as np

from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, phase_lag
from rotorstudy.units import shown_amplitude, shown_speed

LABELLED = 6  # speeds marked in a polar plot
IN_A_ROW = 3  # polar plots


def bode(speed, curves, points=None, points_speed=None, lines=(), bands=()):
    """Amplitude and phase lag over speed (rad/s), a column a node; lines : speeds marked; bands : ranges shaded."""
    (unit, factor), (speed_unit, per) = shown_amplitude(), shown_speed()
    picture, axes = figure(2, len(curves), height=1.9, width=3.4 if len(curves) < 3 else 2.6, sharex=True)
    for column, (node, probes) in zip(axes.T, curves.items(), strict=True):
        for i, (name, one) in enumerate(probes.items()):
            lag, colour = phase_lag(one), COLOURS[i % len(COLOURS)]
            column[0].plot(per * speed, factor * np.abs(one), color=colour, label=name)
            column[1].plot(per * speed, lag, color=colour)
            if points:
                found, shown = points[node][name], per * points_speed
                style = {"color": colour, "marker": MARKERS[i % len(MARKERS)], "linestyle": "", "fillstyle": "none"}
                near = np.interp(points_speed, speed, lag)
                off = phase_lag(found)
                column[0].plot(shown, factor * np.abs(found), **style)
                column[1].plot(shown, off + 360 * np.round((near - off) / 360), **style)
        for panel in column:
            _marks(panel, per, lines, bands)
        column[0].set_title(f"node {node}")
        column[0].legend()
        column[1].set_xlabel(f"speed ({speed_unit})")
    axes[0, 0].set_ylabel(f"1X ({unit})")
    axes[1, 0].set_ylabel("lag from the mark (°)")
    return picture


def _marks(panel, per, lines, bands):
    for low, high in bands:
        panel.axvspan(per * low, per * high, color="0.5", alpha=0.15, linewidth=0)
    for speed in lines:
        panel.axvline(per * speed, color="0.4", linestyle=":", linewidth=0.9)


def polar(speed, curves, points=None):
    """1X in the complex plane, lag counter-clockwise: each resonance a loop; some speeds are written beside it."""
    (unit, factor), (speed_unit, per) = shown_amplitude(), shown_speed()
    rows = -(-len(curves) // IN_A_ROW)
    picture, axes = figure(rows, -(-len(curves) // rows), 3.1, 3.1, subplot_kw={"projection": "polar"})
    for empty in axes.flat[len(curves) :]:
        empty.set_visible(False)
    for panel, (node, probes) in zip(axes.flat, curves.items(), strict=False):
        for i, (name, one) in enumerate(probes.items()):
            colour = COLOURS[i % len(COLOURS)]
            panel.plot(-np.angle(one), factor * np.abs(one), color=colour, label=name)
            if points:
                found = points[node][name]
                marker = MARKERS[i % len(MARKERS)]
                panel.plot(-np.angle(found), factor * np.abs(found), marker, color=colour, fillstyle="none")
        largest = max(probes.values(), key=lambda one: np.abs(one).max())
        for at in marked(largest, LABELLED):
            place = -np.angle(largest[at]), factor * np.abs(largest[at])
            panel.plot(*place, "k.", markersize=3)
            panel.annotate(f"{per * speed[at]:.0f}", place, textcoords="offset points", xytext=(3, 3), fontsize=6)
        panel.set_title(f"node {node}")
        panel.set_rlabel_position(_emptiest(np.array(list(probes.values()))))
        panel.yaxis.get_major_locator().base.set_params(nbins=4)
    handles = max((panel.get_legend_handles_labels()[0] for panel in axes.flat), key=len)
    names = [list(probes) for probes in curves.values()]
    named = [dict.fromkeys(one[i] for one in names if i < len(one)) for i in range(len(handles))]
    picture.legend(handles, [" / ".join(one) for one in named], loc="outside lower center", ncols=4)
    picture.suptitle(f"1X ({unit}) over phase lag; numbers: {speed_unit}")
    return picture


def marked(vectors, count):
    """Positions of some vectors (speed,), evenly spaced along their curve."""
    length = np.concatenate([[0], np.cumsum(np.abs(np.diff(vectors)))])
    return np.unique(np.searchsorted(length, np.linspace(0, length[-1], count)).clip(0, len(vectors) - 1))


def _emptiest(vectors):
    """Phase lag, degrees, in the middle of the eighth of a turn that vectors (..., complex) reach into least."""
    middles = np.arange(22.5, 360, 45)
    lag = -np.angle(vectors.ravel(), deg=True)
    away = np.abs((lag - middles[:, None] + 180) % 360 - 180)
    return middles[np.where(away < 30, np.abs(vectors.ravel()), 0).max(axis=1).argmin()]
