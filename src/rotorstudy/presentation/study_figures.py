"""Figures every simulated study has. Each function takes Datasets and returns a matplotlib figure; scripts save it."""

import numpy as np

from rotorstudy.measurement.records import reference_signal
from rotorstudy.presentation.plots import (
    COLOURS,
    MARKERS,
    figure,
    plain_log,
    plot_full_spectrum,
    plot_orbit,
    plot_phase,
)
from rotorstudy.store import as_complex

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


MANY = 8  # parameters; beyond, figures leave something out


def label(parameter):
    return LABELS.get(str(parameter), str(parameter).replace("_", " "))


def error_unit(parameter):
    return "rad" if str(parameter).endswith("phase") else "%"


def in_units(parameter, error, true):
    """An error in the unit it is shown in: rad for phases, per cent of the value for all others."""
    return error if error_unit(parameter) == "rad" else error * 100 / abs(true)


def time_and_orbit(config, records, speed, title):
    """Three turns of a record: both directions, orbit and phase reference; steady state and start from rest."""
    shown = records.time.values < 3 * 2 * np.pi / speed
    time = records.time.values[shown]
    picture, axes = figure(2, 2)
    for i, source in enumerate(records.source.values):
        z = as_complex(records.displacement.sel(source=source).sel(speed=speed, method="nearest").isel(node=0))[shown]
        style = {"label": str(source), "color": COLOURS[i], "linestyle": ("-", "--")[i]}
        axes[0, 0].plot(time * 1e3, z.real * 1e6, **style)
        axes[0, 1].plot(time * 1e3, z.imag * 1e6, **style)
        plot_orbit(z, axes[1, 0], index=i, linestyle=("-", "--")[i])
    axes[1, 1].plot(time * 1e3, reference_signal(speed, config.harmonics, time), color=COLOURS[6])
    axes[0, 0].set(xlabel="time (ms)", ylabel="vertical x (µm)", title="Vertical displacement")
    axes[0, 1].set(xlabel="time (ms)", ylabel="horizontal y (µm)", title="Horizontal displacement")
    axes[1, 0].set_title("Orbit")
    axes[1, 1].set(xlabel="time (ms)", ylabel="reference signal (1)", title="Multi-harmonic phase reference")
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    picture.suptitle(title, fontsize=9)
    return picture


def full_spectra(harmonics, rows, panels, printed=None):
    """Amplitudes and phases of several spectra of one record, one panel below the other.

    rows    : label -> (panel -> (harmonic,) complex); panel is a title and "amplitude" or "phase"
    panels  : [(title, "amplitude" or "phase")]
    printed : title -> (harmonics, values in m or rad) of the thesis
    """
    from matplotlib.legend_handler import HandlerTuple

    picture, axes = figure(len(panels), 1, height=2.2, width=4.5)
    for panel, (title, kind) in zip(axes[:, 0], panels, strict=True):
        here = {name: values[title] for name, values in rows.items() if title in values}
        for i, (name, values) in enumerate(here.items()):
            index = list(rows).index(name)
            if kind == "amplitude":
                plot_full_spectrum(harmonics, values, panel, label=name, index=i, count=len(here))
            else:
                plot_phase(harmonics, values, panel, label=name, index=index)
        if printed and title in printed:
            at, values = printed[title]
            scale = 1e6 if kind == "amplitude" else 1.0
            panel.plot(at, np.asarray(values) * scale, "kx", label="printed in the thesis")
        panel.set_title(title)
    entries = [panel.get_legend_handles_labels() for panel in axes[:, 0]]
    shown = {}
    for handles, texts in entries:
        for handle, text in zip(handles, texts, strict=True):
            shown.setdefault(text, {})[type(handle).__name__] = handle  # a bar of the amplitudes, a mark of the phases
    both = [tuple(kinds.values()) for kinds in shown.values()]
    picture.legend(both, shown.keys(), loc="outside lower center", ncols=3, handler_map={tuple: HandlerTuple(None)})
    return picture


def error_against_noise(noisy, title):
    """Rms error of every estimator over the noise level, with the bound.

    noisy : title of the columns -> Monte Carlo Dataset of one record kind
    """
    first = next(iter(noisy.values()))
    columns = [(name, model) for name, data in noisy.items() for model in data.noise_model.values]
    picture, axes = figure(first.sizes["parameter"], len(columns), height=1.7, width=2.6, sharex=True)
    for c, (name, model) in enumerate(columns):
        data = noisy[name].sel(noise_model=model)
        for panel, parameter in zip(axes[:, c], data.parameter.values, strict=True):
            true = float(data.true.sel(parameter=parameter))
            for i, estimator in enumerate(data.estimator.values):
                error = data.estimate.sel(estimator=estimator, parameter=parameter) - true
                rms = in_units(parameter, np.sqrt((error**2).mean("trial")), true)
                text = str(estimator).replace("_", " ")
                panel.loglog(data.noise, rms, MARKERS[i] + "-", color=COLOURS[i], label=text)
            bound = in_units(parameter, data.cramer_rao.sel(parameter=parameter), true)
            panel.loglog(data.noise, bound, "k--", label="Cramér-Rao bound")
            if c == 0:
                panel.set_ylabel(f"{label(parameter)}\nrms error ({error_unit(parameter)})")
            plain_log(panel, data.noise.values)
        axes[0, c].set_title(f"{name}\nnoise {model}")
        axes[-1, c].set_xlabel("noise level (%)")
    axes[0, 0].legend()
    picture.suptitle(title, fontsize=9)
    return picture


def bias(bias_data, cases, title):
    """Error of the estimates over the error of what is held known; cases: name in the data -> name shown."""
    parameters = bias_data.parameter.values
    many = len(parameters) > MANY  # then parameters go down
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
                        in_units(parameter, error, 1.0),
                        ("-", "--")[c],
                        color=COLOURS[i],
                        label=text,
                    )
            panel.set_title(label(parameter) if many or k == 0 else "")
            panel.set_xlabel(f"error of {known_name(str(known))} (%)")
            panel.set_ylabel(f"error ({error_unit(parameter)})")
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


def weight_dominance(config, dominance, case, shown, title):
    """What weight dominance costs: amplitude ratio at the shown speeds, and the error of what is identified."""
    picture, axes = figure(1, 2, height=2.8)
    amplitude = np.abs(as_complex(dominance.displacement))
    ratio = amplitude[1] / amplitude[0]
    speeds = [speed_name(w) for w in config.shown_speeds_rad_s]
    crack = config.rigs[config.main_rig]["cracks"][0]
    model = config.rig(config.main_rig)
    name, (pattern, _, _) = next(
        iter(model.structure.stiffness_loss_at(crack.get("node"), crack.get("element")).items())
    )
    loss = next(value for key, value in crack.items() if key.startswith(name)) * dominance.crack_scale.values
    percent, unit = loss / np.sum(pattern * model.structure.stiffness) * 100, "%"
    if not model.structure.is_supported:  # what a part of the stiffness is depends on the mesh
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
    shown_parameters = [p for p in dominance.parameter.values if error_unit(p) == "%"]
    for i, parameter in enumerate(shown_parameters):
        error = dominance.error.sel(case=case, parameter=parameter) * 100
        axes[0, 1].plot(percent, error, MARKERS[i % 7] + "-", color=COLOURS[i % 7], label=label(parameter))
    axes[0, 1].set(xlabel=f"stiffness lost by the open crack ({unit})", ylabel="error of the estimate (%)")
    if np.nanmax(np.abs(dominance.error.sel(case=case, parameter=shown_parameters))) > 10:
        axes[0, 1].set_yscale("symlog", linthresh=10)
    axes[0, 1].set_title(f"What identification pays, {shown}")
    picture.legend(*axes[0, 1].get_legend_handles_labels(), loc="outside lower right", ncols=2)
    picture.suptitle(title, fontsize=9)
    return picture


def stability(stable, closed_form=None):
    """Growth rate over speed, and the threshold; closed_form: (label, function of the damping ratio) to compare."""
    picture, axes = figure(1, 2, height=2.6)
    natural = float(stable.natural_frequency)
    for i, damping in enumerate(stable.damping_ratio.values):
        growth = stable.growth_rate.sel(damping_ratio=damping)
        axes[0, 0].plot(stable.relative_speed, growth, color=COLOURS[i], label=f"c_E / c_H = {damping:g}")
    axes[0, 0].axhline(0, color="k", linewidth=0.8)
    axes[0, 0].set(xlabel="speed / natural frequency (1)", ylabel="growth rate (1/s)", title="Unstable above zero")
    axes[0, 0].legend()
    line = np.linspace(0, float(stable.damping_ratio.max()), 50)
    if closed_form:
        text, function = closed_form
        axes[0, 1].plot(line, function(line), "k--", label=text)
    axes[0, 1].plot(stable.damping_ratio, stable.threshold / natural, MARKERS[0], color=COLOURS[0], label="eigenvalues")
    axes[0, 1].set(xlabel="external / internal damping (1)", ylabel="threshold / natural frequency (1)")
    axes[0, 1].set_title("Threshold of stability")
    axes[0, 1].legend()
    return picture


def campbell(whirl, rigs, title):
    """Whirl frequency over speed with the lines of 1X, 2X, 3X and -1X; rigs: name in the data -> name shown."""
    picture, axes = figure(1, len(rigs), height=3.2, sharey=True)
    speed = whirl.speed.values / (2 * np.pi)
    for panel, (rig, shown) in zip(axes[0], rigs.items(), strict=True):
        here = whirl.sel(rig=rig)
        frequency = here.frequency.values / (2 * np.pi)
        highest = min(np.abs(frequency).max() * 1.05, 4 * speed[-1])
        for mode in range(frequency.shape[1]):
            forward = np.median(frequency[:, mode]) > 0
            text = ("forward whirl" if forward else "backward whirl") if mode in (0, frequency.shape[1] - 1) else None
            if (frequency > 0).all():  # anisotropic
                text = "whirl, forward and backward mixed" if mode == 0 else None
            panel.plot(
                speed,
                np.abs(frequency[:, mode]),
                "-" if forward else "--",
                color=COLOURS[0 if forward else 1],
                label=text,
            )
        for i, order in enumerate(whirl.order.values):
            if order > 0:
                panel.plot(speed, order * speed, ":", color="0.5", linewidth=0.9)
                top = min(speed[-1], highest / order)
                panel.annotate(f"{order}X", (top, order * top), fontsize=7, ha="right", va="top")
            marks = here.critical_speed.sel(order=order).values / (2 * np.pi)
            marks = marks[np.isfinite(marks)]
            panel.plot(
                marks,
                abs(order) * marks,
                MARKERS[i],
                color="k",
                fillstyle="none",
                label=f"meets {order}X",
                linestyle="",
            )
        panel.set(xlabel="spin speed (Hz)", title=shown, xlim=(0, speed[-1]), ylim=(0, highest))
    axes[0, 0].set_ylabel("whirl frequency (Hz)")
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    picture.suptitle(title, fontsize=9)
    return picture


def correlation_text(value):
    """0.98, and next to one how far from it: -0.99996 -> -1+4e-5."""
    gap = 1 - abs(value)
    if gap >= 0.005:
        return f"{value:.2f}"
    if gap < 1e-12:
        return f"{value:.0f}"
    sign = "-1+" if value < 0 else "1-"
    digits, exponent = f"{gap:.0e}".split("e")
    return f"{sign}{digits}e{int(exponent)}"


def collinearity(data, case, title):
    """Correlation of the estimates, and how much their trading off costs each of them."""
    here = data.sel(case=case)
    names = [label(p) for p in here.parameter.values]
    picture, axes = figure(1, 2, height=3.0, width=3.6)
    image = axes[0, 0].imshow(here.correlation, cmap="PuOr", vmin=-1, vmax=1)
    for i, row in enumerate(here.correlation.values):
        for j, value in enumerate(row):
            if len(names) > MANY:
                continue  # the colours must do
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
    axes[0, 1].set(xlabel="bound / bound with all others known (1)", title="Cost of trading off")
    picture.suptitle(title, fontsize=9)
    return picture


def measurements(data, case, parameter, title):
    """Bound of one parameter for every further measurement, the best first."""
    bound = data.bound.sel(case=case, parameter=parameter)
    bound = bound.isel(measurement=np.argsort(-bound.values))
    values = in_units(parameter, bound.values, 1.0)
    picture, axes = figure(height=2.8, width=5.0)
    own = [i for i, name in enumerate(bound.measurement.values) if name == "as it is"]
    colours = [COLOURS[1] if i in own else COLOURS[0] for i in range(len(values))]
    axes[0, 0].barh(range(len(values)), values, color=colours)
    for i, value in enumerate(values):
        axes[0, 0].text(value, i, f" {value:.2g}", va="center", fontsize=7)
    axes[0, 0].set_xscale("log")
    axes[0, 0].set_xlim(right=values.max() * 4)
    axes[0, 0].set_yticks(range(len(values)), [str(name) for name in bound.measurement.values])
    noise = float(data.noise.sel(case=case)) * 1e6
    axes[0, 0].set_xlabel(f"bound ({error_unit(parameter)}), noise of every probe {noise:.2g} µm")
    picture.suptitle(title, fontsize=9)
    return picture
