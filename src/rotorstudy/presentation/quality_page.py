"""The quality page: findings, facts and charts of every record, in one self-contained file."""

import numpy as np
import pandas as pd

from rotorstudy.measurement.findings import SEVERITIES, NodeFacts, RecordFacts, facts_of
from rotorstudy.presentation import charts
from rotorstudy.presentation.charts import bode_pictures
from rotorstudy.presentation.pages import cells, inline_png, render
from rotorstudy.presentation.plots import png_bytes
from rotorstudy.store import write_text
from rotorstudy.units import shown_unit

SHOWN_REVOLUTIONS = 4  # of the waveform
MOST_SAMPLES = 480  # of it that are drawn
SHARP = 110  # dpi; these pictures are few


def write_page(measurement, path, title):
    """Write the quality page of a Measurement to a file; title : heading of the page."""
    records, nodes = [], []
    for one in measurement.facts:
        records.append({"record": one.where, **_named(one, RecordFacts)})
        nodes += [{"record": one.where, "node": at, **_named(its, NodeFacts)} for at, its in one.nodes.items()]
    counts = {kind: sum(f.severity == kind for f in measurement.findings) for kind in SEVERITIES}
    found = ", ".join(f"{n} {kind}{'s' * (n > 1)}" for kind, n in counts.items() if n) or "no problem was found"
    page = render(
        "quality.html",
        title=f"{title}: {found}",
        findings=measurement.findings,
        counts=counts,
        records=_table(records),
        nodes=_table(nodes),
        bode=measurement.spectrum and _bode(measurement.spectrum, charts.axes_of(measurement.rig, {})),
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


def _table(rows):
    """Rows of facts without the columns that none has; those of a table of harmonics are few."""
    return cells(pd.DataFrame(rows).dropna(axis="columns", how="all"), 4)


def _view(measurement):
    """The charts of orbit, waveform and full spectrum of every speed."""
    spectrum, reading = measurement.spectrum, measurement.rig.structure.reading
    amplitude = spectrum.amplitude.transpose(0, 2, 1)
    largest = int(np.abs(amplitude[:, :, spectrum.harmonics != 0]).max(axis=(1, 2)).argmax())
    records = {record.speed: record for record in measurement.records}
    return charts.speed_view(
        "records",
        spectrum.speed,
        spectrum.sensors,
        spectrum.harmonics,
        {"measured": ("measured, with two standard deviations", 0, amplitude)},
        {"measured": np.sqrt(spectrum.variance).transpose(0, 2, 1)},
        (largest, 0),
        {"mark_rad": reading.mark_rad},
        [getattr(records.get(w), "where", "").split(", ")[0] for w in spectrum.speed],
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
    rounded = charts.rounded
    passes = [int(np.argmin(np.abs(turned - 360 * turn))) for turn in range(SHOWN_REVOLUTIONS)]
    found = []
    for z in record.displacement:
        moving = factor * (z - np.nanmean(z))[inside]
        found.append({"angle": rounded(turned), "x": rounded(moving.real), "y": rounded(moving.imag), "marks": passes})
    return found


def _bode(spectrum, axes):
    """Charts and static pictures of 1X over speed along each probe; None with few speeds, or without 1X and -1X."""
    if not charts.is_sweep(spectrum.speed, spectrum.harmonics):
        return None
    order = np.argsort(spectrum.speed)
    speed, sorted_by_speed = spectrum.speed[order], spectrum.amplitude[order]
    data = charts.bode_charts(
        "bode", speed, charts.along_probes(axes, spectrum.sensors, spectrum.harmonics, sorted_by_speed)
    )
    drawn = zip(("Bode plot", "Polar plot"), bode_pictures(data).values(), strict=True)
    return {"charts": data, "pictures": {title: inline_png(png_bytes(picture, SHARP)) for title, picture in drawn}}
