"""Figures of stability and whirl. Each function takes results and returns a matplotlib figure."""

import numpy as np

from rotorstudy.presentation.plots import COLOURS, MARKERS, figure

FLAT = 0.01  # change of a whirl frequency with speed, below which it is taken for constant


def stability(stable, formula=None):
    """Growth rate over speed, and the threshold of stability; formula : 1 + the damping ratio, as written."""
    picture, axes = figure(1, 2, height=2.6)
    natural = float(stable.natural_frequency)
    for i, damping in enumerate(stable.damping_ratio.values):
        growth = stable.growth_rate.sel(damping_ratio=damping)
        axes[0, 0].plot(stable.relative_speed, growth, color=COLOURS[i], label=f"$c_E / c_H = {damping:g}$")
    axes[0, 0].axhline(0, color="k", linewidth=0.8)
    axes[0, 0].set(xlabel="speed / natural frequency (1)", ylabel="growth rate (1/s)", title="Unstable above zero")
    axes[0, 0].legend()
    line = np.linspace(0, float(stable.damping_ratio.max()), 50)
    if formula:
        axes[0, 1].plot(line, 1 + line, "k--", label=formula)
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
            _mode(panel, speed, frequency[:, mode], mixed=bool((frequency > 0).all()))
        for i, order in enumerate(whirl.order.values):
            if order > 0:
                panel.plot(speed, order * speed, ":", color="0.5", linewidth=0.9)
                top = min(speed[-1], highest / order)
                panel.annotate(f"{order}X", (top, order * top), fontsize=7, ha="right", va="top")
            marks = here.critical_speed.sel(order=order).values / (2 * np.pi)
            marks = marks[(marks < 0.99 * speed[-1]) & (abs(order) * marks < 0.99 * highest)]  # not on the frame
            style = {"color": "k", "fillstyle": "none", "linestyle": "", "label": f"meets {order}X"}
            panel.plot(marks, abs(order) * marks, MARKERS[i], **style)
        panel.set(xlabel="spin speed (Hz)", title=shown, xlim=(0, speed[-1]), ylim=(0, highest))
    axes[0, 0].set_ylabel("whirl frequency (Hz)")
    named = {}
    for panel in axes[0]:
        named |= dict(zip(*panel.get_legend_handles_labels()[::-1], strict=True))
    picture.legend(named.values(), named.keys(), loc="outside lower center", ncols=3)
    picture.suptitle(title)
    return picture


def _mode(panel, speed, frequency, mixed):
    """The line of a mode over speed, in Hz; elliptic whirl (mixed) is told by its slope, of gyroscopic moments."""
    if not mixed:
        forward = np.median(frequency) > 0
        kinds = [("forward whirl", np.full(len(speed), forward)), ("backward whirl", np.full(len(speed), not forward))]
    else:
        slope = np.gradient(frequency, speed)
        rising, falling = slope > FLAT, slope < -FLAT
        names = ("rises with speed: mostly forward", "falls with speed: mostly backward", "neither")
        kinds = list(zip(names, (rising, falling, ~rising & ~falling), strict=True))
    for i, (text, chosen) in enumerate(kinds):
        if chosen.any():
            line = np.where(chosen, np.abs(frequency), np.nan)
            panel.plot(speed, line, ("-", "--", "-.")[i], color=COLOURS[i], label=text)
