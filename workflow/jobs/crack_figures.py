"""Figures of the crack models side by side, of what `studies.cracks.compare` gives."""

import numpy as np

from rotorstudy.model.registry import registry
from rotorstudy.presentation.plots import COLOURS, curves, figure, finished, label, plot_full_spectrum
from rotorstudy.store import as_complex
from rotorstudy.studies.cracks import DIRECTIONS

STYLES = ("-", "--", "-.", ":")
TITLES = ("Rotating: weak direction ξ", "Rotating: across it, η", "Fixed: vertical", "Fixed: horizontal")
GREEK = {"xi": "ξ", "eta": "η"}
LEAST = 1e-11  # m, smallest amplitude shown; below any probe's resolution


def _style(i):
    return {"color": COLOURS[i % len(COLOURS)], "linestyle": STYLES[i % len(STYLES)]}


def stiffness(comparison):
    """Stiffness over the shaft angle in four directions."""
    picture, axes = figure(2, 2, height=2.1, sharex=True)
    values, angle = comparison.stiffness / 1e3, np.degrees(comparison.shaft_angle)
    low, high = float(values.min()), float(values.max())
    room = 0.05 * (high - low)
    for panel, direction, title in zip(axes.flat, DIRECTIONS, TITLES, strict=True):
        curves(panel, values.sel(direction=direction), angle, "crack", _style)
        panel.set(title=title, ylabel="stiffness (kN/m)", xticks=range(0, 361, 90), ylim=(low - room, high + room))
    for panel in axes[1]:
        panel.set_xlabel("shaft angle (°), 0: crack down")
    return finished(picture, "The same loss of the open crack, distributed differently over a revolution", legend=3)


def spectra(comparison):
    """Full spectra at the shown speeds, one panel per speed."""
    picture, axes = figure(comparison.sizes["speed"], 1, height=1.9, width=6.5, sharex=True)
    harmonics, natural = comparison.harmonic.values, float(comparison.natural_frequency)
    for panel, speed in zip(axes[:, 0], comparison.speed.values, strict=True):
        for i, crack in enumerate(comparison.crack.values):
            values = as_complex(comparison.displacement.sel(crack=crack, speed=speed))
            some, style = np.abs(values) > LEAST, {"index": i, "count": comparison.sizes["crack"]}
            plot_full_spectrum(harmonics[some], values[some], panel, label=label(crack), **style)
        panel.set_xticks(harmonics, [f"{n}X" for n in harmonics])
        panel.set(title=f"{speed:.0f} rad/s, {speed / natural:.2f} of the natural frequency", xlabel="")
    axes[-1, 0].set_xlabel("harmonic (backward < 0 < forward)")
    return finished(picture, "An open crack excites 0X and 2X, a breathing crack every harmonic", legend=5)


def speed_sweep(config, comparison):
    """Amplitude of some harmonics over speed, with the natural frequency over the order."""
    orders, natural = config.shown_orders, float(comparison.natural_frequency)
    picture, axes = figure(len(orders), 1, height=1.8, width=5.5, sharex=True)
    speed = comparison.swept_speed / natural
    for panel, n in zip(axes[:, 0], orders, strict=True):
        for i, crack in enumerate(comparison.crack.values):
            size = np.abs(as_complex(comparison.swept_displacement.sel(crack=crack, harmonic=n)))
            if size.max() > LEAST:
                panel.semilogy(speed, size * 1e6, label=label(crack), **_style(i))
        if speed[0] < 1 / n < speed[-1]:
            panel.axvline(1 / n, color="k", linewidth=0.8, linestyle=":")
        panel.set(ylabel=f"{n}X (µm)")
    axes[0, 0].set_title("Dotted: natural frequency of the uncracked rotor over the order")
    axes[-1, 0].set_xlabel("speed over natural frequency of the uncracked rotor (1)")
    return finished(picture, "Subcritical resonances: nX peaks just below 1/n of the natural frequency", legend=3)


def depth(config, comparison):
    """Stiffness loss over crack depth."""
    shaft, (picture, axes) = config.shaft, figure(height=2.6, width=4.5)
    loss = comparison.depth_loss / shaft.stiffness * 100
    for i, law in enumerate(comparison.depth.values):
        for turning, line in (("xi", "-"), ("eta", "--")):
            style = {"color": COLOURS[i % len(COLOURS)], "label": f"{label(law)}, {GREEK[turning]}"}
            axes[0, 0].plot(comparison.depth_ratio, loss.sel(depth=law, turning=turning), line, **style)
    axes[0, 0].set(
        xlabel="crack depth over diameter (1)",
        ylabel="stiffness loss of the shaft (%)",
        xlim=(0, 0.02 + max(plugin.valid[1] for plugin in registry().plugins["depth"].values())),
        title=f"Crack and disc at mid-span; diameter {shaft.diameter_m * 1e3:g} mm, span {shaft.span_m * 1e3:g} mm",
    )
    axes[0, 0].legend()
    return finished(picture, "Only a deep crack reduces the stiffness noticeably")
