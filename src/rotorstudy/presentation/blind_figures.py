"""Figures of a blind test, from its Dataset."""

import numpy as np

from rotorstudy.blind.criteria import LARGE
from rotorstudy.blind.glance import ANSWERS
from rotorstudy.presentation.plots import COLOURS, MARKERS, figure

NOMINAL = 0.95  # coverage of an interval


def blind_figures(data):
    """The figures of a blind test."""
    return {
        "curves": curves(data),
        "confusion": confusion(data),
        "calibration": calibration(data),
        "coverage": coverage(data),
        "gain": gain(data),
    }


def answers_figure(answers):
    """The five answers, a point with 95 % bounds for each source of the truth; answers : rows of `glance.counted`."""
    picture, axes = figure(1, 1, height=2.6, width=6.4)
    axes = axes[0, 0]
    sources = list(dict.fromkeys(answers.source))
    for i, source in enumerate(sources):
        rows = answers[(answers.source == source) & (answers.cases > 0)]
        place = np.array([list(ANSWERS).index(key) for key in rows.answer]) + 0.3 * (i - (len(sources) - 1) / 2)
        reach = 100 * np.array([rows.share - rows.low, rows.high - rows.share])
        style = {"fmt": MARKERS[i], "color": COLOURS[i], "capsize": 2, "label": source}
        axes.errorbar(100 * rows.share, place, xerr=reach, **style)
        for y, row in zip(place, rows.itertuples(), strict=True):
            axes.text(103, y, f"{row.found} of {row.cases}", va="center", fontsize=7, color=COLOURS[i])
    axes.set_yticks(range(len(ANSWERS)), [name for name, _ in ANSWERS.values()])
    axes.set(xlim=(-2, 118), ylim=(len(ANSWERS) - 0.4, -0.6), xlabel="share of cases (%), with 95 % bounds")
    axes.set_xticks(range(0, 101, 20))
    right = answers[(answers.answer == "in_set") & (answers.cases > 0)]
    told = " and ".join(f"{row.found} of {row.cases}" for row in right.itertuples()) or "no case"
    picture.suptitle(f"The hidden effect is named or not ruled out in {told}", fontsize=8)
    picture.legend(loc="outside lower center", ncols=2, frameon=False)
    return picture


def _percent(share):
    return f"{100 * share:.0f} %" if np.isfinite(share) else "no case"


def curves(data):
    """Completeness and reliability over the size of the effect."""
    picture, axes = figure(1, 1, height=2.8, width=4.2)
    axes = axes[0, 0]
    for i, name in enumerate(("completeness", "reliability")):
        there = data[f"{name}_cases"].values > 0
        part = data.isel(size_bin=there)
        centre = part[name].values
        error = np.abs([centre - part[f"{name}_low"].values, part[f"{name}_high"].values - centre])
        place = part.size_bin.values * (1.03 if i else 0.97)
        axes.errorbar(place, centre, error, color=COLOURS[i], fmt=f"-{MARKERS[i]}", capsize=2, label=name)
    axes.axhline(0.95, color="0.5", linewidth=0.8, linestyle=":")
    axes.axvline(LARGE, color="0.5", linewidth=0.8, linestyle=":")
    axes.set(xscale="log", ylim=(-0.03, 1.03), ylabel="share of cases, 95 % bounds")
    axes.set_xticks([1, 3, 10, 30, 100], ["1", "3", "10", "30", "100"])
    axes.set_xlabel("size of the effect in standard deviations (1)")
    found = data.sel(criterion="in_set")
    low, high = (100 * float(found[f"criterion_{end}"]) for end in ("low", "high"))
    said = f"{_percent(float(found.criterion_reached))} ({low:.0f} to {high:.0f}, {int(found.criterion_cases)} cases)"
    picture.suptitle(f"In the stated set at size 3 and more: {said}", fontsize=8)
    axes.legend(loc="lower right")
    return picture


def confusion(data):
    """Counts of answers by truth; right answers and declared confounders boxed."""
    from matplotlib.patches import Rectangle

    rows, columns = (np.flatnonzero(data.confusion.values.sum(axis=axis)) for axis in (1, 0))
    data = data.isel(truth=rows, answer=columns)
    truths, answers, counts = data.truth.values, data.answer.values, data.confusion.values
    whole = np.maximum(counts.sum(axis=1, keepdims=True), 1)
    width, height = 0.19 * len(answers) + 1.6, 0.19 * len(truths) + 1.9
    picture, axes = figure(1, 1, height=height, width=width)
    axes = axes[0, 0]
    axes.grid(False)
    axes.imshow(counts / whole, cmap="Blues", vmin=0, vmax=3, aspect="auto")  # tinted: a count is read, not guessed
    for i, j in zip(*np.nonzero(counts), strict=True):
        axes.text(j, i, counts[i, j], ha="center", va="center", fontsize=7)
    for i, j in zip(*np.nonzero(data.accepted.values), strict=True):
        right = data.accepted.values[i, j] == 1
        style = {"edgecolor": "k", "linewidth": 1.2} if right else {"edgecolor": "#E69F00", "linewidth": 0.9}
        axes.add_patch(Rectangle((j - 0.5, i - 0.5), 1, 1, fill=False, linestyle="-" if right else "--", **style))
    axes.set_xticks(range(len(answers)), list(map(_called, answers)), rotation=90)
    axes.set_yticks(range(len(truths)), list(map(_called, truths)))
    axes.set(xlabel="first answer", ylabel="hidden")
    share = counts[data.accepted.values == 1].sum() / max(counts.sum(), 1)
    dashed = "; dashed: a declared confounder" * bool((data.accepted.values == 2).any())
    axes.set_title(f"First answer right (boxed) in {_percent(share)} of cases{dashed}")
    return picture


def _called(effect):
    """ac_coupling -> AC coupling."""
    return str(effect).replace("_", " ").replace("ac coupling", "AC coupling")


def calibration(data):
    """Share of true causes over their stated posterior probability."""
    picture, axes = figure(1, 1, height=2.8)
    axes = axes[0, 0]
    part = data.isel(probability_bin=data.probability_cases.values > 0)
    right = part.share_right.values
    error = np.abs([right - part.share_right_low.values, part.share_right_high.values - right])
    axes.plot([0, 1], [0, 1], color="0.5", linewidth=0.8, linestyle=":", label="calibrated")
    axes.errorbar(part.stated_probability, right, error, fmt="-o", color=COLOURS[0], capsize=2, label="observed")
    for x, y, n in zip(part.stated_probability.values, right, part.probability_cases.values, strict=True):
        axes.annotate(int(n), (x, y), textcoords="offset points", xytext=(-4, -9), fontsize=6, ha="right")
    axes.set(xlim=(0, 1.03), ylim=(0, 1.03), ylabel="share that is true")
    axes.set_xlabel("stated posterior probability of the first cause")
    axes.set_title(f"Stated probabilities are off by {float(data.calibration_error):.2f} on average")
    axes.legend()
    return picture


def coverage(data):
    """Truth inside the stated set, and intervals that hold the truth."""
    picture, axes = figure(1, 1, height=2.6, width=4.4)
    axes = axes[0, 0]
    part = data.isel(criterion=((data.criterion_kind == "coverage") & (data.criterion_cases > 0)).values)
    value = part.criterion_reached.values
    error = np.abs([value - part.criterion_low.values, part.criterion_high.values - value])
    axes.errorbar(value, np.arange(len(value)), xerr=error, fmt="o", color=COLOURS[0], capsize=2)
    axes.axvline(NOMINAL, color="0.5", linewidth=0.8, linestyle=":")
    axes.set_yticks(range(len(value)), [str(what) for what in part.criterion_what.values])
    axes.set_ylim(-0.6, len(value) - 0.4)
    axes.set_xlabel("share, 95 % bounds")
    below = int((part.criterion_high.values < NOMINAL).sum())
    picture.suptitle(f"Coverage is below 95 % in {below} of {len(value)} rows, by their 95 % bounds", fontsize=8)
    return picture


def gain(data):
    """Distribution of the error on held-out speeds, after over before."""
    picture, axes = figure(1, 1, height=2.6, width=4.2)
    axes = axes[0, 0]
    states = np.isfinite(data.case_probability.values)
    large = (data.case_known.values == 1) & (data.case_size.values >= LARGE) & states
    for i, (name, label) in enumerate(
        (("gain_true", "against the signal without noise"), ("gain", "against the measurement"))
    ):
        values = np.sort(data[f"case_{name}"].values[large])
        values = values[np.isfinite(values)]
        share = (np.arange(len(values)) + 0.5) / max(len(values), 1)
        axes.plot(values, share, color=COLOURS[i], linestyle=("-", "--")[i], label=label)
    axes.axvline(0.1, color="0.5", linewidth=0.8, linestyle=":")
    axes.axvline(1, color="0.5", linewidth=0.8)
    axes.set(
        xscale="log", ylim=(0, 1), xlabel="error on held-out speeds, after over before (1)", ylabel="share of cases"
    )
    axes.legend(loc="lower right", fontsize=6)
    found = data.sel(criterion="gain")
    left = f"median ratio {float(found.criterion_reached):.2g}" if found.criterion_cases else "no case"
    picture.suptitle(f"Error of the extended over that of the base model: {left}", fontsize=8)
    return picture
