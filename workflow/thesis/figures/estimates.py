"""Figures of the accuracy of estimates in the simulated chapters: of their configuration and Datasets of their stages.

cases : case -> its name in the figure;  phases are shown in degrees, all others in per cent of their value
"""

from itertools import product

import numpy as np

from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, finished, label
from rotorstudy.store import as_complex
from rotorstudy.studies.analyses import AS_IT_IS, first_crack
from rotorstudy.studies.config import file_name

STYLES = ("-", "--", ":", "-.")  # of speeds
MANY = 8  # parameters: figures of more have another layout or fewer labels
MOST_CURVES = 6  # with a colour of their own
NO_ERROR = 0.01  # percent, too small for a curve
HIGHEST = 8.5  # inches, of all rows of panels: shown at half its size the figure fits in a window
WIDEST = 8.0  # inches; a wider figure is hard to read in a column of text
LEAST = 1e-3  # smaller errors by a wrong known quantity are drawn here


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


def rows(panel, names):
    """A row of a panel for each name, from the top."""
    panel.set_yticks(range(len(names)), names)
    panel.set_ylim(len(names) - 0.5, -0.5)


def weight_dominance(config, weight_dominance, title, cases=None):
    """A crack on the static deflection alone: amplitude ratio at the shown speeds, error of the first of the cases."""
    case, shown = next(iter((cases or {case: case for case in config.cases}).items()))
    picture, ((left, right),) = figure(1, 2, height=2.8)
    weight_dominant, full = np.abs(as_complex(weight_dominance.displacement.transpose("crack", ...)))
    structure, crack = config.rig(config.main_rig).structure, config.rigs[config.main_rig]["cracks"][0]
    losses = structure.stiffness_loss_at(crack.get("node"), crack.get("element"))
    name, (pattern, _, _) = next(iter(losses.items()))
    loss = first_crack(config, config.main_rig).values[name] * weight_dominance.crack_scale.values
    lost, unit = loss / np.sum(pattern * structure.stiffness) * 100, "%"
    if not structure.is_supported:  # a share of the stiffness would depend on the mesh
        lost, unit = loss / 1e3, "kN/m"
    speeds = [speed_name(w) for w in config.shown_speeds_rad_s]
    for i, n in enumerate((0, 1, 2, 3)):
        for s in range(len(speeds)):
            style = {"linestyle": STYLES[s % len(STYLES)], "color": COLOURS[i], "label": f"{n}X" if s == 0 else None}
            left.plot(lost, (full / weight_dominant)[:, s, config.harmonics.index(n)], **style)
    for s, text in enumerate(speeds):
        left.plot([], [], color="0.4", linestyle=STYLES[s % len(STYLES)], label=text)
    left.axhline(1, color="k", linewidth=0.8)
    left.set(ylabel="full crack / weight dominant (1)", title="Amplitude ratio")
    here = weight_dominance.error.sel(case=case) * 100
    sizes = np.abs(here)
    worst = {p: float(np.nanmax(sizes.sel(parameter=p))) for p in here.parameter.values if config.reported[p] != "rad"}
    ordered = sorted(worst, key=worst.get, reverse=True)
    coloured = [p for p in ordered[:MOST_CURVES] if worst[p] > NO_ERROR]
    for i, parameter in enumerate(coloured):
        style = {"color": COLOURS[i], "label": label(parameter)}
        right.plot(lost, here.sel(parameter=parameter), MARKERS[i] + "-", **style)
    if others := ordered[len(coloured) :]:
        error = here.sel(parameter=others).transpose(..., "parameter")
        lines = right.plot(lost, error, color="0.75", linewidth=0.8, zorder=0)
        lines[0].set_label(f"{len(others)} others, {max(worst[others[0]], NO_ERROR):.2g} % at most")
    if worst[ordered[0]] > 10:
        right.set_yscale("symlog", linthresh=10)
    right.set(ylabel="error of the estimate (%)", title=f"Error of the identification, {shown}")
    for panel, side, columns in ((left, "left", 3), (right, "right", 2)):
        panel.set_xlabel(f"stiffness lost by the open crack ({unit})")
        picture.legend(*panel.get_legend_handles_labels(), loc=f"outside lower {side}", ncols=columns)
    return finished(picture, title)


def correlation_text(value):
    """A correlation as 0.98, or near +-1 by its distance: -0.99996 -> -1+4e-5."""
    gap = 1 - abs(value)
    if gap >= 0.005:
        return f"{value:.2f}"
    if gap < 1e-12:
        return f"{value:.0f}"
    digits, exponent = f"{gap:.0e}".split("e")
    return f"{'-1+' if value < 0 else '1-'}{digits}e{int(exponent)}"


def collinearity(identifiability, title):
    """Correlation of the estimates of the first case, and the loss of accuracy that it causes for each."""
    here = identifiability.isel(case=0)
    names = [label(p) for p in here.parameter.values]
    many, place = len(names) > MANY, range(len(names))
    picture, ((left, right),) = figure(1, 2, height=4.4 if many else 3.0, width=3.6)
    image = left.imshow(here.correlation, cmap="PuOr", vmin=-1, vmax=1)
    for (i, j), value in np.ndenumerate([] if many else here.correlation.values):  # else colours only
        text, style = correlation_text(value), {"ha": "center", "va": "center"}
        style |= {"fontsize": 5 if len(text) < 6 else 4, "color": "white" if abs(value) > 0.7 else "black"}
        left.text(j, i, text, **style)
    left.grid(False)
    left.set_xticks(place, names, rotation=90)
    left.set_yticks(place, names)
    left.set_title("Correlation of efficient estimates")
    picture.colorbar(image, ax=left, shrink=0.6)
    right.barh(place, here.inflation, color=COLOURS[0])
    right.set_yticks(place, names)
    right.invert_yaxis()
    right.set_xscale("log")
    right.xaxis.set_major_formatter("{x:g}")
    right.xaxis.set_minor_formatter("{x:g}" if here.inflation.max() < 10 else "")
    right.set(xlabel="bound over bound with\nall others known (1)", title="Loss of accuracy by correlation")
    return finished(picture, title)


def measurements(config, identifiability, title, parameter):
    """Bound of one parameter in the first case for every further measurement, the best first."""
    here, unit = identifiability.isel(case=0).sel(parameter=parameter), config.reported[parameter]
    bound = here.bound.isel(measurement=np.argsort(-here.bound.values))
    names, values = bound.measurement.values.astype(str), in_units(unit, bound.values, 1.0)
    picture, ((panel,),) = figure(height=2.8, width=5.0)
    panel.barh(range(len(values)), values, color=[COLOURS[int(name == AS_IT_IS)] for name in names])
    for i, value in enumerate(values):
        panel.text(value, i, f" {value:.2g}", va="center", fontsize=7)
    panel.set_xscale("log")
    panel.set_xlim(right=values.max() * 4)
    panel.set_yticks(range(len(values)), names)
    panel.set_xlabel(f"bound ({error_unit(unit)}), noise of every probe {float(here.noise) * 1e6:.2g} µm")
    return finished(picture, title)


def error_against_noise(config, monte_carlo, title, cases=None):
    """Rms error of every estimator over the noise, with the bound, for records of a steady state."""
    shown = {
        name: monte_carlo[file_name(case)] for case, name in (cases or {case: case for case in config.cases}).items()
    }
    return errors_and_bounds({k: v.sel(record="steady state") for k, v in shown.items()}, config.reported, title)


def error_by_record(config, monte_carlo_thesis, title):
    """Rms error of every estimator over the noise, with the bound, a column for each kind of record."""
    ((_, data),) = monte_carlo_thesis.items()
    return errors_and_bounds({kind: data.sel(record=kind) for kind in config.record.kinds}, config.reported, title)


def errors_and_bounds(noisy, units, title):
    """Errors over the noise; noisy : title -> Monte Carlo Dataset;  units : reported parameter -> its unit."""
    columns = [(name, model) for name, data in noisy.items() for model in data.noise_model.values]
    count = next(iter(noisy.values())).sizes["parameter"]
    if count > MANY:
        return _errors_over_bounds(noisy, columns, title)
    picture, axes = figure(count, len(columns), min(1.7, HIGHEST / count), min(2.6, WIDEST / len(columns)))
    for (name, model), column in zip(columns, axes.T, strict=True):
        data = noisy[name].sel(noise_model=model)
        for panel, parameter in zip(column, data.parameter.values, strict=True):
            true, unit = float(data.true.sel(parameter=parameter)), units[parameter]
            for i, estimator in enumerate(data.estimator.values):
                error = data.estimate.sel(estimator=estimator, parameter=parameter) - true
                rms = in_units(unit, np.sqrt((error**2).mean("trial")), true)
                panel.loglog(data.noise, rms, MARKERS[i] + "-", color=COLOURS[i], label=label(estimator))
            bound = in_units(unit, data.cramer_rao.sel(parameter=parameter), true)
            panel.loglog(data.noise, bound, "k--", label="Cramér-Rao bound")
            if panel in axes[:, 0]:
                panel.set_ylabel(f"{label(parameter)}\nrms error ({error_unit(unit)})")
            plain_log(panel, data.noise.values)
        column[0].set_title(f"{name}\nnoise {model}")
        column[-1].set_xlabel("noise level (%)")
    return finished(picture, title, legend=4 if len(columns) > 1 else 1)


def _errors_over_bounds(noisy, columns, title):
    """Rms error over the Cramer-Rao bound: a row a parameter, from the lowest to the highest noise level."""
    names = [label(parameter) for parameter in next(iter(noisy.values())).parameter.values]
    picture, axes = figure(1, len(columns), height=0.24 * len(names) + 1.2, width=3.4, sharey=True)
    for panel, (name, model) in zip(axes[0], columns, strict=True):
        data = noisy[name].sel(noise_model=model)
        over = np.sqrt(((data.estimate - data.true) ** 2).mean("trial")) / data.cramer_rao
        over = over.transpose("estimator", "parameter", "noise").isel(noise=[0, -1])
        for i, estimator in enumerate(data.estimator.values):
            _dumbbells(panel, over.values[i], i, len(over), label(estimator))
        panel.set_xscale("log")
        panel.xaxis.set_major_formatter("{x:g}")
        panel.axvline(1, color="k", linewidth=0.8, linestyle=":")
        low, high = over.noise.values
        told = f"rms error / Cramér-Rao bound\n(filled: {low:g} % noise, open: {high:g} %)"
        panel.set(title=f"{name}\nnoise {model}", xlabel=told)
    rows(axes[0, 0], names)
    return finished(picture, title, legend=4)


def bias(config, bias, title, cases=None):
    """Error of estimates by quantities wrong by 1 % and by the most that was tried."""
    units, parameters, size = config.reported, bias.parameter.values, np.abs(bias.percent)
    known, ends = bias.known.values, [1.0, float(size.max())]
    height, width = 0.3 * len(parameters) + 1.3, max(7.0 / len(known), 2.2)
    picture, axes = figure(1, len(known), height, width, sharey=True)
    each = list(product((cases or {case: case for case in config.cases}).items(), bias.estimator.values))
    scale = np.array([in_units(units[parameter], 1.0, 1.0) for parameter in parameters])
    for panel, quantity in zip(axes[0], known, strict=True):
        for i, ((case, shown), estimator) in enumerate(each):
            error = np.abs(bias.relative_error.sel(known=quantity, case=case, estimator=estimator))
            worst = np.stack([error.where(size <= end + 1e-9).max("percent").values for end in ends], axis=-1)
            worst = np.maximum(worst * scale[:, None], LEAST)
            _dumbbells(panel, worst, i, len(each), f"{shown}, {label(estimator)}")
        panel.set(xscale="log", title=f"{known_name(str(quantity))} wrong")
    rows(axes[0, 0], [label(p) + (" (°)" if units[p] == "rad" else "") for p in parameters])
    clipped = f"\nsmaller ones at {LEAST:g}" if min(panel.get_xlim()[0] for panel in axes[0]) < LEAST else ""
    axes[0, 0].set_xlabel(f"largest error of the estimate (%; phases: °){clipped}")
    title = f"{title}\n(filled: known quantity {ends[0]:g} % wrong, open: {ends[1]:g} %)"
    return finished(picture, title, legend=2)


def _dumbbells(panel, values, i, count, text):
    """A line from a filled to an open mark in each row; values (row, 2), of the i-th of `count` beside each other."""
    place = np.arange(len(values)) + 0.6 * ((i + 0.5) / count - 0.5)
    colour, mark = COLOURS[i % len(COLOURS)], MARKERS[i % len(MARKERS)]
    panel.hlines(place, *values.T, color=colour, linewidth=0.8)
    panel.plot(values[:, 0], place, mark, markersize=5, label=text, color=colour)
    panel.plot(values[:, 1], place, mark, markersize=3, markerfacecolor="white", color=colour)


def sensors(config, sensors):
    """Errors and bounds with few sensors, and starts that converge."""
    picture, axes = figure(1, len(config.cases), height=3.6, width=4.0, sharey=True)
    place, converged = range(sensors.sizes["parameter"]), (sensors.start_error < 1e-6).sum("start")
    axes[0, 0].set_yticks(place, [label(name) for name in sensors.parameter.values])
    for panel, case in zip(axes[0], config.cases, strict=True):
        for i, (name, nodes) in enumerate(config.sensor_sets.items()):
            starts = " and ".join(map(str, dict.fromkeys(converged.sel(sensors=name).values.tolist())))
            told = f"nodes {', '.join(map(str, nodes))} ({starts} of {sensors.sizes['start']} starts converge)"
            one = sensors.sel(sensors=name, case=case) * 100
            panel.plot(one.bound, place, "|", markersize=9, color=COLOURS[i])
            panel.plot(one.scatter, place, MARKERS[i], fillstyle="none", color=COLOURS[i], label=told)
        panel.set(xscale="log", xlabel="error at 1 % noise (%; phases: % of 1 rad)", title=case)
    axes[0, 0].invert_yaxis()
    every, smallest = next(iter(config.sensor_sets)), min(config.sensor_sets, key=lambda k: len(config.sensor_sets[k]))
    times = float((sensors.bound.sel(sensors=smallest) / sensors.bound.sel(sensors=every)).max())
    nodes = ", ".join(map(str, config.sensor_sets[smallest]))
    told = f"By node {nodes} alone bounds (dashes) are up to {times:.0f} times those of all sensors"
    return finished(picture, told, legend=2)


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
