"""What a run of benchmarks/cracks.py shows: shares with 95 % bounds, and the page."""

from itertools import pairwise

import numpy as np
import pandas as pd

from rotorstudy.blind.scoring import share_bounds

SIZES = ("position_m", "depth_ratio", "angle_rad")
DEPTH = 0.15  # relative
PLACE = 0.05  # of the length
ANGLE = np.deg2rad(10)
INTERVAL = 1.96  # standard deviations of a 95 % interval
EXPLAINED = 1e-3  # p-value from which no warning is given
VISIBLE = 0.01
SECONDS = 10.0
BINS = (0.05, 0.1, 0.2, 0.3, 0.4)  # of the depth over the diameter


def is_right(errors: dict, true: dict) -> bool:
    """Whether the errors of position (m), depth and angle (rad) of a crack are small enough."""
    return bool(
        abs(errors["depth_ratio"]) <= DEPTH * true["depth_ratio"]
        and abs(errors["position_m"]) <= PLACE * true["length_m"]
        and abs(errors["angle_rad"]) <= ANGLE
    )


def judged(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows with `depth_right`, `place_right`, `angle_right`, `all_right`; without an answer they are wrong."""
    rows = rows.copy()
    rows["depth_right"] = np.abs(rows.depth_ratio_error) <= DEPTH * rows.true_depth_ratio
    rows["place_right"] = np.abs(rows.position_m_error) <= PLACE * rows.true_length_m
    rows["angle_right"] = np.abs(rows.angle_rad_error) <= ANGLE
    rows["all_right"] = rows.depth_right & rows.place_right & rows.angle_right
    return rows


def share(what, right, asked=""):
    """A row of the summary: the share that is right, with 95 % bounds, and the share asked for."""
    right = np.asarray(right, bool)
    low, high = share_bounds(int(right.sum()), len(right))
    return {"what": what, "value": right.mean() if len(right) else np.nan, "low": low, "high": high,
            "cases": len(right), "asked": asked}  # fmt: skip


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """The shares that count, with 95 % bounds; cases that could not be drawn are left out."""
    rows = judged(rows[~rows.outcome.str.startswith("not drawn")])
    cracks, slots = rows[rows.kind == "crack"], rows[rows.kind == "slot"]
    answered = cracks[(cracks.outcome == "done") & (cracks.p_value >= EXPLAINED)]
    held = [answered[f"{name}_held"].astype(bool) for name in SIZES]
    found = [
        share("depth within 15 %, place within 5 %, angle within 10 degrees", cracks.all_right, ">= 85 %"),
        share(
            "of the cracks that change a harmonic by 1 % of 1X or more, all three",
            cracks.all_right[cracks.change >= VISIBLE],
        ),
        share("of the answers without a warning, all three", answered.all_right),
        share("all three, at the best place or another one stated", cracks.stated_right.fillna(False)),
        share("answers with another place beside the best", answered.stated > 1),
        share("depth within 15 %", cracks.depth_right),
        share("place within 5 % of the length", cracks.place_right),
        share("angle within 10 degrees", cracks.angle_right),
        share("95 % intervals of depth, place and angle that hold the truth", np.concatenate(held), "93 to 97 %"),
        share("breathing law right", cracks.law_right.fillna(False)),
        share("slots said to open and close", slots.breathing.fillna("none") != "none", "<= 2 %"),
        share("identified in 10 s of one core or less", rows.seconds <= SECONDS, "all"),
    ]
    for low, high in pairwise(BINS):
        here = cracks[(cracks.true_depth_ratio >= low) & (cracks.true_depth_ratio < high)]
        found.append(share(f"all three right, depth {100 * low:.0f} to {100 * high:.0f} %", here.all_right))
    if "verdict" in rows:
        told = rows[rows.verdict.notna()]
        crack, slot = told[told.kind == "crack"], told[told.kind == "slot"]
        alone = (crack.verdict == "cause") & (crack.named == "transverse_crack")
        near = np.abs(crack.verdict_position_error) <= PLACE * crack.true_length_m
        stated = crack[crack.verdict_depth.notna()]
        found += [
            share("diagnosed with the whole library: crack named alone, place within 5 %", alone & near),
            share("diagnosed: 95 % intervals that hold the depth",
                  (stated.verdict_low <= stated.true_depth_ratio) & (stated.true_depth_ratio <= stated.verdict_high),
                  "90 to 97 %"),
            share("diagnosed: slots called a crack that opens and closes",
                  slot.verdict_breathing.isin(["gradual", "sudden"]), "<= 2 %"),
        ]  # fmt: skip
    return pd.DataFrame(found)


def page(rows: pd.DataFrame) -> str:
    """The numbers as a Markdown table."""
    slots = int((rows.kind == "slot").sum())
    lines = [
        f"{len(rows)} records, {len(rows) - slots} cracks and {slots} slots, seeds {rows.seed.min()} to "
        f"{rows.seed.max()}, each used once ([`crack_records.csv`](crack_records.csv)).",
        "",
    ]
    lines += ["| | reached | 95 % bounds | cases | asked |", "|---|---|---|---|---|"]
    for one in summary(rows).itertuples():
        value = "-" if np.isnan(one.value) else f"{100 * one.value:.0f} %"
        lines.append(
            f"| {one.what} | {value} | {100 * one.low:.0f} to {100 * one.high:.0f} % | {one.cases} | {one.asked} |"
        )
    seconds = rows.seconds.dropna()
    lines += ["", f"One core, median {seconds.median():.1f} s, largest {seconds.max():.1f} s for an identification."]
    return "\n".join(lines) + "\n"
