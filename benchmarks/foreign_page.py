"""Numbers of runs of benchmarks/foreign.py in README and docs: python benchmarks/foreign_page.py FOLDER --forms FOLDER

The rows of the cases go to `docs/independent_records.csv`, those of faults of another form to `docs/forms.csv`. What
follows from them stands between marks in `docs/independent_records.md` and in the README; a test compares these.
"""

import argparse
import textwrap
from pathlib import Path

import numpy as np
import pandas as pd
from marked_pages import ROOT, table, with_numbers, write

from rotorstudy.blind.criteria import LARGE, judge
from rotorstudy.blind.scoring import calibration, grouped

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
    lines = []
    for one in judge(rows).itertuples():
        if one.cases:
            share = one.kind == "share"
            scale, unit = (100, " %") if share else (1, "")
            value, low, high = (f"{scale * number:.{0 if share else 2}{'f' if share else 'g'}}"
                                for number in (one.reached, one.low, one.high))  # fmt: skip
            lines.append((one.what, f"{value}{unit}", f"{low} to {high}{unit}", one.cases, one.needed))
    seconds, gain = rows[~rows.verdict.isin(["not drawn", "refused"])].seconds, _gain(rows)
    lines += [
        ("calibration error by chance alone", f"{by_chance(rows):.2g}", "", "", ""),
        ("error at held-out speeds, after over before, median", f"{gain.median():.2g}", "", len(gain), ""),
        ("the same, worst", f"{gain.max():.3g}", "", "", ""),
        ("seconds of one core for a diagnosis, median", f"{seconds.median():.0f}", "", len(seconds), ""),
        ("the same, most", f"{seconds.max():.3g}", "", "", ""),
    ]
    kinds = by_kind(rows)
    kinds.index = kinds.index.str.replace("_", " ")
    right = kinds[kinds.alone == kinds.cases].cases
    told = f"All named alone at the right place: {', '.join(f'{kind} ({count})' for kind, count in right.items())}."
    others = kinds.drop([*right.index, "healthy"], errors="ignore")  # clean records have a row above
    counts = [(kind, *("-" if pd.isna(one) else f"{one:.3g}" for one in row)) for kind, row in others.iterrows()]
    judged = table(("", "reached", "95 % bounds", "cases", "asked"), lines)
    return f"{judged}\n\n{textwrap.fill(told, 150)}\n\n{table(('other kinds', *others.columns), counts)}"


def by_kind(rows):
    """Counts of each kind of case, for sizes of at least LARGE (all clean ones); outside: not in the library."""
    seen = grouped(rows[(rows.kind == "healthy") | ~(rows["size"] < LARGE)])
    is_outside = (seen.group == "outside") & ~seen.kind.str.contains("outside")
    seen = seen.assign(kind=seen.kind.mask(is_outside, seen.kind + "_outside"))
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


def _gain(rows):
    """Errors at held-out speeds, after over before, of large effects."""
    return rows[(rows["size"] >= LARGE) & rows.gain.notna()].gain


def sentence(rows):
    """The same in a few sentences, for the README."""
    found = judge(rows).set_index("key")

    def count(key):
        return f"{found.found[key]} of {found.cases[key]}"

    def bounded(key):
        one = found.loc[key]
        return f"{count(key)} ({100 * one.reached:.0f} %; 95 % bounds {100 * one.low:.0f} to {100 * one.high:.0f} %)"

    done = rows[~rows.verdict.isin(["not drawn", "refused"])]
    unknown = done[done.verdict == "unknown"].seconds
    worst = ", ".join(f"{kind.replace('_', ' ')} {100 * share:.0f} %" for kind, share in _worst(by_kind(rows)).items())
    worst, pairs = f"Worst kinds, named alone: {worst}. " if worst else "", found.cases["two_in_set"]
    pairs = f"Pairs, both in the stated set: {bounded('two_in_set')}. " if pairs else ""
    text = (
        f"{len(rows)} cases. Single effects of three standard deviations or more: named alone at the right place in "
        f"{bounded('named_alone')}; named or not ruled out in {bounded('in_set')}; a wrong name in "
        f"{count('wrong_name')}. {worst}{pairs}Cracks named, within one element: {count('cracks_named')}. Clean "
        f"records called clean: {count('clean_called_clean')}. The stated probability is off by "
        f"{found.reached['calibration']:.2f} on average; chance alone gives {by_chance(rows):.2f}. The error at "
        f"held-out speeds falls to {_gain(rows).median():.2g} of what it was in the median, to "
        f"{_gain(rows).quantile(0.9):.2g} or less in 90 %, and to {_gain(rows).max():.3g} in the worst case. Seconds "
        f"of one core: {done.seconds.median():.0f} in the median, {unknown.median():.0f} where the verdict is unknown, "
        f"{done.seconds.max():.3g} at most."
    )
    return textwrap.fill(text, 130, initial_indent="  ", subsequent_indent="  ")


def _worst(kinds):
    """Shares named alone of the worst kinds of single effects with several cases, if not all of them are."""
    single = kinds[~kinds.index.str.contains("healthy|pair|outside") & (kinds.cases >= WORST_OF)]
    shares = single.alone / single.cases
    return shares[shares < 1].nsmallest(3)


def pages(rows):
    """{path: text} of the pages with the numbers of some cases; rows : key of `ROWS` -> table."""
    texts = {path: path.read_text(encoding="utf-8") for path in (PAGE, README)}
    for mark, some in rows.items():
        texts[PAGE] = with_numbers(texts[PAGE], f"numbers of {mark}", numbers(some))
        if f"records of {mark}" in texts[README]:
            texts[README] = with_numbers(texts[README], f"records of {mark}", sentence(some))
    return texts


def read_rows():
    """The rows of the cases, as `pages` takes them."""
    return {mark: pd.read_csv(path) for mark, path in ROWS.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="*", metavar="FOLDER", help="none: write the pages again")
    parser.add_argument("--forms", type=Path, nargs="*", default=[], metavar="FOLDER", help="of --families forms")
    given = parser.parse_args()
    for mark, folders in (("library", given.folders), ("forms", given.forms)):
        if folders:
            rows = pd.concat([pd.read_csv(folder / "cases.csv") for folder in folders])
            rows[COLUMNS].to_csv(ROWS[mark], index=False, float_format="%.4g")
    write(pages(read_rows()))


if __name__ == "__main__":
    main()
