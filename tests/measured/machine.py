"""A machine as a user sees it: Chapter 6's rotor with probes and a phase mark anywhere, written in any format.

The user's plane: angles grow clockwise from straight up as seen from the coupling, and the shaft turns the other way.
What a probe and the keyphasor show is written out here from that picture, not with the package's own formulas.
"""

from pathlib import Path

import numpy as np
import yaml
from scipy.integrate import solve_ivp
from scipy.io import savemat

from rotorstudy import load_rig, simulate_records

ROOT = Path(__file__).parents[2]
HARMONICS = [0, 1, -1, 2, -2, 3, -3, 5, -5, 7]
SPEEDS = [60.0, 80.0, 100.0]
TIME = np.arange(10000) / 4000
NOISE = 5e-7
GRAVITY, SENSOR, MARK = np.pi, np.pi / 2, np.pi / 6
UNITS = {"m": 1.0, "mm": 1e3, "um": 1e6, "mil": 1 / 2.54e-5, "V": 7874.0}  # a metre
PROBES = [  # channel, node, angle in degrees, unit, sign
    ("disc 1 left", 2, -45, "V", -1), ("disc 1 right", 2, 45, "mm", 1),
    ("disc 2 left", 4, -45, "mil", 1), ("disc 2 right", 4, 30, "um", -1),
]  # fmt: skip


def section(**changes):
    """The section `measurement:` that describes this machine."""
    probes = []
    for channel, node, angle, unit, sign in PROBES:
        probe = {"channel": channel, "node": node, "angle_deg": float(angle), "unit": unit, "sign": sign}
        probes.append(probe | ({"sensitivity_V_per_m": UNITS["V"]} if unit == "V" else {}))
    key = {"channel": "key", "sensor_angle_deg": 90.0, "mark_angle_deg": 30.0}
    found = {"rotation": "against_angles", "gravity_angle_deg": 180.0, "probes": probes, "keyphasor": key}
    found |= {"speed_channel": "speed", "speed_unit": "rpm", "harmonics": HARMONICS}
    return {**found, **changes}


def write_rig(path, **changes):
    """The rig file of the machine, or of the project's own records with measurement=None."""
    rig = yaml.safe_load((ROOT / "examples" / "chapter_6_rotor.yaml").read_text())
    rig["measurement"] = section(**changes)
    path.write_text(yaml.safe_dump(rig))
    return path


def model():
    return load_rig(ROOT / "examples" / "chapter_6_rotor.yaml")


def records(seed=1, speeds=SPEEDS, time=TIME, noise=NOISE):
    """Records with white noise in x and y that begin at any angle."""
    generator = np.random.default_rng(seed)
    made = simulate_records(model(), speeds, [0, 1], time, start_angle_rad=generator.uniform(0, 6, len(speeds)))
    for record in made:
        x, y = generator.normal(size=(2, *record.displacement.shape)) * noise
        record.displacement[:] += x + 1j * y
    return made


def channels(record):
    """What the recorder holds: {name: (time,) values in the unit of the channel}, and the node of each probe."""
    seen = record.displacement.conj() * np.exp(1j * GRAVITY)  # mirrored, as angles run against the rotation
    found = {"time": record.time}
    for channel, node, angle, unit, sign in PROBES:
        towards = (seen[record.sensors.index(node)] * np.exp(-1j * np.deg2rad(angle))).real
        found[channel] = sign * towards * UNITS[unit]
    mark = GRAVITY - shaft_angle(record) + MARK
    found["key"] = 5 * np.exp(-0.5 * (np.angle(np.exp(1j * (mark - SENSOR))) / 0.1) ** 2)
    found["speed"] = np.full(len(record.time), record.speed * 30 / np.pi)
    return found


def shaft_angle(record):
    """Angle of the reference line over time, from the simulated reference signal 1 + cos(angle)."""
    turned = record.speed * record.time
    both = np.column_stack([np.cos(turned), -np.sin(turned)])
    cosine, sine = np.linalg.lstsq(both, record.reference - 1, rcond=None)[0]
    return turned + np.arctan2(sine, cosine)


def write(kind, folder, record, name=None, **changes):
    """One record in a format; `changes` replace channels. Returns the path."""
    found = channels(record) | changes
    name = name or f"run_{record.speed:g}"
    path = folder / f"{name}.{kind}"
    if kind == "csv":
        rows = np.column_stack(list(found.values()))
        line = ",".join(["%.15f"] * rows.shape[1]) + "\n"
        path.write_text(",".join(found) + "\n" + line * len(rows) % tuple(rows.ravel().tolist()))
    elif kind == "mat":
        savemat(path, {key.replace(" ", "_"): value for key, value in found.items()})
    elif kind == "uff":
        from uff_files import signal_set, write_sets

        names = [name for name in found if name != "time"]
        write_sets(path, [signal_set(name, i, record.time, found[name], binary=1) for i, name in enumerate(names)])
    return path


def mark_times(record):
    """Times (revolution,) s at which the phase mark passes its sensor, but at the very ends of a record."""
    angle, time = (shaft_angle(record) - (GRAVITY + MARK - SENSOR))[20:-20], record.time[20:-20]
    turns = np.arange(np.ceil(angle[0] / (2 * np.pi)), angle[-1] / (2 * np.pi))
    return np.interp(turns * 2 * np.pi, angle, time)


def swept(stiffness, damping, force, first, rate, time):
    """Motions (coordinate, time), complex, m, of oscillators of unit mass at the speed first + rate t, by integration.

    stiffness, damping : (coordinate,) 1/s^2, 1/s;  force : (coordinate,) m, over the squared speed
    """

    def derivative(t, state):
        position, velocity = np.split(state, 2)
        pull = force * ((first + rate * t) ** 2 - 1j * rate) * np.exp(1j * (first * t + rate * t * t / 2))
        return np.concatenate([velocity, pull - damping * velocity - stiffness * position])

    start = force * first**2 / (stiffness - first**2 + 1j * damping * first)
    both = np.concatenate([start, 1j * first * start])
    return solve_ivp(derivative, (0, time[-1]), both, "DOP853", time, rtol=1e-7, atol=1e-11).y[: len(start)]


STEADY = 80.0  # rad/s
MARKS = np.arange(1, 31) * 2 * np.pi / STEADY  # of the phase mark at that speed, s


def pulses(marks, sign=1, base=0.0, noise=0.0):
    """The channel of the keyphasor with pulses at some times."""
    signal = base + sign * 5 * np.exp(-0.5 * ((TIME[:, None] - marks) * STEADY / 0.1) ** 2).sum(axis=1)
    return {"key": signal + noise * np.random.default_rng(1).normal(size=len(TIME))}
