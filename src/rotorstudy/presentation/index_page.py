"""results/index.html: the entry to every page, figure and table of the workflow."""

import json
import re
from pathlib import Path

from rotorstudy.presentation.pages import render
from rotorstudy.store import write_text

HEADINGS = {
    "": ("All chapters", "Each printed value beside ours, the errors of the thesis, and the plugin library."),
    "diagnosis": ("Diagnoses", "What the thesis's models get wrong on its own measurements, and what explains it."),
    "blind": ("Blind tests", "Effects hidden in simulated measurements and diagnosed blind."),
    "compare": (
        "Comparison",
        "Every spectrum method with every estimator on five rotors; which to use for which data.",
    ),
    "chapter_2": ("Chapter 2", "Cracked rotor with two degrees of freedom."),
    "chapter_3": ("Chapter 3", "The first experiment, replayed."),
    "chapter_4": ("Chapter 4", "Rotor with an offset disc and gyroscopic moments."),
    "chapter_5": ("Chapter 5", "The second experiment, replayed."),
    "chapter_6": ("Chapter 6", "Finite-element rotor on anisotropic bearings."),
    "chapter_7": ("Transverse cracks", "How small a crack can be found, and how accurately, by place and sensors."),
    "rigs": ("Both rigs", "Parameters identified on the two test rigs, side by side."),
    "cracks": ("Crack models", "Every crack plugin on one rotor."),
    "bearings": ("Bearing models", "Stiffness and damping of every bearing plugin over speed."),
}  # in the order of the page; other folders follow


def write_index(path, files):
    """Write the page.

    Parameters
    ----------
    path : path
        Of the page; links are relative to its folder.
    files : list of path
        Results in that folder; pages (.html) and figures (.png) are shown, the verdicts and the scoreboard quoted.
    """
    root = Path(path).parent
    inside = sorted((Path(file).relative_to(root) for file in files), key=_in_numbered_order)
    folders = list(dict.fromkeys([*HEADINGS, *(_folder(file) for file in inside)]))
    groups = [_group(root, folder, [file for file in inside if _folder(file) == folder]) for folder in folders]
    write_text(path, render("index.html", title="rotorstudy: results", groups=[one for one in groups if one["count"]]))


def _in_numbered_order(file):
    """Key by which table 4.10 follows table 4.9."""
    return [(int(part), "") if part.isdigit() else (0, part) for part in re.split(r"(\d+)", file.as_posix())]


def _folder(file):
    return file.parts[0] if len(file.parts) > 1 else ""


def _group(root, folder, files):
    """What the template needs of the files of a folder."""
    heading, about = HEADINGS.get(folder, (folder.replace("_", " ").capitalize(), ""))
    pages = [file for file in files if file.suffix == ".html"]
    pictures = [file for file in files if file.suffix == ".png"]
    return {
        "heading": heading,
        "about": about,
        "count": len(pages) + len(pictures),
        "said": _said(root, files),
        "pages": [{"link": file.as_posix(), "name": _name(file)} for file in pages],
        "pictures": [{"link": file.as_posix(), "name": _name(file)} for file in pictures],
    }


def _name(file):
    """A file as a reader calls it: chapter_2/tables/table_2_1.html is 'table 2 1', an index its folder."""
    stem = file.parent.name if file.stem == "index" else file.stem
    shown = stem.replace("_", " ")
    return f"{file.parts[1].replace('_', ' ')}: {shown}" if len(file.parts) > 3 else shown


def _said(root, files):
    """Headline results: the sentences of verdicts, and how many printed values are reproduced."""
    found = []
    for file in files:
        if file.name == "verdict.json":
            summary = json.loads((root / file).read_text(encoding="utf-8"))["summary"]
            found.append(f"{file.parent.name.replace('_', ' ')}: {summary}")
        if file.name == "scoreboard.csv":
            import pandas as pd

            counts = pd.read_csv(root / file, dtype=str).status.value_counts()
            told = ", ".join(f"{count} {status}" for status, count in counts.items())
            found.append(f"Of {counts.sum()} printed values: {told}.")
    return found
