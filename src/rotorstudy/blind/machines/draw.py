"""Random rotors of any size: drawn without dimensions, then scaled."""

from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from rotorstudy.blind.machines.beam import Element
from rotorstudy.blind.machines.film import Film, bearing
from rotorstudy.blind.machines.machine import Bearing, Disc, PointRotor, Rotor, build


def between(rng, low, high):
    """A number between two positive ones, uniform in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def first_frequency(rotor):
    """Lowest natural frequency at rest, undamped, rad/s."""
    machine = build(rotor)
    stiffness = (machine.stiffness + machine.stiffness.T) / 2
    return float(np.sqrt(eigh(stiffness, machine.mass, eigvals_only=True, subset_by_index=[0, 0])[0]))


def draw_shaft(rng, count, mass):
    """Elements of a shaft of `mass` kg, one diameter or two; steel to light metal."""
    slenderness = between(rng, 15, 45)
    modulus, density = between(rng, 7e10, 2.1e11), between(rng, 2700, 7850)
    thick = np.ones(count)
    if count >= 6 and rng.random() < 0.3:
        first, last = sorted(rng.choice(np.arange(1, count), 2, replace=False))
        thick[first:last] = rng.uniform(1.1, 1.5)
    length = (mass / (density * np.pi / 4 / slenderness**2 * np.mean(thick**2))) ** (1 / 3)
    theory = str(rng.choice(["timoshenko", "euler_bernoulli"]))
    piece, thin = length / count, length / slenderness
    return tuple(Element(piece, thin * ratio, modulus, density, theory=theory) for ratio in thick)


def draw_discs(rng, shaft, nodes, mass):
    """Discs of `mass` kg in all at the nodes, 1.5 to 4 shaft diameters in radius."""
    shares = rng.dirichlet(3 * np.ones(len(nodes))) * mass
    discs = []
    for node, part in zip(nodes, shares, strict=True):
        radius = shaft[0].outer_diameter * rng.uniform(1.5, 4.0)
        width = part / (np.pi * radius**2 * 7850.0)
        discs.append(Disc(int(node), float(part), part * radius**2 / 2, part * (3 * radius**2 + width**2) / 12))
    return tuple(discs)


def draw_bearing(rng, node, stiffness, frequency):
    """A bearing near `stiffness` N/m, up to 30 % softer in y; some have cross terms of a tenth."""
    k = stiffness * np.diag([1.0, rng.uniform(0.7, 1.0)])
    if rng.random() < 0.3:
        k = k + stiffness * rng.uniform(-0.1, 0.1) * np.array([[0.0, 1.0], [1.0, 0.0]])
        k = k + stiffness * rng.uniform(0.0, 0.02) * np.array([[0.0, 1.0], [-1.0, 0.0]])
    damping = 2 * rng.uniform(0.03, 0.2) / frequency * np.diag(np.diag(k))
    return Bearing(node, k, damping)


def draw_rotor(rng, mass=None, count=None, overhung=None):
    """A damped rotor; by default of 1 g to 10 t (`mass`, kg) and 2 to 20 elements (`count`), three of ten overhung."""
    mass = between(rng, 1e-3, 1e4) if mass is None else mass
    count = int(rng.integers(2, 21)) if count is None else count
    ratio = between(rng, 0.3, 5.0)
    shaft = draw_shaft(rng, count, mass / (1 + ratio))
    overhung = count >= 4 and rng.random() < 0.3 if overhung is None else overhung
    right = max(2, round(count * rng.uniform(0.6, 0.8))) if overhung else count
    inner = [node for node in range(1, count + 1) if node != right]
    discs = list(rng.choice(inner, min(len(inner), int(rng.integers(1, 4))), replace=False)) if inner else []
    if overhung and count not in discs:
        discs[0] = count
    discs = draw_discs(rng, shaft, sorted(discs), mass * ratio / (1 + ratio))
    span = right * shaft[0].length
    stiffness = between(rng, 1.0, 20.0) * 48 * shaft[0].bending_stiffness / span**3
    return carried(rng, shaft, discs, (0, right), stiffness)


def carried(rng, shaft, discs, nodes, stiffness):
    """The rotor of a shaft with discs on bearings near `stiffness` N/m at two nodes, damped."""
    rigid = tuple(Bearing(node, stiffness * np.eye(2), np.zeros((2, 2))) for node in nodes)
    frequency = first_frequency(Rotor(shaft, discs, rigid))
    bearings = tuple(draw_bearing(rng, node, stiffness, frequency) for node in nodes)
    external = np.zeros(len(shaft) + 1)
    for disc in discs:
        external[disc.node] = 2 * rng.uniform(0.003, 0.02) * frequency * disc.mass
    internal = 2 * between(rng, 3e-4, 3e-3) / frequency
    shaft = tuple(replace(element, internal_damping=internal) for element in shaft)
    return Rotor(shaft, discs, bearings, tuple(external))


def draw_point_rotor(rng, middle):
    """One disc on a massless shaft, in the middle or not."""
    mass = between(rng, 0.1, 100.0)
    slenderness, modulus = between(rng, 20, 45), between(rng, 7e10, 2.1e11)
    share = 0.5 if middle else float(rng.choice([-1, 1]) * rng.uniform(0.08, 0.25) + 0.5)
    # a shaft whose own mass would be a fifth of the disc's
    diameter = (0.2 * mass / (7850 * np.pi / 4 * slenderness)) ** (1 / 3)
    length, radius = slenderness * diameter, diameter * rng.uniform(2.0, 5.0)
    disc = Disc(0, mass, mass * radius**2 / 2, mass * radius**2 / 4)
    rotor = PointRotor(share * length, (1 - share) * length, diameter, modulus, disc, 0.0, 0.0)
    usual = 2 * mass * first_frequency(rotor)
    return replace(rotor, external=usual * rng.uniform(0.01, 0.05), internal=usual * between(rng, 3e-4, 3e-3))


def draw_rotor_on_films(rng):
    """A rotor whose two bearings are oil films that run at half their clearance or more."""
    rotor = draw_rotor(rng, between(rng, 5.0, 5e3), int(rng.integers(5, 11)), False)
    machine, frequency = build(rotor), first_frequency(rotor)
    sag, films, linear = machine.sag(), [], []
    for old in rotor.bearings:
        load = float(old.stiffness[0] @ sag[4 * old.node : 4 * old.node + 2])
        diameter = rotor.elements[0].outer_diameter
        length, clearance = diameter * rng.uniform(0.3, 0.5), diameter / 2 * between(rng, 1e-3, 2.5e-3)
        eccentricity, speed = rng.uniform(0.5, 0.75), 0.6 * frequency
        ocvirk = (1 - eccentricity**2) ** 2 / eccentricity
        ocvirk /= np.sqrt(16 * eccentricity**2 + np.pi**2 * (1 - eccentricity**2))
        viscosity = ocvirk * 8 * load * clearance**2 / (diameter * length**3 * speed)
        films.append(Film(old.node, diameter, length, clearance, float(viscosity), load))
        linear.append(bearing(films[-1], speed))
    return replace(rotor, bearings=tuple(linear), films=tuple(films))


MACHINES = {
    "any": draw_rotor,
    "jeffcott": lambda rng: draw_point_rotor(rng, True),
    "offset_disc": lambda rng: draw_point_rotor(rng, False),
    "between_bearings": lambda rng: draw_rotor(rng, None, int(rng.integers(5, 13)), False),
    "overhung": lambda rng: draw_rotor(rng, None, int(rng.integers(5, 13)), True),
    "many_elements": lambda rng: draw_rotor(rng, None, int(rng.integers(13, 41))),
    "films": draw_rotor_on_films,
}


def draw_unbalance(rng, rotor, frequency):
    """Unbalance of each disc: node to complex moment, kg m; eccentricity times first frequency 0.5 to 6 mm/s (ISO)."""
    grade = between(rng, 5e-4, 6e-3) / frequency
    return {
        disc.node: disc.mass * grade * rng.uniform(0.5, 1.5) * np.exp(1j * rng.uniform(0, 2 * np.pi))
        for disc in rotor.discs
    }


def draw_speeds(rng, frequency, count):
    """Speeds in rad/s: a band below the first critical speed, or through it."""
    low, high = rng.uniform(0.25, 0.35), rng.uniform(0.75, 0.9) if rng.random() < 0.6 else rng.uniform(1.2, 1.5)
    return frequency * np.linspace(low, high, count) * (1 + 0.01 * rng.normal(size=count))
