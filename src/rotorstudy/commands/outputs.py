"""Check the output paths of a command."""

from pathlib import Path

from rotorstudy.errors import RotorstudyError

NETCDF, JSON, YAML, HTML = (".nc", ".nc4"), (".json",), (".yaml", ".yml"), (".html", ".htm")
FORMAT_OF = {".nc": "NetCDF", ".yaml": "YAML", ".html": "HTML"}
OF_FILES = {*NETCDF, *JSON, *YAML, *HTML, ".csv", ".txt", ".png", ".svg", ".pdf"}


def check_file(out, *inputs, option="--out", suffixes=()):
    """Raise unless `out` is a file in an existing folder, with a suffix of its content, and none of the inputs."""
    path = Path(out)
    if path.is_dir():
        raise RotorstudyError(f"{option} {out}: is a folder; give a file in it")
    _check_parent(out, option)
    for given in inputs:
        if path.resolve() == Path(given).resolve():
            raise RotorstudyError(f"{option} {out}: would overwrite an input; choose another name")
    if suffixes and path.suffix.lower() not in suffixes:
        raise RotorstudyError(
            f"{option} {out}: the file is written as {FORMAT_OF[suffixes[0]]}; give it a name that ends in "
            f"{' or '.join(suffixes)}, such as {path.stem}{suffixes[0]}"
        )


def check_folder(out, *inputs, option="--out"):
    """Raise unless `out` is a folder, new or in use, whose parent exists and which contains no input."""
    path = Path(out)
    if path.is_file():
        raise RotorstudyError(f"{option} {out}: is a file; give a folder")
    if path.suffix.lower() in OF_FILES and not path.is_dir():
        raise RotorstudyError(f"{option} {out}: a folder is written, not one file; name it {path.with_suffix('')}")
    _check_parent(out, option)
    if path.resolve() in [Path(given).resolve().parent for given in inputs]:
        raise RotorstudyError(f"{option} {out}: contains an input; give a separate folder")


def _check_parent(out, option):
    if not Path(out).parent.is_dir():
        raise RotorstudyError(f"{option} {out}: the folder '{Path(out).parent}' does not exist; create it first")
