"""Figures of records, full spectra, stability and whirl: each function takes results and returns a figure."""

from typing import NamedTuple

import numpy as np

from rotorstudy.measurement.records import reference_signal
from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, harmonic_axis, plot_full_spectrum, plot_orbit
from rotorstudy.store import as_complex

MOST_DEGREES = 225  # of the axis of phases, so that those about 180 need not be split
FLAT = 0.01  # change of a whirl frequency with speed, below which it is taken for constant


def record(study, speed, title):
    """Three revolutions at a shown speed: both directions, orbit and phase reference; steady state and start from rest.

    {off} in the title: of the start from rest from the steady state
    """
    records, w = study.results["records"], study.config.shown_speeds_rad_s[speed]
    steady, rest = both = as_complex(records.displacement.sel(speed=w, method="nearest").isel(node=0))
    off = f"{np.abs(rest - steady).max() / np.abs(steady).max() * 100:.1g} %"
    shown = records.time.values < 3 * 2 * np.pi / w
    time = records.time.values[shown]
    picture, axes = figure(2, 2)
    # the curves coincide: a thin one on a wide one
    for source, z, index, width in zip(records.source.values, both[:, shown], (5, 6), (3.5, 0.8), strict=True):
        style = {"label": str(source), "color": COLOURS[index], "linewidth": width}
        axes[0, 0].plot(time * 1e3, z.real * 1e6, **style)
        axes[0, 1].plot(time * 1e3, z.imag * 1e6, **style)
        plot_orbit(z, axes[1, 0], index=index, linewidth=width)
    axes[1, 1].plot(time * 1e3, reference_signal(w, study.config.harmonics, time), color=COLOURS[6])
    axes[0, 0].set(xlabel="time (ms)", ylabel="vertical x (µm)", title="Vertical displacement")
    axes[0, 1].set(xlabel="time (ms)", ylabel="horizontal y (µm)", title="Horizontal displacement")
    axes[1, 0].set_title("Orbit")
    axes[1, 1].set(xlabel="time (ms)", ylabel="reference signal (1)", title="Multi-harmonic phase reference")
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    picture.suptitle(title.format(off=off))
    return picture


class Panel(NamedTuple):
    """Amplitudes, m, or phases of some spectra."""

    title: str
    kind: str  # "amplitude" or "phase"
    spectra: dict  # label -> (harmonic,) complex
    printed: tuple | None = None  # harmonics and values, m or rad, of the thesis, if there are any


def full_spectra(harmonics, panels):
    """The Panels of several spectra of one record, one below the other."""
    from matplotlib.legend_handler import HandlerTuple

    picture, axes = figure(len(panels), 1, height=2.2 if len(panels) < 5 else 1.7, width=4.8)
    labels, entries = list(dict.fromkeys(label for one in panels for label in one.spectra)), {}
    for panel, (title, kind, spectra, printed) in zip(axes[:, 0], panels, strict=True):
        first, last = (list(spectra.values())[k] for k in (0, -1))
        for i, (name, values) in enumerate(spectra.items()):
            if kind == "amplitude":
                plot_full_spectrum(harmonics, values, panel, label=name, index=i, count=len(spectra))
            else:
                plot_phase(harmonics, values, panel, name, labels.index(name), first)
        if printed:
            at, shown = printed[0], 1e6 * np.asarray(printed[1])
            if kind == "phase":
                shown = phases_near(np.rad2deg(printed[1]), phases_of(last, first, harmonics, at))
            panel.plot(at, shown, "kx", markersize=3, label="printed in the thesis")
        panel.set_title(title)
        panel.set_xlabel(panel.get_xlabel() if panel is axes[-1, 0] else "")
        for handle, text in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(text, {})[type(handle).__name__] = handle  # a bar of amplitudes, a mark of phases
    both = [tuple(kinds.values()) for kinds in entries.values()]
    picture.legend(both, entries.keys(), loc="outside lower center", ncols=3, handler_map={tuple: HandlerTuple(None)})
    return picture


def phases_near(phases, near):
    """Phases (...) in degrees, moved by a revolution where that brings them beside those of `near` (...), degrees."""
    beside = near + (np.asarray(phases) - near + 180) % 360 - 180
    return np.where(np.abs(beside) > MOST_DEGREES, phases, beside)


def phases_of(amplitude, near, harmonics, at):
    """Phases in degrees, as `plot_phase` draws them, of some harmonics `at` of amplitude (harmonic,)."""
    drawn = phases_near(np.angle(amplitude, deg=True), np.angle(near, deg=True))
    return drawn[[list(harmonics).index(n) for n in at]]


def plot_phase(harmonics, amplitude, axes, label, index, near):
    """Phase of R_n in degrees over the harmonics, as points; near : drawn before, -179 stands beside its 180."""
    phase = phases_of(amplitude, near, harmonics, harmonics)
    style = {"color": COLOURS[index], "fillstyle": "none", "markersize": max(8 - 2 * index, 3), "clip_on": False}
    axes.plot(np.asarray(harmonics), phase, MARKERS[index], label=label, **style)
    axes.set_ylim(-MOST_DEGREES - 15, MOST_DEGREES + 15)  # with room for a mark
    axes.set_yticks(range(-180, 181, 90))
    axes.set_ylabel("phase (°)")
    harmonic_axis(axes, harmonics)


def stability(study, formula=None):
    """Growth rate over speed, and the threshold of stability; formula : 1 + the damping ratio, as written."""
    stable = study.results["stability"]
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


def campbell(study, rigs, title):
    """Whirl frequency over speed with the lines of 1X, 2X, 3X and -1X; rigs: name in the data -> name shown."""
    picture, axes = figure(1, len(rigs), height=3.2, sharey=True)
    whirl = study.results["whirl"]
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
