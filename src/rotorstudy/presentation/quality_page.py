"""The quality page: findings, facts and charts of every record, in one self-contained file."""

import numpy as np

from rotorstudy.measurement.findings import SEVERITIES, NodeFacts, RecordFacts, facts_of
from rotorstudy.presentation.bode_figures import bode, polar
from rotorstudy.presentation.charts import along_probes, bode_charts, deviations, rounded, speed_view
from rotorstudy.presentation.pages import inline_png, render
from rotorstudy.presentation.plots import png_bytes
from rotorstudy.presentation.tables import cells
from rotorstudy.store import write_text
from rotorstudy.units import shown_unit

SHOWN_REVOLUTIONS = 4  # of the waveform
MOST_SAMPLES = 480  # of it that are drawn
FEWEST_SPEEDS = 8  # of a Bode plot
SHARP = 110  # dpi; these pictures are few


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
        bode=measurement.spectrum and _bode(measurement.spectrum, measurement.rig.structure.reading),
        view=measurement.spectrum and _view(measurement),
    )
    write_text(path, page)


def _named(facts, kind):
    """Facts under their long names with unit."""
    found = {}
    for name, unit, long in facts_of(kind):
        unit, factor = shown_unit(unit)
        found[f"{long} ({unit})" if unit else long] = factor * float(getattr(facts, name))
    return found


def _known(rows):
    """A DataFrame of rows without the columns of facts that none has; those of a table of harmonics are few."""
    import pandas as pd

    return pd.DataFrame(rows).dropna(axis="columns", how="all")


def _view(measurement):
    """The charts of orbit, waveform and full spectrum of every speed."""
    spectrum, reading = measurement.spectrum, measurement.rig.structure.reading
    amplitude = spectrum.amplitude.transpose(0, 2, 1)
    largest = int(np.abs(amplitude[:, :, spectrum.harmonics != 0]).max(axis=(1, 2)).argmax())
    records = {record.speed: record for record in measurement.records}
    return speed_view(
        "records",
        spectrum.speed,
        spectrum.sensors,
        spectrum.harmonics,
        {"measured": ("measured, with two standard deviations", 0, amplitude)},
        {"measured": deviations(spectrum)},
        (largest, 0),
        {"mark_rad": reading.mark_rad},
        [getattr(records.get(w), "where", "") for w in spectrum.speed],
        signals=(lambda i: _signals(records.get(spectrum.speed[i]), reading.mark_rad)) if records else None,
    )


def _signals(record, mark):
    """What was measured at each node in the first revolutions of a record after its phase mark, and each mark there."""
    if record is None:
        return None
    factor = shown_unit("m")[1]
    angle = record.speed * record.time - mark  # time zero is at the shaft's reference line
    start = 2 * np.pi * np.ceil(angle[0] / (2 * np.pi))
    inside = np.flatnonzero((angle >= start) & (angle < start + 2 * np.pi * SHOWN_REVOLUTIONS))
    inside = inside[:: max(1, len(inside) // MOST_SAMPLES)]
    turned = np.rad2deg(angle[inside] - start)
    passes = [int(np.argmin(np.abs(turned - 360 * turn))) for turn in range(SHOWN_REVOLUTIONS)]
    found = []
    for z in record.displacement:
        moving = factor * (z - np.nanmean(z))[inside]
        found.append({"angle": rounded(turned), "x": rounded(moving.real), "y": rounded(moving.imag), "marks": passes})
    return found


def _bode(spectrum, reading):
    """Charts and static pictures of 1X over speed along each probe; None with few speeds, or without 1X and -1X."""
    if len(spectrum.speed) < FEWEST_SPEEDS or not {1, -1} <= set(spectrum.harmonics.tolist()):
        return None
    order = np.argsort(spectrum.speed)
    speed, curves = spectrum.speed[order], {}
    for i, node in enumerate(spectrum.sensors):
        probes = reading.probes_at(node)
        curves[node] = along_probes(probes, reading.mark_rad, spectrum.harmonics, spectrum.amplitude[order, :, i])
    pictures = {
        title: inline_png(png_bytes(draw(speed, curves), SHARP))
        for title, draw in (("Bode plot", bode), ("Polar plot", polar))
    }
    return {"charts": bode_charts("bode", speed, curves), "pictures": pictures}
