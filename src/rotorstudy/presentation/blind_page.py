"""The pages of a blind test: acceptance criteria, and cases with a wrong answer."""

from pathlib import Path

from rotorstudy.blind.criteria import LARGE, statement, table, tally
from rotorstudy.presentation.blind_figures import blind_figures
from rotorstudy.presentation.captions import BLIND_FIGURES
from rotorstudy.presentation.pages import inline_png, render
from rotorstudy.presentation.plots import save_figure
from rotorstudy.presentation.tables import cells, write_csv, write_html
from rotorstudy.store import write_text

MARKS = {"reached": "good", "not reached": "bad", "undecided": "doubtful"}
NOTES = (
    "Change over noise: the change of the measured harmonics by the effect over their noise, both rms. Beyond the base "
    "counts only the part that base parameters and calibration cannot absorb.",
    "low and high are 95 % bounds: of Clopper and Pearson for shares, by order statistics for medians, by bootstrap "
    "over the cases for the calibration error. A criterion is reached, or not reached, if the whole range "
    "between the bounds is; otherwise it is undecided.",
    "An answer is right if it names the cause and its place, or if it is ambiguous and its set contains them.",
    "Foreign effects are physics that the library lacks, or one of its effects left out of it. A confounder is "
    "declared by a plugin, or for foreign physics by the blind test.",
    "Errors on held-out speeds count against the signal without noise, which only a blind test knows. Against the "
    "measurement they cannot fall below its noise.",
)
OPENING = {  # key of a criterion -> its count in words
    "clean_called_clean": "{count} clean records were called clean",
    "right_large": "the cause and its place were right in {count} cases whose effect changes the harmonics by three "
    "times their noise or more",
    "chain_not_rotor": "{count} errors of the measuring chain were not mistaken for effects on the rotor",
}


def write_pages(data, criteria, rows, folder):
    """Write figures (PNG, SVG), criteria and cases (CSV, HTML) to a folder.

    Parameters
    ----------
    data : xarray.Dataset
        As `blind.summary.summary` returns it, with the attributes cases and seed.
    criteria : list of Criterion
    rows : pandas.DataFrame
        As `blind.scoring.score` returns it.
    folder : str or Path
    """
    folder = Path(folder)
    for name, picture in blind_figures(data).items():
        save_figure(picture, *(folder / "figures" / f"{name}.{kind}" for kind in ("png", "svg")))
    cases = rows.drop(columns=["covered"])
    write_csv(table(criteria), folder / "criteria.csv")
    write_csv(cases.drop(columns=["seconds"]), folder / "cases.csv")
    source = (
        f"{data.attrs['cases']} cases of seed {data.attrs['seed']}: effects were hidden in simulated measurements, "
        "whose equations are not those of the diagnosis, and the truth was sealed before the diagnosis began."
    )
    figures = [
        (name.replace("_", " ").capitalize(), inline_png(folder / "figures" / f"{name}.png"), caption)
        for name, caption in BLIND_FIGURES.items()
    ]
    write_text(folder / "criteria.html", criteria_page(criteria, source, figures))
    _write_cases(cases, source, folder)


def opening(criteria):
    """Opening sentences: the number of criteria by status, and the main counts with their bounds."""
    known = {c.key: c for c in criteria if c.cases}
    said = [
        text.format(count=f"{c.found} of {c.cases} ({100 * c.low:.0f} to {100 * c.high:.0f} %)")
        for key, text in OPENING.items()
        if (c := known.get(key))
    ]
    counts = f"With 95 % bounds: {'; '.join(said)}." if said else "No case concerns the main criteria."
    return [statement(criteria), counts]


def criteria_page(criteria, source, figures):
    """The page of criteria and figures as HTML; figures : (label, source of the image, caption) of each."""
    shown = table([c for c in criteria if c.cases]).drop(columns=["key", "kind"])
    without = len(criteria) - len(shown)
    notes = [*NOTES, f"{without} criteria have no cases in this run and are not listed."] if without else NOTES
    found = tally(criteria)
    return render(
        "blind.html",
        title="Blind tests: acceptance criteria of the diagnosis",
        opening=[*opening(criteria), source],
        open={status: found[status] for status in ("not reached", "undecided")},
        table=cells(shown, 3),
        marks=MARKS,
        notes=notes,
        figures=figures,
    )


def _write_cases(cases, source, folder):
    """The page of the cases with a wrong answer, the largest effects first."""
    foreign = (cases.kind == "foreign") & (cases["size"] >= LARGE) & (cases.verdict != "unknown") & ~cases.confounder
    wrong = cases.known & ~cases.right | (cases.kind == "clean") & (cases.verdict != "nothing") | foreign
    shown = cases[wrong].sort_values("size", ascending=False)
    shown = shown[
        ["case", "kind", "rig", "noise_percent", "size", "truth", "verdict", "answer", "posterior_probability"]
    ]
    by_rig = cases.groupby("rig").seconds.agg(["count", "mean", "max"]).reset_index()
    note = f"{len(shown)} of {len(cases)} cases have a wrong answer, the largest effects first. Size is the change of "
    note += "the harmonics over their noise; an effect below 1 can hardly be detected."
    write_html(folder / "cases.html", "Blind tests: cases with a wrong answer", [note, source],
               {"Cases": shown, "Duration of a diagnosis (s)": by_rig}, 3)  # fmt: skip
