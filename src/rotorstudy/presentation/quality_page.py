"""The quality page: findings, facts and a figure of every record, in one self-contained file."""

import logging

import numpy as np

from rotorstudy.measurement.facts import NodeFacts, RecordFacts, facts_of
from rotorstudy.measurement.findings import SEVERITIES
from rotorstudy.presentation.pages import inline_png, render
from rotorstudy.presentation.tables import cells
from rotorstudy.store import write_text
from rotorstudy.units import RAD_PER_S, shown_unit, spin

log = logging.getLogger(__name__)

SHOWN_REVOLUTIONS = 4  # of the time signal
MOST_PICTURES = 24
MARGINS_OF_THREE = {"left": 0.06, "right": 0.985, "bottom": 0.2, "top": 0.96, "wspace": 0.3}
MARGINS_OF_ONE = {"left": 0.17, "right": 0.96, "bottom": 0.2, "top": 0.96}
MOST_NAMED = 5  # nodes in one column of a legend


def write_page(measurement, path, title):
    """Write the quality page of a Measurement to a file; title : heading of the page."""
    records = [{"record": one.where, **_named(one, RecordFacts)} for one in measurement.facts]
    nodes = [
        {"record": one.where, "node": node, **_named(facts, NodeFacts)}
        for one in measurement.facts
        for node, facts in one.nodes.items()
    ]
    page = render(
        "quality.html",
        title=title,
        findings=measurement.findings,
        counts={kind: sum(f.severity == kind for f in measurement.findings) for kind in SEVERITIES},
        records=cells(_known(records), 4),
        nodes=cells(_known(nodes), 4),
        speeds=len(measurement.spectrum.speed) if measurement.spectrum else 0,
        bode=_bode(measurement.spectrum) if measurement.spectrum else {},
        pictures=_pictures(measurement) if measurement.spectrum else {},
    )
    write_text(path, page)


def _named(facts, kind):
    """Facts under their long names with unit; a speed in rpm too."""
    found = {}
    for name, unit, long in facts_of(kind):
        value, (unit, factor) = float(getattr(facts, name)), shown_unit(unit)
        found[f"{long} ({unit})" if unit else long] = factor * value
        if unit == "rad/s":
            found[f"{long} (rpm)"] = value / RAD_PER_S["rpm"]
    return found


def _known(rows):
    """A DataFrame of rows without the columns of facts that none has; those of a table of harmonics are few."""
    import pandas as pd

    return pd.DataFrame(rows).dropna(axis="columns", how="all")


def _bode(spectrum):
    """{title: figure} of 1X over speed."""
    from rotorstudy.presentation.bode_figures import bode_pictures

    return {title: inline_png(png) for title, png in bode_pictures(spectrum).items()}


def _pictures(measurement):
    """{speed and record: figure} for at most MOST_PICTURES speeds."""
    spectrum, found = measurement.spectrum, {}
    count = len(spectrum.speed)
    log.info("drawing %d speeds", min(count, MOST_PICTURES))
    frames = {}
    for i in np.unique(np.linspace(0, count - 1, min(count, MOST_PICTURES)).astype(int)):
        record = next((r for r in measurement.records if r.speed == spectrum.speed[i]), None)
        where = spin(spectrum.speed[i]) + (f" ({record.where})" if record else "")
        found[where] = inline_png(_picture(spectrum, i, record, frames))
    return found


def _frame(panels, margins):
    """Empty axes with fixed margins: a layout engine would take most of the time of a picture."""
    from matplotlib.ticker import StrMethodFormatter

    from rotorstudy.presentation.plots import figure

    picture, axes = figure(1, panels)
    picture.set_layout_engine(None)
    picture.subplots_adjust(**margins)
    spectrum = axes[0, -1]
    spectrum.set_yscale("log")
    spectrum.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))  # powers set as formulas take far longer
    return picture, axes[0]


def _picture(spectrum, i, record, frames):
    """Time signal and orbit (if there is a record) and spectrum with error bars at one speed, as a PNG.

    frames : dict of the axes that are drawn in again, as new ones take longer than all that they show
    """
    from rotorstudy.presentation.plots import COLOURS, harmonic_axis, plot_orbit, png_bytes

    panels, margins = (3, MARGINS_OF_THREE) if record else (1, MARGINS_OF_ONE)
    if panels not in frames:
        frames[panels] = _frame(panels, margins)
    picture, axes = frames[panels]
    for panel in axes:
        for kind in ("containers", "lines", "collections"):  # a container removes its lines itself
            for drawn in list(getattr(panel, kind)):
                drawn.remove()
        panel.relim()
        panel.autoscale()
    axes = list(axes)
    if record:
        shown = record.time < record.time[0] + SHOWN_REVOLUTIONS * 2 * np.pi / record.speed
        revolutions = record.time[shown] * record.speed / (2 * np.pi)
        signals, orbit_axes = axes.pop(0), axes.pop(0)
        for s, node in enumerate(record.sensors):
            z, colour = record.displacement[s, shown], COLOURS[s % len(COLOURS)]
            moving = z - np.nanmean(z)
            signals.plot(revolutions, moving.real * 1e6, color=colour, label=f"x, node {node}")
            signals.plot(revolutions, moving.imag * 1e6, color=colour, linestyle="--", label=f"y, node {node}")
            plot_orbit(z, orbit_axes, index=s % len(COLOURS), label=f"node {node}")
        signals.set_xlabel("revolutions")
        signals.set_ylabel("displacement minus mean (µm)")
        if len(record.sensors) <= MOST_NAMED:
            columns = min(4, 2 * len(record.sensors))
            low, high = signals.get_ylim()  # with room for the legend above the curves
            signals.set_ylim(low, high + 0.13 * np.ceil(2 * len(record.sensors) / columns) * (high - low))
            signals.legend(loc="upper center", ncols=columns, columnspacing=0.8, handlelength=1.5)
    count = len(spectrum.harmonics)
    for s, node in enumerate(spectrum.sensors):
        variance = np.diag(spectrum.covariance[i, s])
        std = np.sqrt(variance[:count] + variance[count:])
        size = np.abs(spectrum.amplitude[i, :, s])
        place = spectrum.harmonics + 0.15 * (s - (len(spectrum.sensors) - 1) / 2)
        low = np.minimum(2 * std, 0.9 * size)
        colour = COLOURS[s % len(COLOURS)]
        bars = {"yerr": 1e6 * np.array([low, 2 * std]), "markersize": 3, "label": f"node {node}"}
        axes[0].errorbar(place, 1e6 * size, fmt="o", color=colour, **bars)
    axes[0].set_ylabel("amplitude, bars of 2 σ (µm)")
    axes[0].legend(ncols=1 + len(spectrum.sensors) // MOST_NAMED)
    harmonic_axis(axes[0], spectrum.harmonics)
    return png_bytes(picture)
