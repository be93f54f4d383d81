"""Records of a machine in a plant by the independent simulator, with a rig file from drawings: one folder a state.

    python benchmarks/plant.py FOLDER [STATE ...] [--draw N]

STATE: one of STATES below. The draw is of what differs from the drawings, of runout, gains and noise.

    python benchmarks/plant.py --table FILE STATE [--draw N]

writes what a monitoring system exports of a state: amplitudes of 1X and 2X to 0.01 mil and phases to 1 degree, at slow
roll and at speeds that scatter. The tables of examples/compressor are of draw 5, healthy and clearance.

    python benchmarks/plant.py --study FOLDER [STATE ...] [--draw N]

diagnoses the healthy machine, updates the rig by it, and compares it with the states; a line of JSON for each.
"""

import argparse
import csv
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from named_machines import plant

from rotorstudy.blind.machines.contacts import RubLaw
from rotorstudy.blind.machines.effects import add_preload, add_seal, add_thermal_bow
from rotorstudy.blind.machines.elastic_crack import arc_form
from rotorstudy.blind.machines.files import page
from rotorstudy.blind.machines.film import running_position
from rotorstudy.blind.machines.form_cracks import add_form
from rotorstudy.blind.machines.machine import LocalForce
from rotorstudy.blind.machines.measuring import Chain, Probe, record, surface_runout
from rotorstudy.blind.machines.stepping import steady_state

SPEEDS = np.array([1200, 1600, 2000, 2400, 2800, 3200, 3600, 4000]) * 2 * np.pi / 60
STATES = {  # what is true of each, and the effects and places that are right
    "healthy": (),
    "clearance": ("bearing_change", {"node": 4, "number": "radial_clearance_m"}),  # 35 % more at the drive end
    "clearance_nde": ("bearing_change", {"node": 10, "number": "radial_clearance_m"}),  # the same at the other end
    "hot_oil": ("bearing_change", {"number": "viscosity_Pa_s"}),  # 30 % thinner in both films
    "frame": ("foundation_change", {"node": 4}),  # its feet 25 % softer: grout
    "unbalance": ("unbalance", {"node": 14}),  # half as much again at the last wheel
    "unbalance_coupling": ("unbalance", {"node": 1}),  # twice as much
    "crack": ("transverse_crack", {"element": 10}),  # a fifth of the diameter beside the bearing of the wheels
    "crack_middle": ("transverse_crack", {"element": 7}),  # 0.35 of the diameter between the bearings
    "rub": ("rub", {"node": 12}),  # light, at the first wheel
    "preload": ("static_preload", {"node": 1}),  # 400 N across at the coupling
    "thermal_bow": ("bow", {}),  # 6 K across the shaft, in two elements between the bearings
    "seal": ("seal", {"node": 13}),  # that of the second wheel swirls
}
PROBES, ANGLES = (3, 9), (-np.pi / 4, np.pi / 4)
LABELS = {3: "DE", 9: "NDE"}
STEPS, MODES = 96, 10
AT_REST_V = -10.0  # gap voltage of every probe while the shaft lies at the bottom
FOUNDATION = (
    "foundation_mass", "foundation_stiffness_xx", "foundation_stiffness_yy", "foundation_damping_xx",
    "foundation_damping_yy", "bearings[frame].radius_of_gyration_m",
)  # fmt: skip


def rotor_in(state):
    """The rotor with its films in a state, and its foundation."""
    rotor, foundation = plant.compressor()
    clearance = {"clearance": (1.35, 1.0), "clearance_nde": (1.0, 1.35)}.get(state, (1.0, 1.0))
    thinner = 0.7 if state == "hot_oil" else 1.0
    films = [
        replace(film, clearance=film.clearance * share, viscosity=film.viscosity * thinner)
        for film, share in zip(rotor.films, clearance, strict=True)
    ]
    if state == "frame":
        foundation = replace(foundation, stiffness=tuple(0.75 * k for k in foundation.stiffness))
    return replace(rotor, films=tuple(films)), foundation


def motion(state, speeds=SPEEDS):
    """Steady motion in a state as the probes on the block see it, from where each journal runs."""
    rotor, foundation = rotor_in(state)
    unbalance = {0: 16 * 4e-5 * np.exp(1j), 11: 26 * 3e-5, 13: 29 * 3.5e-5 * np.exp(2j)}
    unbalance[13] *= 1.5 if state == "unbalance" else 1.0
    unbalance[0] *= 2.0 if state == "unbalance_coupling" else 1.0
    machine = plant.build_on_foundation(rotor, foundation, speeds, unbalance)
    if state.startswith("crack"):
        element, depth = (9, 0.2) if state == "crack" else (6, 0.35)
        place = rotor.positions[element] + 0.4 * rotor.elements[element].length
        add_form(machine, float(place), arc_form(rotor.elements[element], depth, 0.0), 0.7)
    if state == "preload":
        add_preload(machine, 0, 400.0, np.pi / 2)
    if state == "thermal_bow":
        add_thermal_bow(machine, (5, 6), 6.0, 0.5)
    if state == "seal":
        add_seal(machine, 12, 5e5, 4e5, 500.0, 0.0, 0.0)
    if state == "rub":
        selection = plant.against_block(machine, foundation, 11)
        healthy = steady_state(machine, speeds, STEPS, MODES)
        radius = np.linalg.norm(healthy.displacement @ selection, axis=-1).max()
        law = RubLaw(2e6, 0.9 * radius, 0.1, 0.1, (0.0, 0.0), 1e-3)
        machine.local.append(LocalForce(selection, law, "rub"))
    steady = steady_state(machine, speeds, STEPS, MODES)
    return plant.shown_by(steady, machine, foundation, PROBES)


def write(folder, state, draw, steady=None, again=0):
    """Write record.nc (zero mean at every speed, as by AC coupling), rig.yaml and truth.json."""
    import xarray as xr

    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([draw, 31])
    probes = {}
    for node in PROBES:
        runout = surface_runout(rng, ANGLES, 3e-6, orders=4)
        probes[node] = tuple(
            Probe(angle, gain=1 + 0.02 * rng.normal(), runout=profile)
            for angle, profile in zip(ANGLES, runout, strict=True)
        )
    error = rng.normal(size=4)
    shots = np.random.default_rng([draw, 31, list(STATES).index(state), again])
    chain = Chain(rate=128 * SPEEDS.max() / (2 * np.pi), revolutions=32, noise=1e-7, coloured_noise=5e-8, quantum=2e-8,
                  amplitude_scatter=2e-3, phase_scatter=2e-3, jitter=1e-4, pulse_width=0.35)  # fmt: skip
    steady = steady or motion(state)
    taken = record(shots, steady, PROBES, probes, chain)
    shown = taken["displacement"]
    shown -= shown.mean(axis=-1, keepdims=True)
    names = ("speed", "node", "direction", "time")
    xr.Dataset(
        {
            "displacement": (names, shown, {"units": "m"}),
            "keyphasor": (("speed", "time"), taken["keyphasor"], {"units": "V"}),
        },
        {
            "speed": ("speed", taken["speed"], {"units": "rad/s"}),
            "node": ("node", np.array(PROBES) + 1, {"units": "1"}),
            "direction": ("direction", ["a", "b"]),
            "time": ("time", taken["time"], {"units": "s"}),
        },
        {"title": "Simulated vibration record"},
    ).to_netcdf(folder / "record.nc", encoding={"displacement": {"dtype": "float32"}})
    for name, with_foundation in (("rig", True), ("rig_without_foundation", False)):
        (folder / f"{name}.yaml").write_text(page(rig(error, with_foundation)), encoding="utf-8")
    (folder / "truth.json").write_text(
        json.dumps({"state": state, "draw": draw, "floquet": steady.multipliers.tolist()})
    )


def write_table(path, state, draw):
    """Write the table of a state as a monitoring system exports it, of probes 45 degrees off the top."""
    rng, shots = np.random.default_rng([draw, 31]), np.random.default_rng([draw, 32, list(STATES).index(state)])
    gaps = np.random.default_rng([draw, 33, list(STATES).index(state)])
    angles = {"X": 3 * np.pi / 4, "Y": -3 * np.pi / 4}
    probes = {}
    for node in PROBES:
        runout = surface_runout(rng, angles.values(), 3e-6, orders=4)
        probes |= {
            f"{LABELS[node]} {name}": (node, angle, 1 + 0.02 * rng.normal(), profile)
            for (name, angle), profile in zip(angles.items(), runout, strict=True)
        }
    slow, speeds = 300 * np.pi / 30, SPEEDS * (1 + 1e-3 * shots.normal(size=len(SPEEDS)))
    speeds = np.round(np.append(slow, speeds) * 30 / np.pi) * np.pi / 30
    steady = motion(state, speeds)
    heads = ["Speed (rpm)"]
    heads += [f"{p} {n}X {what}" for p in probes for n in (1, 2) for what in ("Amp (mil pp)", "Phase (deg lag)")]
    rows = [heads]
    films = [rotor_in(state)[0].films[PROBES.index(node)] for node, *_ in probes.values()]
    rows[0] += [f"{p} Gap (V)" for p in probes]
    for k, speed in enumerate(speeds):
        rows.append([f"{speed * 30 / np.pi:.0f}"])
        for node, angle, gain, runout in probes.values():
            x, y = steady.displacement[k, :, 4 * node : 4 * node + 2].T
            for n in (1, 2):
                turn = np.exp(-1j * n * steady.angle)
                vector = 2 * np.mean((np.cos(angle) * x + np.sin(angle) * y) * turn) + runout[n]
                vector = gain * vector * (1 + 2e-3 * shots.normal()) + 2e-8 * (shots.normal() + 1j * shots.normal())
                lag = -np.rad2deg(np.angle(vector)) - n * 90.0  # the sensor of the phase mark is at 90 degrees
                rows[-1] += [f"{2 * abs(vector) / 25.4e-6:.2f}", f"{round(lag) % 360}"]
        for film, (node, angle, gain, _) in zip(films, probes.values(), strict=True):
            rest = [steady.displacement[k, :, 4 * node + i].mean() for i in (0, 1)]
            x, y = running_position(film, speed) + rest - [film.clearance, 0.0]  # from the bottom of the bearing
            volts = 7874 * gain * (np.cos(angle) * x + np.sin(angle) * y) + 0.01 * gaps.normal()
            rows[-1].append(f"{AT_REST_V + volts:.2f}")
    with open(path, "w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def foundation_section():
    """A block as large as the one there, with round numbers: up to 20 % off."""
    return {
        "foundation": [
            {"kind": "foundation_block", "node": PROBES[0] + 1, "second_node": PROBES[1] + 1, "label": "frame",
             "radius_of_gyration_m": 0.35, "foundation_mass_kg": 1000.0, "foundation_stiffness_xx_N_per_m": 1e8,
             "foundation_stiffness_yy_N_per_m": 2e8, "foundation_damping_xx_N_s_per_m": 3e4,
             "foundation_damping_yy_N_s_per_m": 3e4}
        ]
    }  # fmt: skip


def rig(error, with_foundation):
    """The rig file from drawings, with errors in standard deviations; of the foundation rough numbers, or nothing."""
    rotor, _ = plant.compressor()
    clearances, viscosity = 1 + 0.05 * error[:2], 1 + 0.08 * error[2]
    return {
        "rotor": {
            "kind": "finite_element",
            "youngs_modulus_Pa": 2.1e11 * (1 + 0.005 * error[3]),
            "elements": [
                {"length_m": part.length, "outer_diameter_m": part.outer_diameter} for part in rotor.elements
            ],
            "discs": [
                {"node": disc.node + 1, "mass_kg": disc.mass, "polar_moment_kg_m2": disc.polar_moment,
                 "diametral_moment_kg_m2": disc.diametral_moment, "label": label}
                for disc, label in zip(rotor.discs, ("coupling", "wheel 1", "wheel 2", "wheel 3"), strict=True)
            ],
        },
        "bearings": [
            {"kind": "short_journal", "node": film.node + 1, "label": LABELS[film.node], "diameter_m": film.diameter,
             "length_m": film.length, "radial_clearance_m": film.clearance * share,
             "viscosity_Pa_s": film.viscosity * viscosity}
            for film, share in zip(rotor.films, clearances, strict=True)
        ],
        **(foundation_section() if with_foundation else {}),
        "effects": [
            {"kind": "shaft_damping", "shaft_damping_s": 1e-6},
            *(
                {"kind": "unbalance", "node": node + 1, "label": label, "mass_kg": 1.0,
                 "eccentricity_m": 1e-6, "eccentricity_phase_rad": 0.0}
                for node, label in ((0, "coupling"), (11, "wheel 1"), (13, "wheel 3"))
            ),
        ],
        "sensors": [node + 1 for node in PROBES],
        "measurement": {
            "rotation": "with_angles",
            "harmonics": [1, -1, 2, -2, 3, -3],
            "probes": [
                {"channel": name, "angle_deg": float(np.rad2deg(angle))}
                | ({"relative_to": "bearing"} if with_foundation else {})
                for name, angle in zip("ab", ANGLES, strict=True)
            ],
            "keyphasor": {"channel": "keyphasor", "sensor_angle_deg": 90.0, "mark_angle_deg": 0.0},
        },
        "diagnosis": {
            "uncertainty": {
                "default": 0.1, "eccentricity": 3000.0, "rotor": 0.0, "rotor.youngs_modulus_Pa": 0.01,
                "bearing_scale": 0.0,
                **{f"bearings[{label}].{key}": 0.1 for label in LABELS.values()
                   for key in ("radial_clearance_m", "viscosity_Pa_s")},
                **(dict.fromkeys(FOUNDATION, 0.3) if with_foundation else {}),
            },
            "nuisance": {"probe_gain": 0.02, "probe_angle": 0.01, "phase_reference": 0.01, "runout": 3e-6},
            "model_error": 0.05,
            "model_floor": 0.02,
        },
    }  # fmt: skip


def study(folder, states, draw):
    """Diagnose the healthy machine of a draw, and compare states with it; lines of JSON in FOLDER/study.jsonl."""
    from rotorstudy.diagnosis.runs.compare import compare
    from rotorstudy.diagnosis.verdict.extend import extended_rig
    from rotorstudy.diagnosis.verdict.investigate import investigate
    from rotorstudy.measurement.measurement import measured_spectrum
    from rotorstudy.model.rig import RigFile
    from rotorstudy.yaml_file import read_yaml

    folder = Path(folder)
    healthy = motion("healthy")
    write(folder / "before", "healthy", draw, healthy)
    rig_path = folder / "before" / "rig.yaml"
    before, model, _ = measured_spectrum([folder / "before" / "record.nc"], rig_path)
    settings = RigFile(rig_path, read_yaml(rig_path)).given["diagnosis"]

    def said(state, verdict, seconds):
        causes = [
            [c.effect, c.where, round(c.posterior_probability, 4)] for c in (*verdict.causes, *verdict.ambiguous_with)
        ]
        row = {"state": state, "draw": draw, "verdict": verdict.verdict, "causes": causes, "alone": len(verdict.causes),
               "seconds": round(seconds, 1), "places": [[o.where, o.motion] for o in verdict.one_place]}  # fmt: skip
        with open(folder / "study.jsonl", "a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")

    start = time.process_time()
    found = investigate(before, model, settings=settings)
    said("healthy, diagnosed", found.verdict, time.process_time() - start)
    updated = RigFile(rig_path, extended_rig(read_yaml(rig_path), found))
    for state in states:
        write(folder / state, state, draw, healthy if state == "healthy" else motion(state), 1)
        after, model, _ = measured_spectrum([folder / state / "record.nc"], updated)
        start = time.process_time()
        one = compare(before, after, model, settings=settings)
        said(state, one.diagnosis.verdict, time.process_time() - start)


if __name__ == "__main__":
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("folder")
    asked.add_argument("states", nargs="*", default=list(STATES))
    asked.add_argument("--draw", type=int, default=1)
    asked.add_argument("--table", action="store_true")
    asked.add_argument("--study", action="store_true")
    asked = asked.parse_args()
    if asked.study:
        study(asked.folder, asked.states, asked.draw)
        asked.states = []
    for one in asked.states:
        if asked.table:
            write_table(asked.folder, one, asked.draw)
            continue
        write(Path(asked.folder) / f"{one}_{asked.draw}", one, asked.draw)
