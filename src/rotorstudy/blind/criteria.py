"""Acceptance criteria of the diagnosis: value asked for, value reached with 95 % bounds, and reasons for failures."""

from collections import Counter

import numpy as np
import pandas as pd

from rotorstudy.blind.meanings import PLACE
from rotorstudy.blind.scoring import calibration, grouped, share_bounds

LARGE = 3.0  # size from which an effect must be found
CRACKS = ("crack", "open_crack", "crack_form", "open_crack_form")
OPTIONAL = ("beside", "causes", "names_rotor", "place_error", "flexibility_held", "gain_true")
RESAMPLES = 400  # of the cases, for the bounds of the calibration error
STATUSES = ("reached", "undecided", "not reached")
OWN = "this run"
AT_A_GLANCE = {  # key -> the answer in the words of the figure, and as a sentence with its count
    "clean_called_clean": ("clean called clean", "A record with nothing hidden was called clean in {count}."),
    "named_alone": (
        "named alone",
        "A hidden effect of three standard deviations or more was named alone, at the right place, in {count}.",
    ),
    "in_set": ("in the stated set", "It was named, or among the causes that the answer does not rule out, in {count}."),
    "wrong_name": ("wrong name", "Another effect was named alone in {count}."),
    "called_unknown": ("called unknown", "The answer was that no known effect explains the record in {count}."),
}


def judge(rows: pd.DataFrame, source: str = OWN) -> pd.DataFrame:
    """A row for each criterion, judged on the rows of `scoring.score`, or of a file with part of their columns.

    Its columns:

    source, key        : where the truth comes from, and the name used by files, pages and figures
    what, kind         : the quantity in words, and whether it is a "share", a "calibration" error or a "median"
    needed             : values that are accepted
    reached, low, high : the value and its 95 % bounds; without cases nan, and the widest possible bounds
    found, cases       : counts behind the value: of cases, or of intervals where these are counted
    status             : "reached" or "not reached" if the whole range between the bounds is, else "undecided"
    reasons            : what went wrong most often, if it is not reached
    """
    rows = grouped(rows)
    rows = rows.assign(**{name: np.nan for name in OPTIONAL if name not in rows})
    rows = rows.assign(answer=rows.get("answer", rows.named), machine=rows.get("machine", "any"))
    failed = rows.verdict.isin(["failed", "crashed"])
    refused = rows[rows.verdict == "refused"]
    done = rows[~failed & ~rows.verdict.isin(["not drawn", "refused"])]
    large = done[done["size"] >= LARGE]
    single, clean = large[large.group.isin(["single", "chain"])], done[done.group == "clean"]
    form = single[single.families.str.endswith("_form")]
    cracks = single[single.families.isin(CRACKS)]
    named = cracks[cracks.alone.astype(bool)]
    placed, held = (named[named[key].notna()] for key in ("place_error", "flexibility_held"))
    two = large[(large.group == "two") & ~(large.beside < LARGE)]  # a smaller one beside the other nobody could name
    outside, chain = large[large.group == "outside"], done[(done.group == "chain") & done.names_rotor.notna()]
    stated = done[(done.causes > 0) & (done.group != "outside")]
    gain = large[large.gain.notna()]
    found = [
        _share("clean_called_clean", "clean records called clean", clean, clean.verdict == "nothing", (0.99, 1)),
        _share("in_set", "single effects in the stated set", single, single.in_set, (0.95, 1)),
        _share("named_alone", "single effects named alone at the right place", single, single.alone, (0.85, 1)),
        _share("called_unknown", "single effects called unknown", single, single.verdict == "unknown", (0, 0.05)),
        _share("wrong_name", "single effects given a wrong name", single, single.wrong, (0, 0.01)),
        _share("form_in_set", "single effects with another law in the stated set", form, form.in_set, (0.95, 1)),
        _share("form_named_alone", "single effects with another law named alone", form, form.alone, (0.85, 1)),
        _share("form_wrong_name", "single effects with another law given a wrong name", form, form.wrong, (0, 0.01)),
        _share("cracks_named", "cracks named alone at their place", cracks, cracks.alone, (0.85, 1)),
        _share("crack_place", "named cracks whose place is within 5 % of the shaft", placed,
               placed.place_error <= PLACE, (0.95, 1)),
        _share("crack_angle", "named cracks whose angle is within 10 degrees", named, named.angle_right, (0.95, 1)),
        _share("crack_flexibility", "intervals that hold the true flexibility of a crack", held,
               held.flexibility_held == 1, (0.90, 0.97)),
        _share("two_in_set", "two effects, both in the stated set", two, two.in_set, (0.8, 1)),
        _share("outside_unknown", "effects outside the library called unknown", outside, outside.verdict == "unknown",
               (0.95, 1)),
        _share("chain_not_rotor", "errors of the measuring chain not attributed to the rotor", chain,
               chain.names_rotor == 0, (0.95, 1)),
        _share("refused", "records refused for the right reason", refused, refused.alone, (0.95, 1)),
        _share("stated_set", "truth inside the stated set of causes", stated, stated.in_set, (0.95, 1)),
        _intervals(done),
        _calibration(done),
        _share("held_out_worse", "cases whose error on held-out speeds increased", gain, gain.gain > 1, (0, 0.01)),
        _median("gain", "ratio of errors on held-out speeds, after to before, median, against the signal without noise",
                large, large.gain_true, (0, 0.1)),
        _share("without_verdict", "diagnoses that ended without a verdict", rows, failed, (0, 0.003)),
    ]  # fmt: skip
    return pd.DataFrame(found).assign(source=source)


def _judged(key, what, kind, needed, reached, bounds, found, cases, reasons):
    (least, most), (low, high) = needed, map(float, bounds)
    if not cases:
        status = "no cases"
    elif least <= low and high <= most:
        status = "reached"
    else:
        status = "not reached" if high < least or low > most else "undecided"
    if status == "undecided" and least <= reached <= most:
        few = "1 case is" if cases == 1 else f"{cases} cases are"
        reasons = (f"the value is accepted, but {few} too few to prove it", *reasons)
    said = "; ".join(reasons) if status in ("undecided", "not reached") else ""
    asked = f"<= {most:g}" if least == 0 else f">= {least:g}" if most == 1 else f"{least:g} to {most:g}"
    return {"key": key, "what": what, "kind": kind, "needed": asked, "reached": float(reached), "low": low,
            "high": high, "found": int(found), "cases": int(cases), "status": status, "reasons": said}  # fmt: skip


def _share(key, what, part, right, needed):
    right = np.asarray(right, bool)
    k, n = int(right.sum()), len(right)
    wrong = part[right if needed[0] == 0 else ~right]
    return _judged(key, what, "share", needed, k / n if n else np.nan, share_bounds(k, n), k, n, _reasons(wrong))


def _reasons(wrong):
    """The most frequent failures: what was hidden and what was answered."""
    if not len(wrong):
        return ()
    pairs = Counter(zip(wrong.families, wrong.answer, strict=True)).most_common(4)
    said = ", ".join(f"{count} × {truth} answered {answer}" for (truth, answer), count in pairs)
    rigs = ", ".join(f"{name} {count}" for name, count in Counter(wrong.machine).most_common())
    return f"{len(wrong)} failed: {said.replace('_', ' ')}", f"by machine: {rigs}"


def _intervals(rows):
    """Share of 95 % intervals that hold the truth; bounds by cases, as the parameters of a case are not independent."""
    exact = rows[rows.sizes > 0]
    k, n = int(exact.covered.sum()), int(exact.sizes.sum())
    value, cases = k / n if n else np.nan, len(exact)
    bounds = share_bounds(round(value * cases) if cases else 0, cases)
    missed = Counter(exact[exact.covered < exact.sizes].families).most_common(5)
    often = ", ".join(f"{count} × {name}" for name, count in missed).replace("_", " ")
    reasons = [f"{n} intervals in {cases} cases", *([f"missed most often: {often}"] if often else [])]
    what = "95 % intervals that hold the truth"
    return _judged("intervals", what, "share", (0.93, 0.97), value, bounds, k, n, reasons)


def _calibration(rows):
    """Expected calibration error; bounds by bootstrap over the cases."""
    from scipy.stats import bootstrap

    stated = rows[rows.probability.notna()]
    data = stated.probability.to_numpy(float), stated.first_right.to_numpy(float)
    bounds = 0.0, 1.0
    if len(stated) > 1:
        bounds = bootstrap(
            data, lambda *drawn: calibration(*drawn)[-1], paired=True, vectorized=False, n_resamples=RESAMPLES,
            method="percentile", rng=np.random.default_rng(0),
        ).confidence_interval  # fmt: skip
    surely_wrong = stated[~stated.first_right.astype(bool) & (stated.probability > 0.9)]
    mean, share = (one.mean() if len(stated) else np.nan for one in data)
    reasons = f"mean probability {mean:.3f}, share right {share:.3f}", *_reasons(surely_wrong)
    return _judged("calibration", "calibration error of the stated probability", "calibration", (0, 0.05),
                   calibration(*data)[-1], bounds, 0, len(stated), reasons)  # fmt: skip


def _median(key, what, part, values, needed):
    """Median of error ratios; bounds by order statistics, which need at least six cases."""
    from scipy.stats import quantile_test

    there = values.notna()
    part, values = part[there], values[there].to_numpy(float)
    bounds = quantile_test(values, p=0.5).confidence_interval(0.95) if len(values) else (np.nan, np.nan)
    bounds = bounds if np.isfinite(bounds).all() else (0.0, np.inf)
    good = values <= needed[1]
    value = np.median(values) if len(values) else np.nan
    return _judged(key, what, "median", needed, value, bounds, good.sum(), len(values), _reasons(part[~good]))


def sentences(criteria: pd.DataFrame) -> list[str]:
    """A sentence for each answer AT_A_GLANCE, with the counts of every source that has cases."""
    found = []
    for key, (_, text) in AT_A_GLANCE.items():
        told = [
            f"{row.found} of {row.cases} cases of {row.source} ({100 * row.low:.0f} to {100 * row.high:.0f} %)"
            for row in criteria[(criteria.key == key) & (criteria.cases > 0)].itertuples()
        ]
        if told:
            found.append(text.format(count=" and in ".join(told)))
    return found


def statement(criteria: pd.DataFrame) -> str:
    """One sentence: how many criteria are reached, undecided and not reached."""
    counted = ", ".join(f"{(criteria.status == status).sum()} {status}" for status in STATUSES)
    return f"Acceptance criteria: {counted}."


def printed(criteria: pd.DataFrame) -> str:
    """A summary for a terminal: the statement, then a line for each criterion that has cases."""
    shown = criteria[criteria.cases > 0]
    lines = [statement(criteria)]
    for c in shown.itertuples():
        value = f"{c.reached:.3g} ({c.low:.3g} to {c.high:.3g})"
        lines.append(f"{c.status:12} {c.what}: {value}; needed {c.needed}; cases: {c.cases}")
    if without := len(criteria) - len(shown):
        lines.append(f"{without} criteria have no cases here and are left out; run more cases to judge them.")
    return "\n".join(lines)
