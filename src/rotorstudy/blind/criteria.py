"""Acceptance criteria of the diagnosis: required value, value reached with its bounds, and reasons for failures."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from rotorstudy.blind.meanings import PLACE
from rotorstudy.blind.scoring import calibration, grouped, share_bounds

if TYPE_CHECKING:
    from pandas import DataFrame

LARGE = 3.0  # size from which an effect must be found
CRACKS = ("crack", "open_crack", "crack_form", "open_crack_form")
OPTIONAL = ("beside", "causes", "names_rotor", "place_error", "flexibility_held", "gain_true")
RESAMPLES = 400  # of the cases, for the bounds of the calibration error
STATUSES = ("reached", "undecided", "not reached")

Status = Literal["reached", "undecided", "not reached", "for information", "no cases"]
Kind = Literal["share", "coverage", "calibration", "median"]


@dataclass(frozen=True)
class Criterion:
    """One acceptance criterion and its result.

    key                : name used by files, pages and figures;  what : the quantity in words
    kind               : "share" of cases; "coverage", share of stated sets or intervals that hold the truth;
                         "calibration" error of the stated posterior probabilities; "median" of a ratio of errors
    needed             : lowest and highest accepted value; None if the quantity is reported for information only
    reached, low, high : the value and its 95 % bounds; without cases nan, and the widest possible bounds
    found, cases       : counts behind the value: of cases, or of intervals where these are counted
    status             : "reached" or "not reached" if the whole range between the bounds is, else "undecided"
    reasons            : what went wrong most often, if it is not reached
    """

    key: str
    what: str
    kind: Kind
    needed: tuple[float, float] | None
    reached: float
    low: float
    high: float
    found: int
    cases: int
    status: Status
    reasons: tuple[str, ...] = ()

    @property
    def needed_text(self) -> str:
        """The accepted values in words; empty for information."""
        if self.needed is None:
            return ""
        least, most = self.needed
        return f"<= {most:g}" if least == 0 else f">= {least:g}" if most == 1 else f"{least:g} to {most:g}"


def judge(rows: "DataFrame") -> list[Criterion]:
    """All criteria, judged on the rows of `scoring.score`, or on those of a file with part of their columns."""
    rows = grouped(rows)
    rows = rows.assign(**{name: np.nan for name in OPTIONAL if name not in rows})
    rows = rows.assign(answer=rows.get("answer", rows.named), machine=rows.get("machine", "any"))
    done = rows[~rows.verdict.isin(["not drawn", "refused", "failed", "crashed"])]
    large = done[done["size"] >= LARGE]
    single, clean = large[large.group.isin(["single", "chain"])], done[done.group == "clean"]
    form = single[single.families.str.endswith("_form")]
    cracks = single[single.families.isin(CRACKS)]
    named = cracks[cracks.alone.astype(bool)]
    placed, held = (named[named[key].notna()] for key in ("place_error", "flexibility_held"))
    two = large[large.group == "two"]
    hidden = two.beside < LARGE  # nobody could name it
    of_form = two[~hidden][two[~hidden].families.str.contains("_form")]
    outside, chain = large[large.group == "outside"], done[(done.group == "chain") & done.names_rotor.notna()]
    stated = done[(done.causes > 0) & (done.group != "outside")]
    refused, gain = rows[rows.verdict == "refused"], large[large.gain.notna()]
    return [
        _share("clean_called_clean", "clean records called clean", clean, clean.verdict == "nothing", (0.99, 1)),
        _share("in_set", "single effects in the stated set", single, single.in_set, (0.95, 1)),
        _share("named_alone", "single effects named alone at the right place", single, single.alone, (0.85, 1)),
        _share("called_unknown", "single effects called unknown", single, single.verdict == "unknown", None),
        _share("wrong_name", "single effects given a wrong name", single, single.wrong, (0, 0.01)),
        _share("form_in_set", "single effects of another form than that of the library in the stated set", form,
               form.in_set, (0.95, 1)),
        _share("form_named_alone", "single effects of another form named alone", form, form.alone, (0.85, 1)),
        _share("form_wrong_name", "single effects of another form given a wrong name", form, form.wrong, (0, 0.01)),
        _share("cracks_named", "cracks named alone at their place", cracks, cracks.alone, (0.85, 1)),
        _share("cracks_in_set", "cracks in the stated set", cracks, cracks.in_set, None),
        _share("crack_place", "named cracks whose place is within 5 % of the shaft", placed,
               placed.place_error <= PLACE, (0.95, 1)),
        _share("crack_angle", "named cracks whose angle is within 10 degrees", named, named.angle_right, (0.95, 1)),
        _share("crack_flexibility", "intervals that hold the true flexibility of a crack", held,
               held.flexibility_held == 1, (0.90, 0.97), "coverage"),
        _share("two_in_set", "two effects, both in the stated set", two[~hidden], two[~hidden].in_set, (0.8, 1)),
        _share("two_with_a_form", "two effects, one of another form, both in the stated set", of_form, of_form.in_set,
               (0.8, 1)),
        _share("two_hidden", f"two effects, one below size {LARGE:g} beside the other, both in the stated set",
               two[hidden], two[hidden].in_set, None),
        _share("outside_unknown", "effects outside the library called unknown", outside, outside.verdict == "unknown",
               (0.95, 1)),
        _share("outside_named", "effects outside the library taken for one of it, named alone", outside,
               outside.verdict == "cause", None),
        _share("chain_not_rotor", "errors of the measuring chain not attributed to the rotor", chain,
               chain.names_rotor == 0, (0.95, 1)),
        _share("stated_set", "truth inside the stated set of causes", stated, stated.in_set, (0.95, 1),
               "coverage"),
        _intervals(done),
        _calibration("calibration", "calibration error of the stated probability", done, (0, 0.05)),
        _share("held_out_worse", "cases whose error on held-out speeds increased", gain, gain.gain > 1, (0, 0.01)),
        _median("gain", "ratio of errors on held-out speeds, after to before, median, against the signal without noise",
                large, large.gain_true, (0, 0.1)),
        _median("gain_measured", "the same ratio, median, against the measurement", large, large.gain, None),
        _share("refused", "records refused for the right reason", refused, refused.alone, None),
        _share("without_verdict", "diagnoses that ended without a verdict", rows,
               rows.verdict.isin(["failed", "crashed"]), (0, 0.003)),
    ]  # fmt: skip


def _judged(key, what, kind, needed, reached, bounds, found, cases, reasons: Callable[[], Sequence[str]]):
    low, high = map(float, bounds)
    if not cases:
        status = "no cases"
    elif needed is None:
        status = "for information"
    elif needed[0] <= low and high <= needed[1]:
        status = "reached"
    else:
        status = "not reached" if high < needed[0] or low > needed[1] else "undecided"
    said = tuple(reasons()) if status in ("undecided", "not reached") else ()
    if status == "undecided" and needed[0] <= reached <= needed[1]:
        few = "1 case is" if cases == 1 else f"{cases} cases are"
        said = (f"the value is accepted, but {few} too few to prove it", *said)
    return Criterion(key, what, kind, needed, float(reached), low, high, int(found), int(cases), status, said)


def _share(key, what, part, right, needed, kind="share"):
    right = np.asarray(right, bool)
    k, n = int(right.sum()), len(right)
    wrong = part[right if needed and needed[0] == 0 else ~right]
    return _judged(key, what, kind, needed, k / n if n else np.nan, share_bounds(k, n), k, n, lambda: _reasons(wrong))


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

    def reasons():
        missed = exact[exact.covered < exact.sizes]
        often = ", ".join(f"{count} × {name}" for name, count in Counter(missed.families).most_common(5)).replace(
            "_", " "
        )
        return [f"{n} intervals in {cases} cases", *([f"missed most often: {often}"] if often else [])]

    return _judged("intervals", "95 % intervals that hold the truth", "coverage", (0.93, 0.97), value, bounds, k, n,
                   reasons)  # fmt: skip


def _calibration(key, what, rows, needed):
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
    means = f"mean probability {data[0].mean() if len(stated) else np.nan:.3f}"
    means += f", share right {data[1].mean() if len(stated) else np.nan:.3f}"
    return _judged(key, what, "calibration", needed, calibration(*data)[-1], bounds, 0, len(stated),
                   lambda: (means, *_reasons(surely_wrong)))  # fmt: skip


def _median(key, what, part, values, needed):
    """Median of error ratios; bounds by order statistics, which need at least six cases."""
    from scipy.stats import quantile_test

    there = values.notna()
    part, values = part[there], values[there].to_numpy(float)
    bounds = quantile_test(values, p=0.5).confidence_interval(0.95) if len(values) else (np.nan, np.nan)
    bounds = bounds if np.isfinite(bounds).all() else (0.0, np.inf)
    good = values <= needed[1] if needed else np.zeros(len(values), bool)
    return _judged(key, what, "median", needed, np.median(values) if len(values) else np.nan, bounds, good.sum(),
                   len(values), lambda: _reasons(part[~good]))  # fmt: skip


def tally(criteria: Sequence[Criterion]) -> dict[str, list[Criterion]]:
    """The criteria of each status in STATUSES."""
    return {status: [c for c in criteria if c.status == status] for status in STATUSES}


def statement(criteria: Sequence[Criterion]) -> str:
    """One sentence: how many criteria are reached, undecided and not reached."""
    counted = ", ".join(f"{len(found)} {status}" for status, found in tally(criteria).items())
    return f"Acceptance criteria: {counted}."


def attributes(criteria: Sequence[Criterion]) -> dict[str, int | str]:
    """Attributes of a file: how many criteria have each status, and the keys of those not reached and undecided."""
    found = {f"criteria_{status.replace(' ', '_')}": len(those) for status, those in tally(criteria).items()}
    missed, undecided = (", ".join(c.key for c in tally(criteria)[status]) for status in ("not reached", "undecided"))
    without = sum(c.status == "no cases" for c in criteria)
    return found | {"criteria_without_cases": without, "missed_criteria": missed, "undecided_criteria": undecided}


def printed(criteria: Sequence[Criterion]) -> str:
    """A summary for a terminal: the statement, then a line for each criterion that has cases."""
    shown = [c for c in criteria if c.cases]
    lines = [statement(criteria)]
    for c in shown:
        needed = f"needed {c.needed_text}; " if c.needed else ""
        value = f"{c.reached:.3g} ({c.low:.3g} to {c.high:.3g})"
        lines.append(f"{c.status:15} {c.what}: {value}; {needed}cases: {c.cases}")
    if without := len(criteria) - len(shown):
        lines.append(f"{without} criteria have no cases here and are left out; run more cases to judge them.")
    return "\n".join(lines)


def table(criteria: Sequence[Criterion]) -> "DataFrame":
    """The criteria as a table, one row each."""
    import pandas as pd

    columns = ("key", "what", "kind", "needed", "reached", "low", "high", "found", "cases", "status", "reasons")
    rows = [{**vars(c), "needed": c.needed_text, "reasons": "; ".join(c.reasons)} for c in criteria]
    return pd.DataFrame(rows, columns=columns)
