"""Seals and couplings as built: added to machines of the independent simulator in x and y, then diagnosed."""

from dataclasses import replace

import numpy as np
import pytest
from machines import SLOW, disc, readings, rig_of, shaft, springs, stepped, unbalance

from rotorstudy import build_model
from rotorstudy.blind.machines.beam import Element
from rotorstudy.blind.machines.effects import add_seal, add_unbalance
from rotorstudy.blind.machines.machine import Bearing, Disc, Rotor, build
from rotorstudy.diagnosis.search.odds import SCALES, log_scales
from rotorstudy.diagnosis.verdict.cause_words import cause_in_words
from rotorstudy.diagnosis.verdict.investigate import investigate

pytestmark = pytest.mark.usefixtures("right_conventions")

SPEEDS = np.array([120.0, 170.0, 230.0, 300.0, 380.0])
HARMONICS = np.array([0, 1, -1, 2, -2, 3, -3])
NOISE = 2e-8  # m
NODES, UNBALANCE, SUPPORT, DAMPING = (1, 2, 3, 4), 1e-5, 1e6, 300.0  # kg m at node 2, N/m and N s/m at both ends
PART = Element(0.2, 0.02, 2.1e11, 7850.0)
ENDS = tuple(Bearing(node, SUPPORT * np.eye(2), DAMPING * np.eye(2)) for node in (0, 3))
ROTOR = Rotor((PART,) * 3, (Disc(1, 2.0, 0.0048, 0.0024),), ENDS)
RIG = rig_of(shaft(0.6, 3, disc(2)), springs((1, 4), SUPPORT, DAMPING), unbalance(2, UNBALANCE, mass_kg=1.0))
MODEL = build_model(RIG | {"sensors": [*NODES]})
SETTINGS = {"uncertainty": {"default": 0.02}, "leave_out": SLOW, "most_causes": 1, "candidates_per_round": 2}


def diagnosed(add=lambda machine, speed: None, rotor=ROTOR):
    """The verdict on the motion of the independent simulator; add : what acts on its machine at a speed."""
    shown = []
    for speed in SPEEDS:
        machine = build(rotor, gravity=9.81)
        rest = machine.sag()
        add_unbalance(machine, 1, UNBALANCE)
        add(machine, speed)
        shown.append(stepped(machine, [speed], HARMONICS, 32, rest)[0])
    data = readings(np.array(shown), SPEEDS, HARMONICS, NODES, NOISE / np.sqrt(2), 1)
    return investigate(data, MODEL, settings=SETTINGS)


def named(found):
    return {(c.effect, c.where.get("node", c.where.get("element"))) for c in found.verdict.causes}


def stated(found):
    return named(found) | {(c.effect, c.where.get("node")) for c in found.verdict.ambiguous_with}


def sizes(found, effect):
    """{name: value} of the parameters of a cause that is named, or not ruled out."""
    cause = next(c for c in (*found.verdict.causes, *found.verdict.ambiguous_with) if c.effect == effect)
    return {name: one.value for name, one in cause.parameters.items()}


def test_the_rotor_itself_is_called_clean():
    assert diagnosed().verdict.verdict == "nothing"


def seal(damping, swirl, mass=0.0, stiffness=0.0, cross=0.0):
    """A short seal at node 3, whose fluid has a mass; Black 1969."""
    return lambda machine, speed: add_seal(
        machine, 2, stiffness - mass * (swirl * speed) ** 2, cross, damping, 2 * mass * swirl * speed, mass, swirl
    )


@pytest.mark.parametrize(("swirl", "mass"), [(0.45, 0.0), (0.3, 0.4)])
def test_a_seal_is_not_internal_damping(swirl, mass):
    found = diagnosed(seal(150.0, swirl, mass))
    assert ("seal", 3) in stated(found) and found.best.cost < 1.2 * len(found.best.residual)
    effects = {c.effect for c in found.verdict.causes}
    assert "seal" in effects and "internal_damping" not in effects
    size = sizes(found, "seal")
    assert size["seal_damping"] == pytest.approx(150.0, rel=0.1)
    assert size["swirl_ratio"] == pytest.approx(swirl, abs=0.05)
    assert size["seal_fluid_mass"] == pytest.approx(mass, abs=0.05)


def test_a_seal_has_a_stiffness_and_a_swirl_of_its_inlet():
    found = diagnosed(seal(150.0, 0.0, stiffness=-6e4, cross=2e4))
    assert ("seal", 3) in stated(found)
    assert sizes(found, "seal")["seal_stiffness"] == pytest.approx(-6e4, rel=0.1)
    assert sizes(found, "seal")["seal_cross_stiffness"] == pytest.approx(2e4, rel=0.2)


def test_internal_damping_is_not_a_seal():
    found = diagnosed(rotor=replace(ROTOR, elements=(PART, replace(PART, internal_damping=2e-4), PART)))
    assert ("internal_damping", 2) in stated(found)
    assert "seal" not in {effect for effect, _ in stated(found)}


def test_external_damping_is_a_seal_without_swirl_at_most():
    found = diagnosed(seal(60.0, 0.0))
    assert named(found) == {("external_damping", 3)}


def test_a_support_that_lost_stiffness_along_one_direction_is_one_cause():
    along = np.array([np.cos(1.4), np.sin(1.4)])
    found = diagnosed(lambda machine, speed: machine.at_node(0, -1e5 * np.outer(along, along)))
    assert named(found) == {("support_loss", 1)}
    size = sizes(found, "support_loss")
    assert size["support_stiffness_loss"] == pytest.approx(1e5, rel=0.2)
    assert size["direction_rad"] == pytest.approx(1.4, abs=0.1)


def coupling(*places, sizes=((0, 3.0, -1.0), (1, 2.0, 1.0j), (2, 6.0, -2.0 + 1.0j), (3, 0.0, 1.0))):
    """Constant forces and ellipses, N, of (harmonic, x, y), on some (node, sign)."""

    def add(machine, speed):
        for n, x, y in sizes:
            vector = np.zeros(machine.size, complex)
            for node, sign in places:
                vector[4 * node - 4], vector[4 * node - 3] = sign * x, sign * y
            machine.add_harmonic(n, 0, vector)

    return add


def test_a_coupling_has_any_polarisation():
    found = diagnosed(coupling((3, 1)))
    assert named(found) == {("parallel_misalignment", 3)}
    size = sizes(found, "parallel_misalignment")
    forward, backward = 6.0 + 1j * (-2.0 + 1.0j), 6.0 + 1j * (-2.0 - 1.0j)  # of x + j y, twice its harmonics
    assert size["misalignment_force_2X"] == pytest.approx(abs(forward) / 2, rel=0.02)
    assert size["misalignment_force_-2X"] == pytest.approx(abs(backward) / 2, rel=0.02)
    assert size["misalignment_force_0X"] == pytest.approx(abs(3.0 - 1.0j), rel=0.02)


def test_a_coupling_pushes_both_its_ends():
    found = diagnosed(coupling((2, 1), (3, -1)))
    assert named(found) == {("parallel_misalignment", 2)} and found.verdict.causes[0].where == {"element": 2}


def test_a_sentence_names_the_harmonics_that_are_there():
    found = diagnosed(coupling((3, 1), sizes=[(2, 4.0, -4.0j)]))  # turns forward
    assert named(found) == {("parallel_misalignment", 3)}
    text = cause_in_words(found.verdict.causes[0])
    assert "misalignment force 2X" in text and "3X" not in text and "0X" not in text


def test_absent_harmonics_cost_little_evidence():
    """Exact for amplitudes that the data do not correlate: each is absent, or has one of the widths."""
    mean, std = np.array([0.3, 1e-4, -2e-4]), np.array([1e-2, 2e-4, 2e-4])
    data = 1 / std**2 - 1
    middle = mean / std**2 / data

    def densities(i, widths):
        variance = 1 / data[i] + np.asarray(widths) ** 2
        return np.exp(-0.5 * middle[i] ** 2 / variance) / np.sqrt(variance)

    ratio = 0.0
    for i in range(3):
        one = 0.5 * densities(i, [0.0])[0] + 0.5 * densities(i, SCALES).mean()
        ratio += np.log(one / densities(i, [1.0])[0])
    assert log_scales(mean, np.diag(std**2), np.arange(3)) == pytest.approx(ratio, rel=1e-6)
    first = log_scales(mean[:1], np.diag(std[:1] ** 2), np.array([0]))
    widest = sum(np.log(densities(i, [0.0])[0] / densities(i, [1.0])[0]) for i in (1, 2))
    assert ratio > first + widest - 3 * np.log(2)
