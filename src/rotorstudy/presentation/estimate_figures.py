"""Figures of the accuracy of estimates. Each function takes results and returns a matplotlib figure.

units : reported name of a parameter -> its unit; phases are shown in rad, all others in per cent of their value
"""

import numpy as np

from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, plain_log
from rotorstudy.store import as_complex
from rotorstudy.studies.identifiability import AS_IT_IS
from rotorstudy.studies.weight_dominance import first_crack

LABELS = {
    "internal_damping": "internal damping",
    "external_damping": "external damping",
    "eccentricity": "eccentricity",
    "eccentricity_phase": "unbalance phase",
    "stiffness_loss": "crack stiffness",
    "stiffness_loss_22": "crack stiffness 22",
    "stiffness_loss_44": "crack stiffness 44",
}
STYLES = ("-", "--", ":", "-.")  # of speeds
MANY = 8  # parameters: figures of more have another layout or fewer labels


def label(parameter):
    """A parameter as figures name it."""
    return LABELS.get(str(parameter), str(parameter).replace("_", " "))


def error_unit(unit):
    """The unit in which errors of a parameter of some unit are shown."""
    return "rad" if unit == "rad" else "%"


def in_units(unit, error, true):
    """An error (SI) in the unit in which it is shown; true : value it is relative to."""
    return error if unit == "rad" else error * 100 / abs(true)


def error_against_noise(noisy, units, title):
    """Rms error of every estimator over the noise level, with the bound.

    noisy : title of the columns -> Monte Carlo Dataset of one record kind
    """
    first = next(iter(noisy.values()))
    columns = [(name, model) for name, data in noisy.items() for model in data.noise_model.values]
    picture, axes = figure(first.sizes["parameter"], len(columns), height=1.7, width=2.6, sharex=True)
    for c, (name, model) in enumerate(columns):
        data = noisy[name].sel(noise_model=model)
        for panel, parameter in zip(axes[:, c], data.parameter.values, strict=True):
            true, unit = float(data.true.sel(parameter=parameter)), units[parameter]
            for i, estimator in enumerate(data.estimator.values):
                error = data.estimate.sel(estimator=estimator, parameter=parameter) - true
                rms = in_units(unit, np.sqrt((error**2).mean("trial")), true)
                text = str(estimator).replace("_", " ")
                panel.loglog(data.noise, rms, MARKERS[i] + "-", color=COLOURS[i], label=text)
            bound = in_units(unit, data.cramer_rao.sel(parameter=parameter), true)
            panel.loglog(data.noise, bound, "k--", label="Cramér-Rao bound")
            if c == 0:
                panel.set_ylabel(f"{label(parameter)}\nrms error ({error_unit(unit)})")
            plain_log(panel, data.noise.values)
        axes[0, c].set_title(f"{name}\nnoise {model}")
        axes[-1, c].set_xlabel("noise level (%)")
    axes[0, 0].legend()
    picture.suptitle(title, fontsize=9)
    return picture


def bias(bias_data, cases, units, title):
    """Error of the estimates over the error of the quantities held known; cases: name in the data -> name shown."""
    parameters = bias_data.parameter.values
    many = len(parameters) > MANY  # then parameters are rows
    size = (len(parameters), bias_data.sizes["known"]) if many else (bias_data.sizes["known"], len(parameters))
    picture, axes = figure(*size, height=2.0, width=3.2 if many else 2.2)
    axes = axes.T if many else axes
    for k, known in enumerate(bias_data.known.values):
        for panel, parameter in zip(axes[k], parameters, strict=True):
            for c, (case, shown) in enumerate(cases.items()):
                for i, estimator in enumerate(bias_data.estimator.values):
                    error = bias_data.relative_error.sel(
                        known=known, case=case, estimator=estimator, parameter=parameter
                    )
                    text = f"{shown}, {str(estimator).replace('_', ' ')}"
                    panel.plot(
                        bias_data.percent,
                        in_units(units[parameter], error, 1.0),
                        ("-", "--")[c],
                        color=COLOURS[i],
                        label=text,
                    )
            panel.set_title(label(parameter) if many or k == 0 else "")
            panel.set_xlabel(f"error of {known_name(str(known))} (%)")
            panel.set_ylabel(f"error ({error_unit(units[parameter])})")
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    picture.suptitle(title, fontsize=9)
    return picture


def known_name(key):
    """mass_kg -> mass, youngs_modulus_Pa -> youngs modulus: the unit left out."""
    *inside, name = key.split(".")
    name = name.split("_per_")[0]
    name = name.rsplit("_", 2 if name.endswith("kg_m2") else 1)[0].replace("_", " ")
    return f"{name} of {inside[0].removesuffix('s')} {int(inside[1]) + 1}" if inside else name


def speed_name(speed):
    """A speed in the words of the studies: 20 Hz where it is a whole frequency, else 88 rad/s (14.0 Hz)."""
    frequency = speed / (2 * np.pi)
    if abs(frequency - round(frequency)) < 1e-6:
        return f"{frequency:.0f} Hz"
    return f"{speed:.0f} rad/s ({frequency:.1f} Hz)"


def weight_dominance(config, dominance, case, shown, units, title):
    """Error by weight dominance: amplitude ratio at the shown speeds, and error of the estimates."""
    picture, axes = figure(1, 2, height=2.8)
    amplitude = np.abs(as_complex(dominance.displacement))
    ratio = amplitude[1] / amplitude[0]
    speeds = [speed_name(w) for w in config.shown_speeds_rad_s]
    crack = config.rigs[config.main_rig]["cracks"][0]
    model = config.rig(config.main_rig)
    name, (pattern, _, _) = next(
        iter(model.structure.stiffness_loss_at(crack.get("node"), crack.get("element")).items())
    )
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
    shown_parameters = [p for p in dominance.parameter.values if units[p] != "rad"]
    for i, parameter in enumerate(shown_parameters):
        error = dominance.error.sel(case=case, parameter=parameter) * 100
        axes[0, 1].plot(percent, error, MARKERS[i % 7] + "-", color=COLOURS[i % 7], label=label(parameter))
    axes[0, 1].set(xlabel=f"stiffness lost by the open crack ({unit})", ylabel="error of the estimate (%)")
    if np.nanmax(np.abs(dominance.error.sel(case=case, parameter=shown_parameters))) > 10:
        axes[0, 1].set_yscale("symlog", linthresh=10)
    axes[0, 1].set_title(f"Error of the identification, {shown}")
    picture.legend(*axes[0, 1].get_legend_handles_labels(), loc="outside lower right", ncols=2)
    picture.suptitle(title, fontsize=9)
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


def collinearity(data, case, title):
    """Correlation of the estimates, and the loss of accuracy that it causes for each."""
    here = data.sel(case=case)
    names = [label(p) for p in here.parameter.values]
    picture, axes = figure(1, 2, height=3.0, width=3.6)
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
    picture.colorbar(image, ax=axes[0, 0], shrink=0.8)
    axes[0, 1].barh(range(len(names)), here.inflation, color=COLOURS[0])
    axes[0, 1].set_yticks(range(len(names)), names)
    axes[0, 1].invert_yaxis()
    axes[0, 1].set_xscale("log")
    axes[0, 1].set(xlabel="bound / bound with all others known (1)", title="Loss of accuracy by correlation")
    picture.suptitle(title, fontsize=9)
    return picture


def measurements(data, case, parameter, unit, title):
    """Bound of one parameter for every further measurement, the best first."""
    bound = data.bound.sel(case=case, parameter=parameter)
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
    noise = float(data.noise.sel(case=case)) * 1e6
    axes[0, 0].set_xlabel(f"bound ({error_unit(unit)}), noise of every probe {noise:.2g} µm")
    picture.suptitle(title, fontsize=9)
    return picture
