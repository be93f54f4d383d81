"""The answers of blind tests at a glance: five counts with 95 % bounds, for each source of the truth."""

from typing import TYPE_CHECKING

from rotorstudy.blind.criteria import LARGE
from rotorstudy.blind.scoring import grouped, share_bounds

if TYPE_CHECKING:
    from pandas import DataFrame

OWN, PUBLISHED = "this run", "the published run"
ANSWERS = {  # key -> the answer in the words of the figure, and as a sentence with its count
    "clean": ("clean called clean", "A record with nothing hidden was called clean in {count}."),
    "alone": (
        "named alone",
        "A hidden effect of three standard deviations or more was named alone, at the right place, in {count}.",
    ),
    "in_set": ("in the stated set", "It was named, or among the causes that the answer does not rule out, in {count}."),
    "wrong": ("wrong name", "Another effect was named alone in {count}."),
    "unknown": ("called unknown", "The answer was that no known effect explains the record in {count}."),
}


def answers_of(rows: "DataFrame", source: str = OWN) -> "DataFrame":
    """The five counts, from the rows of `scoring.score` or those that benchmarks/foreign.py leaves; see `counted`."""
    done = grouped(rows[~rows.verdict.isin(["not drawn", "refused", "failed", "crashed"])])
    clean = done[done.group == "clean"]
    single = done[done.group.isin(["single", "chain"]) & (done["size"] >= LARGE)]
    right = {key: single[key] for key in ("alone", "in_set", "wrong")}
    return counted(source, clean.verdict == "nothing", right | {"unknown": single.verdict == "unknown"})


def counted(source: str, clean, single) -> "DataFrame":
    """A row for each of ANSWERS: answer, source, found, cases, share and its 95 % bounds low and high.

    source : where the truth comes from
    clean  : for each clean record, whether it was called clean
    single : every other key of ANSWERS -> for each single effect of the library, whether that was the answer
    """
    import pandas as pd

    rows = []
    for key, right in ({"clean": clean} | single).items():
        found, cases = int(right.sum()), len(right)
        low, high = share_bounds(found, cases)
        share = found / cases if cases else float("nan")
        rows.append(
            {"answer": key, "source": source, "found": found, "cases": cases, "share": share, "low": low, "high": high}
        )
    return pd.DataFrame(rows)


def sentences(answers: "DataFrame") -> list[str]:
    """A sentence for each of ANSWERS, with the counts of every source; answers : rows of `counted`."""
    found = []
    for key, (_, text) in ANSWERS.items():
        rows = answers[(answers.answer == key) & (answers.cases > 0)]
        told = [
            f"{row.found} of {row.cases} cases of {row.source} ({100 * row.low:.0f} to {100 * row.high:.0f} %)"
            for row in rows.itertuples()
        ]
        if told:
            found.append(text.format(count=" and in ".join(told)))
    return found
