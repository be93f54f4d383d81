"""`rotorstudy balance`: correction masses, and the vibration that they leave."""

import sys

from rotorstudy.commands.outputs import check_file
from rotorstudy.errors import RotorstudyError


def add(commands):
    """Add the command and its arguments to the subparsers."""
    parser = commands.add_parser("balance", help="correction masses by the model of a rig and its records")
    parser.add_argument("records", nargs="+", help="record files, tables of harmonics, or one imported spectrum")
    parser.add_argument("--rig", required=True, help="rig file, best one that `identify --runs` has updated")
    parser.add_argument(
        "--planes", required=True, nargs="+", metavar="NODE", help="nodes (or their labels) for correction masses"
    )
    parser.add_argument(
        "--holes", type=int, metavar="N", help="only in N holes of each plane, at equal angles, the first at 0 degrees"
    )
    parser.add_argument(
        "--weights",
        type=float,
        nargs="+",
        metavar="G_MM",
        help="with --holes: unbalances that one weight in a hole adds, g mm; at most two holes of a plane are used",
    )
    parser.add_argument("--out", metavar="FILE", help="NetCDF file for the corrections, and the vibration they leave")
    parser.set_defaults(func=run)


def run(given):
    """Print the corrections with their standard deviations, and the 1X vibration before and after."""
    import numpy as np

    from rotorstudy.diagnosis.runs.balance import balance_files
    from rotorstudy.diagnosis.runs.balance_holes import equal_holes
    from rotorstudy.measurement.conventions import read_conventions
    from rotorstudy.model.rig import read_rig
    from rotorstudy.units import spin, um

    if (given.holes is None) != (given.weights is None):
        raise RotorstudyError("balance: --holes and --weights belong together; give both, or neither")
    if given.out:
        check_file(given.out, given.rig, *given.records)
    rig = read_rig(given.rig)
    sense = read_conventions(rig.given, given.rig).sense
    holes = None if given.holes is None else equal_holes(given.holes, given.weights, sense)
    planes = [int(plane) if plane.isdigit() else plane for plane in given.planes]
    found, conventions, findings = balance_files(given.records, rig, planes, holes)
    for finding in findings:
        print(finding, file=sys.stderr)
    if holes:
        _print_choices(found, planes, given.holes)
    else:
        _print_corrections(found, planes, conventions)
    print("1X vibration, semi-major axis of the orbit: before, left (95 %), and the next reading (95 %)")
    for i, speed in enumerate(found.spectrum.speed):
        for j, node in enumerate(found.spectrum.sensors):
            sizes = ([um(size[i, j]) for size in one] for one in (found.after, found.next_reading))
            left, shown = (f"{middle} ({low} to {high})" for low, middle, high in sizes)
            print(f"  {spin(speed)}, node {node}: {um(found.before[i, j])}, {left}, {shown}")
    if given.out:
        _save(given, rig, found, planes)
    return {
        "planes": planes,
        "correction_kg_m": np.asarray(found.corrections).tolist(),
        "covariance": np.asarray(found.covariance).tolist(),
        "before_m": found.before.tolist(),
        "after_m": np.asarray(found.after).tolist(),
    }


def _print_corrections(found, planes, conventions):
    """Print the best corrections with their standard deviations."""
    import numpy as np

    from rotorstudy.inference.estimate import magnitude_and_phase
    from rotorstudy.units import quantity

    names = [f"plane {plane}_{part}" for plane in planes for part in ("real", "imag")]
    _, sizes, covariance = magnitude_and_phase(names, found.corrections.ravel(), found.covariance)
    std = np.sqrt(np.diag(covariance))
    print(
        "unbalance to be added (± one standard deviation; angles as in the rig file, from the shaft's reference line)"
    )
    for i, plane in enumerate(planes):
        angle = conventions.sense * sizes[2 * i + 1] % (2 * np.pi)
        size = quantity(sizes[2 * i], "kg m", std[2 * i])
        print(f"  plane {plane}: {size} at {quantity(angle, 'rad', std[2 * i + 1])}")


def _print_choices(found, planes, count):
    """Print what is put into which hole."""
    from rotorstudy.units import quantity

    print(
        f"unbalance to be added, in {count} holes at equal angles (as in the rig file, from the shaft's reference line)"
    )
    for plane, choice in zip(planes, found.choices, strict=True):
        parts = [f"{quantity(size, 'kg m')} at {360 * hole / count:.4g}°" for hole, size in choice.placed]
        print(f"  plane {plane}: {' and '.join(parts) or 'none'}")


def _save(given, rig, found, planes):
    """Write the corrections, and the vibration before and after, to a NetCDF file."""
    from rotorstudy.diagnosis.runs.balance import INTERVAL
    from rotorstudy.model.rig import named_plugins
    from rotorstudy.store import dataset, provenance, save

    spectrum = found.spectrum
    coordinates = {
        "plane": ([str(plane) for plane in planes], "1", "correction plane"),
        "speed": (spectrum.speed, "rad/s", "speed"),
        "node": (list(spectrum.sensors), "1", "node of the probes"),
        "percentile": (list(INTERVAL), "%", "of the predicted vibration"),
    }
    size, axis = "unbalance to be added, from the shaft's reference line", "semi-major axis of the 1X orbit"
    variables = {
        "correction": (("plane",), found.corrections @ [1, 1j], "kg m", size),
        "before": (("speed", "node"), found.before, "m", f"{axis}, measured"),
        "after": (("percentile", "speed", "node"), found.after, "m", f"{axis}, left by the corrections"),
        "next_reading": (("percentile", "speed", "node"), found.next_reading, "m", f"{axis} that the next run shows"),
    }
    data = dataset(variables, coordinates, title="corrections of the balance")
    origin = provenance(rig.given, named_plugins(rig.given)) | {"records": ", ".join(map(str, given.records))}
    save(data.assign_attrs(origin), given.out)
