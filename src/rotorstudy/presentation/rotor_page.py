"""The page of a rotordynamic analysis; and the check of a rig file, as text and as plain data."""

from dataclasses import asdict
from functools import partial

import numpy as np
import pandas as pd

from rotorstudy.diagnosis.verdict.cause_words import readable
from rotorstudy.presentation.pages import cells, pictures, render
from rotorstudy.presentation.rotor_figures import whirl_name
from rotorstudy.response.whirl import RESONANT, required_margin, separation_margin
from rotorstudy.studies.rig_check import TRIED
from rotorstudy.studies.stability_margin import LEAST_DECREMENT, log_decrement
from rotorstudy.units import number, percent, quantity, shown_amplitude, shown_speed

MOST_EFFECTS = 8  # on the least stable mode, the largest
RIGID = 1e-3  # of the weight: what the bearings do not carry beyond that is carried by rigid supports
ROUND_OFF = 1e-9  # of the weight
OIL_WHIRL, LITTLE_DAMPED = (0.35, 0.55), 0.3  # frequency over speed, and logarithmic decrement below which it is said
OVERDAMPED = 10.0  # logarithmic decrement that is not worth a number
FAR = 0.15  # of the clearance: three times what an error of 10 % in clearance or viscosity moves a journal
SAME_RESONANCE = 0.05  # a peak of a probe within this of a critical speed is that of its mode
_speed = partial(quantity, unit="rad/s", digits=5)


def rotor_page(analysis, figures, charts, title, captions):
    """The page as HTML, of figures name -> PNG (path or bytes), and charts of `rotor_charts`."""
    found = analysis_data(analysis)
    found["growth_rate"] = found["growth_rate"][:MOST_EFFECTS]
    return render(
        "rotor.html",
        title=f"Rotordynamic analysis of {title}",
        summary=summary(analysis),
        operating=analysis.operating and " to ".join(map(_speed, analysis.operating)),
        figures=pictures(figures, captions),
        charts=charts,
        tables={name: cells(pd.DataFrame(map(_shown, rows)), 4) if rows else None for name, rows in found.items()},
    )


def analysis_data(analysis):
    """Tables of a RotorAnalysis, each a list of dicts in SI, as for JSON."""
    damping = [{"effect": name, "part_of_the_growth_rate_1_per_s": value} for name, value in analysis.damping.items()]
    found = {"criticals": criticals(analysis), "loads": loads(analysis), "resonances": resonances(analysis)}
    return found | {"growth_rate": damping}


def _shown(row):
    """A row of a table with the headings and in the units of a reader."""
    units = {"_rad_per_s": shown_speed(), "_m": shown_amplitude(), "_N": ("N", 1.0), "_Hz": ("Hz", 1.0)}
    units |= {"_1_per_s": ("1/s", 1.0), "_share": ("%", 100.0), "": ("", 1.0)}
    found = {}
    for key, value in row.items():
        ending = next(ending for ending in units if key.endswith(ending))
        unit, factor = units[ending]
        heading = f"{readable(key.removesuffix(ending))} ({unit or 1})"
        found[heading] = factor * value if isinstance(value, float) else value
    return found


def summary(analysis):
    """The results in sentences, a list."""
    data, margin, (unit, per) = analysis.data, analysis.margin, shown_speed()
    speed, growth, decrement = data.growth_speed.values, data.growth_rate.values, margin and margin.log_decrement
    text = render(
        "rotor_summary.txt",
        analysis=analysis,
        last=_speed(float(data.speed[-1])),
        shown=[f"{_speed(one.speed)} ({whirl_name(one.direction)})" for one in analysis.resonant],
        none_shown=_none(analysis),
        overdamped=len(analysis.criticals) - len(analysis.resonant),
        resonant=RESONANT,
        growth_speeds=len(speed),
        threshold=number((analysis.threshold or 0.0) * per, 5),
        stable=speed[(speed > (analysis.threshold or np.inf)) & (growth < 0)].tolist(),
        unit=unit,
        margin=margin,
        decrement=margin and (number(decrement, 3) if decrement < OVERDAMPED else f"over {OVERDAMPED:g}"),
        least=LEAST_DECREMENT,
        oil_whirl=margin
        and margin.on_films
        and decrement < LITTLE_DAMPED
        and OIL_WHIRL[0] < margin.frequency / margin.speed < OIL_WHIRL[1],
        separations=[_separation(analysis, one.speed) for one in analysis.resonant] if analysis.operating else [],
        journals=[_journal(one) for one in analysis.centrelines if len(one.measured)],
        unbounded=dict.fromkeys(_speed(one.peak.speed) for one in analysis.peaks if np.isinf(one.peak.amplitude)),
        written={"speed": _speed, "percent": percent, "quantity": quantity},
    )
    return text.splitlines()


def _separation(analysis, critical):
    """A critical speed, its separation margin, on which side of the operating range, and what is needed, or None."""
    near = [one.peak for one in analysis.peaks if abs(one.peak.speed / critical - 1) < SAME_RESONANCE]
    needed = [required_margin(peak, analysis.operating) for peak in near]
    place = "below" if critical < analysis.operating[0] else "above"
    needed = max((share for share in needed if np.isfinite(share)), default=None)
    return critical, separation_margin(critical, analysis.operating), place, needed


def _journal(one):
    """Where a journal was measured at its highest measured speed, where its film runs there, and whether it is far."""
    i = int(one.measured_speed.argmax())
    seen, film = (f"{number(abs(z) / one.clearance, 2)} of the clearance at {number(np.rad2deg(np.angle(z)) % 360, 2)}°"
                  for z in (one.measured[i], one.expected[i]))  # fmt: skip
    far = abs(one.measured[i] - one.expected[i]) > FAR * one.clearance
    doubt = one.doubt(i) or "far off, so that load (alignment), clearance or oil are not as stated"
    return {"node": one.node, "seen": seen, "speed": one.measured_speed[i], "film": film, "doubt": far and doubt}


def _none(analysis):
    """Why no critical speed is listed: where the analysed range ended below the whirl frequencies, that is said."""
    frequency = analysis.data.frequency.values[-1]
    above = frequency[np.isfinite(frequency) & (frequency > float(analysis.data.speed[-1]))]
    if not len(above):
        return "none"
    return f"none in this range; the lowest whirl frequency above it is {_speed(above.min())} there (see --speeds)"


def criticals(analysis):
    """A row for each critical speed that shows as a resonance."""
    rows = []
    for one in analysis.resonant:
        row = {"speed_rad_per_s": one.speed, "frequency_Hz": one.speed / (2 * np.pi)}
        row |= {"damping_ratio": one.damping_ratio, "logarithmic_decrement": float(log_decrement(one.damping_ratio))}
        rows.append(row | {"whirl": whirl_name(one.direction)})
    return rows


def resonances(analysis):
    """A row for each resonance of a probe, with separation margins if the operating range is stated."""
    rows = []
    for node, probe, peak in analysis.peaks:
        row = {"probe": f"{probe} at node {node}", "peak_rad_per_s": peak.speed}
        row |= {"1X_m": peak.amplitude, "amplification_factor": peak.amplification}
        if operating := analysis.operating:
            row["separation_margin_share"] = separation_margin(peak.speed, operating)
            row["margin_required_by_API_617_share"] = required_margin(peak, operating)
        rows.append({key: one if isinstance(one, str) or np.isfinite(one) else None for key, one in row.items()})
    return rows


def loads(analysis):
    """A row for each bearing, and one for what rigid supports carry."""
    rows = []
    for one in analysis.loads:
        name, across = f"node {one.node}" + (f" ({one.label})" if one.label else ""), one.force.imag
        across = across if abs(across) > ROUND_OFF * analysis.weight else 0.0
        rows.append({"bearing": name, "downward_N": one.force.real, "across_N": across})
    rest = analysis.weight - sum(one.force.real for one in analysis.loads)
    if abs(rest) > RIGID * analysis.weight:
        rows.append({"bearing": "rigid supports", "downward_N": rest, "across_N": 0.0})
    return rows


def check_data(check):
    """A RigCheck as a dict for JSON."""
    found = {"errors": len(check.errors), "findings": [asdict(finding) for finding in check.findings]}
    found["speed_range_rad_per_s"] = list(check.valid) if check.valid else None
    if check.analysis:
        found |= {"summary": summary(check.analysis), "weight_N": check.analysis.weight}
        found |= {"loads": loads(check.analysis), "criticals": criticals(check.analysis)}
    return found


def check_words(check):
    """A RigCheck as lines of text."""
    lines, analysis, (unit, per) = [], check.analysis, shown_speed()
    if check.model:
        structure = check.model.structure
        length = f"{structure.length:.4g} m, " if structure.length else ""
        mass = float(structure.along @ structure.mass @ structure.along)
        count = len(structure.nodes)
        lines.append(f"rotor: {length}{mass:.4g} kg, {count} {'node that moves' if count == 1 else 'nodes that move'}")
    if analysis:
        shares = [f"{row['bearing']} {row['downward_N']:.4g} N" for row in loads(analysis)]
        lines.append(f"static loads: {', '.join(shares) or 'none'}; weight {analysis.weight:.4g} N")
        lines += [
            f"critical speed: {_speed(one.speed)}, {whirl_name(one.direction)}, damping ratio {one.damping_ratio:.3g}"
            for one in analysis.resonant
        ]
        lines += summary(analysis)[0 if not analysis.resonant else 1 :]
    if check.valid and check.valid != (TRIED[0], TRIED[-1]):
        low, high = (number(w * per, 4) for w in check.valid)
        lines.append(f"all bearings are defined from {low} to {high} {unit}")
    lines += [str(finding) for finding in check.findings]
    counts = [sum(f.severity == kind for f in check.findings) for kind in ("error", "warning", "note")]
    told = [f"{n} {kind}{'s' * (n != 1)}" for n, kind in zip(counts, ("error", "warning", "note"), strict=True)]
    return [*lines, ", ".join(told)]
