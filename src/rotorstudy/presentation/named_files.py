"""Figures and tables are matched to files by name, never by position in a list."""

from pathlib import Path

from rotorstudy.errors import RotorstudyError


def files_by_name(kind, made, paths):
    """Group the files to be written by what each holds."""
    found = {name: [] for name in made}
    missing = []
    for path in map(Path, paths):
        found.get(path.stem, missing).append(path)
    if missing:
        names = ", ".join(dict.fromkeys(path.stem for path in missing))
        raise RotorstudyError(f"no {kind} was made for: {names} (made: {', '.join(found)})")
    extra = [name for name, files in found.items() if not files]
    if extra:
        raise RotorstudyError(f"no file is named for the {kind}: {', '.join(extra)}; add it to the rule's outputs")
    return found
