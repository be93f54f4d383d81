"""Figures of records and of their full spectra. Each function takes results and returns a matplotlib figure."""

from typing import NamedTuple

import numpy as np

from rotorstudy.measurement.records import reference_signal
from rotorstudy.presentation import plots
from rotorstudy.store import as_complex

SOURCES = ((5, 3.5), (6, 0.8))  # colour and width of the steady state, and of the start from rest


def time_and_orbit(config, records, speed, title):
    """Three revolutions of a record: both directions, orbit and phase reference; steady state and start from rest."""
    shown = records.time.values < 3 * 2 * np.pi / speed
    time = records.time.values[shown]
    picture, axes = plots.figure(2, 2)
    for i, source in enumerate(records.source.values):
        z = as_complex(records.displacement.sel(source=source).sel(speed=speed, method="nearest").isel(node=0))[shown]
        index, width = SOURCES[i]  # the curves coincide: a thin one on a wide one
        style = {"label": str(source), "color": plots.COLOURS[index], "linewidth": width}
        axes[0, 0].plot(time * 1e3, z.real * 1e6, **style)
        axes[0, 1].plot(time * 1e3, z.imag * 1e6, **style)
        plots.plot_orbit(z, axes[1, 0], index=index, linewidth=width)
    axes[1, 1].plot(time * 1e3, reference_signal(speed, config.harmonics, time), color=plots.COLOURS[6])
    axes[0, 0].set(xlabel="time (ms)", ylabel="vertical x (µm)", title="Vertical displacement")
    axes[0, 1].set(xlabel="time (ms)", ylabel="horizontal y (µm)", title="Horizontal displacement")
    axes[1, 0].set_title("Orbit")
    axes[1, 1].set(xlabel="time (ms)", ylabel="reference signal (1)", title="Multi-harmonic phase reference")
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    picture.suptitle(title)
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

    picture, axes = plots.figure(len(panels), 1, height=2.2 if len(panels) < 5 else 1.7, width=4.8)
    labels, entries = list(dict.fromkeys(label for one in panels for label in one.spectra)), {}
    for panel, (title, kind, spectra, printed) in zip(axes[:, 0], panels, strict=True):
        first, last = (list(spectra.values())[k] for k in (0, -1))
        for i, (name, values) in enumerate(spectra.items()):
            if kind == "amplitude":
                plots.plot_full_spectrum(harmonics, values, panel, label=name, index=i, count=len(spectra))
            else:
                plots.plot_phase(harmonics, values, panel, label=name, index=labels.index(name), near=first)
        if printed:
            at, shown = printed[0], 1e6 * np.asarray(printed[1])
            if kind == "phase":
                shown = plots.phases_near(np.rad2deg(printed[1]), plots.phases_of(last, first, harmonics, at))
            panel.plot(at, shown, "kx", markersize=3, label="printed in the thesis")
        panel.set_title(title)
        panel.set_xlabel(panel.get_xlabel() if panel is axes[-1, 0] else "")
        for handle, text in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(text, {})[type(handle).__name__] = handle  # a bar of amplitudes, a mark of phases
    both = [tuple(kinds.values()) for kinds in entries.values()]
    picture.legend(both, entries.keys(), loc="outside lower center", ncols=3, handler_map={tuple: HandlerTuple(None)})
    return picture
