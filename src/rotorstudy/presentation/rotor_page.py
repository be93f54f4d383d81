"""The page of a rotordynamic analysis; and the check of a rig file, as text and as plain data."""

from dataclasses import asdict

import numpy as np
import pandas as pd

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


def rotor_page(analysis, figures, charts, title, captions):
    """The page as HTML, of figures name -> PNG (path or bytes), and charts of `rotor_charts`."""
    changes, heading = list(analysis.damping.items())[:MOST_EFFECTS], "change of the growth rate (1/s)"
    found = {"criticals": criticals(analysis), "peaks": resonances(analysis), "loads": loads(analysis)}
    found["damping"] = [{"effect": name, heading: value} for name, value in changes]
    return render(
        "rotor.html",
        title=f"Rotordynamic analysis of {title}",
        analysis=analysis,
        summary=summary(analysis),
        operating=analysis.operating and " to ".join(map(_speed, analysis.operating)),
        figures=pictures(figures, captions),
        charts=charts,
        tables={name: cells(pd.DataFrame(rows), 4) if rows else None for name, rows in found.items()},
    )


def _speed(speed, unit=True):
    """A speed (rad/s) in the reader's unit: 5400 rpm."""
    name, per = shown_speed()
    return f"{number(float(speed) * per, 5)}{f' {name}' if unit else ''}"


def summary(analysis):
    """The results in sentences, a list."""
    last = _speed(analysis.data.speed[-1])
    named = [f"{_speed(one.speed)} ({whirl_name(one.direction)})" for one in analysis.resonant]
    found = [f"Critical speeds up to {last}: {', '.join(named) or _none(analysis)}."]
    hidden = len(analysis.criticals) - len(analysis.resonant)
    if hidden:
        text = f"{hidden} more are overdamped and do not" if hidden > 1 else "1 more is overdamped and does not"
        found.append(f"{text} show (damping ratio above {RESONANT:g}).")
    speed, growth = analysis.data.growth_speed.values, analysis.data.growth_rate.values
    if analysis.threshold is None:
        shown = f", as far as {len(speed)} speeds show, parametric resonances of the lowest modes included"
        shown = shown if analysis.left_out and not analysis.damping else ""  # only where the stiffness rotates
        found.append(f"The rotor is stable up to {last}{shown}.")
    else:
        stable = speed[(speed > analysis.threshold) & (growth < 0)]
        until = f" to {_speed(stable[0])}" if len(stable) else f" {shown_speed()[0]}"
        found.append(f"The rotor is unstable from {_speed(analysis.threshold, False)}{until}.")
    found += [*_stability(analysis), *_margins(analysis), *_positions(analysis)]
    found.append(f"Unbalance: {analysis.unbalance}.")
    if analysis.left_out:
        found.append(
            f"Whirl and unbalance response leave out {', '.join(analysis.left_out)}: what is nonlinear or rotates with "
            "the shaft. The growth rate includes it; that of a nonlinear force is about its own steady state."
        )
    if analysis.at_spin_speed:
        found.append(
            f"Stiffness and damping of {', '.join(analysis.timeless)} are those at the spin speed: exact for critical "
            "speeds and unbalance response, approximate for whirl at other frequencies and for the growth rate."
        )
    elif analysis.timeless:
        left_out = f"what has no time-domain form of {', '.join(analysis.timeless)}"
        found.append(
            f"Whirl and growth rate leave out {left_out}; the decrement of the first forward mode and the unbalance "
            "response include it."
        )
    unbounded = dict.fromkeys(_speed(p.peak.speed) for p in analysis.peaks if np.isinf(p.peak.amplitude))
    if unbounded:
        found.append(f"No damping acts on the resonance at {', '.join(unbounded)}: its response has no bound.")
    return found


def _stability(analysis):
    """Sentences on the first forward mode at the highest operating speed, as in level 1 of API 617."""
    margin = analysis.margin
    if margin is None:
        return []
    share = margin.frequency / margin.speed
    mode = f"the first forward mode ({_speed(margin.frequency)}, {percent(share, 2)} of the speed)"
    decrement = number(margin.log_decrement, 3) if margin.log_decrement < OVERDAMPED else f"over {OVERDAMPED:g}"
    found = [
        f"At {_speed(margin.speed)} {mode} has the logarithmic decrement {decrement}; API 617 "
        f"asks for {LEAST_DECREMENT:g} with the cross-coupling that the machine is expected to have."
    ]
    if margin.cross_coupling:
        bears = f"Cross-coupling of {quantity(margin.cross_coupling, 'N/m')} at node {margin.node} takes it to zero"
        found.append(f"{bears}; unless that is more than twice what is expected there, API 617 asks for level 2.")
    if margin.on_films and OIL_WHIRL[0] < share < OIL_WHIRL[1] and margin.log_decrement < LITTLE_DAMPED:
        found.append(
            "Oil whirl: a forward mode near half of the speed is driven by the films. Watch for a line at "
            f"{percent(share, 2)} of the speed; more load, less clearance or thicker films change it."
        )
    return found


def _margins(analysis):
    """A sentence on the separation margin of each critical speed that shows, up to the end of the range."""
    if not analysis.operating:
        return []
    found = []
    for one in analysis.resonant:
        margin, text = separation_margin(one.speed, analysis.operating), f"The critical speed {_speed(one.speed)} is"
        near = [p.peak for p in analysis.peaks if abs(p.peak.speed / one.speed - 1) < SAME_RESONANCE]
        needed = [required_margin(peak, analysis.operating) for peak in near]
        needed = max((share for share in needed if np.isfinite(share)), default=None)
        place = "below" if one.speed < analysis.operating[0] else "above"
        text += f" {percent(margin)} {place} the operating range" if margin else " inside the operating range"
        if needed is None:
            found.append(f"{text}; its amplification is not known, or no probe shows it.")
        elif margin >= needed:
            found.append(f"{text}; API 617 asks for {percent(needed)}.")
        else:
            found.append(f"{text}: too near, API 617 asks for {percent(needed)}.")
    return found


def _positions(analysis):
    """A sentence on each journal whose position was measured, at its highest measured speed."""
    found = []
    for one in analysis.centrelines:
        if not len(one.measured):
            continue
        i = int(one.measured_speed.argmax())
        expected = one.expected[i]
        seen, film = (f"{number(abs(z) / one.clearance, 2)} of the clearance at {number(np.rad2deg(np.angle(z)), 2)}°"
                      for z in (one.measured[i], expected))  # fmt: skip
        text = f"The journal at node {one.node} was measured at {seen} from gravity at {_speed(one.measured_speed[i])}"
        far = abs(one.measured[i] - expected) > FAR * one.clearance
        hint = one.doubt(i) or "far off, so that load (alignment), clearance or oil are not as stated"
        found.append(f"{text}; its film of the rig runs at {film}{f': {hint}' if far else ''}.")
    return found


def _none(analysis):
    """Why no critical speed is listed: where the analysed range ended below the whirl frequencies, that is said."""
    last = float(analysis.data.speed[-1])
    frequency = analysis.data.frequency.values[-1]
    above = frequency[np.isfinite(frequency) & (frequency > last)]
    if not len(above):
        return "none"
    return f"none in this range; the lowest whirl frequency above it is {_speed(above.min())} there (see --speeds)"


def criticals(analysis):
    """A row for each critical speed that shows as a resonance."""
    unit, per = shown_speed()
    rows = []
    for one in analysis.resonant:
        row = {f"speed ({unit})": one.speed * per, "frequency (Hz)": one.speed / (2 * np.pi)}
        row |= {"damping ratio (1)": one.damping_ratio, "logarithmic decrement (1)": log_decrement(one.damping_ratio)}
        rows.append({**row, "whirl": whirl_name(one.direction)})
    return rows


def resonances(analysis):
    """A row for each resonance of a probe, with separation margins if the operating range is stated."""
    rows, (unit, factor), (speed_unit, per) = [], shown_amplitude(), shown_speed()
    for node, probe, peak in analysis.peaks:
        row = {
            "probe": f"{probe} at node {node}",
            f"peak ({speed_unit})": peak.speed * per,
            f"1X ({unit})": factor * peak.amplitude if np.isfinite(peak.amplitude) else None,
            "amplification factor (1)": peak.amplification if np.isfinite(peak.amplification) else None,
        }
        if operating := analysis.operating:
            row["separation margin"] = percent(separation_margin(peak.speed, operating))
            needed = required_margin(peak, operating)
            row["required (API 617)"] = "not known" if np.isnan(needed) else percent(needed)
        rows.append(row)
    return rows


def loads(analysis):
    """A row for each bearing, and one for what rigid supports carry."""
    rows = []
    for one in analysis.loads:
        name, across = f"node {one.node}" + (f" ({one.label})" if one.label else ""), one.force.imag
        across = across if abs(across) > ROUND_OFF * analysis.weight else 0.0
        rows.append({"bearing": name, "downward (N)": one.force.real, "across (N)": across})
    rest = analysis.weight - sum(one.force.real for one in analysis.loads)
    if abs(rest) > RIGID * analysis.weight:
        rows.append({"bearing": "rigid supports", "downward (N)": rest, "across (N)": 0.0})
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
        shares = [f"{row['bearing']} {row['downward (N)']:.4g} N" for row in loads(analysis)]
        lines.append(f"static loads: {', '.join(shares) or 'none'}; weight {analysis.weight:.4g} N")
        lines += [
            f"critical speed: {number(row[f'speed ({unit})'], 5)} {unit}, {row['whirl']}, "
            f"damping ratio {row['damping ratio (1)']:.3g}"
            for row in criticals(analysis)
        ]
        lines += summary(analysis)[0 if not analysis.resonant else 1 :]
    if check.valid and check.valid != (TRIED[0], TRIED[-1]):
        low, high = (number(w * per, 4) for w in check.valid)
        lines.append(f"all bearings are defined from {low} to {high} {unit}")
    lines += [str(finding) for finding in check.findings]
    counts = [sum(f.severity == kind for f in check.findings) for kind in ("error", "warning", "note")]
    told = [f"{n} {kind}{'s' * (n != 1)}" for n, kind in zip(counts, ("error", "warning", "note"), strict=True)]
    return [*lines, ", ".join(told)]
