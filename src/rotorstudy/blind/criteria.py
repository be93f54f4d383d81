"""What was promised of the diagnosis, what it reaches, within which bounds, and if not, what went wrong."""

from collections import Counter

import numpy as np

from rotorstudy.blind.scoring import binomial_bounds, calibration

LARGE = 3.0  # change over noise from which an effect must be found
RESAMPLED = 400  # times, for the bounds of the calibration error


def reached(rows):
    """A DataFrame of the criteria: what, needed, reached, low, high (95 %), found, cases, status, why.

    Those that ask for a size come a second time, for the change that the base parameters cannot take over.
    """
    import pandas as pd

    clean, chain = rows[rows.kind == "clean"], rows[rows.kind == "chain"]
    known = rows[rows.known]
    named = known[known.states_causes]
    held = named[named.gain.notna()]
    found = [
        _share("clean records called clean", clean, clean.verdict == "nothing", 0.99),
        *_by_size(rows, "size", "s"),
        *(
            _share(f"truth inside the stated set at {level:g} % noise", part, part.inside, 0.95)
            for level, part in named.groupby("noise_percent")
        ),
        _share("chain errors not named as rotor effects", chain, ~chain.names_rotor, 0.95),
        _coverage(rows),
        _calibration(rows, "calibration error of the stated confidence", 0.05),
        _calibration(known, "the same, of effects of the library", None),
        _share("held-out error made worse", held, held.gain > 1, 0.01, at_most=True),
        _share("effects of the library called unknown", known, known.verdict == "unknown", None),
        *_by_size(rows, "beyond", "s beyond the base"),
    ]
    return pd.DataFrame(found)


def _by_size(rows, size, called):
    """Bars of effects of a size; size : column it stands in, called : how."""
    single = rows[rows.known & rows.kind.isin(["single", "chain"])]
    large = single[single[size] >= LARGE]
    small = single[single[size].between(0.6, 2) & (single.noise_percent == 5.0)]
    foreign = rows[(rows.kind == "foreign") & (rows[size] >= LARGE)]
    two = rows[(rows.kind == "two") & (rows.noise_percent == 1.0)]
    if size != "size":  # two effects are drawn from 3 on
        two = two[two[size] >= LARGE]
    held = rows[rows.known & rows.states_causes & rows.gain.notna() & (rows[size] >= LARGE)]
    beyond = "" if size == "size" else f", both {called} >= 3"
    return [
        _share(f"right cause and place at {called} >= 3", large, large.right, 0.95),
        _share(f"the same, named alone ({called})", large, large.exact & (large.verdict == "cause"), None),
        _share(f"right cause and place at {called} 0.6 to 2 and 5 % noise", small, small.right, 0.80),
        _share(f"foreign effects at {called} >= 3 called unknown or a declared confounder", foreign,
               (foreign.verdict == "unknown") | foreign.confounder, 0.90),
        _median_gain(held, "gain", 0.1, called),
        _median_gain(held, "gain_measured", None, called),
        _share(f"two effects at 1 % noise exact{beyond}", two, two.exact, 0.85),
        _share(f"the same, or both in the set of an ambiguous verdict ({called})", two, two.right, None),
    ]  # fmt: skip


def _row(what, needed, value, bounds, found, cases, status, why=""):
    low, high = bounds
    return {"what": what, "needed": needed, "reached": float(value), "low": float(low), "high": float(high),
            "found": int(found), "cases": int(cases), "status": status, "why": why}  # fmt: skip


def _status(good, bad, cases):
    """good, bad : whether both bounds lie on that side of the bar."""
    if not cases:
        return "no such case"
    return "reached" if good else "not reached" if bad else "undecided"


def _share(what, part, right, bar, at_most=False):
    right = np.asarray(right, bool)
    k, n = int(right.sum()), len(right)
    low, high = binomial_bounds(k, n)
    value = k / n if n else np.nan
    if bar is None:
        return _row(what, "", value, (low, high), k, n, "for information")
    good, bad = (high <= bar, low > bar) if at_most else (low >= bar, high < bar)
    status, why = _status(good, bad, n), ""
    if status in ("not reached", "undecided"):
        why = _reasons(part[right if at_most else ~right])
        if status == "undecided" and (value <= bar if at_most else value >= bar):
            why = f"the number is there, {n} cases are too few to prove it; {why or 'no case failed'}"
    return _row(what, f"{'<=' if at_most else '>='} {bar:g}", value, (low, high), k, n, status, why)


def _reasons(wrong):
    """The most frequent ways to fail: what was hidden and what was answered."""
    if not len(wrong):
        return ""
    pairs = Counter(zip(wrong.truth, wrong.answer, strict=True)).most_common(4)
    said = ", ".join(f"{count} x {truth} answered {answer}" for (truth, answer), count in pairs)
    rigs = ", ".join(f"{name} {count}" for name, count in Counter(wrong.rig).most_common())
    return f"{len(wrong)} failed: {said}; by rotor: {rigs}"


def _coverage(rows):
    """Share of 95 % intervals that hold the truth; bounds by cases, whose parameters are not independent."""
    exact = rows[rows.covered.map(len) > 0]
    k, n = int(sum(map(sum, exact.covered))), int(sum(map(len, exact.covered)))
    value = k / n if n else np.nan
    cases = len(exact)
    bounds = binomial_bounds(round(value * cases), cases) if cases else (0.0, 1.0)
    status = _status(bounds[0] >= 0.93 and bounds[1] <= 0.97, bounds[1] < 0.93 or bounds[0] > 0.97, n)
    why = ""
    if status != "reached" and n:
        missed = exact[[not all(covered) for covered in exact.covered]]
        why = "missed most: " + ", ".join(f"{c} x {name}" for name, c in Counter(missed.truth).most_common(5))
        if status == "undecided" and 0.93 <= value <= 0.97:
            why = f"the number is there, {cases} cases are too few to prove it; {why}"
    return _row("95 % intervals that hold the truth", "0.93 to 0.97", value, bounds, k, n, status, why)


def _calibration(rows, what, bar):
    """Expected calibration error, bounds by drawing the cases again."""
    stated = rows[rows.posterior_probability.notna()]
    error, count = calibration(rows)[-1], len(stated)
    generator = np.random.default_rng(0)
    again = [
        calibration(stated.iloc[generator.integers(count, size=count)])[-1] for _ in range(RESAMPLED if count else 0)
    ]
    bounds = tuple(np.quantile(again, [0.025, 0.975])) if again else (0.0, 1.0)
    if bar is None:
        return _row(what, "", error, bounds, 0, count, "for information")
    status = _status(bounds[1] <= bar, bounds[0] > bar, count)
    why = ""
    if status != "reached" and count:
        why = (f"mean probability {stated.posterior_probability.mean():.3f}, right {stated.first_right.mean():.3f}; "
               + _reasons(stated[~stated.first_right & (stated.posterior_probability > 0.9)]))  # fmt: skip
    return _row(what, f"<= {bar:g}", error, bounds, 0, count, status, why)


def _median_gain(part, key, bar, called):
    """Median of after over before; bounds by order statistics."""
    from scipy.stats import binom

    values = np.sort(part[key].dropna())
    n, against = len(values), {"gain": "against the signal without noise", "gain_measured": "against the measurement"}
    what = f"held-out error after over before, median at {called} >= 3, {against[key]}"
    if not n:
        return _row(what, "" if bar is None else f"<= {bar:g}", np.nan, (0, np.inf), 0, 0, "no such case")
    i = int(binom.ppf(0.025, n, 0.5))
    bounds, value = (values[max(i - 1, 0)], values[min(n - i, n - 1)]), float(np.median(values))
    if bar is None:
        return _row(what, "", value, bounds, 0, n, "for information")
    status = _status(bounds[1] <= bar, bounds[0] > bar, n)
    why = "" if status == "reached" else _reasons(part[part[key] > bar])
    return _row(what, f"<= {bar:g}", value, bounds, int((values <= bar).sum()), n, status, why)
