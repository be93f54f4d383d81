"""The pages of a blind test: acceptance criteria, and cases with a wrong answer."""

from pathlib import Path

from rotorstudy.blind.criteria import LARGE, judge, sentences, statement
from rotorstudy.presentation.blind_figures import blind_figures
from rotorstudy.presentation.captions import BLIND_FIGURES
from rotorstudy.presentation.pages import inline_png, render, to_index
from rotorstudy.presentation.plots import save_pictures
from rotorstudy.presentation.tables import cells, write_csv, write_html
from rotorstudy.store import write_text

MARKS = {"reached": "good", "not reached": "bad", "undecided": "doubtful"}
NOTES = (
    "Size: the change of the measured harmonics by the effect, of which only the part counts that base parameters and "
    "calibration cannot absorb, in standard deviations, rms. Of two effects the smaller counts.",
    "low and high are 95 % bounds: of Clopper and Pearson for shares, by order statistics for medians, by bootstrap "
    "over the cases for the calibration error. A criterion is reached, or not reached, if the whole range "
    "between the bounds is; otherwise it is undecided. To prove a share of 0.95 takes 72 cases without a failure, "
    "one of 0.99 takes 368. Criteria without cases are not listed.",
    "The stated set has the causes that are named and those that are not ruled out. A cause is right if effect and "
    "place are; an effect of another form than the library's has its physics in another formula.",
    "Outside the library are physics that it lacks, and effects that were left out of it.",
    "Errors on held-out speeds count against the signal without noise, which only a simulation knows. Against the "
    "measurement they cannot fall below its noise.",
)


def write_pages(data, criteria, rows, folder, others=None, index=None):
    """Write figures (PNG, SVG), criteria and cases (CSV, HTML) to a folder; others : name -> rows (CSV) of a run."""
    import pandas as pd

    folder = Path(folder)
    criteria = pd.concat([*(judge(pd.read_csv(path), name) for name, path in (others or {}).items()), criteria])
    png = save_pictures(blind_figures(rows, criteria), folder / "figures")
    write_csv(criteria, folder / "criteria.csv")
    write_csv(rows.drop(columns=["seconds"]), folder / "cases.csv")
    source = (
        f"{data.attrs['cases']} cases of seed {data.attrs['seed']}: effects were hidden in records of an "
        "independent simulator, and the truth was sealed before the diagnosis began."
    )
    titles = {name: name.replace("_", " ").capitalize() for name in BLIND_FIGURES}
    figures = [(titles[name], inline_png(png[name]), caption) for name, caption in BLIND_FIGURES.items()]
    links = to_index(folder / "criteria.html", index)
    wrong = links | {"Cases with a wrong answer": "cases.html"}
    write_text(folder / "criteria.html", criteria_page(criteria, source, figures, wrong))
    _write_cases(rows, source, folder, links | {"How often the diagnosis is right": "criteria.html"})


def criteria_page(criteria, source, figures, links=None):
    """The page as HTML; criteria : of one source or several."""
    return render(
        "blind.html",
        title="Blind tests: how often the diagnosis is right",
        opening=sentences(criteria),
        source=source,
        runs={
            name: {
                "statement": statement(judged),
                "missed": judged[judged.status == "not reached"].to_dict("records"),
                "table": cells(judged[judged.cases > 0].drop(columns=["key", "kind", "source"]), 3, "reasons"),
            }
            for name, judged in criteria.groupby("source", sort=False)
        },
        marks=MARKS,
        notes=NOTES,
        figures=figures,
        links=links or {},
    )


def _write_cases(cases, source, folder, links):
    """The page of the cases with a wrong answer, the largest effects first."""
    outside = (cases.group == "outside") & (cases["size"] >= LARGE) & (cases.verdict != "unknown")
    known = ~cases.group.isin(["outside", "clean"]) & ~cases.in_set.astype(bool)
    wrong = known | (cases.group == "clean") & (cases.verdict != "nothing") | outside
    shown = cases[wrong].sort_values("size", ascending=False)
    shown = shown[["case", "kind", "machine", "size", "families", "verdict", "answer", "probability"]]
    shown = shown.assign(**{key: shown[key].str.replace("_", " ") for key in ("families", "answer")})
    by_rig = cases.groupby("machine").seconds.agg(["count", "mean", "max"]).reset_index()
    note = f"{len(shown)} of {len(cases)} cases have a wrong answer, the largest effects first. Size is in "
    note += "standard deviations; an effect below 1 can hardly be detected."
    tables = {"Cases": shown, "Duration of a diagnosis (s)": by_rig}
    title = "Blind tests: cases with a wrong answer"
    write_html(folder / "cases.html", title, [note, source], tables, 3, links=links)
