"""Where a command may write."""

from pathlib import Path

from rotorstudy.errors import RotorstudyError


def check_file(out, *inputs, option="--out"):
    """Raise unless a result goes to a new or old file in a folder that exists, and not over an input."""
    path = Path(out)
    if path.is_dir():
        raise RotorstudyError(f"{option} {out}: is a folder; name a file in it")
    _check_parent(out, option)
    for given in inputs:
        if path.resolve() == Path(given).resolve():
            raise RotorstudyError(f"{option} {out}: would overwrite an input; choose another name")


def check_folder(out, *inputs, option="--out"):
    """Raise unless results go to a new or old folder beside others that holds no input."""
    path = Path(out)
    if path.is_file():
        raise RotorstudyError(f"{option} {out}: is a file; name a folder")
    _check_parent(out, option)
    if path.resolve() in [Path(given).resolve().parent for given in inputs]:
        raise RotorstudyError(f"{option} {out}: holds an input; name a folder of its own")


def _check_parent(out, option):
    if not Path(out).parent.is_dir():
        raise RotorstudyError(f"{option} {out}: the folder '{Path(out).parent}' does not exist; make it first")
