"""Put the numbers of a run of benchmarks/foreign.py into README and docs: python benchmarks/foreign_page.py FOLDER

The rows of the cases go to `docs/independent_records.csv`. What follows from them stands between marks in
`docs/independent_records.md` and in the README; a test compares both with the file.
"""

import argparse
import re
import textwrap
from pathlib import Path

import pandas as pd
from foreign_scores import by_kind, summary

ROOT = Path(__file__).parents[1]
ROWS = ROOT / "docs/independent_records.csv"
PAGE, README = ROOT / "docs/independent_records.md", ROOT / "README.md"
COLUMNS = [
    "case", "seed", "kind", "families", "mass_kg", "elements", "probed_nodes", "known", "size", "beside", "verdict",
    "named", "stated", "alone", "in_set", "wrong", "probability", "first_right", "gain", "gain_sigma",
    "rise_probability", "sizes", "covered", "angle_right", "seconds",
]  # fmt: skip


def numbers(rows):
    """Markdown tables: what was reached and asked, and the counts of each kind."""
    lines = ["| | reached | 95 % bounds | cases | asked |", "|---|---|---|---|---|"]
    for row in summary(rows).fillna({"low": -1}).itertuples():
        if not row.cases:
            continue
        is_share = row.low >= 0
        value = f"{100 * row.value:.0f} %" if is_share else f"{row.value:.2g}"
        bounds = f"{100 * row.low:.0f} to {100 * row.high:.0f} %" if is_share else ""
        lines.append(f"| {row.what} | {value} | {bounds} | {row.cases} | {row.asked} |")
    table = by_kind(rows)
    lines += ["", f"| kind | {' | '.join(table.columns)} |", "|---" * (len(table.columns) + 1) + "|"]
    for kind, row in table.iterrows():
        cells = ["-" if pd.isna(one) else f"{one:.3g}" for one in row]
        lines.append(f"| {kind.replace('_', ' ')} | {' | '.join(cells)} |")
    return "\n".join(lines)


def sentence(rows):
    """The same in a few sentences, for the README."""
    found = summary(rows).set_index("what")

    def count(what):
        row = found.loc[what]
        return f"{round(row.value * row.cases)} of {row.cases}"

    def bounded(what):
        row = found.loc[what]
        return f"{count(what)} ({100 * row.value:.0f} %; 95 % bounds {100 * row.low:.0f} to {100 * row.high:.0f} %)"

    held = found.loc["held-out error after over before, median"].value
    error = found.loc["calibration error of the stated probability"].value
    chance = found.loc["the same by chance alone, if it were exact"].value
    seconds = found.loc["seconds of one core for a diagnosis, median"].value
    text = (
        f"Of {len(rows)} cases, single effects at three times the noise or more were named alone at the right place in "
        f"{bounded('single effects named alone at the right place')}, and named or not ruled out in "
        f"{bounded('single effects in the stated set')}; {count('single effects given a wrong name')} were given a "
        f"wrong name. Clean records called clean: {count('clean records called nothing')}. Cracks named, with the "
        f"element within one: {count('cracks named, element within one')}. Pairs of which both are in the stated set: "
        f"{count('pairs, both in the stated set')}. The stated probability is off by {error:.2f} on average "
        f"(by chance alone, if it were exact: {chance:.2f}); the error "
        f"at held-out speeds falls to a median of {held:.2g} of what it was. A diagnosis takes {seconds:.2g} s of one "
        "core."
    )
    return textwrap.fill(text, 130, initial_indent="  ", subsequent_indent="  ")


def with_numbers(text, mark, numbers):
    """A page with what stands between its marks replaced."""
    pattern = re.compile(rf"(<!-- {mark} -->\n).*?(\n *<!-- end -->)", re.DOTALL)
    return pattern.sub(lambda found: found[1] + numbers + found[2], text)


def pages(rows):
    """{path: text} of the pages with the numbers of some cases."""
    page, readme = (path.read_text(encoding="utf-8") for path in (PAGE, README))
    return {
        PAGE: with_numbers(page, "numbers", numbers(rows)),
        README: with_numbers(readme, "independent records", sentence(rows)),
    }


def main():
    """Copy the rows, write the pages."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER")
    given = parser.parse_args()
    rows = pd.concat([pd.read_csv(folder / "cases.csv") for folder in given.folders])
    rows[COLUMNS].to_csv(ROWS, index=False, float_format="%.4g")
    for path, text in pages(pd.read_csv(ROWS)).items():
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
