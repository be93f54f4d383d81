"""Pictures and tables of a blind test, and the page that says which promise is kept."""

import base64
from html import escape
from pathlib import Path

import numpy as np

from rotorstudy.blind.criteria import LARGE
from rotorstudy.presentation.blind_figures import FIGURES, draw
from rotorstudy.presentation.plots import save_figure
from rotorstudy.presentation.tables import CSS, html_table, write_csv, write_html
from rotorstudy.store import write_text

TITLE = "Blind tests: what was promised and what is reached"
STATUS = {"reached": "#009E73", "not reached": "#A00000", "undecided": "#8A5A00"}
CAPTIONS = {
    "curves": "Completeness: share of hidden effects that are found, cause and place. Reliability: share of named "
    "causes that are true. Bars are 95 % bounds; dotted: 95 %, and three times the noise.",
    "confusion": "A row a hidden effect, a column an answer; cases with one effect or none, of every size. Solid boxes "
    "are right, dashed ones are confounders the effect declares. What is far below the noise may rightly be 'nothing'.",
    "calibration": "Of all causes named first, how many are true. On the dotted line the confidence is honest, above "
    "it is too modest. The numbers count cases.",
    "coverage": "Shares with 95 % bounds; dotted: 95 %. Stated set: the causes that a verdict names, alone or as not "
    "ruled out.",
    "detection_limits": "Size at which half the effects of a kind are found. A line without a point is a bound only: "
    "all were found, or none. Dotted: three times the noise.",
    "gain": "Error of the extended model over that of the base model on speeds no fit saw, effects of three times the "
    "noise and more. Dotted: a tenth; right of the solid line the extension makes it worse.",
}
PAGE_CSS = """
body { max-width: 75em; }
figure { margin: 0.5em 0 1.5em; } figcaption { max-width: 60em; color: #444; font-size: 0.9em; }
img { max-width: 100%; width: 44em; }
"""

NOTE = (
    "Effects were hidden in simulated measurements by another road than the diagnosis takes, and sealed.",
    "s is the change of the measured harmonics by the effect over their noise, rms.",
    "low and high are 95 % bounds: of Clopper and Pearson for shares, by order for medians, by drawing the cases again "
    "for the calibration error. 'reached' and 'not reached' mean that both lie on that side; 'undecided' that so many "
    "cases do not decide, or that the number is missed but not surely.",
    "Right means: the cause and its place are named, or the verdict is ambiguous and the stated set holds them.",
    "Foreign effects are physics that the library lacks, or one of its effects left out of it; s >= 3 stands for their "
    "detection limit. A confounder is declared by a plugin, or for foreign physics by this package.",
    "Held-out errors are counted against the signal without noise, which only a blind test knows; against the "
    "measurement its noise cannot be undercut.",
)


def write_pages(data, criteria, rows, folder):
    """Write figures (PNG, SVG), criteria and cases (CSV, HTML) to a folder."""
    folder = Path(folder)
    for name in FIGURES:
        save_figure(draw(name, data), *(folder / "figures" / f"{name}.{kind}" for kind in ("png", "svg")))
    cases = rows.drop(columns=["covered"])
    write_csv(criteria, folder / "criteria.csv")
    write_csv(cases.drop(columns=["seconds"]), folder / "cases.csv")
    first = f"{data.attrs['cases']} cases of seed {data.attrs['seed']}. {NOTE[0]}"
    write_bars(criteria, [first, in_short(criteria), *NOTE[1:]], folder)
    foreign = (cases.kind == "foreign") & (cases["size"] >= LARGE) & (cases.verdict != "unknown") & ~cases.confounder
    wrong = cases.known & ~cases.right | (cases.kind == "clean") & (cases.verdict != "nothing") | foreign
    shown = cases[wrong].sort_values("size", ascending=False)
    shown = shown[
        ["case", "kind", "rig", "noise_percent", "size", "truth", "verdict", "answer", "posterior_probability"]
    ]
    by_rig = cases.groupby("rig").seconds.agg(["count", "mean", "max"]).reset_index()
    note = (
        f"{first} The largest first; size is the change over the noise, and an effect below one is hardly to be seen."
    )
    write_html(folder / "cases.html", "Blind tests: cases that went wrong", note,
               {f"Wrong: {len(shown)} of {len(cases)}": shown, "Seconds of a diagnosis": by_rig}, 3)  # fmt: skip


def in_short(criteria):
    """How many criteria are reached, not reached and undecided, and which are not reached."""
    count = {status: int((criteria.status == status).sum()) for status in STATUS}
    needed = criteria[criteria.needed != ""]
    said = f"{count['reached']} of {len(needed)} criteria are surely reached, {count['not reached']} surely not, "
    said += f"{count['undecided']} undecided by so many cases"
    below = needed[(needed.status == "undecided") & ~needed.why.str.startswith("the number is there")].what
    missed = [*needed[needed.status == "not reached"].what]
    if missed:
        said += f". Not reached: {'; '.join(missed)}"
    if len(below):
        said += f". Undecided, with a number on the wrong side or not yet sure: {'; '.join(below)}"
    return f"{said}."


def write_bars(criteria, notes, folder):
    """The page of criteria and pictures, which needs no other file."""
    first, *points = notes
    counted = np.abs(criteria.found / criteria.cases.clip(lower=1) - criteria.reached) < 1e-9  # a median has no count
    shown = criteria.assign(found=criteria.found.astype(float).where(counted))
    table = html_table(shown[["what", "needed", "reached", "low", "high", "found", "cases", "status", "why"]], 3)
    for status, colour in STATUS.items():
        table = table.replace(f">{status}</td>", f' style="color: {colour}; font-weight: bold">{status}</td>')
    pictures = []
    for name in FIGURES:
        encoded = base64.b64encode((folder / "figures" / f"{name}.png").read_bytes()).decode()
        label = name.replace("_", " ").capitalize()
        pictures.append(
            f'<h2>{label}</h2><figure><img alt="{label}" src="data:image/png;base64,{encoded}">'
            f"<figcaption>{escape(CAPTIONS[name])}</figcaption></figure>"
        )
    listed = "".join(f"<li>{escape(point)}</li>" for point in points)
    page = [
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{TITLE}</title><style>{CSS}{PAGE_CSS}</style>',
        f"<h1>{TITLE}</h1><p>{escape(first)}</p><ul>{listed}</ul>",
        table,
        *pictures,
    ]
    write_text(folder / "criteria.html", "\n".join(page) + "</html>\n")
