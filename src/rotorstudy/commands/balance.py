"""`rotorstudy balance`: correction masses, and the vibration that they leave."""

import sys


def add(commands):
    """Add the command and its arguments to the subparsers."""
    parser = commands.add_parser("balance", help="correction masses by the model of a rig and its records")
    parser.add_argument("records", nargs="+", help="record files, tables of harmonics, or one imported spectrum")
    parser.add_argument("--rig", required=True, help="rig file, best one that `identify --runs` has updated")
    parser.add_argument(
        "--planes", required=True, nargs="+", metavar="NODE", help="nodes (or their labels) for correction masses"
    )
    parser.set_defaults(func=run)


def run(given):
    """Print the corrections with their 95 % intervals, and the 1X vibration before and after."""
    import numpy as np

    from rotorstudy.diagnosis.balance import balance_files
    from rotorstudy.inference.estimate import magnitude_and_phase
    from rotorstudy.units import quantity, um

    planes = [int(plane) if plane.isdigit() else plane for plane in given.planes]
    found, conventions, findings = balance_files(given.records, given.rig, planes)
    for finding in findings:
        print(finding, file=sys.stderr)
    names = [f"plane {plane}_{part}" for plane in planes for part in ("real", "imag")]
    _, sizes, covariance = magnitude_and_phase(names, found.corrections.ravel(), found.covariance)
    std = np.sqrt(np.diag(covariance))
    print("masses to be added (± one standard deviation; angles as in the rig file, from the shaft's reference line)")
    for i, plane in enumerate(planes):
        angle = conventions.sense * sizes[2 * i + 1] % (2 * np.pi)
        size = quantity(sizes[2 * i], "kg m", std[2 * i])
        print(f"  plane {plane}: {size} at {quantity(angle, 'rad', std[2 * i + 1])}")
    print("1X vibration, semi-major axis of the orbit: before, and predicted (95 %)")
    for i, speed in enumerate(found.spectrum.speed):
        for j, node in enumerate(found.spectrum.sensors):
            low, middle, high = (um(size[i, j]) for size in found.after)
            print(f"  {speed:8.4g} rad/s, node {node}: {um(found.before[i, j])}, {middle} ({low} to {high})")
    return 0
