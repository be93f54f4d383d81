"""The check of a rig file, as text and as plain data."""

from dataclasses import asdict

from rotorstudy.presentation.rotor_page import criticals, loads, summary
from rotorstudy.units import number, shown_speed


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
        lines.append(f"rotor: {length}{mass:.4g} kg, {len(structure.nodes)} nodes that move")
    if analysis:
        shares = [f"{row['bearing']} {row['downward (N)']:.4g} N" for row in loads(analysis)]
        lines.append(f"static loads: {', '.join(shares) or 'none'}; weight {analysis.weight:.4g} N")
        lines += [
            f"critical speed: {number(row[f'speed ({unit})'], 5)} {unit}, {row['whirl']}, "
            f"damping ratio {row['damping ratio (1)']:.3g}"
            for row in criticals(analysis)
        ]
        lines += summary(analysis)[0 if not analysis.resonant else 1 :]
    if check.valid:
        low, high = (number(w * per, 4) for w in check.valid)
        lines.append(f"all bearings are defined from {low} to {high} {unit}")
    lines += [str(finding) for finding in check.findings]
    counts = [sum(f.severity == kind for f in check.findings) for kind in ("error", "warning", "note")]
    told = [f"{n} {kind}{'s' * (n != 1)}" for n, kind in zip(counts, ("error", "warning", "note"), strict=True)]
    return [*lines, ", ".join(told)]
