"""Records of a rotor by ROSS (github.com/petrobras/ross), a second opinion: python benchmarks/ross/simulate.py OUT

For each case OUT has a folder with one CSV a speed (time, x and y of each probed node, phase mark) and `truth.json`.
The healthy machine is in OUT/machine.toml, saved by ROSS, and what this leaves out in OUT/machine.json, in the axes of
ROSS: nodes from 0, y upwards, weight along -y, the shaft turns from x to y, and displacements count from the straight
shaft. Runs in `.venv-ross`; it knows nothing of rotorstudy.
"""

import json
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import ross
from ross.faults.crack import Crack

STEEL = {"rho": 7850.0, "E": 2.1e11, "Poisson": 0.3}
SHAFT = {"count": 6, "length": 0.1, "diameter": 0.025}
DISCS = ({"n": 2, "m": 3.0, "Id": 0.0040, "Ip": 0.0075}, {"n": 4, "m": 2.0, "Id": 0.0022, "Ip": 0.0040})
BEARINGS = (
    {"n": 0, "kxx": 2.0e6, "kyy": 1.6e6, "cxx": 1500.0, "cyy": 1200.0},
    {"n": 6, "kxx": 1.8e6, "kyy": 1.4e6, "cxx": 1500.0, "cyy": 1200.0},
)
UNBALANCE = {"node": [2, 4], "unbalance_magnitude": [3.0e-5, 1.6e-5], "unbalance_phase": [0.4, 2.0]}  # kg m, rad
GRAVITY = 9.8065  # of ROSS, where it counts weight at all
PROBES = (0, 2, 4, 6)
SPEEDS = (150.0, 190.0, 230.0, 270.0, 310.0, 350.0, 400.0, 450.0)  # rad/s; critical speeds at 361 and 373
CRACKED, ANGLE = 2, 0.7  # element; angle from the shaft's reference line to the middle of the crack edge, rad
CRACKS = ((CRACKED, ANGLE, (0.1, 0.25)), (3, -1.9, (0.15, 0.3)), (1, 2.6, (0.2,)))  # with depths over the diameter
SHARES = {  # of the crack that is open where the middle of its edge is at this angle from the downward direction
    "mayes": lambda angle: (1 + np.cos(angle)) / 2,
    "gasch": lambda angle: float(np.cos(angle) > 0),
}
STEPS = 1024  # a revolution; the forces of ROSS's faults are those of the step before, late by 2 pi / STEPS
KEPT = 8  # one of these in the record
SETTLING = 0.8  # s; the slowest transient decays as exp(-13 t/s)
REVOLUTIONS = 16
NOISE = 1e-8  # m rms


def rotor(discs=DISCS, bearings=BEARINGS, seals=()):
    """The machine in ROSS."""
    steel = ross.Material("steel", **STEEL)
    size = {"L": SHAFT["length"], "idl": 0.0, "odl": SHAFT["diameter"], "material": steel}
    elements = [ross.ShaftElement(n=n, **size) for n in range(SHAFT["count"])]
    held = [ross.BearingElement(**bearing) for bearing in bearings] + [ross.SealElement(**seal) for seal in seals]
    return ross.Rotor(elements, [ross.DiskElement(**disc) for disc in discs], held)


def linear(machine, unbalance=UNBALANCE):
    """Run of a machine whose only force is the unbalance: function of speed and time."""

    def run(speed, time):
        node, magnitude, phase = unbalance.values()
        force = machine.unbalance_force_over_time(node, magnitude, phase, speed, time)
        return machine.run_time_response(speed, force.T, time)

    return run


def faulty(method, **fault):
    """Run of the healthy machine with a fault, by that method of ROSS."""
    return lambda speed, time: getattr(rotor(), method)(**fault, **UNBALANCE, speed=speed, t=time)


def cracked(law, depth, element=CRACKED, angle=ANGLE):
    """Run of the healthy machine with a crack at the end of an element, opened by the weight.

    ROSS lets the crack change the translational stiffness of its element alone. Here its whole stiffness varies,
    K(a) = K_closed + share(a) (K_open - K_closed), in axes that turn with the crack: xi towards the middle of its edge,
    which points down at a = 0. The flexibilities are those of ROSS: c55 for the moment that opens the crack, and across
    c44, which counts half of it. The periodic motion is that of the implicit midpoint rule with `STEPS` a revolution.
    """
    machine = rotor()
    coordinates = [6 * node + motion for node in range(SHAFT["count"] + 1) for motion in (0, 1, 3, 4)]
    there = slice(4 * element, 4 * element + 8)
    closed, opened = (_by_tip(machine.shaft_elements[element], d) for d in (0.0, depth))
    tip = _tip(SHAFT["length"])

    def stiffness(turned_by):
        c, s = np.cos(turned_by), np.sin(turned_by)
        turned = np.kron(np.eye(2), [[c, s], [-s, c]]) @ tip
        return turned.T @ (SHARES[law](turned_by + np.pi / 2) * (opened - closed)) @ turned

    def run(speed, time):
        m, k, c, g = (part[np.ix_(coordinates, coordinates)] for part in
                      (machine.M(speed), machine.K(speed), machine.C(speed), machine.G()))  # fmt: skip
        node, size, phase = UNBALANCE.values()
        middle = (np.arange(STEPS) + 0.5) * 2 * np.pi / STEPS
        force = machine.unbalance_force_over_time(node, size, phase, speed, middle / speed).T[:, coordinates]
        force = force - m @ np.tile([0, GRAVITY, 0, 0], SHAFT["count"] + 1)
        rest, softened = np.hstack([np.zeros_like(m), np.eye(len(m))]), []
        for turned_by in middle + angle:
            here = k.copy()
            here[there, there] += stiffness(turned_by)
            softened.append(np.vstack([rest, -np.linalg.solve(m, np.hstack([here, c + speed * g]))]))
        pushed = np.hstack([np.zeros_like(force), np.linalg.solve(m, force.T).T])
        motion = _periodic(np.array(softened), pushed, 2 * np.pi / speed / STEPS)
        whole = np.zeros((STEPS, 6 * (SHAFT["count"] + 1)))
        whole[:, coordinates] = motion[:, : len(m)]
        return SimpleNamespace(yout=np.take(whole, np.arange(len(time)) % STEPS, axis=0))

    return run


def _tip(length):
    """(4, 8) motion of the end of an element relative to its start, x, y and tilts along them, by x, y, alpha, beta."""
    return np.array([
        [-1, 0, 0, -length, 1, 0, 0, 0],
        [0, -1, length, 0, 0, 1, 0, 0],
        [0, 0, 0, -1, 0, 0, 0, 1],
        [0, 0, 1, 0, 0, 0, -1, 0],
    ])  # fmt: skip


def _by_tip(element, depth):
    """(4, 4) stiffness of an element held at its start, by the motion of its end along xi, eta and its tilts."""
    e, i, length = element.material.E, element.Ie, element.L
    flexible = np.array([[length**3 * (1 + element.phi / 4) / 3, length**2 / 2], [length**2 / 2, length]]) / (e * i)
    if depth:
        crack = Crack(rotor(), n=CRACKED, depth_ratio=depth, crack_model="Mayes")
        hinges = (crack._get_coefficient(name) for name in ("c55", "c44"))
    else:
        hinges = (0.0, 0.0)
    found = np.zeros((4, 4))
    for axis, hinge in enumerate(hinges):
        found[axis::2, axis::2] = np.linalg.inv(flexible + np.diag([0, hinge]))
    return found


def _periodic(matrices, forces, step):
    """(step, state) periodic solution of x' = A x + b by the implicit midpoint rule."""
    one = np.eye(matrices.shape[-1])
    left = one - step / 2 * matrices
    maps = np.linalg.solve(left, one + step / 2 * matrices)
    added = np.linalg.solve(left, step * forces[..., None])[..., 0]
    turn, sum_ = one, np.zeros(len(one))
    for a, b in zip(maps, added, strict=True):
        turn, sum_ = a @ turn, a @ sum_ + b
    state, found = np.linalg.solve(one - turn, sum_), []
    for a, b in zip(maps, added, strict=True):
        found.append(state)
        state = a @ state + b
    return np.array(found)


def changed(number, **values):
    """The bearings with other values of one of them."""
    return [bearing | values if i == number else bearing for i, bearing in enumerate(BEARINGS)]


def seal(node, damping, swirl):
    """A seal of a liquid: its cross stiffness grows with the speed."""
    speeds = np.array([0.0, 1000.0])
    cross, none, c = swirl * damping * speeds, 0 * speeds, damping + 0 * speeds
    return {"n": node, "frequency": speeds, "kxx": none, "kxy": cross, "kyx": -cross, "kyy": none, "cxx": c, "cyy": c}


def cases():
    """Name, truth (family and ROSS's number of node or element) and run of each case."""
    extra = UNBALANCE | {"node": [2, 4, 4], "unbalance_magnitude": [3e-5, 1.6e-5, 1e-5],
                         "unbalance_phase": [0.4, 2.0, -1.0]}  # fmt: skip
    heavier = (DISCS[0], DISCS[1] | {"m": 2.2})
    coupling = {"coupling": "flex", "n": 0, "radial_stiffness": 4e4, "bending_stiffness": 4e4, "mis_distance_x": 1e-4,
                "mis_distance_y": 1e-4, "mis_angle": 0.03}  # fmt: skip
    rub = {"n": 3, "distance": 1e-5, "contact_stiffness": 2e5, "contact_damping": 0.0}
    yield "healthy", {}, linear(rotor())
    yield "unbalance", {"family": "unbalance", "node": 4}, linear(rotor(), extra)
    yield "disc_mass", {"family": "added_mass", "node": 4}, linear(rotor(discs=heavier))
    yield "soft_support", {"family": "support_loss", "node": 6}, linear(rotor(bearings=changed(1, kyy=1.1e6)))
    cross = changed(0, kxy=1e5, kyx=-1e5)
    yield "cross_coupling", {"family": "cross_coupling", "node": 0}, linear(rotor(bearings=cross))
    yield "seal", {"family": "seal", "node": 3}, linear(rotor(seals=[seal(3, 60.0, 0.45)]))
    for kind in ("parallel", "angular"):
        run = faulty("run_misalignment", mis_type=kind, **coupling)
        yield kind, {"family": "misalignment", "element": 0}, run
    rigid = {"coupling": "rigid", "n": 0, "mis_distance": 1e-6}
    yield "rigid", {"family": "misalignment", "element": 0}, faulty("run_misalignment", **rigid)
    yield "rub", {"family": "rub", "node": 3}, faulty("run_rubbing", friction_coeff=0.0, **rub)
    yield "rub_friction", {"family": "rub", "node": 3}, faulty("run_rubbing", friction_coeff=0.2, **rub)
    # ROSS has two more laws, which at depth zero are not the intact element
    for law in SHARES:
        for depth in CRACKS[0][-1]:
            run = faulty("run_crack", n=CRACKED, depth_ratio=depth, crack_model=law.capitalize())
            yield f"{law}_{depth:g}", {"family": "crack", "element": CRACKED, "weight": True}, run
        for element, angle, depths in CRACKS:
            for depth in depths:
                true = {"position_m": (element + 1) * SHAFT["length"], "depth_ratio": depth, "angle_rad": angle}
                true |= {"family": "crack", "element": element, "weight": True}
                yield f"{law}_{depth:g}_all_terms", true, cracked(law, depth, element, angle)


def record(run, speed, random):
    """Columns of a settled record: time, x and y of each probed node with noise, and the pulses of the phase mark."""
    step = 2 * np.pi / speed / STEPS
    time = np.arange(round(SETTLING / step) + REVOLUTIONS * STEPS) * step
    here = [6 * node + direction for node in PROBES for direction in (0, 1)]
    shown = run(speed, time).yout[-REVOLUTIONS * STEPS :: KEPT, here]
    time = time[-REVOLUTIONS * STEPS :: KEPT]
    angle = np.mod(speed * time + np.pi, 2 * np.pi) - np.pi  # zero: the shaft as it is at time zero
    pulse = 5.0 * np.exp(-((angle / 0.15) ** 2) / 2)
    return np.column_stack([time, shown + NOISE * random.normal(size=shown.shape), pulse])


def main(out):
    random = np.random.default_rng(1)
    header = ",".join(["time", *(f"{direction}{node}" for node in PROBES for direction in "xy"), "key"])
    response = rotor().run_unbalance_response(*UNBALANCE.values(), np.array(SPEEDS)).forced_resp
    machine = {"length": SHAFT["length"], "unbalance": UNBALANCE, "probes": PROBES, "gravity": GRAVITY}
    machine |= {"speeds": SPEEDS, "response": [[[value.real, value.imag] for value in row] for row in response]}
    out.mkdir(parents=True, exist_ok=True)
    rotor().save(out / "machine.toml")
    (out / "machine.json").write_text(json.dumps(machine, indent=1))
    for name, truth, run in cases():
        (out / name).mkdir(exist_ok=True)
        (out / name / "truth.json").write_text(json.dumps(truth))
        for speed in SPEEDS:
            columns = record(run, speed, random)
            np.savetxt(out / name / f"run_{speed:g}.csv", columns, "%.9e", ",", header=header, comments="")
        print(name, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
