"""Full spectra of the thesis's records, amplitudes and phases, one below the other."""

from typing import NamedTuple

import numpy as np

from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, harmonic_axis, plot_full_spectrum

MOST_DEGREES = 225  # of the axis of phases, so that those about 180 need not be split


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
        panel.set(title=title, xlabel=panel.get_xlabel() if panel is axes[-1, 0] else "")
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
