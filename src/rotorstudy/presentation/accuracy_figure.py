"""Which estimator for which noise: scatter and bias of every estimator over the Cramer-Rao bound, a panel a rotor."""

import numpy as np

from rotorstudy.presentation.estimate_figures import label
from rotorstudy.presentation.plots import figure
from rotorstudy.studies.comparison.ranking import named

PAGE_WIDTH = 7.0  # inches, two columns of a journal; text keeps its size in print
PLAIN = "regression"  # the spectrum method that estimators are compared with
LEAST = 0.02  # of the bound: smaller biases are drawn there, as the trials do not determine them
SHADES = ("#9ecae1", "#4a98c9", "#1764ab", "#08306b")  # light to dark with the noise
MARKS = ("o", "s", "^", "D")


def accuracy(whole, trials):
    """Scatter (left) and bias (right) of the worst parameter of every estimator: a row of panels for each rotor.

    Records of whole revolutions, by `PLAIN`. The worst parameter of an estimator on a rotor is that with the largest
    error over its bound at any noise level.
    """
    drawn = whole.sel(spectrum_method=PLAIN, fault=whole.fault[0], noise=whole.noise > 0)
    over = drawn.efficiency**-0.5
    mean = np.exp(np.log(over).mean("parameter")).max(["rotor", "noise"])
    order = np.argsort(mean.fillna(np.inf).values)
    drawn, over = drawn.isel(estimator=order), over.isel(estimator=order)
    names = list(map(named, drawn.estimator.values))
    picture, axes = figure(
        drawn.sizes["rotor"], 2, height=0.19 * len(names) + 0.25, width=PAGE_WIDTH / 2, sharex="col", sharey=True
    )
    for row, rotor in zip(axes, drawn.rotor.values, strict=True):
        here, worst = drawn.sel(rotor=rotor), []
        for i in range(len(names)):
            one, error = here.isel(estimator=i), over.sel(rotor=rotor).isel(estimator=i)
            if not np.isfinite(error).any():
                worst.append("fails")
                continue
            parameter = error.parameter[int(np.argmax(error.max("noise").fillna(0).values))]
            worst.append(label(parameter.values))
            _row(row, one.sel(parameter=parameter), i, trials)
        row[0].set_yticks(range(len(names)), names, fontsize=6.5)
        row[0].set_title(str(rotor), loc="left")
        right = row[1].secondary_yaxis("right")
        right.set_yticks(range(len(names)), worst, fontsize=6.5)
        right.tick_params(length=0)
        row[0].set_ylim(len(names) - 0.5, -0.5)
    for axis, text in zip(axes[-1], ("scatter / bound, 95 % interval", "|bias| / bound, 95 % interval"), strict=True):
        axis.set_xlabel(text)
    axes[0, 1].set_title("worst parameter", loc="right", fontsize=6.5, x=1.25)
    for axis in axes.flat:
        axis.set_xscale("log")
        axis.xaxis.set_major_formatter("{x:g}")
        axis.axvline(1, color="0.4", linewidth=0.8, linestyle=":")
    axes[0, 1].set_xlim(left=LEAST)
    _legend(picture, axes[0, 0], drawn.noise.values)
    least = float(mean.min())
    picture.suptitle(
        f"{names[0].capitalize()} comes closest to the Cramér-Rao bound: within {least:.2g} times it on all rotors and "
        "noise levels\n(geometric mean of the parameters); shown is the worst parameter of each estimator "
        f"(whole revolutions, plain {PLAIN})",
        fontsize=8,
    )
    return picture


def _row(axes, one, i, trials):
    """Scatter and bias of one parameter at every noise level, in row i; one : Dataset (noise,)."""
    from scipy.stats import chi2

    bound = (one.rmse * one.efficiency**0.5).values
    count = np.maximum(trials * (1 - one.failed.values), 2)
    scatter, bias = one.scatter.values / bound, np.abs(one.bias.values) / bound
    low, high = (np.sqrt((count - 1) / chi2.ppf(share, count - 1)) * scatter for share in (0.975, 0.025))
    reach = 1.96 * scatter / np.sqrt(count)
    place = i + np.linspace(-0.3, 0.3, len(bound))
    for n in range(len(bound)):
        style = {"marker": MARKS[n % len(MARKS)], "color": SHADES[n % len(SHADES)], "markersize": 2.5, "linewidth": 0.8}
        axes[0].plot([low[n], high[n]], [place[n]] * 2, color=style["color"], linewidth=style["linewidth"])
        axes[0].plot(scatter[n], place[n], **style)
        ends = np.maximum([bias[n] - reach[n], bias[n] + reach[n]], LEAST)
        axes[1].plot(ends, [place[n]] * 2, color=style["color"], linewidth=style["linewidth"])
        axes[1].plot(max(bias[n], LEAST), place[n], **style)


def _legend(picture, axis, levels):
    """The noise level of each mark."""
    handles = [
        axis.plot([], [], MARKS[n % len(MARKS)], color=SHADES[n % len(SHADES)], markersize=3.5)[0]
        for n in range(len(levels))
    ]
    texts = [f"{level:g} % noise" for level in levels]
    picture.legend(handles, texts, loc="outside lower center", ncols=len(levels), frameon=False)
