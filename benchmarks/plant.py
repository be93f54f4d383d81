"""Records of machines in a plant by the independent simulator, with rig files from drawings (`plant_study.py` judges).

    python benchmarks/plant.py FILE MACHINE STATE [--draw N]

writes a table as a monitoring system exports it: 1X and 2X to 0.01 mil and 1 degree, at slow roll and at speeds that
scatter, of a machine of `named_machines.plant.PLANTS` in one of STATES. The draw is of what differs from the drawings,
of runout, gains and noise. The tables of examples/compressor are of draw 5, healthy and clearance.
"""

import argparse
import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
from named_machines.plant import PLANTS

from rotorstudy.blind.machines import rig_items
from rotorstudy.blind.machines.contacts import add_elliptic_forces, coupling, one_sided, rub_law
from rotorstudy.blind.machines.cracks import add_form, arc_form
from rotorstudy.blind.machines.effects import add_preload, add_thermal_bow
from rotorstudy.blind.machines.files import discs_section, page, stretches, write_records
from rotorstudy.blind.machines.film import running_position
from rotorstudy.blind.machines.machine import LocalForce
from rotorstudy.blind.machines.measuring import Chain, Probe, record, surface_runout
from rotorstudy.blind.machines.stepping import Steady, steady_state

STATES = {  # name: usual size, and the effects that are right
    "healthy": (0.0, ()),
    "clearance": (0.35, ("bearing_change",)),  # of the first film, larger by this share
    "clearance_last": (0.35, ("bearing_change",)),  # of the last film
    "oil": (-0.3, ("bearing_change",)),  # change of the viscosity of all films
    "frame": (-0.25, ("foundation_change",)),  # change of the stiffness of the first block's feet
    "unbalance": (0.5, ("unbalance",)),  # more at the first of the wheels
    "crack": (0.25, ("transverse_crack",)),  # depth over diameter, beside a bearing
    "crack_middle": (0.35, ("transverse_crack",)),
    "rub": (0.3, ("rub",)),  # share of the orbit at the second of the wheels that is cut off
    "looseness": (0.5, ("looseness", "foundation_change")),  # share of a foot's stiffness lost where it lifts
    "parallel": (2e-4, ("parallel_misalignment",)),  # m
    "angular": (4e-3, ("angular_misalignment",)),  # rad
    "preload": (0.5, ("static_preload", "bearing_change")),  # across, at the hub, over the mean load of the films
    "bow": (4.0, ("bow",)),  # K across the shaft
    "runout": (6e-6, ("runout", "shaft_runout")),  # m, another surface at the first plane
    "hub_2X": (100.0, ("parallel_misalignment",)),  # N at twice the speed, along x, at the coupling
    "contact": (2e7, ("rub",)),  # N/m, of a ring at 0.8 of the median orbit at the second of the wheels
}
ANGLES = (-np.pi / 4, np.pi / 4)
STEPS, MODES = 96, 10
AT_REST_V = -10.0  # gap voltage of every probe while the shaft lies at the bottom
BLOCK = ("foundation_mass", "foundation_stiffness_xx", "foundation_stiffness_yy", "foundation_damping_xx",
         "foundation_damping_yy", "radius_of_gyration")  # fmt: skip


def in_state(plant, state, size):
    """The Plant with its films, blocks and unbalance as in a state."""
    films, blocks, unbalance = list(plant.rotor.films), list(plant.blocks), dict(plant.unbalance)
    if state in ("clearance", "clearance_last"):
        one = 0 if state == "clearance" else -1
        films[one] = replace(films[one], clearance=films[one].clearance * (1 + size))
    if state == "oil":
        films = [replace(film, viscosity=film.viscosity * (1 + size)) for film in films]
    if state == "frame":
        blocks[0] = replace(blocks[0], stiffness=tuple(k * (1 + size) for k in blocks[0].stiffness))
    if state == "unbalance":
        unbalance[plant.wheels[0]] *= 1 + size
    return replace(plant, rotor=replace(plant.rotor, films=tuple(films)), blocks=tuple(blocks), unbalance=unbalance)


def add_fault(machine, plant, state, size):
    """Add what a state is beyond other numbers to the Machine of a plant."""
    if state in ("crack", "crack_middle"):
        part = plant.rotor.elements[plant.cracks[state == "crack_middle"][0]]
        add_form(machine, crack_place(plant, state), arc_form(part, size, 0.0), 0.7)
    if state == "preload":
        add_preload(machine, plant.hub, size * np.mean([film.load for film in plant.rotor.films]), np.pi / 2)
    if state == "hub_2X":
        add_elliptic_forces(machine, plant.hub, {(2, 0): (size / 2, size / 2)})
    if state == "bow":
        add_thermal_bow(machine, plant.bow, size, 0.5)
    if state == "looseness":
        own, block = plant.block_slice(machine, 0), plant.blocks[0]
        selection = np.zeros((machine.size, 2))
        selection[own] = block.motion_at(block.feet[0]).T
        machine.local.append(LocalForce(selection, one_sided(size * block.stiffness[0], np.inf, np.pi), "foot"))
    if state in ("parallel", "angular"):
        angular = state == "angular"
        selection, stiffness = machine.plane(plant.hub, angular), plant.coupling[angular]
        if plant.other_hub is not None:
            selection = selection - machine.plane(plant.other_hub, angular)
        machine.stiffness -= stiffness * selection @ selection.T  # its mean is part of the sound machine
        law = coupling(stiffness, 0.1, size * np.exp(2j), 0.05 * size * np.exp(1j))
        machine.local.append(LocalForce(selection, law, state))
    if state in ("rub", "contact"):
        selection = plant.against_block(machine, plant.wheels[1])
        healthy = steady_state(machine, plant.speeds, STEPS, MODES).displacement @ selection
        centre = healthy.mean(axis=(0, 1))  # of the ring: where the shaft runs, bent by its load
        radius = np.linalg.norm(healthy - centre, axis=-1).max(axis=-1)
        gap, stiffness = (1 - size) * radius.max(), plant.rotor.mass * float(np.mean(plant.speeds)) ** 2
        if state == "contact":
            gap, stiffness = 0.8 * np.median(radius), size
        law = rub_law(stiffness, gap, 0.1, 0.1, centre, 1e-3)
        machine.local.append(LocalForce(selection, law, "rub"))


def crack_place(plant, state):
    """Of its crack along the shaft, m."""
    element, share = plant.cracks[state == "crack_middle"]
    return float(plant.rotor.positions[element] + share * plant.rotor.elements[element].length)


def motion(name, state, size, speeds=None, kept=None):
    """Steady motion of a machine in a state as the probes on its blocks see it, from where each journal runs.

    kept : folder of motions computed before, or None
    """
    path = kept and Path(kept) / f"{name}_{state}_{size:g}.npz"
    if path and path.exists():
        return Steady(**np.load(path))
    plant = in_state(PLANTS[name](), state, size)
    plant = plant if speeds is None else replace(plant, speeds=speeds)
    machine = plant.build()
    add_fault(machine, plant, state, size)
    steady = plant.shown_by(steady_state(machine, plant.speeds, STEPS, MODES), machine)
    if path:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez(path, **vars(steady))
    return steady


def right_places(plant, state):
    """Where what a state is may be stated, by the keys of a place of the package."""
    nodes = [film.node + 1 for film in plant.rotor.films]
    on_first_block = [node for node in nodes if plant.block_at(node - 1) == 0]
    hubs = [node + 1 for node in (plant.hub, plant.other_hub) if node is not None]
    return {
        "clearance": {"node": nodes[:1], "number": ["radial_clearance_m"]},
        "clearance_last": {"node": nodes[-1:], "number": ["radial_clearance_m"]},
        "oil": {"number": ["viscosity_Pa_s"]},
        "frame": {"node": on_first_block},
        "looseness": {"node": on_first_block, "foundation": on_first_block, "foot": [1]},
        "unbalance": {"node": [plant.wheels[0] + 1]},
        "rub": {"node": [plant.wheels[1] + 1]},
        "contact": {"node": [plant.wheels[1] + 1]},
        "crack": {"element": [plant.cracks[0][0] + 1]},
        "crack_middle": {"element": [plant.cracks[1][0] + 1]},
        "parallel": {"node": hubs, "element": [plant.hub + 1]},
        "hub_2X": {"node": hubs[:1], "element": [plant.hub + 1]},
        "angular": {"node": hubs},
        "preload": {"node": [*hubs, *nodes], "number": ["load_N"]},
        "runout": {"node": nodes[:1]},
    }.get(state, {})


def drawn_probes(rng, plant, angles):
    """Probes at two angles of each film, {node: [Probe, Probe]}, on surfaces with runout."""
    surfaces = ((film.node, surface_runout(rng, angles, 3e-6, orders=4)) for film in plant.rotor.films)
    return {
        node: [Probe(angle, 1 + 0.02 * rng.normal(), 0.0, own) for angle, own in zip(angles, runout, strict=True)]
        for node, runout in surfaces
    }


def write(folder, name, state, draw, steady, again=0):
    """Write record.nc (zero mean at every speed, as by AC coupling) and rig.yaml; returns their paths."""
    folder, plant = Path(folder), PLANTS[name]()
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([draw, 31])
    probes, error = drawn_probes(rng, plant, ANGLES), rng.normal(size=50)
    nodes = list(probes)
    if state == "runout":
        other = surface_runout(np.random.default_rng([draw, 34]), ANGLES, STATES[state][0], orders=4)
        probes[nodes[0]] = [replace(p, runout=own) for p, own in zip(probes[nodes[0]], other, strict=True)]
    shots = np.random.default_rng([draw, 31, list(STATES).index(state), again])
    chain = Chain(rate=128 * plant.speeds.max() / (2 * np.pi), revolutions=32, noise=1e-7, coloured_noise=5e-8,
                  quantum=2e-8, amplitude_scatter=2e-3, phase_scatter=2e-3, jitter=1e-4, pulse_width=0.35)  # fmt: skip
    taken = record(shots, steady, nodes, probes, chain)
    taken["displacement"] -= taken["displacement"].mean(axis=-1, keepdims=True)
    write_records(folder / "record.nc", taken, nodes)
    (folder / "rig.yaml").write_text(page(rig(plant, error)), encoding="utf-8")
    return folder / "record.nc", folder / "rig.yaml"


def write_table(path, name, state, draw):
    """Write the table of a state as a monitoring system exports it, of probes 45 degrees off the top."""
    plant, number, size = PLANTS[name](), list(STATES).index(state), STATES[state][0]
    rng, shots, gaps = map(np.random.default_rng, ([draw, 31], [draw, 32, number], [draw, 33, number]))
    drawn, films = drawn_probes(rng, plant, (3 * np.pi / 4, -3 * np.pi / 4)), in_state(plant, state, size).rotor.films
    probes = {
        f"{label} {axis}": (film, probe)
        for film, label in zip(films, labels(plant), strict=True)
        for axis, probe in zip("XY", drawn[film.node], strict=True)
    }
    slow, speeds = 300 * np.pi / 30, plant.speeds * (1 + 1e-3 * shots.normal(size=len(plant.speeds)))
    speeds = np.round(np.append(slow, speeds) * 30 / np.pi) * np.pi / 30
    steady = motion(name, state, size, speeds)
    heads = [f"{p} {n}X {what}" for p in probes for n in (1, 2) for what in ("Amp (mil pp)", "Phase (deg lag)")]
    rows = [["Speed (rpm)", *heads, *(f"{p} Gap (V)" for p in probes)]]
    for k, speed in enumerate(speeds):
        rows.append([f"{speed * 30 / np.pi:.0f}"])
        for film, probe in probes.values():
            moved = steady.displacement[k, :, 4 * film.node : 4 * film.node + 2].T
            for n in (1, 2):
                line = 2 * np.mean(moved * np.exp(-1j * n * steady.angle), axis=-1)
                vector = probe.reading(*line, lambda order, amplitude, n=n: amplitude * (order == n))
                vector = vector * (1 + 2e-3 * shots.normal()) + 2e-8 * (shots.normal() + 1j * shots.normal())
                lag = -np.rad2deg(np.angle(vector)) - n * 90.0  # the sensor of the phase mark is at 90 degrees
                rows[-1] += [f"{2 * abs(vector) / 25.4e-6:.2f}", f"{round(lag) % 360}"]
        for film, probe in probes.values():
            rest = steady.displacement[k, :, 4 * film.node : 4 * film.node + 2].mean(axis=0)
            x, y = running_position(film, speed) + rest - [film.clearance, 0.0]  # from the bottom of the bearing
            volts = 7874 * probe.reading(x, y, lambda order, amplitude: 0.0) + 0.01 * gaps.normal()
            rows[-1].append(f"{AT_REST_V + volts:.2f}")
    with open(path, "w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def labels(plant):
    """Of its films."""
    return ("DE", "NDE") if len(plant.rotor.films) == 2 else tuple(f"bearing {k + 1}" for k in range(4))


def rig(plant, error):
    """The rig file from drawings, with errors (many standard deviations drawn): modulus, films, blocks, loads."""
    rotor, upright, draws = plant.rotor, plant.thrust or {}, iter(error)
    own, films = dict(zip((film.node for film in rotor.films), labels(plant), strict=True)), []
    modulus, viscosity = 1 + 0.005 * next(draws), 1 + 0.08 * next(draws)
    for one in rotor.films:
        clearance = one.clearance * (1 + 0.05 * next(draws))
        place = {"node": one.node + 1, "label": own[one.node]}
        place |= {"load_N": one.load * (1 + 0.05 * next(draws))} if upright else {}
        films.append(rig_items.film(one.diameter, one.length, clearance, one.viscosity * viscosity, **place))
    blocks = []
    for number, block in enumerate(plant.blocks):
        nodes = [film.node + 1 for film in rotor.films if plant.block_at(film.node) == number]
        values = (block.mass, *(2 * k for k in block.stiffness), *(2 * c for c in block.damping))
        units = ("kg", "N_per_m", "N_per_m", "N_s_per_m", "N_s_per_m")
        blocks.append(
            {"kind": "foundation_block", "node": nodes[0], "second_node": nodes[1], "label": f"block {number + 1}",
             "centre_m": block.centre, "feet_m": list(block.feet),
             "radius_of_gyration_m": block.radius_of_gyration * (1 + 0.15 * next(draws))}
            | {f"{key}_{unit}": value * (1 + 0.15 * next(draws))
               for key, unit, value in zip(BLOCK, units, values, strict=False)}
        )  # fmt: skip
    return {
        "rotor": {
            "kind": "finite_element",
            "youngs_modulus_Pa": 2.1e11 * modulus,
            "gravity_m_per_s2": 0.0 if upright else 9.81,
            "elements": stretches(rotor.elements),
            "discs": discs_section(rotor),
            "static_forces": [{"node": node + 1, "force_N": value} for node, value in upright.items()],
        },
        "bearings": films,
        "foundation": blocks,
        "effects": [
            {"kind": "shaft_damping", "shaft_damping_s": 1e-6},
            *(rig_items.unbalance(n + 1, 1e-6, label=f"at {n + 1}", mass_kg=rotor.mass) for n in plant.unbalance),
        ],
        "sensors": [film.node + 1 for film in rotor.films],
        "measurement": {
            "rotation": "with_angles",
            "harmonics": [1, -1, 2, -2, 3, -3],
            "probes": [
                {"channel": name, "angle_deg": float(np.rad2deg(angle)), "relative_to": "bearing"}
                for name, angle in zip("ab", ANGLES, strict=True)
            ],
            "keyphasor": {"channel": "keyphasor", "sensor_angle_deg": 90.0, "mark_angle_deg": 0.0},
        },
        "diagnosis": {
            "uncertainty": {
                "default": 0.1, "eccentricity": 30.0, "rotor": 0.0, "rotor.youngs_modulus_Pa": 0.01,
                "bearing_scale": 0.0, "bearings.viscosity_Pa_s": 0.1,
                **{f"bearings[{one}].radial_clearance_m": 0.1 for one in own.values()},
                **({f"bearings[{one}].load_N": 0.1 for one in own.values()} if upright else {}),
                **dict.fromkeys(BLOCK[:-1], 0.3),
                **{f"bearings[{block['label']}].radius_of_gyration_m": 0.3 for block in blocks},
            },
            "nuisance": {"probe_gain": 0.02, "probe_angle": 0.01, "phase_reference": 0.01, "runout": 3e-6},
            "model_error": 0.05,
            "model_floor": 0.02,
        },
    }  # fmt: skip


if __name__ == "__main__":
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("file")
    asked.add_argument("machine", choices=PLANTS)
    asked.add_argument("state", choices=STATES)
    asked.add_argument("--draw", type=int, default=1)
    asked = asked.parse_args()
    write_table(asked.file, asked.machine, asked.state, asked.draw)
