"""Figures of the simulated chapters (2, 4 and 6): of their configuration, and of Datasets of their stages.

Further arguments are in `report/captions.yaml`.
"""

import numpy as np

from rotorstudy.measurement.noise import standard_normal, with_noise
from rotorstudy.measurement.records import reference_signal
from rotorstudy.model.cracks import SERIES_ORDER
from rotorstudy.model.registry import registry
from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, finished, plot_orbit
from rotorstudy.response.measured import measured_response
from rotorstudy.response.statics import static_deflection
from rotorstudy.response.whirl import time_invariant, whirl_modes, without_damping
from rotorstudy.store import as_complex
from rotorstudy.units import percent
from thesis.chapter_tables import places
from thesis.figures.full_spectra import Panel, full_spectra
from thesis.scoreboard import PLACE, PRINTED, published

PLACES = ("left bearing", "disc 1", "crack", "disc 2", "right bearing")
NODES = {n: f"node {n}: {place}" for n, place in enumerate(PLACES, start=1)}  # of Chapter 6
DIRECTIONS = {"vertical x": np.real, "horizontal y": np.imag}
FLAT = 0.01  # change of a whirl frequency with speed, below which it is taken for constant


def record(config, records, speed, title):
    """Three revolutions at a shown speed: both directions, orbit and phase reference; steady state and start from rest.

    {off} in the title: of the start from rest from the steady state
    """
    w, (picture, axes) = config.shown_speeds_rad_s[speed], figure(2, 2)
    steady, rest = both = as_complex(records.displacement.sel(speed=w, method="nearest").isel(node=0))
    off = f"{np.abs(rest - steady).max() / np.abs(steady).max() * 100:.1g} %"
    shown = records.time.values < 3 * 2 * np.pi / w
    time = records.time.values[shown]
    # the curves coincide: a thin one on a wide one
    for source, z, index, width in zip(records.source.values, both[:, shown], (5, 6), (3.5, 0.8), strict=True):
        style = {"label": str(source), "color": COLOURS[index], "linewidth": width}
        axes[0, 0].plot(time * 1e3, z.real * 1e6, **style)
        axes[0, 1].plot(time * 1e3, z.imag * 1e6, **style)
        plot_orbit(z, axes[1, 0], index=index, linewidth=width)
    axes[1, 1].plot(time * 1e3, reference_signal(w, config.harmonics, time), color=COLOURS[6])
    axes[0, 0].set(xlabel="time (ms)", ylabel="vertical x (µm)", title="Vertical displacement")
    axes[0, 1].set(xlabel="time (ms)", ylabel="horizontal y (µm)", title="Horizontal displacement")
    axes[1, 0].set_title("Orbit")
    axes[1, 1].set(xlabel="time (ms)", ylabel="reference signal (1)", title="Multi-harmonic phase reference")
    return finished(picture, title.format(off=off), legend=2)


def breathing_function(config, speed):
    """The breathing function of the crack and its series, over two revolutions."""
    crack = registry().get("crack", config.rigs[config.main_rig]["cracks"][0]["kind"])
    (picture, axes), time = figure(), np.linspace(0, 4 * np.pi / speed, 2000)
    axes[0, 0].plot(time * 1e3, crack.function(speed * time), label="switching crack")
    for order, line in ((7, "--"), (SERIES_ORDER, ":")):
        series = sum(s * np.exp(1j * k * speed * time) for k, s in crack.series(order).items()).real
        axes[0, 0].plot(time * 1e3, series, line, label=f"series to order {order}")
    title = f"Breathing function over two revolutions at {speed:g} rad/s"
    axes[0, 0].set(xlabel="time (ms)", ylabel="breathing function (1: open)", title=title, ylim=(-0.15, 1.65))
    axes[0, 0].legend(loc="upper center", ncols=2)
    return picture


def _spectrum(config, results, quantity, speed_rad_s, node=None, rig="physical", noise=False, **where):
    """(harmonic,) complex of a rig; with one realisation of 1 % white noise in time."""
    here = results[rig].sel(speed=speed_rad_s, method="nearest")
    if quantity == "reference phase":
        return np.exp(1j * here.reference_phase.sel(where).values)
    found = as_complex(here.displacement.sel(where).sel(node=int(here.node[0] if node is None else node)))
    if not noise:
        return found
    steady = config.clean_spectrum(config.rig(rig), [float(here.speed)])
    numbers = standard_normal(config.monte_carlo.seed, 99, 1, (2, *steady.amplitude.shape))
    trial = with_noise(steady, 0.01, "white in time", config.record.samples, numbers)
    return found + (trial.amplitude[0] - steady.amplitude)[0, :, 0]


def _panel(config, reference, results, title, column, rows, **elsewhere):
    """Spectra at the place of a printed column (table, case, method), which has the crosses, or elsewhere."""
    wanted = dict(zip(("table", "case", "method"), column, strict=True))
    columns = places(reference, "full_spectrum", column[:1], [*PRINTED, *PLACE])
    (at,) = [one for one in columns if wanted.items() <= one.items()]
    place = {key: at[key] for key in PLACE if key in at} | elsewhere
    shown = {label: _spectrum(config, results, at["quantity"], **(place | given)) for label, given in rows.items()}
    known = published(reference, column[:1])
    known = known[(known.case == wanted["case"]) & (known.method == wanted["method"])]
    marks = None if elsewhere else (known.item.astype(int), known.published)
    kind = "amplitude" if at["quantity"] == "amplitude" else "phase"
    return Panel(title.format(speed=f"{place['speed_rad_s']:g} rad/s"), kind, shown, marks)


def spectra(config, reference, spectra, spectra_thesis, panels, speed=None, title=None):
    """Full spectra; panels : arguments of `_panel`;  speed : of the shown ones, instead of that of the columns."""
    elsewhere = {} if speed is None else {"speed_rad_s": config.shown_speeds_rad_s[speed]}
    results = {"physical": spectra, "thesis": spectra_thesis}
    found = [_panel(config, reference, results, **one, **elsewhere) for one in panels]
    return finished(full_spectra(config.harmonics, found), title)


def _motion(config, records):
    """Three revolutions at every node: time (time,) ms, node -> (time,) complex, m, and the speed."""
    speed = config.shown_speeds_rad_s[0]
    here = records.sel(speed=speed, method="nearest").sel(source="from rest")
    shown = here.time.values < 3 * 2 * np.pi / speed
    signals = {n: as_complex(here.displacement.sel(node=n))[shown] for n in NODES}
    return here.time.values[shown] * 1e3, signals, speed


def records_of_nodes(config, records, direction):
    """One direction of the motion of every node."""
    time, signals, speed = _motion(config, records)
    picture, axes = figure(height=2.8, width=5.5)
    for n, name in NODES.items():
        axes[0, 0].plot(time, DIRECTIONS[direction](signals[n]) * 1e6, label=name, linewidth=1.0)
    axes[0, 0].set(xlabel="time (ms)", ylabel=f"{direction} (µm)")
    axes[0, 0].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return finished(picture, f"Three revolutions at {speed:g} rad/s, about the static deflection")


def orbits(config, records):
    """Orbits of every node."""
    _, signals, speed = _motion(config, records)
    picture, axes = figure(1, len(NODES), height=2.4, width=2.0)
    for panel, (n, name) in zip(axes[0], NODES.items(), strict=True):
        plot_orbit(signals[n], panel)
        panel.set_title(name)
    return finished(picture, f"Orbits at {speed:g} rad/s: the shaft moves like a rigid body on its soft bearings")


def _along_the_shaft(model):
    """Positions (position,) on the shaft, m, and the motion (position, dof) there by a unit of each coordinate."""
    position = np.linspace(0, model.structure.length, 201)
    return position, np.array([model.structure.shape_at(s) for s in position])


def static_line(config):
    """Deflection and slope at rest."""
    model, speed = config.rig(config.main_rig), config.shown_speeds_rad_s[0]
    structure, (position, shapes) = model.structure, _along_the_shaft(model)
    deflection = static_deflection(model, [speed], model.theta[: len(model.rotor_unknowns)]).value[0].real
    line, at = shapes @ deflection, np.linspace(0, position[-1], len(structure.nodes))
    picture, axes = figure(1, 2, height=2.4)
    for panel, values, kind, name in (
        (axes[0, 0], line, "translation", "static deflection (µm)"),
        (axes[0, 1], np.gradient(line, position), "tilt", "slope (µrad)"),
    ):
        panel.plot(position, values * 1e6)
        panel.plot(at, [deflection[structure.index(n, kind)] * 1e6 for n in structure.nodes], "ko", label="nodes")
        panel.set(xlabel="position along the shaft (m)", ylabel=name, title=name.split()[-2].capitalize())
    axes[0, 0].invert_yaxis()
    axes[0, 0].legend()
    share = percent(deflection[structure.index(1)] / deflection[structure.index(3)], 2)
    return finished(picture, f"Static line: the bearings contribute {share} of the deflection at the crack")


def modes_and_unbalance(config):
    """Lowest whirl modes without damping, and the response to unbalance over speed."""
    model, speed = config.rig(config.main_rig), config.shown_speeds_rad_s[0]
    uncracked, (position, interpolated) = time_invariant(model), _along_the_shaft(model)
    values, shapes = whirl_modes(uncracked, speed, without_damping(uncracked))
    lowest = np.flatnonzero(values.imag > 0)[:4]
    picture, axes = figure(1, 2, height=2.6)
    for mode in lowest:
        both = interpolated @ shapes[mode].reshape(2, -1).T  # forward and backward part; vertical is their sum
        vertical, horizontal = np.abs(both.sum(axis=1)), np.abs(both[:, 0] - both[:, 1])
        main, way = (vertical, "x") if vertical.max() > horizontal.max() else (horizontal, "y")
        axes[0, 0].plot(position, main / main.max(), label=f"{values[mode].imag:.0f} rad/s, mostly {way}")
    axes[0, 0].set(xlabel="position along the shaft (m)", ylabel="size over largest (1)", title="Lowest whirl modes")
    axes[0, 0].legend(fontsize=6)
    sweep = np.linspace(20.0, 600.0, 400)
    response = np.abs(measured_response(uncracked, sweep, [1])[:, 0]) * 1e6
    axes[0, 1].semilogy(sweep, response, label=[f"node {n}" for n in model.sensors])
    axes[0, 1].set(xlabel="spin speed (rad/s)", ylabel="1X forward (µm)", title="Response to unbalance")
    axes[0, 1].legend(fontsize=6, loc="lower right")
    first, second = np.sort(np.abs(values[lowest].imag))[:2]
    return finished(picture, f"First whirl at {first:.0f} and {second:.0f} rad/s; the thesis prints 415.99 rad/s")


def stability(stability, formula=None):
    """Growth rate over speed, and the threshold of stability; formula : 1 + the damping ratio, as written."""
    picture, axes = figure(1, 2, height=2.6)
    ratio, natural = stability.damping_ratio, float(stability.natural_frequency)
    for i, damping in enumerate(ratio.values):
        growth = stability.growth_rate.sel(damping_ratio=damping)
        axes[0, 0].plot(stability.relative_speed, growth, color=COLOURS[i], label=f"$c_E / c_H = {damping:g}$")
    axes[0, 0].axhline(0, color="k", linewidth=0.8)
    axes[0, 0].set(xlabel="speed / natural frequency (1)", ylabel="growth rate (1/s)", title="Unstable above zero")
    line = np.linspace(0, float(ratio.max()), 50)
    if formula:
        axes[0, 1].plot(line, 1 + line, "k--", label=formula)
    axes[0, 1].plot(ratio, stability.threshold / natural, MARKERS[0], color=COLOURS[0], label="eigenvalues")
    axes[0, 1].set(xlabel="external / internal damping (1)", ylabel="threshold / natural frequency (1)")
    axes[0, 1].set_title("Threshold of stability")
    for panel in axes[0]:
        panel.legend()
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
    return finished(picture, title, legend=3)


def _mode(panel, speed, frequency, mixed):
    """The line of a mode over speed, in Hz; elliptic whirl (mixed) is told by its slope, of gyroscopic moments."""
    if mixed:
        slope = np.gradient(frequency, speed)
        names = ("rises with speed: mostly forward", "falls with speed: mostly backward", "neither")
        kinds = zip(names, (slope > FLAT, slope < -FLAT, np.abs(slope) <= FLAT), strict=True)
    else:
        forward = np.full(len(speed), np.median(frequency) > 0)
        kinds = zip(("forward whirl", "backward whirl"), (forward, ~forward), strict=True)
    for i, (text, chosen) in enumerate(kinds):
        if chosen.any():
            line = np.where(chosen, np.abs(frequency), np.nan)
            panel.plot(speed, line, ("-", "--", "-.")[i], color=COLOURS[i], label=text)
