"""Figures of the crack models side by side. Each function takes the Dataset of `studies.cracks.compare`."""

import numpy as np

from rotorstudy.model.registry import registry
from rotorstudy.presentation.plots import COLOURS, figure, plot_full_spectrum
from rotorstudy.store import as_complex
from rotorstudy.studies.cracks import DIRECTIONS

STYLES = ("-", "--", "-.", ":")
GREEK = {"xi": "ξ", "eta": "η"}
LEAST = 1e-11  # m, smallest amplitude shown; below any probe's resolution


def _style(i):
    return {"color": COLOURS[i % len(COLOURS)], "linestyle": STYLES[i % len(STYLES)]}


def _name(plugin):
    return str(plugin).replace("_", " ")


def stiffness_figure(data):
    """Stiffness over the shaft angle in four directions."""
    picture, axes = figure(2, 2, height=2.1, sharex=True)
    titles = ("Rotating: weak direction ξ", "Rotating: across it, η", "Fixed: vertical", "Fixed: horizontal")
    for panel, direction, title in zip(axes.flat, DIRECTIONS, titles, strict=True):
        for i, crack in enumerate(data.crack.values):
            values = data.stiffness.sel(crack=crack, direction=direction)
            panel.plot(np.degrees(data.shaft_angle), values / 1e3, label=_name(crack), **_style(i))
        panel.set(title=title, ylabel="stiffness (kN/m)", xticks=range(0, 361, 90))
    for panel in axes[1]:
        panel.set_xlabel("shaft angle (°), 0: crack down")
    low, high = float(data.stiffness.min()) / 1e3, float(data.stiffness.max()) / 1e3
    for panel in axes.flat:
        panel.set_ylim(low - 0.05 * (high - low), high + 0.05 * (high - low))
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    picture.suptitle("The same loss of the open crack, distributed differently over a revolution")
    return picture


def spectra_figure(data):
    """Full spectra at the shown speeds, one panel per speed."""
    picture, axes = figure(data.sizes["speed"], 1, height=1.9, width=6.5, sharex=True)
    natural = float(data.natural_frequency)
    for panel, speed in zip(axes[:, 0], data.speed.values, strict=True):
        for i, crack in enumerate(data.crack.values):
            values = as_complex(data.displacement.sel(crack=crack, speed=speed))
            some = np.abs(values) > LEAST
            style = {"label": _name(crack), "index": i, "count": data.sizes["crack"]}
            plot_full_spectrum(data.harmonic.values[some], values[some], panel, **style)
        panel.set_xticks(data.harmonic.values, [f"{n}X" for n in data.harmonic.values])
        panel.set(title=f"{speed:.0f} rad/s, {speed / natural:.2f} of the natural frequency", xlabel="")
    axes[-1, 0].set_xlabel("harmonic (backward < 0 < forward)")
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    picture.suptitle("An open crack excites 0X and 2X, a breathing crack every harmonic")
    return picture


def sweep_figure(data, orders):
    """Amplitude of some harmonics over speed, with the natural frequency over the order."""
    picture, axes = figure(len(orders), 1, height=1.8, width=5.5, sharex=True)
    natural = float(data.natural_frequency)
    for panel, n in zip(axes[:, 0], orders, strict=True):
        for i, crack in enumerate(data.crack.values):
            height = np.abs(as_complex(data.swept_displacement.sel(crack=crack, harmonic=n)))
            if height.max() > LEAST:
                panel.semilogy(data.swept_speed / natural, height * 1e6, label=_name(crack), **_style(i))
        if data.swept_speed[0] < natural / n < data.swept_speed[-1]:
            panel.axvline(1 / n, color="k", linewidth=0.8, linestyle=":")
        panel.set(ylabel=f"{n}X (µm)")
    axes[0, 0].set_title("Dotted: natural frequency of the uncracked rotor over the order")
    axes[-1, 0].set_xlabel("speed over natural frequency of the uncracked rotor (1)")
    shown = (zip(*panel.get_legend_handles_labels(), strict=True) for panel in axes[:, 0])
    handles = {text: handle for pairs in shown for handle, text in pairs}
    picture.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3)
    picture.suptitle("Subcritical resonances: nX peaks just below 1/n of the natural frequency")
    return picture


def depth_figure(data, shaft):
    """Stiffness loss over crack depth."""
    picture, axes = figure(height=2.6, width=4.5)
    for i, depth in enumerate(data.depth.values):
        for turning, style in (("xi", "-"), ("eta", "--")):
            loss = data.depth_loss.sel(depth=depth, turning=turning) / shaft.stiffness * 100
            text = f"{_name(depth)}, {GREEK[turning]}"
            axes[0, 0].plot(data.depth_ratio, loss, style, color=COLOURS[i % len(COLOURS)], label=text)
    axes[0, 0].set(
        xlabel="crack depth over diameter (1)",
        ylabel="stiffness loss of the shaft (%)",
        xlim=(0, 0.02 + max(plugin.valid[1] for plugin in registry().plugins["depth"].values())),
        title=f"Crack and disc at mid-span; diameter {shaft.diameter_m * 1e3:g} mm, span {shaft.span_m * 1e3:g} mm",
    )
    axes[0, 0].legend()
    picture.suptitle("Only a deep crack reduces the stiffness noticeably")
    return picture


def figures(config, comparison):
    """The figures of the crack models."""
    return {
        "stiffness": stiffness_figure(comparison),
        "spectra": spectra_figure(comparison),
        "speed_sweep": sweep_figure(comparison, config.shown_orders),
        "depth": depth_figure(comparison, config.shaft),
    }
