"""results/index.html: the entry to every page, figure and table of the workflow."""

import json
import re
from pathlib import Path

from rotorstudy.blind.glance import sentences
from rotorstudy.presentation.pages import render
from rotorstudy.store import write_text
from rotorstudy.studies.comparison.ranking import in_short

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


def write_index(path, files, report=None):
    """Write the page.

    Parameters
    ----------
    path : path
        Of the page; links are relative to its folder.
    files : list of path
        Results in that folder; pages (.html) and figures (.png) are shown, headline results quoted.
    report : path, optional
        A text (reStructuredText) with the headline results, for the first page of Snakemake's report.
    """
    root = Path(path).parent
    inside = sorted((Path(file).relative_to(root) for file in files), key=_in_numbered_order)
    folders = list(dict.fromkeys([*HEADINGS, *(_folder(file) for file in inside)]))
    groups = [_group(root, folder, [file for file in inside if _folder(file) == folder]) for folder in folders]
    groups = [one for one in groups if one["count"]]
    write_text(path, render("index.html", title="rotorstudy: results", groups=groups))
    if report:
        write_text(report, _report(groups))


CALLED = {"zoo": "plugin library (zoo)", "published": "numbers that others printed"}
PLAIN = {ord(mark): f"\\{mark}" for mark in "\\`_|"} | {ord("{"): "(", ord("}"): ")"}


def _report(groups):
    """What was found, as reStructuredText that is a Jinja template too: no character of it is markup."""
    lines = ["A thesis on separating internal and external damping of cracked rotors, recomputed. What was found:", ""]
    for group in groups:
        for text in group["said"]:
            lines += [f"* {group['heading']}: {text}".translate(PLAIN), ""]
    lines.append("The chapters have the figures and tables; every item has a caption (press the i beside it).")
    return "\n".join(lines) + "\n"


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
    """A file as a reader calls it: chapter_2/tables/table_2_1.html is 'table 2.1', an index its folder."""
    stem = file.parent.name if file.stem == "index" else file.stem
    shown = re.sub(r"^(figure|table) (\d+) (\d+)$", r"\1 \2.\3", CALLED.get(stem, stem.replace("_", " ")))
    return f"{file.parts[1].replace('_', ' ')}: {shown}" if len(file.parts) > 3 else shown


def _said(root, files):
    """Headline results: the sentences of verdicts, and what the tables of QUOTED say."""
    found = []
    for file in files:
        if file.name == "verdict.json":
            summary = json.loads((root / file).read_text(encoding="utf-8"))["summary"]
            found.append(f"{file.parent.name.replace('_', ' ')}: {summary}")
        if quote := QUOTED.get(file.as_posix()):
            found += quote(root / file)
    return found


def _of_scoreboard(path):
    import pandas as pd

    counts = pd.read_csv(path, dtype=str).status.value_counts()
    return [f"Of {counts.sum()} printed values: {', '.join(f'{count} {status}' for status, count in counts.items())}."]


def _of_answers(path):
    import pandas as pd

    return sentences(pd.read_csv(path))


def _of_advice(path):
    import pandas as pd

    return [
        f"Use {row['spectrum method']} with {row['estimator']} if {row['use this if']}: the error is "
        f"{row['error, times the least possible']} times the least possible."
        for row in in_short(pd.read_csv(path)).to_dict("records")
    ]


def _of_published(path):
    import pandas as pd

    rows = pd.read_csv(path)
    return [
        f"Of {len(rows)} numbers that others printed of {rows.model.nunique()} machines, {rows.agrees.sum()} agree "
        f"with ours, {(rows.agrees & rows.reason.isna()).sum()} of them to the last digit printed."
    ]


QUOTED = {
    "scoreboard.csv": _of_scoreboard,
    "published.csv": _of_published,
    "blind/answers.csv": _of_answers,
    "compare/advice.csv": _of_advice,
}
