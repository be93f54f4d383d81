"""Records of a machine in a plant by the independent simulator, with a rig file from drawings: one folder a state.

    python benchmarks/plant.py FOLDER [STATE ...] [--draw N]

STATE: healthy, clearance (35 % more at the drive end), crack (a fifth of the diameter beside the bearing of the
wheels), rub (light, at the first wheel), unbalance. The draw is of what differs from the drawings, of runout, gains and
noise.

    python benchmarks/plant.py --table FILE STATE [--draw N]

writes what a monitoring system exports of a state: amplitudes of 1X and 2X to 0.01 mil and phases to 1 degree, at slow
roll and at speeds that scatter. The tables of examples/compressor are of draw 5, healthy and clearance.
"""

import argparse
import csv
import json
from pathlib import Path

import numpy as np
from named_machines import plant

from rotorstudy.blind.machines.contacts import RubLaw
from rotorstudy.blind.machines.elastic_crack import arc_form
from rotorstudy.blind.machines.files import page
from rotorstudy.blind.machines.form_cracks import add_form
from rotorstudy.blind.machines.machine import LocalForce
from rotorstudy.blind.machines.measuring import Chain, Probe, record, surface_runout
from rotorstudy.blind.machines.stepping import steady_state

SPEEDS = np.array([1200, 1600, 2000, 2400, 2800, 3200, 3600, 4000]) * 2 * np.pi / 60
STATES = ("healthy", "clearance", "crack", "rub", "unbalance")
PROBES, ANGLES = (3, 9), (-np.pi / 4, np.pi / 4)
LABELS = {3: "DE", 9: "NDE"}
STEPS, MODES = 96, 10
FOUNDATION = (
    "foundation_mass", "foundation_stiffness_xx", "foundation_stiffness_yy", "foundation_damping_xx",
    "foundation_damping_yy", "bearings[frame].radius_of_gyration_m",
)  # fmt: skip


def motion(state, speeds=SPEEDS, runs_unbalance=None):
    """Steady motion in a state as the probes on the block see it, and where each journal runs (speed, film, 2), m."""
    rotor, foundation = plant.compressor(1.35 if state == "clearance" else 1.0)
    unbalance = {0: 16 * 4e-5 * np.exp(1j), 11: 26 * 3e-5, 13: 29 * 3.5e-5 * np.exp(2j)}
    if state == "unbalance":
        unbalance[13] *= 1.5
    machine = plant.build_on_foundation(rotor, foundation, speeds, unbalance)
    if state == "crack":
        place = rotor.positions[9] + 0.4 * rotor.elements[9].length
        add_form(machine, float(place), arc_form(rotor.elements[9], 0.2, 0.0), 0.7)
    if state == "rub":
        selection = plant.against_block(machine, foundation, 11)
        healthy = steady_state(machine, speeds, STEPS, MODES)
        radius = np.linalg.norm(healthy.displacement @ selection, axis=-1).max()
        law = RubLaw(2e6, 0.9 * radius, 0.1, 0.1, (0.0, 0.0), 1e-3)
        machine.local.append(LocalForce(selection, law, "rub"))
    steady = steady_state(machine, speeds, STEPS, MODES)
    return plant.shown_by(steady, machine, foundation, PROBES)


def write(folder, state, draw):
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
    shots = np.random.default_rng([draw, 31, STATES.index(state)])
    chain = Chain(rate=128 * SPEEDS.max() / (2 * np.pi), revolutions=32, noise=1e-7, coloured_noise=5e-8, quantum=2e-8,
                  amplitude_scatter=2e-3, phase_scatter=2e-3, jitter=1e-4, pulse_width=0.35)  # fmt: skip
    steady = motion(state)
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
    rng, shots = np.random.default_rng([draw, 31]), np.random.default_rng([draw, 32, STATES.index(state)])
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


if __name__ == "__main__":
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("folder")
    asked.add_argument("states", nargs="*", default=STATES)
    asked.add_argument("--draw", type=int, default=1)
    asked.add_argument("--table", action="store_true")
    asked = asked.parse_args()
    for one in asked.states:
        if asked.table:
            write_table(asked.folder, one, asked.draw)
            continue
        write(Path(asked.folder) / f"{one}_{asked.draw}", one, asked.draw)
