"""Figures of the simulated chapters (2, 4 and 6): kinds of figures, whose arguments are in `report/captions.yaml`."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from rotorstudy.measurement.noise import standard_normal, with_noise
from rotorstudy.model.cracks import SERIES_ORDER
from rotorstudy.model.registry import registry
from rotorstudy.presentation.plots import figure, plot_orbit
from rotorstudy.response.measured import measured_response
from rotorstudy.response.statics import static_deflection
from rotorstudy.response.whirl import time_invariant, whirl_modes, without_damping
from rotorstudy.store import as_complex
from rotorstudy.studies.config import StudyConfig, file_name
from rotorstudy.units import percent
from thesis.chapter_tables import described, places
from thesis.figures import estimates, responses
from thesis.figures.responses import Panel, full_spectra
from thesis.scoreboard import PLACE, PRINTED, published

PLACES = {1: "left bearing", 2: "disc 1", 3: "crack", 4: "disc 2", 5: "right bearing"}  # nodes of Chapter 6
DIRECTIONS = {"vertical x": np.real, "horizontal y": np.imag}


class Study(NamedTuple):
    """A chapter: results of its stages by name, printed values, and where ours of each printed column are."""

    config: StudyConfig
    results: dict
    printed: pd.DataFrame
    columns: list

    def spectrum(self, quantity, speed_rad_s, node=None, rig="physical", noise=False, **where):
        """(harmonic,) complex of a rig; with one realisation of 1 % white noise in time."""
        results = self.results["spectra" if rig == "physical" else f"spectra_{rig}"]
        here = results.sel(speed=speed_rad_s, method="nearest")
        if quantity == "reference phase":
            return np.exp(1j * here.reference_phase.sel(where).values)
        found = as_complex(here.displacement.sel(where).sel(node=int(here.node[0] if node is None else node)))
        if not noise:
            return found
        config = self.config
        steady = config.clean_spectrum(config.rig(rig), [float(here.speed)])
        numbers = standard_normal(config.monte_carlo.seed, 99, 1, (2, *steady.amplitude.shape))
        trial = with_noise(steady, 0.01, "white in time", config.record.samples, numbers)
        return found + (trial.amplitude[0] - steady.amplitude)[0, :, 0]

    def panel(self, title, column, rows, **elsewhere):
        """Spectra at the place of a printed column (table, case, method), which has the crosses, or elsewhere."""
        (at,) = [one for one in self.columns if [one[key] for key in ("table", "case", "method")] == column]
        place, known = {key: at[key] for key in PLACE if key in at} | elsewhere, self.printed
        shown = {label: self.spectrum(at["quantity"], **(place | given)) for label, given in rows.items()}
        for key, value in zip(("table", "case", "method"), column, strict=True):
            known = known[known[key] == value]
        marks = None if elsewhere else (known.item.astype(int), known.published)
        kind = "amplitude" if at["quantity"] == "amplitude" else "phase"
        return Panel(title.format(speed=f"{place['speed_rad_s']:g} rad/s"), kind, shown, marks)


def breathing_function(study, speed):
    """The breathing function of the crack and its series, over two revolutions."""
    config = study.config
    crack = registry().get("crack", config.rigs[config.main_rig]["cracks"][0]["kind"])
    picture, axes = figure()
    time = np.linspace(0, 4 * np.pi / speed, 2000)
    axes[0, 0].plot(time * 1e3, crack.function(speed * time), label="switching crack")
    for order, style in ((7, "--"), (SERIES_ORDER, ":")):
        series = sum(s * np.exp(1j * k * speed * time) for k, s in crack.series(order).items()).real
        axes[0, 0].plot(time * 1e3, series, style, label=f"series to order {order}")
    title = f"Breathing function over two revolutions at {speed:g} rad/s"
    axes[0, 0].set(xlabel="time (ms)", ylabel="breathing function (1: open)", title=title)
    axes[0, 0].set_ylim(-0.15, 1.65)
    axes[0, 0].legend(loc="upper center", ncols=2)
    return picture


def spectra(study, panels, speed=None):
    """Full spectra; panels : arguments of `Study.panel`;  speed : of the shown ones, instead of that of the columns."""
    elsewhere = {} if speed is None else {"speed_rad_s": study.config.shown_speeds_rad_s[speed]}
    return full_spectra(study.config.harmonics, [study.panel(**panel, **elsewhere) for panel in panels])


def spectra_of_nodes(study, title, columns, rows):
    """Full spectra of every node, those beyond the printed columns without crosses."""
    columns = dict(zip(PLACES, columns, strict=False))
    some = next(iter(columns.values()))
    named = {n: f"node {n}: {place}" for n, place in PLACES.items()}
    own = {n: {} if n in columns else {"node": n} for n in PLACES}
    panels = [study.panel(named[n], columns.get(n, some), rows, **own[n]) for n in PLACES]
    picture = full_spectra(study.config.harmonics, panels)
    picture.suptitle(title)
    return picture


def motion(study):
    """Three revolutions at every node: time (time,) ms, node -> (time,) complex, m, and the speed."""
    speed = study.config.shown_speeds_rad_s[0]
    here = study.results["records"].sel(speed=speed, method="nearest").sel(source="from rest")
    shown = here.time.values < 3 * 2 * np.pi / speed
    signals = {n: as_complex(here.displacement.sel(node=n))[shown] for n in PLACES}
    return here.time.values[shown] * 1e3, signals, speed


def records_of_nodes(study, direction):
    """One direction of the motion of every node."""
    time, signals, speed = motion(study)
    picture, axes = figure(1, 1, height=2.8, width=5.5)
    for n, place in PLACES.items():
        values = DIRECTIONS[direction](signals[n]) * 1e6
        axes[0, 0].plot(time, values, label=f"node {n}: {place}", linewidth=1.0)
    axes[0, 0].set(xlabel="time (ms)", ylabel=f"{direction} (µm)")
    axes[0, 0].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    picture.suptitle(f"Three revolutions at {speed:g} rad/s, about the static deflection")
    return picture


def orbits(study):
    """Orbits of every node."""
    _, signals, speed = motion(study)
    picture, axes = figure(1, len(PLACES), height=2.4, width=2.0)
    for panel, (n, place) in zip(axes[0], PLACES.items(), strict=True):
        plot_orbit(signals[n], panel)
        panel.set_title(f"node {n}: {place}")
    picture.suptitle(f"Orbits at {speed:g} rad/s: the shaft moves like a rigid body on its soft bearings")
    return picture


def along_the_shaft(model):
    """Positions (position,) on the shaft, m, and the motion (position, dof) there by a unit of each coordinate."""
    position = np.linspace(0, model.structure.length, 201)
    return position, np.array([model.structure.shape_at(s) for s in position])


def static_line(study):
    """Deflection and slope at rest."""
    model, speed = study.config.rig(study.config.main_rig), study.config.shown_speeds_rad_s[0]
    structure, (position, shapes) = model.structure, along_the_shaft(model)
    deflection = static_deflection(model, [speed], model.theta[: len(model.rotor_unknowns)]).value[0].real
    line = shapes @ deflection
    at = np.linspace(0, position[-1], len(structure.nodes))
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
    bearings = deflection[structure.index(1)] / deflection[structure.index(3)]
    picture.suptitle(f"Static line: the bearings contribute {percent(bearings, 2)} of the deflection at the crack")
    return picture


def modes_and_unbalance(study):
    """Lowest whirl modes without damping, and the response to unbalance over speed."""
    model, speed = study.config.rig(study.config.main_rig), study.config.shown_speeds_rad_s[0]
    uncracked, (position, interpolated) = time_invariant(model), along_the_shaft(model)
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
    first = np.sort(np.abs(values[lowest].imag))[:2]
    picture.suptitle(f"First whirl at {first[0]:.0f} and {first[1]:.0f} rad/s; the thesis prints 415.99 rad/s")
    return picture


def error_against_noise(study, title, cases=None, by_record=False, trials="monte_carlo"):
    """Errors of estimates; cases : case -> its name, by default all;  by_record : a column for each kind of record."""
    data = {name: study.results[trials][file_name(case)] for case, name in estimates.named_cases(study, cases).items()}
    if by_record:
        ((_, data),) = data.items()
        data = {kind: data.sel(record=kind) for kind in study.config.record.kinds}
    else:
        data = {name: one.sel(record="steady state") for name, one in data.items()}
    return estimates.error_against_noise(data, study.config.reported, title)


KINDS = {  # a figure is of the kind of its name where it states none
    "record": responses.record,
    "spectra": spectra,
    "spectra of nodes": spectra_of_nodes,
    "records of nodes": records_of_nodes,
    "orbits": orbits,
    "static line": static_line,
    "breathing function": breathing_function,
    "modes_and_unbalance": modes_and_unbalance,
    "error_against_noise": error_against_noise,
    "bias": estimates.bias,
    "weight_dominance": estimates.weight_dominance,
    "collinearity": estimates.collinearity,
    "measurements": estimates.measurements,
    "sensors": estimates.sensors,
    "stability": responses.stability,
    "campbell": responses.campbell,
}


def figures(config, reference, shown, **results):
    """The figures `shown` of a chapter, {name: arguments}, from the Datasets of its stages."""
    numbers = list(described(reference, config.name)["tables"])
    columns = places(reference, "full_spectrum", numbers, [*PRINTED, *PLACE])
    study = Study(config, results, published(reference, numbers), columns)
    found = {}
    for name, arguments in shown.items():
        kind = arguments.get("kind", name)
        found[name] = KINDS[kind](study, **{key: value for key, value in arguments.items() if key != "kind"})
    return found
