"""What a run of benchmarks/foreign.py shows: shares with 95 % bounds, and counts by kind of case."""

import numpy as np
import pandas as pd

from rotorstudy.blind.scoring import calibration, share_bounds

LARGE = 3.0  # size from which an effect must be found
IMPROBABLE = 0.05  # probability by which noise raises the error at held-out speeds although the causes are right
DRAWN = 500  # sets of answers, right with the probability stated
PAIRS, CRACKS = ("pair", "form_pair"), ("crack", "open_crack", "crack_form", "open_crack_form")
ANGLE, PLACE = 10.0, 0.05  # errors of a crack that is found: degrees, share of the length of the shaft
SLOW = 30.0  # seconds of one core, above which a diagnosis is counted as slow


def share(what, of, right, asked=""):
    """A row of the summary: the share of some cases that is right, with 95 % bounds, and the share asked for."""
    right = np.asarray(right, bool)
    count, cases = int(right.sum()), len(of)
    low, high = share_bounds(count, cases)
    return {
        "what": what,
        "value": count / cases if cases else np.nan,
        "low": low,
        "high": high,
        "cases": cases,
        "asked": asked,
    }


def summary(rows):
    """The shares that count, with 95 % bounds."""
    done = rows[~rows.verdict.isin(["not drawn", "refused", "crashed"])]
    refused = rows[rows.verdict == "refused"]
    healthy, single = done[done.kind == "healthy"], done[~done.kind.isin(["healthy", *PAIRS])]
    known = single[single.known.astype(bool) & (single["size"] >= LARGE)]
    outside = single[~single.known.astype(bool) & (single["size"] >= LARGE)]
    cracks = single[single.kind.isin(CRACKS) & single.known.astype(bool) & (single["size"] >= LARGE)]
    named_cracks = cracks[cracks.alone.astype(bool)]
    pairs = done[done.kind.isin(PAIRS) & (done["size"] >= LARGE)]
    hidden = pairs.get("beside", pd.Series(np.nan, pairs.index)) < LARGE  # nobody could name it; not known of old runs
    stated = done[done.probability.notna()]
    held = done[done.gain.notna()]
    large = held[held["size"] >= LARGE]
    held_sizes = np.arange(int(done.sizes.sum())) < int(done.covered.sum())
    probability = stated.probability.to_numpy(float)
    error = calibration(probability, stated.first_right.to_numpy(float))[-1]
    rows = [
        share("single effects named alone at the right place", known, known.alone, ">= 80 %"),
        share("single effects in the stated set", known, known.in_set, ">= 95 %"),
        share("single effects called unknown", known, known.verdict == "unknown"),
        share("single effects called nothing", known, known.verdict == "nothing"),
        share("single effects given a wrong name", known, known.wrong, "<= 2 %"),
        share("cracks named, element within one", cracks, cracks.alone, ">= 80 %"),
        share("cracks in the stated set", cracks, cracks.in_set),
        share("angle of a named crack within 10 degrees", named_cracks, named_cracks.angle_right, "all"),
        *of_forms(known, pairs[~hidden]),
        share("pairs, both in the stated set", pairs[~hidden], pairs.in_set[~hidden], ">= 80 %"),
        share("pairs of which one is below size 3 beside the other", pairs[hidden], pairs.in_set[hidden]),
        share("clean records called nothing", healthy, healthy.verdict == "nothing", ">= 99 %"),
        share("effects left out of the library called unknown", outside, outside.verdict == "unknown", ">= 95 %"),
        share("effects left out of the library named alone", outside, outside.verdict == "cause"),
        share("95 % intervals that hold the true size", held_sizes, held_sizes, "93 to 97 %"),
        share("held-out error worse with the causes", held, held.gain > 1, "<= 1 %"),
        share("the same, of effects of size 3 or more", large, large.gain > 1),
        *improbable_rise(held),
        share("records refused for the right reason", refused, refused.alone),
        share("diagnoses that crashed", rows, rows.verdict == "crashed", "none"),
        share(f"diagnoses slower than {SLOW:g} s of one core", done, done.seconds > SLOW, "none"),
    ]
    by_noise = held.rise_probability.mean() if "rise_probability" in held else np.nan
    numbers = [
        ("share of held-out errors that noise alone would make worse", by_noise, len(held), ""),
        ("held-out error after over before, median", held.gain.median(), len(held), "<= 0.1"),
        ("calibration error of the stated probability", error, len(stated), "<= 0.05"),
        ("the same by chance alone, if it were exact", by_chance(probability), len(stated), ""),
        ("seconds of one core for a diagnosis, median", done.seconds.median(), len(done), ""),
    ]
    return pd.DataFrame(rows + [dict(zip(("what", "value", "cases", "asked"), one, strict=True)) for one in numbers])


def of_forms(known, pairs):
    """Rows on faults whose form is not the library's; none where there are none."""
    forms = known[known.kind.str.endswith("_form")]
    if not len(forms):
        return []
    cracks = forms[forms.kind.isin(CRACKS)]
    named = cracks[cracks.alone.astype(bool)]
    placed, angled = named[named.place_error.notna()], named[named.angle_error_deg.notna()]
    held, pairs = named[named.flexibility_held.notna()], pairs[pairs.kind == "form_pair"]
    return [
        share("single effects of another form named alone", forms, forms.alone, ">= 85 %"),
        share("single effects of another form in the stated set", forms, forms.in_set, ">= 95 %"),
        share("single effects of another form given a wrong name", forms, forms.wrong, "<= 1 %"),
        share("cracks of another form named", cracks, cracks.alone, ">= 85 %"),
        share("cracks of another form in the stated set", cracks, cracks.in_set),
        share("named: place within 5 % of the shaft", placed, placed.place_error <= PLACE, "all"),
        share("named: angle within 10 degrees", angled, angled.angle_error_deg.abs() <= ANGLE, "all"),
        share("named: interval that holds the true flexibility", held, held.flexibility_held, "90 to 97 %"),
        share("pairs, one of another form, both in the stated set", pairs, pairs.in_set, ">= 80 %"),
    ]


def improbable_rise(held):
    """Rows on the error at held-out speeds that weigh it by its noise; none for cases of a version without these."""
    if "rise_probability" not in held:
        return []
    return [
        share("the same, in standard deviations", held, held.gain_sigma > 1),
        share("the same, where that is improbable", held, (held.gain > 1) & (held.rise_probability < IMPROBABLE)),
    ]


def by_chance(probability):
    """Median calibration error of so few cases whose stated probabilities (case,) are exact."""
    random = np.random.default_rng(0)
    drawn = random.random((DRAWN, len(probability))) < probability
    return float(np.median([calibration(probability, right.astype(float))[-1] for right in drawn]))


def by_kind(rows):
    """Counts of each kind of case, for sizes of at least LARGE (all healthy ones)."""
    seen = rows[(rows.kind == "healthy") | ~(rows["size"] < LARGE)]
    table = seen.groupby("kind", sort=False).agg(
        cases=("case", "size"), alone=("alone", "sum"), in_set=("in_set", "sum"), wrong=("wrong", "sum"),
        seconds=("seconds", "median"),
    )  # fmt: skip
    for verdict in ("nothing", "cause", "ambiguous", "unknown", "convention", "refused", "crashed", "not drawn"):
        table[verdict] = seen.groupby("kind").verdict.agg(lambda said, v=verdict: int((said == v).sum()))
    return table
