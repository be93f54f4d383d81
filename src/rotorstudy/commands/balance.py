"""Correction masses by the model of a rig and its records."""

from rotorstudy.commands.shared import NETCDF, check_file, tell
from rotorstudy.errors import RotorstudyError
from rotorstudy.units import number, quantity, shown_amplitude, spin


def add(parser):
    parser.add_argument("records", nargs="+", help="record files, tables of harmonics, or one imported spectrum")
    parser.add_argument("--rig", required=True, help="rig file, best one that `identify --runs` has updated")
    told = "nodes (or their labels) for correction masses"
    parser.add_argument("--planes", required=True, nargs="+", metavar="NODE", help=told)
    told = "only in N holes of each plane, at equal angles, the first at 0 degrees"
    parser.add_argument("--holes", type=int, metavar="N", help=told)
    told = "with --holes: unbalances that a weight in one hole may add, g mm; at most two holes of a plane are used"
    parser.add_argument("--weights", type=float, nargs="+", metavar="G_MM", help=told)
    parser.add_argument("--out", metavar="FILE", help="NetCDF file for the corrections, and the vibration they leave")


def run(given):
    """Print the corrections with their standard deviations, and the 1X vibration before and after."""
    from rotorstudy.diagnosis.runs.balance import INTERVAL, balance_files
    from rotorstudy.diagnosis.runs.balance_holes import equal_holes
    from rotorstudy.measurement.conventions import read_conventions
    from rotorstudy.model.rig import read_rig

    if (given.holes is None) != (given.weights is None):
        raise RotorstudyError("balance: --holes and --weights belong together; give both, or neither")
    if given.out:
        check_file(given.out, given.rig, *given.records, suffixes=NETCDF)
    rig = read_rig(given.rig)
    conventions = read_conventions(rig.given, given.rig)
    holes = None if given.holes is None else equal_holes(given.holes, given.weights, conventions.sense)
    planes = [int(plane) if plane.isdecimal() else plane for plane in given.planes]
    found, findings = balance_files(given.records, rig, planes, holes)
    tell(findings)
    if holes:
        where = f"in {given.holes} holes at equal angles ({conventions.shaft_angles})"
        said = [_in_holes(choice, given.holes) for choice in found.choices]
    else:
        where = f"(± one standard deviation; angles {conventions.shaft_angles})"
        said = _corrections(found, planes, conventions.sense)
    print(f"unbalance to be added{',' * bool(holes)} {where}")
    for plane, text in zip(planes, said, strict=True):
        print(f"  plane {plane}: {text}")
    unit, factor = shown_amplitude()
    print(f"1X along the longest axis of the orbit, {unit}: before, left (95 %), and the next reading (95 %)")
    for i, speed in enumerate(found.spectrum.speed):
        for j, node in enumerate(found.spectrum.sensors):
            sizes = ([number(factor * size[i, j], 2) for size in one] for one in (found.after, found.next_reading))
            left, shown = (f"{middle} ({low} to {high})" for low, middle, high in sizes)
            print(f"  {spin(speed)}, node {node}: {number(factor * found.before[i, j], 2)}, {left}, {shown}")
    if given.out:
        _save(given, rig, found, planes)
    shown = {"correction_kg_m": found.corrections, "covariance": found.covariance, "speeds_rad_s": found.spectrum.speed}
    shown |= {"before_m": found.before, "after_m": found.after, "next_reading_m": found.next_reading}
    data = {"planes": planes, "nodes": list(found.spectrum.sensors), "percentiles": list(INTERVAL)}
    if holes:
        placed = [[(hole + 1, float(holes.angles[hole]), size) for hole, size in one.placed] for one in found.choices]
        keys = ("hole", "angle_rad", "unbalance_kg_m")
        data["in_holes"] = [[dict(zip(keys, one, strict=True)) for one in own] for own in placed]
    return data | {name: one.tolist() for name, one in shown.items()}


def _corrections(found, planes, sense):
    """The best correction of each plane with its standard deviations, as text."""
    import numpy as np

    from rotorstudy.inference.estimate import magnitude_and_phase

    names = [f"plane {plane}_{part}" for plane in planes for part in ("real", "imag")]
    _, sizes, covariance = magnitude_and_phase(names, found.corrections.ravel(), found.covariance)
    sizes, std = sizes.reshape(-1, 2), np.sqrt(np.diag(covariance)).reshape(-1, 2)
    for (size, angle), (of_size, of_angle) in zip(sizes, std, strict=True):
        yield f"{quantity(size, 'kg m', of_size)} at {quantity(sense * angle % (2 * np.pi), 'rad', of_angle)}"


def _in_holes(choice, count):
    """What is put into which holes of a plane, as text."""
    parts = [f"{quantity(size, 'kg m')} at {360 * hole / count:.4g}°" for hole, size in choice.placed]
    return " and ".join(parts) or "none"


def _save(given, rig, found, planes):
    """Write the corrections, and the vibration before and after, to a NetCDF file."""
    from rotorstudy.diagnosis.runs.balance import INTERVAL
    from rotorstudy.store import provenance, save
    from rotorstudy.studies.common import results

    spectrum = found.spectrum
    along = {"plane": list(map(str, planes)), "speed": spectrum.speed, "node": list(spectrum.sensors)}
    sizes = {"before": found.before, "after": found.after, "next_reading": found.next_reading}
    sizes["correction"] = found.corrections @ [1, 1j]
    data = results("balance", "corrections of the balance", **along, percentile=list(INTERVAL), **sizes)
    origin = provenance(rig.given, rig.plugins) | {"records": ", ".join(map(str, given.records))}
    save(data.assign_attrs(origin), given.out)
