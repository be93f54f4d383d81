"""Figures of the errors of estimates, by noise and by wrong known quantities; arguments as in `estimate_figures`."""

import numpy as np

from rotorstudy.presentation.estimate_figures import MANY, error_unit, in_units, label
from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, plain_log

HIGHEST = 8.5  # inches, of all rows of panels: shown at half its size the figure fits in a window
WIDEST = 8.0  # inches; a wider figure is hard to read in a column of text
LEAST = 1e-3  # smaller errors by a wrong known quantity are drawn here


def error_against_noise(noisy, units, title):
    """Rms error of every estimator over the noise, with the bound; noisy : title -> Monte Carlo Dataset."""
    columns = [(name, model) for name, data in noisy.items() for model in data.noise_model.values]
    if next(iter(noisy.values())).sizes["parameter"] > MANY:
        return _error_over_bound(noisy, columns, title)
    picture, panels = _panels(noisy, columns)
    for (name, model), column in zip(columns, panels, strict=True):
        data = noisy[name].sel(noise_model=model)
        for panel, parameter in zip(column, data.parameter.values, strict=True):
            true, unit = float(data.true.sel(parameter=parameter)), units[parameter]
            for i, estimator in enumerate(data.estimator.values):
                error = data.estimate.sel(estimator=estimator, parameter=parameter) - true
                rms = in_units(unit, np.sqrt((error**2).mean("trial")), true)
                text = str(estimator).replace("_", " ")
                panel.loglog(data.noise, rms, MARKERS[i] + "-", color=COLOURS[i], label=text)
            bound = in_units(unit, data.cramer_rao.sel(parameter=parameter), true)
            panel.loglog(data.noise, bound, "k--", label="Cramér-Rao bound")
            if len(columns) == 1 or column is panels[0]:
                panel.set_ylabel(f"{label(parameter)}\nrms error ({error_unit(unit)})")
            plain_log(panel, data.noise.values)
            if len(columns) == 1 or panel is column[-1]:
                panel.set_xlabel("noise level (%)")
        column[0].set_title(f"{name}\nnoise {model}")
    picture.legend(*panels[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    picture.suptitle(title)
    return picture


def _panels(noisy, columns):
    """A figure, and for each column its panels: a column each, or rows of three if there is only one."""
    count = next(iter(noisy.values())).sizes["parameter"]
    if len(columns) > 1:
        picture, axes = figure(
            count, len(columns), height=min(1.7, HIGHEST / count), width=min(2.6, WIDEST / len(columns))
        )
        return picture, list(axes.T)
    picture, axes = figure(-(-count // 3), 3, height=2.0, width=2.4)
    for unused in axes.flat[count:]:
        unused.axis("off")
    return picture, [axes.flat[:count]]


def _error_over_bound(noisy, columns, title):
    """Rms error over the Cramer-Rao bound: a row a parameter, from the lowest to the highest noise level."""
    first = next(iter(noisy.values()))
    names = [label(parameter) for parameter in first.parameter.values]
    picture, axes = figure(1, len(columns), height=0.24 * len(names) + 1.2, width=3.4, sharey=True)
    for panel, (name, model) in zip(axes[0], columns, strict=True):
        data = noisy[name].sel(noise_model=model)
        rms = np.sqrt(((data.estimate - data.true) ** 2).mean("trial"))
        over = (rms / data.cramer_rao).transpose("estimator", "parameter", "noise")
        for i, estimator in enumerate(data.estimator.values):
            _dumbbells(
                panel,
                over.isel(estimator=i).values[:, [0, -1]],
                i,
                over.sizes["estimator"],
                str(estimator).replace("_", " "),
            )
        panel.set_xscale("log")
        panel.xaxis.set_major_formatter("{x:g}")
        panel.axvline(1, color="k", linewidth=0.8, linestyle=":")
        panel.set_title(f"{name}\nnoise {model}")
        low, high = data.noise.values[[0, -1]]
        panel.set_xlabel(f"rms error / Cramér-Rao bound\n(filled: {low:g} % noise, open: {high:g} %)")
    axes[0, 0].set_yticks(range(len(names)), names)
    axes[0, 0].set_ylim(len(names) - 0.5, -0.5)
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    picture.suptitle(title)
    return picture


def bias(bias_data, cases, units, title):
    """Error of estimates by quantities wrong by 1 % and by the most that was tried; cases : name -> name shown."""
    parameters, known = bias_data.parameter.values, bias_data.known.values
    size = np.abs(bias_data.percent)
    ends = [1.0, float(size.max())]
    picture, axes = figure(
        1, len(known), height=0.3 * len(parameters) + 1.3, width=max(7.0 / len(known), 2.2), sharey=True
    )
    rows = [(c, e) for c in range(len(cases)) for e in range(bias_data.sizes["estimator"])]
    for panel, quantity in zip(axes[0], known, strict=True):
        for i, (c, e) in enumerate(rows):
            case, shown = list(cases.items())[c]
            error = np.abs(bias_data.relative_error.sel(known=quantity, case=case).isel(estimator=e))
            worst = np.stack([error.where(size <= end + 1e-9).max("percent").values for end in ends], axis=-1)
            scale = np.array([in_units(units[parameter], 1.0, 1.0) for parameter in parameters])
            text = f"{shown}, {str(bias_data.estimator.values[e]).replace('_', ' ')}"
            _dumbbells(panel, np.maximum(worst * scale[:, None], LEAST), i, len(rows), text)
        panel.set_xscale("log")
        panel.set_title(f"{known_name(str(quantity))} wrong")
    names = [label(p) + (" (°)" if error_unit(units[p]) == "°" else "") for p in parameters]
    axes[0, 0].set_yticks(range(len(names)), names)
    axes[0, 0].set_ylim(len(names) - 0.5, -0.5)
    clipped = f"\nsmaller ones at {LEAST:g}" if min(panel.get_xlim()[0] for panel in axes[0]) < LEAST else ""
    axes[0, 0].set_xlabel(f"largest error of the estimate (%; phases: °){clipped}")
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    picture.suptitle(f"{title}\n(filled: known quantity {ends[0]:g} % wrong, open: {ends[1]:g} %)")
    return picture


def _dumbbells(panel, values, i, count, text):
    """A line from a filled to an open mark in each row; values (row, 2), of the i-th of `count` beside each other."""
    place = np.arange(len(values)) + 0.6 * ((i + 0.5) / count - 0.5)
    style = {"color": COLOURS[i % len(COLOURS)]}
    mark = MARKERS[i % len(MARKERS)]
    panel.hlines(place, *values.T, color=style["color"], linewidth=0.8)
    panel.plot(values[:, 0], place, mark, markersize=5, label=text, **style)
    panel.plot(values[:, 1], place, mark, markersize=3, markerfacecolor="white", **style)


def known_name(key):
    """mass_kg -> mass, youngs_modulus_Pa -> Young's modulus: the unit left out."""
    *inside, name = key.split(".")
    name = name.split("_per_")[0]
    name = name.rsplit("_", 2 if name.endswith("kg_m2") else 1)[0].replace("_", " ").replace("youngs", "Young's")
    return f"{name} of {inside[0].removesuffix('s')} {int(inside[1]) + 1}" if inside else name
