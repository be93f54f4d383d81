"""Pictures and tables of a blind test, and the page that says which promise is kept."""

from pathlib import Path

from rotorstudy.blind.figures import FIGURES, draw
from rotorstudy.plots import save_figure
from rotorstudy.tables import write_csv, write_html

NOTE = (
    "Effects were hidden in simulated measurements by another road than the diagnosis takes, and sealed.",
    "s is the change of the measured harmonics by the effect over their noise, rms.",
    "low and high are 95 % bounds: of Clopper and Pearson for shares, by order for medians, by drawing the cases again "
    "for the calibration error. 'reached' and 'not reached' mean that both lie on that side; 'undecided' that so many "
    "cases do not decide, or that the number is missed but not surely.",
    "Right means: the cause and its place are named, or the verdict is ambiguous and the stated set holds them.",
    "Foreign effects are physics that the library lacks, or one of its effects left out of it; s >= 3 stands for their "
    "detection limit. A twin is one that a plugin declares, or for foreign physics one that this package declares.",
    "Held-out errors are counted against the signal without noise, which only a blind test knows; against the "
    "measurement its noise cannot be undercut.",
)


def write_pages(data, bars, rows, folder):
    """Write figures (PNG, SVG), bars and cases (CSV, HTML) to a folder."""
    folder = Path(folder)
    for name in FIGURES:
        save_figure(draw(name, data), *(folder / "figures" / f"{name}.{kind}" for kind in ("png", "svg")))
    first = f"{data.attrs['cases']} cases of seed {data.attrs['seed']}. {NOTE[0]}"
    cases = rows.drop(columns=["covered"])
    write_csv(bars, folder / "bars.csv")
    write_csv(cases.drop(columns=["seconds"]), folder / "cases.csv")
    write_html(folder / "bars.html", "Blind tests: what was promised and what is reached", [first, *NOTE[1:]],
               {"": bars}, 3)  # fmt: skip
    failed = cases[cases.known & ~cases.right | (cases.kind == "clean") & (cases.verdict != "nothing")]
    shown = failed[["case", "kind", "rig", "noise_percent", "size", "truth", "verdict", "answer", "confidence"]]
    by_rig = cases.groupby("rig").seconds.agg(["count", "mean", "max"]).reset_index()
    write_html(folder / "cases.html", "Blind tests: cases that went wrong", first,
               {"Wrong": shown, "Seconds of a diagnosis": by_rig}, 3)  # fmt: skip
