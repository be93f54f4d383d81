"""Figures of Chapter 6: the rotor with two discs on anisotropic bearings."""

import numpy as np

from rotorstudy.presentation import estimate_figures
from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, plot_orbit
from rotorstudy.presentation.spectrum_figures import Panel, full_spectra
from rotorstudy.response.measured import measured_response
from rotorstudy.response.statics import static_deflection
from rotorstudy.response.whirl import time_invariant, whirl_modes, without_damping
from rotorstudy.store import as_complex
from rotorstudy.studies.config import file_name
from rotorstudy.units import percent
from thesis.figures.common import study_figures
from thesis.scoreboard import published

PLACES = {1: "left bearing", 2: "disc 1", 3: "crack", 4: "disc 2", 5: "right bearing"}
DIRECTIONS = {"figure_6_6": (np.real, "vertical x"), "figure_6_7": (np.imag, "horizontal y")}
QUANTITIES = {"figure_6_9": "amplitude", "figure_6_10": "phase"}


def positions(config):
    """(position,) along the shaft of the main rig, m."""
    length = sum(part["length_m"] for part in config.rigs[config.main_rig]["rotor"]["elements"])
    return np.linspace(0, length, 201)


def static_line(model, position, speed):
    """Figure 6.5: deflection and slope at rest; position : (position,) m."""
    structure = model.structure
    deflection = static_deflection(model, [speed], model.theta[: len(model.rotor_unknowns)]).value[0].real
    line = np.array([structure.shape_at(s) for s in position]) @ deflection
    at = np.linspace(0, position[-1], len(structure.nodes))
    picture, axes = figure(1, 2, height=2.4)
    axes[0, 0].plot(position, line * 1e6)
    axes[0, 0].plot(at, [deflection[structure.index(n)] * 1e6 for n in structure.nodes], "ko", label="nodes")
    axes[0, 0].set(xlabel="position along the shaft (m)", ylabel="static deflection (µm)", title="Deflection")
    axes[0, 0].invert_yaxis()
    axes[0, 0].legend()
    axes[0, 1].plot(position, np.gradient(line, position) * 1e6)
    axes[0, 1].plot(at, [deflection[structure.index(n, "tilt")] * 1e6 for n in structure.nodes], "ko")
    axes[0, 1].set(xlabel="position along the shaft (m)", ylabel="slope (µrad)", title="Slope")
    bearings = deflection[structure.index(1)] / deflection[structure.index(3)]
    picture.suptitle(f"Static line: the bearings contribute {percent(bearings, 2)} of the deflection at the crack")
    return picture


def motion(records, speed):
    """Three revolutions at every node: time (time,) ms, and node -> (time,) complex, um."""
    here = records.sel(speed=speed, method="nearest").sel(source="from rest")
    shown = here.time.values < 3 * 2 * np.pi / speed
    signals = {n: as_complex(here.displacement.sel(node=n))[shown] * 1e6 for n in PLACES}
    return here.time.values[shown] * 1e3, signals


def records_figure(time, signals, speed, part, text):
    """Figures 6.6 and 6.7: one direction of the motion of every node; time, signals : of `motion`."""
    picture, axes = figure(1, 1, height=2.8, width=5.5)
    for i, (n, place) in enumerate(PLACES.items()):
        axes[0, 0].plot(time, part(signals[n]), color=COLOURS[i], label=f"node {n}: {place}", linewidth=1.0)
    axes[0, 0].set(xlabel="time (ms)", ylabel=f"{text} (µm)")
    axes[0, 0].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    picture.suptitle(f"Three revolutions at {speed:g} rad/s, about the static deflection")
    return picture


def orbits_figure(signals, speed):
    """Figure 6.8: orbits of every node; signals : of `motion`."""
    picture, axes = figure(1, len(PLACES), height=2.4, width=2.0)
    for panel, (n, place) in zip(axes[0], PLACES.items(), strict=True):
        plot_orbit(signals[n] * 1e-6, panel)
        panel.set_title(f"node {n}: {place}")
    picture.suptitle(f"Orbits at {speed:g} rad/s: the shaft moves like a rigid body on its soft bearings")
    return picture


def spectra_figure(config, rows, speed, quantity, printed):
    """Figures 6.9 and 6.10: amplitude or phase of the full spectra of every node; rows : label -> spectra Dataset."""
    seen = {"source": "from rest", "record": "complete cycles", "spectrum_method": "regression"}
    seen = {**seen, "phase_reference": "reference"}
    found = {name: data.displacement.sel(seen).sel(speed=speed, method="nearest") for name, data in rows.items()}
    printed, panels = printed[(printed.quantity == quantity) & (printed.method == "regression")], []
    for n, place in PLACES.items():
        own = printed[printed.case == f"100 rad/s, node {n}"]
        marks = (own.item.astype(int), own.published) if len(own) else None
        spectra = {name: as_complex(data.sel(node=n)) for name, data in found.items()}
        panels.append(Panel(f"node {n}: {place}", quantity, spectra, marks))
    picture = full_spectra(config.harmonics, panels)
    picture.suptitle(f"Full spectrum at {speed:g} rad/s, {quantity}")
    return picture


def modes_and_unbalance(model, position, speed):
    """Lowest whirl modes without damping, and the response to unbalance over speed; position : (position,) m."""
    uncracked = time_invariant(model)
    values, shapes = whirl_modes(uncracked, speed, without_damping(uncracked))
    lowest = np.flatnonzero(values.imag > 0)[:4]
    interpolated = np.array([model.structure.shape_at(s) for s in position])
    picture, axes = figure(1, 2, height=2.6)
    for i, mode in enumerate(lowest):
        both = interpolated @ shapes[mode].reshape(2, -1).T  # forward and backward part; vertical is their sum
        vertical, horizontal = np.abs(both.sum(axis=1)), np.abs(both[:, 0] - both[:, 1])
        main, way = (vertical, "x") if vertical.max() > horizontal.max() else (horizontal, "y")
        label = f"{values[mode].imag:.0f} rad/s, mostly {way}"
        axes[0, 0].plot(position, main / main.max(), color=COLOURS[i], label=label)
    axes[0, 0].set(xlabel="position along the shaft (m)", ylabel="size over largest (1)", title="Lowest whirl modes")
    axes[0, 0].legend(fontsize=6)
    sweep = np.linspace(20.0, 600.0, 400)
    response = np.abs(measured_response(uncracked, sweep, [1])[:, 0]) * 1e6
    for i, n in enumerate(model.sensors):
        axes[0, 1].semilogy(sweep, response[:, i], color=COLOURS[i], label=f"node {n}")
    axes[0, 1].set(xlabel="spin speed (rad/s)", ylabel="1X forward (µm)", title="Response to unbalance")
    axes[0, 1].legend(fontsize=6, loc="lower right")
    first = np.sort(np.abs(values[lowest].imag))[:2]
    picture.suptitle(f"First whirl at {first[0]:.0f} and {first[1]:.0f} rad/s; the thesis prints 415.99 rad/s")
    return picture


def sensors_figure(config, few):
    """Errors and bounds with few sensors, and starts that converge; few : of `studies.sensors.sensors`."""
    picture, axes = figure(1, len(config.cases), height=3.6, width=4.0, sharey=True)
    place = range(few.sizes["parameter"])
    axes[0, 0].set_yticks(place, [estimate_figures.label(name) for name in few.parameter.values])
    for panel, case in zip(axes[0], config.cases, strict=True):
        for i, (name, nodes) in enumerate(config.sensor_sets.items()):
            right = [int((few.start_error.sel(sensors=name, case=one) < 1e-6).sum()) for one in config.cases]
            starts = " and ".join(map(str, dict.fromkeys(right)))
            text = f"nodes {', '.join(map(str, nodes))} ({starts} of {few.sizes['start']} starts converge)"
            style = {"color": COLOURS[i], "label": text}
            bound = few.bound.sel(sensors=name, case=case) * 100
            panel.plot(bound, place, "|", markersize=9, color=COLOURS[i])
            scatter = few.scatter.sel(sensors=name, case=case) * 100
            panel.plot(scatter, place, MARKERS[i], fillstyle="none", **style)
        panel.set_xscale("log")
        panel.set(xlabel="error at 1 % noise (%; phases: % of 1 rad)", title=case)
    axes[0, 0].invert_yaxis()
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    smallest = min(config.sensor_sets, key=lambda name: len(config.sensor_sets[name]))
    times = float((few.bound.sel(sensors=smallest) / few.bound.sel(sensors=next(iter(config.sensor_sets)))).max())
    nodes = ", ".join(map(str, config.sensor_sets[smallest]))
    picture.suptitle(f"By node {nodes} alone bounds (dashes) are up to {times:.0f} times those of all sensors")
    return picture


TITLES = {
    "error_against_noise": "Maximum likelihood attains the bound; least squares does not",
    "collinearity": "Even at a single speed, correlation costs about a factor of three at most",
    "campbell": "Whirl on anisotropic bearings",
    "bias": "A wrong disc mass affects the bearings of maximum likelihood, not of least squares",
    "weight_dominance": "Weight dominance falsifies the internal damping and the crack stiffness",
}


def figures(config, reference, records, spectra, thesis_spectra, sensors, monte_carlo, **stages):
    """The figures of Chapter 6; as those of Chapter 2, with the Dataset of `sensors`."""
    printed = published(reference, [f"6.{n}" for n in range(2, 8)])
    model, speed, position = config.rig(config.main_rig), config.shown_speeds_rad_s[0], positions(config)
    combined = list(config.cases)[1]
    best = {case: monte_carlo[file_name(case)].sel(record="steady state") for case in config.cases}
    rigs = {"physical": "right gyroscopic sign", "thesis": "the thesis's sign and mass"}
    found = study_figures(config, stages, best, {combined: combined}, TITLES, rigs=rigs)
    time, signals = motion(records, speed)
    for name, (part, text) in DIRECTIONS.items():
        found[name] = records_figure(time, signals, speed, part, text)
    rows = {"physical": spectra, "the thesis's reading": thesis_spectra}
    for name, quantity in QUANTITIES.items():
        found[name] = spectra_figure(config, rows, speed, quantity, printed)
    return found | {
        "figure_6_5": static_line(model, position, speed),
        "figure_6_8": orbits_figure(signals, speed),
        "modes_and_unbalance": modes_and_unbalance(model, position, speed),
        "sensors": sensors_figure(config, sensors),
    }
