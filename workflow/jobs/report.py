"""What the report shows: pictures and pages with their captions, by the place of their files in the results."""

import re
from pathlib import Path

from snakemake.io import report

from jobs.index_page import HEADINGS
from rotorstudy.errors import RotorstudyError
from rotorstudy.presentation.captions import BLIND_FIGURES, DIAGNOSIS_FIGURES
from rotorstudy.store import write_text
from rotorstudy.yaml_file import read_yaml
from thesis.scoreboard import table_name


def captioned(group, figures):
    """{figure: its caption, and its kind and arguments if it has some}; RotorstudyError without a caption."""
    found = {name: one if isinstance(one, dict) else {"caption": one} for name, one in figures.items()}
    for name in (name for name, one in found.items() if not isinstance(one.get("caption"), str)):
        raise RotorstudyError(f"report/captions.yaml: figure '{name}' of {group} needs 'caption:', a text")
    return found


STATED = read_yaml(Path(__file__).parents[1] / "report" / "captions.yaml")
CAPTIONS = {
    **{f"diagnosis_{name}": text for name, (_, text) in DIAGNOSIS_FIGURES.items()},
    **{f"blind_{name}": text for name, (_, text) in BLIND_FIGURES.items()},
    **STATED.pop("pages"),
}
REPLAYED = STATED.pop("replays")
SHOWN, TABLES = {}, {}  # group -> its figures, each with its kind and arguments, and its tables, in the order stated
for _group, _parts in STATED.items():
    SHOWN[_group] = captioned(_group, _parts["figures"])
    CAPTIONS |= {f"{_group}_{name}": one.pop("caption") for name, one in SHOWN[_group].items()}
    if "tables" in _parts:
        TABLES[_group] = list(_parts["tables"])
        CAPTIONS |= {f"{_group}_{name}": text for name, text in _parts["tables"].items()}
FIGURES = {**SHOWN, "diagnosis": DIAGNOSIS_FIGURES, "blind": BLIND_FIGURES}  # group -> names of its figures


def add_printed(name, tables):
    """Printed tables of a chapter, before its others; their captions are {number: (title, note)}."""
    TABLES[name] = list(dict.fromkeys([*map(table_name, tables), *TABLES.get(name, ())]))
    CAPTIONS.update({f"{name}_{table_name(number)}": f"{title}. {note}" for number, (title, note) in tables.items()})


def add_replay(name, replay):
    """The figures and tables of a replay, with the captions of their kinds where none of their own is stated."""
    FIGURES[name], TABLES[name] = replay.figures, ["estimates", "physical_checks", "response"]
    kinds = {shown: (item.kind, item.case) for shown, item in replay.figures.items()}
    for shown, (kind, case) in (kinds | {table: (table, "") for table in TABLES[name]}).items():
        if kind in REPLAYED:
            CAPTIONS.setdefault(f"{name}_{shown}", REPLAYED[kind].format(case=case))
    add_printed(name, {number: (sheet.title, sheet.note) for number, sheet in replay.sheets.items()})


def reported(files, results):
    """Files of a job as Snakemake takes them: a path, or many; pictures and pages are marked for the report."""
    if not isinstance(files, str):
        return [reported(path, results) for path in files]
    inside = Path(files).relative_to(results)
    if inside.suffix not in (".png", ".html") or inside == Path("index.html"):
        return files
    folder, name = (inside.parts[0] if len(inside.parts) > 1 else ""), inside.stem
    caption = f"{folder}_{name}".strip("_")
    if caption not in CAPTIONS:  # else it is missed when the report is written, after everything has run
        raise RotorstudyError(f"no caption for {files}: state {caption} in workflow/report/captions.yaml")
    text = Path(".snakemake", "captions", f"{caption}.rst")  # Snakemake reads captions from files
    if not text.is_file() or text.read_text(encoding="utf-8") != CAPTIONS[caption]:
        write_text(text, CAPTIONS[caption])
    what = re.sub(r"^(figure|table) (\d+) (\d+)$", _numbered, name.replace("_", " "))
    kind = "Figures" if inside.suffix == ".png" else "Tables" if folder != "diagnosis" else "Pages"
    # items with the same label would hide each other: tables are beside figures, and a diagnosis is one of several
    what += " (table)" * (kind == "Tables" and not name.startswith("table"))
    if folder == "diagnosis" and len(inside.parts) > 2:
        what = f"{inside.parts[1].replace('_', ' ')}: {'verdict' if name == 'index' else what}"
    labels = {"what": what[:1].upper() + what[1:]}
    return report(files, str(text.resolve()), category=HEADINGS[folder][0], subcategory=kind, labels=labels)


def _numbered(found):
    """Figure 5.4, with a hair space before a single digit: the report sorts by letters, and 5.10 follows 5.4."""
    kind, chapter, number = found.groups()
    return f"{kind} {chapter}.{number if len(number) > 1 else chr(0x200A) + number}"
