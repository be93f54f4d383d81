"""Numbers of runs of benchmarks/foreign.py in README and docs: python benchmarks/foreign_page.py FOLDER --forms FOLDER

The rows of the cases go to `docs/independent_records.csv`, those of faults of another form to `docs/forms.csv`. What
follows from them stands between marks in `docs/independent_records.md` and in the README; a test compares these.
"""

import argparse
import re
import textwrap
from pathlib import Path

import numpy as np
import pandas as pd

from rotorstudy.blind.criteria import LARGE, judge
from rotorstudy.blind.scoring import calibration

ROOT = Path(__file__).parents[1]
ROWS = {"library": ROOT / "docs/independent_records.csv", "forms": ROOT / "docs/forms.csv"}
PAGE, README = ROOT / "docs/independent_records.md", ROOT / "README.md"
WORST_OF = 5  # cases: kinds with fewer are not called worst
DRAWN = 500  # sets of answers, right with the probability stated
COLUMNS = [
    "case", "seed", "kind", "families", "mass_kg", "elements", "probed_nodes", "known", "size", "beside", "verdict",
    "named", "stated", "alone", "in_set", "wrong", "probability", "first_right", "gain", "gain_sigma",
    "rise_probability", "sizes", "covered", "angle_right", "place_error", "angle_error_deg", "flexibility_held",
    "seconds",
]  # fmt: skip


def numbers(rows):
    """Markdown tables: what was reached and asked, and the counts of each kind."""
    lines = ["| | reached | 95 % bounds | cases | asked |", "|---|---|---|---|---|"]
    for one in judge(rows):
        if not one.cases:
            continue
        share = one.kind in ("share", "coverage")
        scale, unit = (100, " %") if share else (1, "")
        value, low, high = (f"{scale * number:.{0 if share else 2}{'f' if share else 'g'}}"
                            for number in (one.reached, one.low, one.high))  # fmt: skip
        lines.append(f"| {one.what} | {value}{unit} | {low} to {high}{unit} | {one.cases} | {one.needed_text} |")
    lines.append(f"| calibration error by chance alone, if it were exact | {by_chance(rows):.2g} | | | |")
    seconds = rows[~rows.verdict.isin(["not drawn", "refused"])].seconds
    lines.append(f"| seconds of one core for a diagnosis, median | {seconds.median():.2g} | | {len(seconds)} | |")
    lines.append(f"| the same, most | {seconds.max():.3g} | | {len(seconds)} | |")
    table = by_kind(rows)
    table.index = table.index.str.replace("_", " ")
    right = table[table.alone == table.cases].cases
    told = f"All named alone at the right place: {', '.join(f'{kind} ({count})' for kind, count in right.items())}."
    table = table.drop([*right.index, "healthy"], errors="ignore")  # clean records have a row above
    lines += ["", textwrap.fill(told, 150), ""]
    lines += [f"| other kinds | {' | '.join(table.columns)} |", "|---" * (len(table.columns) + 1) + "|"]
    for kind, row in table.iterrows():
        cells = ["-" if pd.isna(one) else f"{one:.3g}" for one in row]
        lines.append(f"| {kind} | {' | '.join(cells)} |")
    return "\n".join(lines)


def by_kind(rows):
    """Counts of each kind of case, for sizes of at least LARGE (all clean ones)."""
    seen = rows[(rows.kind == "healthy") | ~(rows["size"] < LARGE)]
    found = seen.groupby("kind", sort=False).agg(
        cases=("case", "size"), alone=("alone", "sum"), in_set=("in_set", "sum"), wrong=("wrong", "sum"),
        seconds=("seconds", "median"),
    )  # fmt: skip
    said = seen.verdict.eq("unknown").groupby(seen.kind).sum()
    found.insert(4, "called unknown", said)
    return found.rename(columns={"in_set": "in the set", "wrong": "wrong name", "seconds": "s, median"})


def by_chance(rows):
    """Median calibration error of so few cases if their stated probabilities were exact."""
    probability = rows.probability.dropna().to_numpy(float)
    random = np.random.default_rng(0)
    drawn = random.random((DRAWN, len(probability))) < probability
    return float(np.median([calibration(probability, right.astype(float))[-1] for right in drawn]))


def sentence(rows):
    """The same in a few sentences, for the README."""
    found = {one.key: one for one in judge(rows)}

    def count(key):
        return f"{found[key].found} of {found[key].cases}"

    def bounded(key):
        one = found[key]
        return f"{count(key)} ({100 * one.reached:.0f} %; 95 % bounds {100 * one.low:.0f} to {100 * one.high:.0f} %)"

    done = rows[~rows.verdict.isin(["not drawn", "refused"])]
    large = rows[(rows["size"] >= LARGE) & rows.gain.notna()]
    unknown = done[done.verdict == "unknown"].seconds
    worst = ", ".join(f"{kind.replace('_', ' ')} {100 * share:.0f} %" for kind, share in _worst(by_kind(rows)).items())
    worst, pairs = f"Worst kinds, named alone: {worst}. " if worst else "", found["two_in_set"].cases
    pairs = f"Pairs, both in the stated set: {bounded('two_in_set')}. " if pairs else ""
    text = (
        f"{len(rows)} cases. Single effects of three standard deviations or more: named alone at the right place in "
        f"{bounded('named_alone')}; named or not ruled out in {bounded('in_set')}; a wrong name in "
        f"{count('wrong_name')}. {worst}{pairs}Cracks named, within one element: {count('cracks_named')}. Clean "
        f"records called clean: {count('clean_called_clean')}. The stated probability is off by "
        f"{found['calibration'].reached:.2f} on average; chance alone gives {by_chance(rows):.2f}. The error at "
        f"held-out speeds falls to {found['gain_measured'].reached:.2g} of what it was in the median, to "
        f"{large.gain.quantile(0.9):.2g} or less in 90 %, and to {large.gain.max():.3g} in the worst case. Seconds of "
        f"one core: {done.seconds.median():.2g} in the median, {unknown.median():.2g} where the verdict is unknown, "
        f"{done.seconds.max():.3g} at most."
    )
    return textwrap.fill(text, 130, initial_indent="  ", subsequent_indent="  ")


def _worst(table):
    """Shares named alone of the worst kinds of single effects with several cases."""
    single = table[~table.index.str.contains("healthy|pair|outside") & (table.cases >= WORST_OF)]
    return (single.alone / single.cases).nsmallest(3)


def with_numbers(text, mark, numbers):
    """A page with what stands between its marks replaced."""
    pattern = re.compile(rf"(<!-- {mark} -->\n).*?( *<!-- end -->)", re.DOTALL)
    return pattern.sub(lambda found: f"{found[1]}{numbers}\n{found[2]}", text)


def pages(rows):
    """{path: text} of the pages with the numbers of some cases; rows : key of `ROWS` -> table."""
    texts = {path: path.read_text(encoding="utf-8") for path in (PAGE, README)}
    for mark, some in rows.items():
        texts[PAGE] = with_numbers(texts[PAGE], f"numbers of {mark}", numbers(some))
        texts[README] = with_numbers(texts[README], f"records of {mark}", sentence(some))
    return texts


def read_rows():
    """The rows of the cases, as `pages` takes them."""
    return {mark: pd.read_csv(path) for mark, path in ROWS.items()}


def main():
    """Copy the rows, write the pages."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="*", metavar="FOLDER", help="none: write the pages again")
    parser.add_argument("--forms", type=Path, nargs="*", default=[], metavar="FOLDER", help="of --families forms")
    given = parser.parse_args()
    for mark, folders in (("library", given.folders), ("forms", given.forms)):
        if folders:
            rows = pd.concat([pd.read_csv(folder / "cases.csv") for folder in folders])
            rows[COLUMNS].to_csv(ROWS[mark], index=False, float_format="%.4g")
    for path, text in pages(read_rows()).items():
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
