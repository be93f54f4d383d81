"""Figures of the accuracy of estimates. Each function takes results and returns a matplotlib figure.

units : reported name of a parameter -> its unit; phases are shown in degrees, all others in per cent of their value
"""

import numpy as np

from rotorstudy.presentation.plots import COLOURS, MARKERS, figure
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
MOST_CURVES = 6  # with a colour of their own
NO_ERROR = 0.01  # percent, too small for a curve


def label(parameter):
    """A parameter as figures name it."""
    return LABELS.get(str(parameter), str(parameter).replace("_", " "))


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
    here = dominance.error.sel(case=case) * 100
    worst = {
        p: float(np.nanmax(np.abs(here.sel(parameter=p)))) for p in dominance.parameter.values if units[p] != "rad"
    }
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


def collinearity(data, case, title):
    """Correlation of the estimates, and the loss of accuracy that it causes for each."""
    here = data.sel(case=case)
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
    picture.suptitle(title)
    return picture
