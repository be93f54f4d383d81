"""What several commands share: options, speeds in rad/s or rpm, checks of output paths, findings."""

import os
import sys
from os.path import dirname, realpath
from pathlib import Path

from rotorstudy.errors import RotorstudyError
from rotorstudy.units import RAD_PER_S, ends_of_interval

NETCDF, JSON, YAML, HTML = (".nc", ".nc4"), (".json",), (".yaml", ".yml"), (".html", ".htm")
FORMAT_OF = {".nc": "NetCDF", ".yaml": "YAML", ".html": "HTML"}
INTERRUPTED = 130  # status after Ctrl-C: 128 and the number of the signal
OF_FILES = {*NETCDF, *JSON, *YAML, *HTML, ".csv", ".txt", ".png", ".svg", ".pdf"}


def add_rpm(parser):
    """Add `--rpm`."""
    parser.add_argument("--rpm", action="store_true", help="the speeds given are in rpm instead of rad/s")


def add_rig_and_folder(parser):
    """Add `--rig` and `--out` of a diagnosis."""
    told = "rig file with a value for every parameter; settings in its section 'diagnosis:'"
    parser.add_argument("--rig", required=True, help=told)
    parser.add_argument("--out", required=True, metavar="DIR", help="output folder for verdict, figures and page")


def in_rad_s(speeds, rpm):
    """Speeds (speed,) as given, None if none were, in rad/s."""
    return [speed * RAD_PER_S["rpm"] for speed in speeds] if speeds is not None and rpm else speeds


def check_file(out, *inputs, option="--out", suffixes=()):
    """Raise unless `out` is a file in an existing folder, with a suffix of its content, and none of the inputs."""
    path = Path(out)
    if path.is_dir():
        raise RotorstudyError(f"{option} {out}: is a folder; give a file in it")
    _check_place(out, path.parent, option)
    if any(realpath(path) == realpath(given) for given in inputs):  # of a loop of links, too
        raise RotorstudyError(f"{option} {out}: would overwrite an input; choose another name")
    if suffixes and path.suffix.lower() not in suffixes:
        raise RotorstudyError(
            f"{option} {out}: the file is written as {FORMAT_OF[suffixes[0]]}; give it a name that ends in "
            f"{' or '.join(suffixes)}, such as {path.stem}{suffixes[0]}"
        )


def check_folder(out, *inputs):
    """Raise unless `out` is a folder, new or in use, whose parent exists and which contains no input."""
    path = Path(out)
    if path.is_file():
        raise RotorstudyError(f"--out {out}: is a file; give a folder")
    if path.suffix.lower() in OF_FILES and not path.is_dir():
        raise RotorstudyError(f"--out {out}: a folder is written, not one file; name it {path.with_suffix('')}")
    _check_place(out, path if path.is_dir() else path.parent, "--out")
    if realpath(path) in [dirname(realpath(given)) for given in inputs]:
        raise RotorstudyError(f"--out {out}: contains an input; give a separate folder")


def _check_place(out, folder, option):
    """Raise unless files can be written into a folder; now, and not after minutes of work."""
    if not folder.is_dir():
        raise RotorstudyError(f"{option} {out}: the folder '{folder}' does not exist; create it first")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise RotorstudyError(f"{option} {out}: no permission to write into the folder '{folder}'; choose another one")


def tell(findings):
    """Say what was found in the records, apart from results."""
    for finding in findings:
        print(finding, file=sys.stderr)


def estimate_rows(estimates, least=None):
    """Each of some (name, value, standard deviation, unit, if known ends of 95 %) as for JSON, in SI.

    least : name -> least possible value;  returns : the rows, and a warning of those that are below by more than chance
    """
    rows, below = [], []
    for name, value, std, unit, *known in estimates:
        lowest = (least or {}).get(name, -float("inf"))
        (ends,) = known or [ends_of_interval(value, std, lowest)]
        row = {"name": name, "value": float(value), "standard_deviation": float(std), "unit": unit}
        rows.append(row | {"interval_95": list(map(float, ends))})
        below += [name] * bool(ends[1] < lowest)
    told = "cannot be so low; the rig lacks something that acts alike, or states something of it wrongly"
    return rows, [f"{', '.join(below)} {told}"] if below else []


def conclude(verdict, out):
    """Say the verdict that was written into a folder; returns the exit status and the verdict as data for JSON."""
    tell(verdict.findings)
    print(verdict.summary)
    print(f"wrote {Path(out) / 'index.html'}")
    stopped = any(finding.name in ("search stopped", "limits stopped") for finding in verdict.findings)
    return INTERRUPTED if stopped else 0, verdict.model_dump(mode="json")


def file_of_project(packaged, own):
    """A path inside the installed package, or in a clone, where it lies elsewhere, that path from its root."""
    path = Path(__file__).parents[1] / packaged
    return path if path.exists() else Path(__file__).parents[3] / own
