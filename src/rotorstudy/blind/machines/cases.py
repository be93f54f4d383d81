"""Cases: a random machine with one effect, its records as measured, and the truth about it."""

from collections import ChainMap
from dataclasses import dataclass, replace

import numpy as np

from rotorstudy.blind.machines import effects
from rotorstudy.blind.machines.draw import MACHINES, draw_rotor, draw_speeds, draw_unbalance, first_frequency
from rotorstudy.blind.machines.faults import FAMILIES, Draw
from rotorstudy.blind.machines.film import add_film
from rotorstudy.blind.machines.forms import FORMS
from rotorstudy.blind.machines.machine import PointRotor, Rotor, build
from rotorstudy.blind.machines.measuring import Chain, Probe, expected_harmonics, record, surface_runout
from rotorstudy.blind.machines.stepping import NoSteadyState, Steady, steady_state

CHAIN_FAULTS = ("swapped", "reversed", "phase_offset", "delay", "angle_error", "gain", "runout", "unloaded_zero")
PROBE_FAULTS = ("swapped", "reversed", "angle_error", "gain", "runout")  # at one node
SHOWN_BY_THE_MEAN = ("preload", "internal_damping")  # the shaft's damping is silent at 1X and shifts the sag sideways
KNOWN = ChainMap(FAMILIES, FORMS)
TRIES = 20
RUNOUT = 0.01  # of an ordinary surface over the usual motion


@dataclass(frozen=True)
class Case:
    """A machine with one effect, as it is and as it was measured; nodes count from 0, those of `effects` from 1."""

    machine: str
    rotor: Rotor | PointRotor
    unbalance: dict  # node to complex moment, kg m
    effects: list
    changed: dict  # see `visibility`
    steady: Steady  # motion with all effects
    healthy: Steady  # motion without
    alone: list  # motion with each effect
    sag: np.ndarray  # (coordinates,) rest position of the healthy machine
    zero: np.ndarray | None  # (coordinates,) where the probes read zero; None: on the unloaded line
    nodes: list
    probes: dict
    chain: Chain
    fault: str | None
    faulty_node: int | None
    records: dict  # see `measuring.record`
    picture: dict  # sense and gravity of the rig's angles

    def shown(self, steady, harmonics):
        """What its probes show of a motion without noise, see `measuring.expected_harmonics`."""
        return expected_harmonics(steady, self.nodes, self.probes, self.chain, harmonics, self.zero)

    def sound(self):
        """The same case with probes and chain without gross faults or errors, from the unloaded line."""
        right = {"gain": 1.0, "angle_error": 0.0, "reversed": False, "runout": {}}
        probes = {node: tuple(replace(probe, **right) for probe in pair) for node, pair in self.probes.items()}
        return replace(
            self, probes=probes, chain=replace(self.chain, swapped=(), phase_offset=0.0, delay=0.0), zero=None
        )


def machine_of(rotor, unbalance, speeds):
    """The machine of a rotor with its unbalance and weight, at the speeds at which it runs."""
    machine = build(rotor)
    for film, linear in zip(rotor.films, rotor.bearings, strict=False):
        add_film(machine, film, linear, speeds)
    for node, value in unbalance.items():
        effects.add_unbalance(machine, node, abs(value), np.angle(value))
    return machine


def measured_nodes(rng, rotor):
    """Two to four nodes with probes, one at a disc; the only one of a rotor that has no more."""
    discs = [disc.node for disc in rotor.discs]
    count = min(int(rng.integers(2, 5)), rotor.nodes)
    first = int(rng.choice(discs))
    rest = [node for node in range(rotor.nodes) if node != first]
    return sorted([first, *(int(node) for node in rng.choice(rest, count - 1, replace=False))])


def swing_of(healthy, nodes):
    """Usual radius of the healthy motion at the nodes with probes, m."""
    return float(np.median([np.ptp(healthy.displacement[:, :, 4 * node], axis=1).mean() / 2 for node in nodes]))


def ordinary_probes(rng, angles, rough):
    """Probes at one node, of ordinary quality, on a surface with a runout of `rough` m."""
    runout = surface_runout(rng, angles, rough)
    return [
        Probe(float(angle), 1 + 5e-3 * rng.normal(), np.deg2rad(0.5) * rng.normal(), profile)
        for angle, profile in zip(angles, runout, strict=True)
    ]


def draw_chain(rng, healthy, nodes, fault=None):
    """Probes, chain of ordinary quality with a gross fault if named, and the node, from 0, of a faulty probe."""
    swing = swing_of(healthy, nodes)
    first = rng.uniform(0, 2 * np.pi)
    angles = (first, first + np.pi / 2 * rng.choice([-1, 1]) * rng.uniform(0.8, 1.2))
    wrong, probes = int(rng.choice(nodes)), {}
    for node in nodes:
        rough = rng.uniform(0.1, 0.4) if fault == "runout" and node == wrong else RUNOUT
        probes[node] = pair = ordinary_probes(rng, angles, swing * rough)
        if node == wrong:
            at = int(rng.integers(2))
            if fault == "reversed":
                pair[at] = replace(pair[at], reversed=True)
            if fault == "gain":
                pair[at] = replace(pair[at], gain=pair[at].gain * rng.choice([0.8, 1.25]))
            if fault == "angle_error":
                error = pair[at].angle_error + np.deg2rad(rng.choice([-15, 15]))
                pair[at] = replace(pair[at], angle_error=error)
    quality = swing * 10 ** rng.uniform(-3.5, -2)
    slowest, fastest = healthy.speed.min(), healthy.speed.max()
    chain = Chain(
        rate=float(128 * fastest / (2 * np.pi)),
        revolutions=32.0,
        noise=float(quality),
        coloured_noise=float(quality * rng.uniform(0, 1)),
        quantum=float(quality * 0.3),
        swapped=(wrong,) if fault == "swapped" else (),
        phase_offset=float(np.deg2rad(rng.choice([-30, 30]))) if fault == "phase_offset" else 0.0,
        delay=float(0.2 / slowest) if fault == "delay" else 0.0,
        amplitude_scatter=float(rng.uniform(0, 5e-3)),
        phase_scatter=float(rng.uniform(0, 5e-3)),
        jitter=float(rng.uniform(0, 5e-4)),
        sensor_angle=float(rng.uniform(0, 2 * np.pi)),
        mark_angle=float(rng.uniform(0, 2 * np.pi)),
        pulse_width=0.35,
    )
    return probes, chain, wrong if fault in PROBE_FAULTS else None


def visibility(steady, healthy, nodes):
    """Change of each harmonic by the effect over the healthy 1X, root mean square over speeds and nodes."""
    orders = range(-3, 4)
    shown, sound = (motion.harmonics(nodes, orders) for motion in (steady, healthy))
    change, base = (np.sqrt(np.mean(np.abs(off) ** 2, axis=(0, 2))) for off in (shown - sound, sound))
    return dict(zip(map(str, orders), (change / base[orders.index(1)]).tolist(), strict=True))


def draw_case(
    seed, family, speeds=8, steps=256, modes=10, chain_fault=None, mass=None, count=None, visible=0.0, machine="any",
    severity=1.0, known=KNOWN,
):  # fmt: skip
    """A random Case of `known` families, joined by "+"; after `TRIES` machines without steady motion NoSteadyState.

    steps, modes : of the integration, see `stepping.steady_state`;  mass, count : see `draw.draw_rotor`
    visible      : least change of some harmonic but 0X over the healthy 1X; of `SHOWN_BY_THE_MEAN` 0X counts too
    severity     : times the usual size, of `forms.FORMS`;  known : name -> function, as FAMILIES
    """
    if chain_fault not in (None, *CHAIN_FAULTS):
        raise ValueError(f"no fault of the chain: {chain_fault}")
    rng = np.random.default_rng(seed)
    for _ in range(TRIES):
        try:
            rotor = draw_rotor(rng, mass, count) if machine == "any" else MACHINES[machine](rng)
            frequency = first_frequency(rotor)
            unbalance = draw_unbalance(rng, rotor, frequency)
            speed = draw_speeds(rng, frequency, speeds)
            sound = machine_of(rotor, unbalance, speed)
            healthy = steady_state(sound, speed, steps, modes)
            whole, added, alone = machine_of(rotor, unbalance, speed), [], []
            for name in family.split("+"):
                state = rng.bit_generator.state
                drawn = Draw(rng, whole, unbalance, healthy, frequency, severity)
                added.append({"family": name, **known[name](drawn)})
                if "+" in family:  # the same draw on a machine of its own
                    apart, again = machine_of(rotor, unbalance, speed), np.random.default_rng()
                    again.bit_generator.state = state
                    known[name](Draw(again, apart, unbalance, healthy, frequency, severity))
                    alone.append(steady_state(apart, speed, steps, modes, most=25))
            steady = steady_state(whole, speed, steps, modes, most=25)
        except NoSteadyState:
            continue
        nodes = measured_nodes(rng, rotor)
        changed = visibility(steady, healthy, nodes)
        if max(change for k, change in changed.items() if k != "0" or family in SHOWN_BY_THE_MEAN) >= visible:
            break
    else:
        raise NoSteadyState(f"none of {TRIES} machines of {family} moves steadily and shows it")
    probes, chain, wrong = draw_chain(rng, healthy, nodes, chain_fault)
    sag = sound.sag()
    zero = 0 * sag if chain_fault == "unloaded_zero" else sag
    picture = {"rotation": str(rng.choice(["with_angles", "against_angles"]))}
    picture["gravity_angle_deg"] = float(rng.choice([0, 90, 180, 270]))
    records = record(rng, steady, nodes, probes, chain, zero)
    faulty = None if wrong is None else wrong + 1
    return Case(machine, rotor, unbalance, added, changed, steady, healthy, alone or [steady], sag, zero, nodes, probes,
                chain, chain_fault, faulty, records, picture)  # fmt: skip
