"""Random rotors of any size: drawn without dimensions, then scaled."""

from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from foreign.beam import Element
from foreign.machine import Bearing, Disc, Rotor, build


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
    return tuple(
        Element(length / count, length / slenderness * ratio, modulus, density, theory=theory) for ratio in thick
    )


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


def draw_rotor(rng, mass=None, count=None):
    """A rotor between bearings or overhung.

    Parameters
    ----------
    rng : numpy.random.Generator
    mass : float or None
        In kg; None: 1 g to 10 t.
    count : int or None
        Elements; None: 2 to 20.

    Returns
    -------
    Rotor
        Damped by its bearings, by external damping at its discs and by the shaft's material.
    """
    mass = between(rng, 1e-3, 1e4) if mass is None else mass
    count = int(rng.integers(2, 21)) if count is None else count
    ratio = between(rng, 0.3, 5.0)
    shaft = draw_shaft(rng, count, mass / (1 + ratio))
    overhung = count >= 4 and rng.random() < 0.3
    right = max(2, round(count * rng.uniform(0.6, 0.8))) if overhung else count
    inner = [node for node in range(1, count + 1) if node != right]
    discs = list(rng.choice(inner, min(len(inner), int(rng.integers(1, 4))), replace=False)) if inner else []
    if overhung and count not in discs:
        discs[0] = count
    discs = draw_discs(rng, shaft, sorted(discs), mass * ratio / (1 + ratio))
    span = right * shaft[0].length
    stiffness = between(rng, 1.0, 20.0) * 48 * shaft[0].bending_stiffness / span**3
    rigid = tuple(Bearing(node, stiffness * np.eye(2), np.zeros((2, 2))) for node in (0, right))
    frequency = first_frequency(Rotor(shaft, discs, rigid))
    bearings = tuple(draw_bearing(rng, node, stiffness, frequency) for node in (0, right))
    external = np.zeros(count + 1)
    for disc in discs:
        external[disc.node] = 2 * rng.uniform(0.003, 0.02) * frequency * disc.mass
    internal = 2 * between(rng, 3e-4, 3e-3) / frequency
    shaft = tuple(replace(element, internal_damping=internal) for element in shaft)
    return Rotor(shaft, discs, bearings, tuple(external))


def draw_unbalance(rng, rotor, frequency):
    """Unbalance of each disc: node to complex moment, kg m; eccentricity times first frequency 0.5 to 6 mm/s (ISO
    grade).
    """
    grade = between(rng, 5e-4, 6e-3) / frequency
    return {
        disc.node: disc.mass * grade * rng.uniform(0.5, 1.5) * np.exp(1j * rng.uniform(0, 2 * np.pi))
        for disc in rotor.discs
    }


def draw_speeds(rng, frequency, count):
    """Speeds in rad/s: a band below the first critical speed, or through it."""
    low, high = rng.uniform(0.25, 0.35), rng.uniform(0.75, 0.9) if rng.random() < 0.6 else rng.uniform(1.2, 1.5)
    return frequency * np.linspace(low, high, count) * (1 + 0.01 * rng.normal(size=count))
