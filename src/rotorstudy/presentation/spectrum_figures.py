"""Figures of records and of their full spectra. Each function takes results and returns a matplotlib figure."""

import numpy as np

from rotorstudy.measurement.records import reference_signal
from rotorstudy.presentation.plots import (
    COLOURS,
    figure,
    phases_near,
    phases_of,
    plot_full_spectrum,
    plot_orbit,
    plot_phase,
)
from rotorstudy.store import as_complex

SOURCES = ((5, 3.5), (6, 0.8))  # colour and width of the steady state, and of the start from rest


def time_and_orbit(config, records, speed, title):
    """Three revolutions of a record: both directions, orbit and phase reference; steady state and start from rest."""
    shown = records.time.values < 3 * 2 * np.pi / speed
    time = records.time.values[shown]
    picture, axes = figure(2, 2)
    for i, source in enumerate(records.source.values):
        z = as_complex(records.displacement.sel(source=source).sel(speed=speed, method="nearest").isel(node=0))[shown]
        index, width = SOURCES[i]  # the curves coincide: a thin one on a wide one
        style = {"label": str(source), "color": COLOURS[index], "linewidth": width}
        axes[0, 0].plot(time * 1e3, z.real * 1e6, **style)
        axes[0, 1].plot(time * 1e3, z.imag * 1e6, **style)
        plot_orbit(z, axes[1, 0], index=index, linewidth=width)
    axes[1, 1].plot(time * 1e3, reference_signal(speed, config.harmonics, time), color=COLOURS[6])
    axes[0, 0].set(xlabel="time (ms)", ylabel="vertical x (µm)", title="Vertical displacement")
    axes[0, 1].set(xlabel="time (ms)", ylabel="horizontal y (µm)", title="Horizontal displacement")
    axes[1, 0].set_title("Orbit")
    axes[1, 1].set(xlabel="time (ms)", ylabel="reference signal (1)", title="Multi-harmonic phase reference")
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    picture.suptitle(title)
    return picture


def full_spectra(harmonics, rows, panels, printed=None):
    """Amplitudes and phases of several spectra of one record, one panel below the other.

    rows    : label -> (panel -> (harmonic,) complex); panel is a title and "amplitude" or "phase"
    panels  : [(title, "amplitude" or "phase")]
    printed : title -> (harmonics, values in m or rad) of the thesis
    """
    from matplotlib.legend_handler import HandlerTuple

    picture, axes = figure(len(panels), 1, height=2.2 if len(panels) < 5 else 1.7, width=4.8)
    for panel, (title, kind) in zip(axes[:, 0], panels, strict=True):
        here = {name: values[title] for name, values in rows.items() if title in values}
        for i, (name, values) in enumerate(here.items()):
            index = list(rows).index(name)
            if kind == "amplitude":
                plot_full_spectrum(harmonics, values, panel, label=name, index=i, count=len(here))
            else:
                plot_phase(harmonics, values, panel, label=name, index=index, near=next(iter(here.values())))
        if printed and title in printed:
            at, values = printed[title]
            first, last = (list(here.values())[k] for k in (0, -1))
            shown = 1e6 * np.asarray(values)
            if kind == "phase":
                shown = phases_near(np.rad2deg(values), phases_of(last, first, harmonics, at))
            panel.plot(at, shown, "kx", markersize=3, label="printed in the thesis")
        panel.set_title(title)
        panel.set_xlabel(panel.get_xlabel() if title == panels[-1][0] else "")
    entries = [panel.get_legend_handles_labels() for panel in axes[:, 0]]
    shown = {}
    for handles, texts in entries:
        for handle, text in zip(handles, texts, strict=True):
            shown.setdefault(text, {})[type(handle).__name__] = handle  # a bar of the amplitudes, a mark of the phases
    both = [tuple(kinds.values()) for kinds in shown.values()]
    picture.legend(both, shown.keys(), loc="outside lower center", ncols=3, handler_map={tuple: HandlerTuple(None)})
    return picture
