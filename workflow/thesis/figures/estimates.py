"""Figures of the accuracy of estimates. Each function takes results and returns a matplotlib figure.

study : `study.Study`;  units : reported name of a parameter -> its unit;  phases are shown in degrees, all others in
per cent of their value
"""

from itertools import product

import numpy as np

from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, label
from rotorstudy.store import as_complex
from rotorstudy.studies.analyses import AS_IT_IS, first_crack

STYLES = ("-", "--", ":", "-.")  # of speeds
MANY = 8  # parameters: figures of more have another layout or fewer labels
MOST_CURVES = 6  # with a colour of their own
NO_ERROR = 0.01  # percent, too small for a curve


def error_unit(unit):
    """The unit in which errors of a parameter of some unit are shown."""
    return "°" if unit == "rad" else "%"


def in_units(unit, error, true):
    """An error (SI) in the unit in which it is shown; true : value it is relative to."""
    return np.rad2deg(error) if unit == "rad" else error * 100 / abs(true)


def speed_name(speed):
    """A speed in the words of the studies: 20 Hz where it is a whole frequency, else 88 rad/s (14.0 Hz)."""
    frequency = speed / (2 * np.pi)
    if abs(frequency - round(frequency)) < 1e-6:
        return f"{frequency:.0f} Hz"
    return f"{speed:.0f} rad/s ({frequency:.1f} Hz)"


def named_cases(study, cases):
    """Case -> its name in a figure, by default its own."""
    return cases or {case: case for case in study.config.cases}


def weight_dominance(study, title, cases=None):
    """A crack on the static deflection alone: amplitude ratio at the shown speeds, error of the first of the cases."""
    config, dominance = study.config, study.results["weight_dominance"]
    case, shown = next(iter(named_cases(study, cases).items()))
    picture, axes = figure(1, 2, height=2.8)
    amplitude = np.abs(as_complex(dominance.displacement))
    ratio = amplitude[1] / amplitude[0]
    speeds = [speed_name(w) for w in config.shown_speeds_rad_s]
    crack = config.rigs[config.main_rig]["cracks"][0]
    model = config.rig(config.main_rig)
    losses = model.structure.stiffness_loss_at(crack.get("node"), crack.get("element"))
    name, (pattern, _, _) = next(iter(losses.items()))
    loss = first_crack(config, config.main_rig).values[name] * dominance.crack_scale.values
    percent, unit = loss / np.sum(pattern * model.structure.stiffness) * 100, "%"
    if not model.structure.is_supported:  # a share of the stiffness would depend on the mesh
        percent, unit = loss / 1e3, "kN/m"
    for i, n in enumerate((0, 1, 2, 3)):
        for s in range(len(speeds)):
            style = {"linestyle": STYLES[s % len(STYLES)], "color": COLOURS[i], "label": f"{n}X" if s == 0 else None}
            axes[0, 0].plot(percent, ratio[:, s, config.harmonics.index(n)], **style)
    for s, text in enumerate(speeds):
        axes[0, 0].plot([], [], color="0.4", linestyle=STYLES[s % len(STYLES)], label=text)
    axes[0, 0].set(xlabel=f"stiffness lost by the open crack ({unit})", ylabel="full crack / weight dominant (1)")
    axes[0, 0].axhline(1, color="k", linewidth=0.8)
    axes[0, 0].set_title("Amplitude ratio")
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower left", ncols=3)
    here = dominance.error.sel(case=case) * 100
    sizes = np.abs(here)
    worst = {p: float(np.nanmax(sizes.sel(parameter=p))) for p in here.parameter.values if config.reported[p] != "rad"}
    ordered = sorted(worst, key=worst.get, reverse=True)
    shown_parameters = [p for p in ordered[:MOST_CURVES] if worst[p] > NO_ERROR]
    for i, parameter in enumerate(shown_parameters):
        error = here.sel(parameter=parameter)
        axes[0, 1].plot(percent, error, MARKERS[i] + "-", color=COLOURS[i], label=label(parameter))
    if others := ordered[len(shown_parameters) :]:
        error = here.sel(parameter=others).transpose(..., "parameter")
        text = f"{len(others)} others, {max(worst[others[0]], NO_ERROR):.2g} % at most"
        lines = axes[0, 1].plot(percent, error, color="0.75", linewidth=0.8, zorder=0)
        lines[0].set_label(text)
    axes[0, 1].set(xlabel=f"stiffness lost by the open crack ({unit})", ylabel="error of the estimate (%)")
    if worst[ordered[0]] > 10:
        axes[0, 1].set_yscale("symlog", linthresh=10)
    axes[0, 1].set_title(f"Error of the identification, {shown}")
    picture.legend(*axes[0, 1].get_legend_handles_labels(), loc="outside lower right", ncols=2)
    picture.suptitle(title)
    return picture


def correlation_text(value):
    """A correlation as 0.98, or near +-1 by its distance: -0.99996 -> -1+4e-5."""
    gap = 1 - abs(value)
    if gap >= 0.005:
        return f"{value:.2f}"
    if gap < 1e-12:
        return f"{value:.0f}"
    sign = "-1+" if value < 0 else "1-"
    digits, exponent = f"{gap:.0e}".split("e")
    return f"{sign}{digits}e{int(exponent)}"


def collinearity(study, title):
    """Correlation of the estimates of the first case, and the loss of accuracy that it causes for each."""
    here = study.results["identifiability"].sel(case=next(iter(study.config.cases)))
    names = [label(p) for p in here.parameter.values]
    picture, axes = figure(1, 2, height=4.4 if len(names) > MANY else 3.0, width=3.6)
    image = axes[0, 0].imshow(here.correlation, cmap="PuOr", vmin=-1, vmax=1)
    for i, row in enumerate(here.correlation.values):
        for j, value in enumerate(row):
            if len(names) > MANY:
                continue  # colours only
            colour = "white" if abs(value) > 0.7 else "black"
            text = correlation_text(value)
            size = 5 if len(text) < 6 else 4
            axes[0, 0].text(j, i, text, ha="center", va="center", fontsize=size, color=colour)
    axes[0, 0].grid(False)
    axes[0, 0].set_xticks(range(len(names)), names, rotation=90)
    axes[0, 0].set_yticks(range(len(names)), names)
    axes[0, 0].set_title("Correlation of efficient estimates")
    picture.colorbar(image, ax=axes[0, 0], shrink=0.6)
    axes[0, 1].barh(range(len(names)), here.inflation, color=COLOURS[0])
    axes[0, 1].set_yticks(range(len(names)), names)
    axes[0, 1].invert_yaxis()
    axes[0, 1].set_xscale("log")
    axes[0, 1].xaxis.set_major_formatter("{x:g}")
    axes[0, 1].xaxis.set_minor_formatter("{x:g}" if here.inflation.max() < 10 else "")
    axes[0, 1].set(xlabel="bound over bound with\nall others known (1)", title="Loss of accuracy by correlation")
    picture.suptitle(title)
    return picture


def measurements(study, title, parameter):
    """Bound of one parameter in the first case for every further measurement, the best first."""
    here = study.results["identifiability"].sel(case=next(iter(study.config.cases)), parameter=parameter)
    bound, unit = here.bound, study.config.reported[parameter]
    bound = bound.isel(measurement=np.argsort(-bound.values))
    values = in_units(unit, bound.values, 1.0)
    picture, axes = figure(height=2.8, width=5.0)
    own = [i for i, name in enumerate(bound.measurement.values) if name == AS_IT_IS]
    colours = [COLOURS[1] if i in own else COLOURS[0] for i in range(len(values))]
    axes[0, 0].barh(range(len(values)), values, color=colours)
    for i, value in enumerate(values):
        axes[0, 0].text(value, i, f" {value:.2g}", va="center", fontsize=7)
    axes[0, 0].set_xscale("log")
    axes[0, 0].set_xlim(right=values.max() * 4)
    axes[0, 0].set_yticks(range(len(values)), [str(name) for name in bound.measurement.values])
    noise = float(here.noise) * 1e6
    axes[0, 0].set_xlabel(f"bound ({error_unit(unit)}), noise of every probe {noise:.2g} µm")
    picture.suptitle(title)
    return picture


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
        height, width = min(1.7, HIGHEST / count), min(2.6, WIDEST / len(columns))
        picture, axes = figure(count, len(columns), height, width)
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
            ends, count = over.isel(estimator=i).values[:, [0, -1]], over.sizes["estimator"]
            _dumbbells(panel, ends, i, count, str(estimator).replace("_", " "))
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


def bias(study, title, cases=None):
    """Error of estimates by quantities wrong by 1 % and by the most that was tried; cases : name -> name shown."""
    wrong, units = study.results["bias"], study.config.reported
    parameters, known, size = wrong.parameter.values, wrong.known.values, np.abs(wrong.percent)
    ends = [1.0, float(size.max())]
    height, width = 0.3 * len(parameters) + 1.3, max(7.0 / len(known), 2.2)
    picture, axes = figure(1, len(known), height, width, sharey=True)
    rows = list(product(named_cases(study, cases).items(), wrong.estimator.values))
    for panel, quantity in zip(axes[0], known, strict=True):
        for i, ((case, shown), estimator) in enumerate(rows):
            error = np.abs(wrong.relative_error.sel(known=quantity, case=case, estimator=estimator))
            worst = np.stack([error.where(size <= end + 1e-9).max("percent").values for end in ends], axis=-1)
            scale = np.array([in_units(units[parameter], 1.0, 1.0) for parameter in parameters])
            text = f"{shown}, {str(estimator).replace('_', ' ')}"
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


def sensors(study):
    """Errors and bounds with few sensors, and starts that converge."""
    config, few = study.config, study.results["sensors"]
    picture, axes = figure(1, len(config.cases), height=3.6, width=4.0, sharey=True)
    place = range(few.sizes["parameter"])
    axes[0, 0].set_yticks(place, [label(name) for name in few.parameter.values])
    for panel, case in zip(axes[0], config.cases, strict=True):
        for i, (name, nodes) in enumerate(config.sensor_sets.items()):
            right = [int((few.start_error.sel(sensors=name, case=one) < 1e-6).sum()) for one in config.cases]
            starts = " and ".join(map(str, dict.fromkeys(right)))
            text = f"nodes {', '.join(map(str, nodes))} ({starts} of {few.sizes['start']} starts converge)"
            style = {"color": COLOURS[i], "label": text}
            bound = few.bound.sel(sensors=name, case=case) * 100
            panel.plot(bound, place, "|", markersize=9, color=COLOURS[i])
            scatter = few.scatter.sel(sensors=name, case=case) * 100
            panel.plot(scatter, place, MARKERS[i], fillstyle="none", **style)
        panel.set_xscale("log")
        panel.set(xlabel="error at 1 % noise (%; phases: % of 1 rad)", title=case)
    axes[0, 0].invert_yaxis()
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    smallest = min(config.sensor_sets, key=lambda name: len(config.sensor_sets[name]))
    times = float((few.bound.sel(sensors=smallest) / few.bound.sel(sensors=next(iter(config.sensor_sets)))).max())
    nodes = ", ".join(map(str, config.sensor_sets[smallest]))
    picture.suptitle(f"By node {nodes} alone bounds (dashes) are up to {times:.0f} times those of all sensors")
    return picture


def known_name(key):
    """mass_kg -> mass, youngs_modulus_Pa -> Young's modulus: the unit left out."""
    *inside, name = key.split(".")
    name = name.split("_per_")[0]
    name = name.rsplit("_", 2 if name.endswith("kg_m2") else 1)[0].replace("_", " ").replace("youngs", "Young's")
    return f"{name} of {inside[0].removesuffix('s')} {int(inside[1]) + 1}" if inside else name


def plain_log(axes, ticks):
    """Logarithmic axes with the given ticks along x and powers of ten along y."""
    from matplotlib.ticker import NullLocator

    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter("{x:g}")
    low, high = axes.get_ylim()
    axes.set_ylim(10 ** np.floor(np.log10(low)), 10 ** np.ceil(np.log10(high)))
    axes.yaxis.set_minor_locator(NullLocator())
