"""results/index.html: the entry to every page, figure and table of the workflow."""

import json
import re
from pathlib import Path

import pandas as pd

from rotorstudy.presentation.pages import render
from rotorstudy.store import load, write_text
from rotorstudy.yaml_file import read_yaml

HEADED = Path(__file__).parents[1] / "report" / "headings.yaml"
HEADINGS = read_yaml(HEADED)  # other folders follow


def write_index(path, files, report):
    """Write the page: first what was found, each with its picture, then every page and figure."""
    root, folders = Path(path).parent, {heading: [] for heading in HEADINGS}
    inside = sorted((Path(file).relative_to(root) for file in files), key=_in_numbered_order)
    for file in inside:
        folders.setdefault(file.parts[0] if len(file.parts) > 1 else "", []).append(file)
    groups, found = [_group(folder, here) for folder, here in folders.items()], _answers(root, inside)
    page = render("index.html", title="What was found", answers=found, groups=[one for one in groups if one["count"]])
    write_text(path, page)
    lines = ["What was found:", ""]
    for one in found:
        lines += [f"**{one['heading']}.** {' '.join(one['said'])}".translate(PLAIN), ""]
    lines.append("The chapters have the figures and tables; every item has a caption (press the i beside it).\n")
    write_text(report, "\n".join(lines))


CALLED = {"zoo": "plugin library (zoo)"}
# of a report, which is reStructuredText and a Jinja template: no character is markup
PLAIN = {ord(mark): f"\\{mark}" for mark in "\\`_|"} | {ord("{"): "(", ord("}"): ")"}


def _answers(root, files):
    """What was found as a list of {heading, said, picture, link}, in the order of QUOTED."""
    found = []
    for heading, pattern, quote, picture, link in QUOTED:
        for file in filter(lambda one: one.match(pattern), files):
            beside = {"picture": file.parent / picture, "link": file.parent / link}
            there = {key: one.as_posix() if one in files else None for key, one in beside.items()}
            told = heading.format(name=file.parent.name.replace("_", " "))
            found.append({"heading": told, "said": quote(root / file), **there})
    return found


def _in_numbered_order(file):
    """Key by which table 4.10 follows table 4.9."""
    return [(int(part), "") if part.isdecimal() else (0, part) for part in re.split(r"(\d+)", file.as_posix())]


def _group(folder, files):
    """What the template needs of the files of a folder."""
    heading, about = HEADINGS.get(folder, (folder.replace("_", " ").capitalize(), ""))
    kinds = {"pages": ".html", "pictures": ".png"}
    found = {
        kind: [{"link": file.as_posix(), "name": _name(file)} for file in files if file.suffix == suffix]
        for kind, suffix in kinds.items()
    }
    return {"heading": heading, "about": about, "count": sum(map(len, found.values())), **found}


def _name(file):
    """A file as a reader calls it: chapter_2/tables/table_2_1.html is 'table 2.1', an index its folder."""
    stem = file.parent.name if file.stem == "index" else file.stem
    shown = re.sub(r"^(figure|table) (\d+) (\d+)$", r"\1 \2.\3", CALLED.get(stem, stem.replace("_", " ")))
    return f"{file.parts[1].replace('_', ' ')}: {shown}" if len(file.parts) > 3 else shown


def _of_scoreboard(path):
    counts = pd.read_csv(path, dtype=str).status.value_counts()
    return [f"Of {counts.sum()} printed values: {', '.join(f'{count} {status}' for status, count in counts.items())}."]


def _of_limits(path):
    """The smallest crack of each rotor of the study at its usual noise, in the best and in the worst place."""
    data, said = load(path), []
    for name in filter(lambda one: one.startswith("smallest_depth_"), data.data_vars):
        rotor = name.removeprefix("smallest_depth_")
        best = data[name].sel(noise=USUAL_NOISE, baseline="healthy record").min(f"planes_{rotor}")
        low, high = 100 * float(best.min()), 100 * float(best.max())
        said.append(
            f"{rotor.replace('_', ' ').capitalize()}: {low:.1f} % of the diameter in the best place, {high:.0f} % "
            f"in the worst, at {USUAL_NOISE:g} % noise with a record of the sound machine."
        )
    return said


def _of_criteria(path):
    from rotorstudy.blind.criteria import sentences  # which takes long, as that of advice does

    return sentences(pd.read_csv(path))


def _of_advice(path):
    from rotorstudy.studies.comparison.ranking import FIRST, in_sentences

    return [
        f"Use {row['spectrum method']} with {row['estimator']} if {row['use this if']}: the error is "
        f"{row['error, times the least possible']} times the least possible."
        for row in in_sentences(pd.read_csv(path).drop_duplicates(FIRST)).to_dict("records")
    ]


USUAL_NOISE = 1.0  # percent
QUOTED = (  # heading, file, its sentences, and beside it a picture and a page; in the order of the page
    ("Diagnosis of measured records: {name}", "diagnosis/*/verdict.json",
     lambda path: [json.loads(path.read_bytes())["summary"]], "figures/before_and_after.png", "index.html"),
    ("How often the diagnosis is right", "blind/criteria.csv", _of_criteria, "figures/answers.png", "criteria.html"),
    ("The smallest crack that is found", "chapter_7/limits.nc", _of_limits, "figures/smallest_crack.png",
     "figures/smallest_crack.png"),
    ("Which method for which data", "compare/advice.csv", _of_advice, "figures/spectra.png", "advice.html"),
    ("The thesis, recomputed", "scoreboard.csv", _of_scoreboard, "chapter_5/figures/physical_checks.png",
     "scoreboard.html"),
)  # fmt: skip
