"""The quality page: findings, facts and a picture of every record, in one file that needs nothing else."""

from html import escape

import numpy as np

from rotorstudy.measurement.facts import NodeFacts, RecordFacts, facts_of
from rotorstudy.presentation.tables import CSS, html_table

SHOWN_TURNS = 4  # of the time signal
MOST_PICTURES = 24
SEVERITY_CSS = """
.error { color: #a00000; } .warning { color: #8a5a00; } .note { color: #444; }
img { max-width: 100%; }
"""


def write_page(measurement, path, title):
    """Write the quality page of a Measurement."""
    import pandas as pd

    from rotorstudy.store import write_text

    counts = [sum(f.severity == kind for f in measurement.findings) for kind in ("error", "warning", "note")]
    summary = "{} errors, {} warnings, {} notes.".format(*counts)
    if measurement.errors:
        summary += " Records with an error are not in the spectrum."
    parts = [f"<h1>{escape(title)}</h1>", f"<p>{summary}</p>", "<h2>Findings</h2>"]
    items = [
        f'<li class="{f.severity}"><b>{f.severity}: {escape(f.name)}</b> ({escape(f.where)}): {escape(f.text)}</li>'
        for f in measurement.findings
    ]
    parts.append(f"<ul>{''.join(items)}</ul>" if items else "<p>None: nothing wrong was seen.</p>")
    rows = [{"record": one.where, **_named(one, RecordFacts)} for one in measurement.facts]
    places = [(one.where, node, facts) for one in measurement.facts for node, facts in one.nodes.items()]
    node_rows = [{"record": where, "node": node, **_named(facts, NodeFacts)} for where, node, facts in places]
    parts += ["<h2>Records</h2>", html_table(pd.DataFrame(rows), 4)]
    parts += ["<h2>Nodes</h2>", html_table(pd.DataFrame(node_rows), 4)]
    if measurement.spectrum is not None:
        parts += _pictures(measurement)
    head = (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{CSS}{SEVERITY_CSS}</style>"
    )
    write_text(path, head + "\n".join(parts) + "</html>\n")


def _named(facts, kind):
    """Facts under their long names with unit."""
    found = {}
    for name, unit, long in facts_of(kind):
        unit, factor = ("µm", 1e6) if unit == "m" else (unit, 1.0)
        found[long if unit == "1" else f"{long} ({unit})"] = factor * float(getattr(facts, name))
    return found


def _pictures(measurement):
    spectrum, records = measurement.spectrum, {id(r): r for r in measurement.records}
    count = len(spectrum.speed)
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_PICTURES)).astype(int))
    parts = ["<h2>Pictures</h2>"]
    if len(chosen) < count:
        parts.append(f"<p>{len(chosen)} of {count} speeds are shown.</p>")
    for i in chosen:
        record = next((r for r in records.values() if r.speed == spectrum.speed[i]), None)
        where = f"{spectrum.speed[i]:.6g} rad/s" + (f" ({record.where})" if record else "")
        parts.append(f"<h3>{escape(where)}</h3>" + _picture(spectrum, i, record))
    return parts


def _picture(spectrum, i, record):
    """Time signal and orbit (if there is a record) and spectrum with error bars of one speed, as an inline PNG."""
    import base64
    import io

    import matplotlib.pyplot as plt

    from rotorstudy.presentation.plots import COLOURS, figure, harmonic_axis, plot_orbit

    picture, axes = figure(1, 3 if record else 1)
    axes = list(axes[0])
    if record:
        shown = record.time < record.time[0] + SHOWN_TURNS * 2 * np.pi / record.speed
        turns = record.time[shown] * record.speed / (2 * np.pi)
        signals, orbit_axes = axes.pop(0), axes.pop(0)
        for s, node in enumerate(record.sensors):
            z, colour = record.displacement[s, shown], COLOURS[s % len(COLOURS)]
            moving = z - np.nanmean(z)
            signals.plot(turns, moving.real * 1e6, color=colour, label=f"x, node {node}")
            signals.plot(turns, moving.imag * 1e6, color=colour, linestyle="--", label=f"y, node {node}")
            plot_orbit(z, orbit_axes, index=s % len(COLOURS), label=f"node {node}")
        signals.set_xlabel("turns")
        signals.set_ylabel("displacement less its mean (µm)")
        signals.legend()
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
    axes[0].set_yscale("log")
    axes[0].set_ylabel("amplitude ± 2 σ (µm)")
    axes[0].legend()
    harmonic_axis(axes[0], spectrum.harmonics)
    stream = io.BytesIO()
    picture.savefig(stream, format="png", dpi=80, metadata={"Software": None})
    plt.close(picture)
    encoded = base64.b64encode(stream.getvalue()).decode()
    return f'<img alt="signal, orbit, spectrum" src="data:image/png;base64,{encoded}">'
