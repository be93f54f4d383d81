"""Drawing, loads, critical speeds, unbalance response and stability of a rig."""

from rotorstudy.commands.shared import add_rpm, check_folder, in_rad_s
from rotorstudy.errors import RotorstudyError

LOWEST, HIGHEST = 1e-3, 1e6  # of a speed that is given, in its unit


def add(parser):
    two = {"type": float, "nargs": 2, "metavar": ("LOWEST", "HIGHEST")}
    parser.add_argument("rig", help="rig file (YAML) with a value for every parameter")
    parser.add_argument("--records", nargs="+", default=(), help="records of the machine, shown beside the response")
    told = "range of speeds in rad/s (default: up to 3.5 times the lowest natural frequency)"
    parser.add_argument("--speeds", **two, help=told)
    parser.add_argument("--operating", **two, help="operating speeds in rad/s, for separation margins")
    add_rpm(parser)
    parser.add_argument("--out", required=True, metavar="DIR", help="output folder for page, data and figures")


def run(given):
    """Write page, data and figures into a folder."""
    from rotorstudy.presentation.rotor_files import analyse_files
    from rotorstudy.presentation.rotor_page import analysis_data, summary

    check_folder(given.out, given.rig, *given.records)
    speeds = _range(given.speeds, given.rpm, "--speeds") or (None, None)
    operating = _range(given.operating, given.rpm, "--operating")
    analysis = analyse_files(given.rig, given.out, speeds, operating, given.records)
    said = summary(analysis)
    print("\n".join([*said, f"wrote {given.out}/index.html"]))
    return {"summary": said, **analysis_data(analysis)}


def _range(given, rpm, option):
    """A range of speeds in rad/s, or None if it is not given."""
    if given is not None and not LOWEST < given[0] < given[1] < HIGHEST:
        told = f"give two speeds from {LOWEST:g} to {HIGHEST:g}, the lower one first"
        raise RotorstudyError(f"{option} {given[0]:g} {given[1]:g}: {told}")
    return in_rad_s(given, rpm)
