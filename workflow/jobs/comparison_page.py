"""Results of the comparison of spectrum methods and estimators: figures, ranking and recommendation."""

import textwrap
from pathlib import Path

import numpy as np
import xarray as xr

from jobs.shown import write_tables
from rotorstudy.presentation.pages import Table
from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, finished, label, save_figures
from rotorstudy.store import gathered, load, provenance, save
from rotorstudy.studies.comparison import ranking
from rotorstudy.studies.comparison.estimates import comparison as compared
from rotorstudy.studies.comparison.ranking import VALID, named
from rotorstudy.studies.config import file_name
from thesis.texts import page

ROW = 3  # panels side by side
PAGE_WIDTH = 7.0  # inches, two columns of a journal; text keeps its size in print
PLAIN = "regression"  # the spectrum method that estimators are compared with
LEAST = 0.02  # of the bound: smaller biases are drawn there, as the trials do not determine them
SHADES = ("#9ecae1", "#4a98c9", "#1764ab", "#08306b")  # light to dark with the noise
MARKS = ("o", "s", "^", "D")
SIDES = np.array([-1, 1])  # ends of an interval


def write_comparison(comparison, pictures, sheets, config, spectra, estimates, bias, index):
    """Write the comparison as NetCDF, its figures and its tables from the files "<rotor>/<method or estimator>.nc"."""
    names = {file_name(name): name for name in config.rotors}

    def loaded(paths):
        """(rotor, method) -> Dataset of all chunks."""
        found = {}
        for path in map(Path, paths):
            found.setdefault((names[path.parent.name], path.stem), []).append(load(path))
        return {key: gathered(parts, "fault") if len(parts) > 1 else parts[0] for key, parts in found.items()}

    whole = compared(loaded(estimates))
    save(whole.assign_attrs(provenance(config.model_dump(), [], config.seed), title=config.title), comparison)
    ranked = ranking.ranking(whole)
    advice = advice_table(ranked, {name: fault.use_if for name, fault in config.faults.items()})
    write_tables({"ranking": Table(ranked), "advice": advice}, sheets, index)
    errors = {key: data.harmonic_error for key, data in loaded(spectra).items()}
    biased = [(*key, data) for key, data in loaded(bias).items()]
    save_figures(comparison_figures(whole, errors, biased, config.trials), pictures)


def advice_table(ranked, use_if):
    """The Table of which methods to use for which fault; use_if : fault -> when to follow it."""
    told = ranking.with_words(ranking.advice(ranked), use_if)
    choices = ranking.in_sentences(told)
    first = choices.drop_duplicates(ranking.FIRST).drop(columns="equally good")
    limits = {"as_good": 100 * (ranking.AS_GOOD - 1), "seldom": 100 * ranking.SELDOM}
    limits |= {"lowest": 100 * VALID[0], "highest": 100 * VALID[1]}
    return page("advice", told, digits=3, shown={"First choice": first, "Up to three choices": choices}, **limits)


def comparison_figures(whole, harmonic_errors, biased, trials):
    """The figures of a comparison.

    whole           : of `studies.comparison.estimates.comparison`;  trials : behind each value with noise
    harmonic_errors : (rotor, spectrum method) -> DataArray (fault, noise), error over the rms of the vibration
    biased          : list of (rotor, estimator, Dataset of `studies.comparison.estimates.bias`)
    """
    level = 1.0 if 1.0 in whole.noise else float(whole.noise.max())
    return {
        "estimators": accuracy(whole, trials),
        "spectra": error_of_harmonics(whole, harmonic_errors, level),
        "faults": error_with_faults(whole, level),
        "coverage": coverage_with_faults(whole, level),
        "bias": bias_of_known_quantities(biased),
    }


def accuracy(whole, trials):
    """Scatter and bias of the parameter of an estimator farthest from its bound: a row of panels for each rotor."""
    drawn = whole.sel(spectrum_method=PLAIN, fault=whole.fault[0], noise=whole.noise > 0)
    mean = np.exp(np.log(drawn.efficiency**-0.5).mean("parameter")).max(["rotor", "noise"])
    drawn = drawn.isel(estimator=np.argsort(mean.fillna(np.inf).values))
    over, names = drawn.efficiency**-0.5, list(map(named, drawn.estimator.values))
    height, width = 0.19 * len(names) + 0.25, PAGE_WIDTH / 2
    picture, axes = figure(drawn.sizes["rotor"], 2, height, width, sharex="col", sharey=True)
    for (left, right), rotor in zip(axes, drawn.rotor.values, strict=True):
        worst = []
        for i in range(len(names)):
            one, error = drawn.sel(rotor=rotor).isel(estimator=i), over.sel(rotor=rotor).isel(estimator=i)
            if not np.isfinite(error).any():
                worst.append("fails")
                continue
            parameter = error.parameter[int(np.argmax(error.max("noise").fillna(0).values))]
            worst.append(label(parameter.values))
            _row((left, right), one.sel(parameter=parameter), i, trials)
        left.set_yticks(range(len(names)), names, fontsize=6.5)
        left.set_title(str(rotor), loc="left")
        beside = right.secondary_yaxis("right")
        beside.set_yticks(range(len(names)), worst, fontsize=6.5)
        beside.tick_params(length=0)
        left.set_ylim(len(names) - 0.5, -0.5)
    for axis, text in zip(axes[-1], ("scatter / bound, 95 % interval", "|bias| / bound, 95 % interval"), strict=True):
        axis.set_xlabel(text)
    axes[0, 1].set_title("worst parameter", loc="right", fontsize=6.5, x=1.25)
    for axis in axes.flat:
        axis.set_xscale("log")
        axis.xaxis.set_major_formatter("{x:g}")
        axis.axvline(1, color="0.4", linewidth=0.8, linestyle=":")
    axes[0, 1].set_xlim(left=LEAST)
    for n, level in enumerate(drawn.noise.values):
        axes[0, 0].plot([], [], **_of_level(n), linestyle="", markersize=3.5, label=f"{level:g} % noise")
    told = f"{names[0].capitalize()} comes closest to the Cramér-Rao bound: within {float(mean.min()):.2g} times it on "
    told += "all rotors and noise levels\n(geometric mean of the parameters); shown is the worst parameter of each "
    told += f"estimator (whole revolutions, plain {PLAIN})"
    return finished(picture, told, legend=drawn.sizes["noise"], size=8, frameon=False)


def _of_level(n):
    """Mark and colour of the n-th noise level."""
    return {"marker": MARKS[n % len(MARKS)], "color": SHADES[n % len(SHADES)]}


def _row(axes, one, i, trials):
    """Scatter and bias of one parameter at every noise level, in row i; one : Dataset (noise,)."""
    from scipy.stats import chi2

    bound = (one.rmse * one.efficiency**0.5).values
    count = np.maximum(trials * (1 - one.failed.values), 2)
    scatter, bias = one.scatter.values / bound, np.abs(one.bias.values) / bound
    low, high = (np.sqrt((count - 1) / chi2.ppf(share, count - 1)) * scatter for share in (0.975, 0.025))
    reach = 1.96 * scatter / np.sqrt(count)
    for n, place in enumerate(i + np.linspace(-0.3, 0.3, len(bound))):
        style = {**_of_level(n), "markersize": 2.5, "linewidth": 0.8}
        ends = np.maximum(bias[n] + reach[n] * SIDES, LEAST)
        for panel, at, interval in ((axes[0], scatter[n], [low[n], high[n]]), (axes[1], max(bias[n], LEAST), ends)):
            panel.plot(interval, [place] * 2, color=style["color"], linewidth=style["linewidth"])
            panel.plot(at, place, **style)


def error_of_harmonics(whole, harmonic_errors, level):
    """Error of the harmonics: a group for each fault, a point for each spectrum method."""
    methods = whole.spectrum_method.values
    rotors, by_method = whole.rotor.values, xr.Variable("spectrum_method", methods)
    errors = [xr.concat([harmonic_errors[one, m].sel(noise=level) for m in methods], by_method) for one in rotors]
    cost = _geometric_mean(xr.concat(errors, xr.Variable("rotor", rotors)), "rotor")
    cost = cost.transpose("fault", "spectrum_method")
    picture, ((axes,),) = figure(height=3.4)
    groups = np.arange(cost.sizes["fault"])
    for i, method in enumerate(methods):
        place = groups + 0.7 * (i / (len(methods) - 1 or 1) - 0.5)
        values = cost.sel(spectrum_method=method)
        axes.semilogy(place, values, MARKERS[i % len(MARKERS)], color=COLOURS[i % len(COLOURS)], label=named(method))
    axes.set_xticks(groups, [textwrap.fill(str(f), 11) for f in cost.fault.values], fontsize=6)
    axes.set_xticks(groups[1:] - 0.5, minor=True)
    axes.tick_params(axis="x", which="both", length=0)
    axes.grid(False, axis="x")
    axes.grid(True, axis="x", which="minor")  # lines between the groups
    axes.set_ylabel("error of harmonics / rms of vibration (1)")
    best = _starting(named(best_by_worst(cost)[0]))
    axes.set_title(f"{best} has the smallest error\nin its worst fault ({level:g} % noise)")
    return finished(picture, legend=3, fontsize=6, frameon=False, columnspacing=1, handletextpad=0.2)


def error_with_faults(whole, level):
    """Error over the Cramer-Rao bound of every pair of spectrum method and estimator, a panel for each fault."""
    from matplotlib.colors import LogNorm

    over = _geometric_mean(whole.sel(noise=level).efficiency ** -0.5, ["parameter", "rotor"])
    over = over.transpose("fault", "spectrum_method", "estimator")
    best = _starting(" with ".join(map(named, best_by_worst(over))))
    told = f"{best} has the smallest error in its worst fault ({level:g} % noise); dark: small"
    return _by_fault(over, LogNorm(1, 100, clip=True), "error / Cramér-Rao bound\n(mean of all rotors)", told)


def coverage_with_faults(whole, level):
    """Share of the stated 95 % intervals that hold the truth, of every pair, a panel for each fault."""
    from matplotlib.colors import Normalize

    covered = whole.sel(noise=level).coverage.mean(["parameter", "rotor"])
    covered = covered.transpose("fault", "spectrum_method", "estimator")
    valid = ((covered >= VALID[0]) & (covered <= VALID[1])).all("fault")
    told = f"{int(valid.sum())} of {valid.size} pairs state valid 95 % intervals with every fault ({level:g} % noise)"
    return _by_fault(covered, Normalize(0, 1), "share of intervals that hold\nthe truth; 0.95 is nominal", told)


def bias_of_known_quantities(biased):
    """Median error of the parameters against the error of a quantity held known, a panel for each rotor."""
    rotors = list(dict.fromkeys(rotor for rotor, *_ in biased))
    picture, axes = figure(1, len(rotors), height=3.0, width=PAGE_WIDTH / max(2, len(rotors)), sharey=True)
    costs = []
    for panel, rotor in zip(axes[0], rotors, strict=True):
        own = [part for part in biased if part[0] == rotor]
        for i, (_, estimator, data) in enumerate(own):
            # NaN where the estimator failed for one of the known quantities: a gap, not the error of the others
            error = abs(data.relative_error).isel(case=-1, estimator=0).max("known", skipna=False)
            error = 100 * error.median("parameter", skipna=False)
            panel.plot(data.percent, error, **_style(i, len(own)), label=named(estimator))
            lost = data.percent[np.isnan(error)]
            place = 0.97 - 0.05 * i  # of the height of the panel, a row an estimator
            style = {"color": COLOURS[i % len(COLOURS)], "transform": panel.get_xaxis_transform()}
            panel.plot(lost, np.full(len(lost), place), "x", **style)
            costs.append(error.where(abs(data.percent) == 1, drop=True))
        panel.set_yscale("symlog", linthresh=1)
        panel.yaxis.set_major_formatter("{x:g}")
        panel.set(title=rotor, xlabel="error of the known quantity (%)")
    axes[0, 0].set(ylim=(0, 300), ylabel="median error of the parameters (%)")
    axes[0, 0].plot([], [], "x", color="0.4", label="no estimate")
    costs, told = np.concatenate([c.values.ravel() for c in costs]), "A mass or stiffness held wrong"
    if np.isfinite(costs).any():
        told += f" by 1 % moves the parameters by {np.nanmin(costs):.1g} to {np.nanmax(costs):.1g} %"
    told += " (worst known quantity, no noise)"
    return finished(picture, told, legend=4, size=8, fontsize=7, frameon=False)


def best_by_worst(values):
    """Labels, of each dimension, of the smallest maximum over the faults; what fails with any is never the best."""
    worst = values.max("fault", skipna=False).fillna(np.inf)
    place = worst.argmin(...)
    return [str(worst[dim][int(index)].values) for dim, index in place.items()]


def _geometric_mean(values, dims):
    return np.exp(np.log(values).mean(dims))


def _style(i, count):
    """Colour, line and marker of curve i; later markers are smaller, so that coinciding curves remain visible."""
    return {
        "color": COLOURS[i % len(COLOURS)],
        "marker": MARKERS[i % len(MARKERS)],
        "linestyle": ("-", "--", ":")[i // len(COLOURS) % 3],
        "markersize": 7 - 4 * i / max(count - 1, 1),
        "fillstyle": "none",
        "linewidth": 0.9,
    }


def _by_fault(values, norm, label, told):
    """A panel of numbers and colours for each fault, and a spare one; values (fault, spectrum_method, estimator)."""
    count = values.sizes["fault"]
    columns = min(ROW, count + 1)
    picture, axes = figure(-(-(count + 1) // columns), columns, height=2.0, width=PAGE_WIDTH / columns)
    for unused in axes.flat[count:]:
        unused.axis("off")
    axes, spare = axes.flat[:count], axes.flat[count]
    for i, (a, fault) in enumerate(zip(axes, values.fault.values, strict=True)):
        image = _table(values.sel(fault=fault).transpose("estimator", "spectrum_method"), a, norm)
        a.set_title(fault)
        a.tick_params(labelbottom=i + ROW > len(axes), labelleft=i % ROW == 0)
    spare.set_xlim(axes[0].get_xlim())
    low = {"rotation": 90, "ha": "center", "va": "top", "fontsize": 6.5, "transform": spare.get_xaxis_transform()}
    for j, method in enumerate(values.spectrum_method.values):  # the columns of the panel above the spare one
        spare.text(j, 1.0, named(method), **low)
    scale = spare.inset_axes([0.0, 0.1, 1.0, 0.08])
    picture.colorbar(image, cax=scale, label=label, orientation="horizontal", format="{x:g}")
    scale.minorticks_off()
    return finished(picture, told, size=8)


def _table(values, axes, norm):
    """Numbers and colours over estimator and spectrum method; values (estimator, spectrum_method)."""
    image = axes.imshow(values, cmap="cividis", norm=norm, aspect="auto")
    for (i, j), value in np.ndenumerate(values.values):
        bright = norm(value) > 0.5
        axes.text(j, i, _shown(value), ha="center", va="center", fontsize=5.5, color="black" if bright else "white")
    names = [named(method) for method in values.spectrum_method.values]
    axes.set_xticks(range(len(names)), names, rotation=90, fontsize=6.5)
    axes.set_yticks(range(values.sizes["estimator"]), map(named, values.estimator.values), fontsize=6.5)
    axes.grid(False)
    return image


def _starting(text):
    """The text as the start of a sentence."""
    return text[:1].upper() + text[1:]


def _shown(value):
    """A number of a table: two digits, or one and a power of ten; "fails" for nan."""
    if np.isnan(value):
        return "fails"
    return f"{value:.2g}" if value < 99.5 else f"{value:.0f}" if value < 999.5 else f"{value:.0e}".replace("e+0", "e")
