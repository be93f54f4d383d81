"""Seals and couplings as built: their forces written down in x and y, solved here, then diagnosed."""

import numpy as np
import pytest
from machines import disc, readings, shaft, springs
from slow_effects import SLOW

from rotorstudy.diagnosis.search.odds import SCALES, log_scales
from rotorstudy.diagnosis.verdict.cause_words import cause_in_words
from rotorstudy.diagnosis.verdict.investigate import investigate
from rotorstudy.model.rig import build_model

SPEEDS = np.array([120.0, 170.0, 230.0, 300.0, 380.0])
HARMONICS = np.array([0, 1, -1, 2, -2, 3, -3])
NOISE = 2e-8  # m
NODES, UNBALANCE, SUPPORT, DAMPING = (1, 2, 3, 4), 1e-5, 1e6, 300.0  # kg m at node 2, N/m and N s/m at both ends
MODEL = build_model(
    {
        "rotor": shaft(0.6, 3, disc(2)),
        "bearings": springs((1, 4), SUPPORT, DAMPING),
        "effects": [{"kind": "unbalance", "node": 2, "mass_kg": 1.0, "eccentricity_m": UNBALANCE}],
        "sensors": list(NODES),
    }
)
SETTINGS = {"uncertainty": {"default": 0.02}, "leave_out": SLOW, "most_causes": 1, "candidates_per_round": 2}


def planar(matrix):
    """A matrix of complex coordinates as one of (x, y): z = x + j y, so that j turns x into y."""
    return np.kron(np.eye(2), np.real(matrix)) + np.kron([[0, -1], [1, 0]], np.imag(matrix))


def solved(coefficients=lambda speed: (), forces=lambda speed: {}, rotating_damping=0.0):
    """Harmonics (speed, harmonic, sensor) of m q'' + c q' + k q = f with q = (all x, all y).

    coefficients(speed) : (kind, node, 2 x 2) of further mass, damping, stiffness
    forces(speed)       : {harmonic: (node, x, y) list}, of e^{jnwt}, real parts
    rotating_damping    : matrix of complex coordinates that acts on the velocity in axes that turn with the shaft
    """
    s, size = MODEL.structure, len(MODEL.structure.dofs)
    shown = np.zeros((len(SPEEDS), len(HARMONICS), len(NODES)), complex)
    at = [s.index(node) for node in NODES]
    ends = [(kind, n, c * np.eye(2)) for kind, c in (("stiffness", SUPPORT), ("damping", DAMPING)) for n in (1, 4)]
    weight = np.concatenate([s.static_load, 0 * s.static_load])

    def add(matrices, given):
        for kind, node, added in given:
            rows = [s.index(node), size + s.index(node)]
            matrices[kind][np.ix_(rows, rows)] += added

    for i, w in enumerate(SPEEDS):
        matrices = {"mass": planar(s.mass), "damping": planar(-1j * w * s.gyroscopic), "stiffness": planar(s.stiffness)}
        add(matrices, ends)
        sag = np.linalg.solve(matrices["stiffness"], weight)
        add(matrices, coefficients(w))
        matrices["damping"] += planar(rotating_damping + 0 * s.mass)
        matrices["stiffness"] += planar(-1j * w * rotating_damping + 0 * s.mass)  # the axes turn with w: q' - j w q
        pushed = {1: [(2, UNBALANCE * w**2, -1j * UNBALANCE * w**2)], 0: [], **{n: [] for n in (2, 3)}}
        for n, given in forces(w).items():
            pushed[n] = pushed[n] + given
        for n, given in pushed.items():
            push = weight.astype(complex) if n == 0 else np.zeros(2 * size, complex)
            for node, x, y in given:
                push[s.index(node)] += x
                push[size + s.index(node)] += y
            dynamic = matrices["stiffness"] + 1j * n * w * matrices["damping"] - (n * w) ** 2 * matrices["mass"]
            x, y = np.split(np.linalg.solve(dynamic, push) - (sag if n == 0 else 0), 2)
            for sign in (1, -1) if n else (1,):  # x = Re(X e^{jnwt}) has X / 2 at n and conj(X) / 2 at -n
                part = (x + 1j * y if sign > 0 else x.conj() + 1j * y.conj()) / (2 if n else 1)
                shown[i, list(HARMONICS).index(sign * n)] = part[at]
    return shown


def measured(shown, seed=1):
    return readings(shown, SPEEDS, HARMONICS, NODES, NOISE / np.sqrt(2), seed)


def diagnosed(**physics):
    return investigate(measured(solved(**physics)), MODEL, settings=SETTINGS)


def named(found):
    return {(c.effect, c.where.get("node", c.where.get("element"))) for c in found.verdict.causes}


def stated(found):
    return named(found) | {(c.effect, c.where.get("node")) for c in found.verdict.ambiguous_with}


def test_the_rotor_itself_is_called_clean():
    assert diagnosed().verdict.verdict == "nothing"


def seal(c, swirl, mass=0.0, stiffness=0.0, cross=0.0):
    """Stiffness, damping and mass of a short seal as matrices of x and y; Black 1969."""
    turn = np.array([[0, 1], [-1, 0]])  # F_x = -c x' - c lambda w y, F_y = -c y' + c lambda w x
    return lambda w: [
        ("damping", 3, c * np.eye(2) + 2 * mass * swirl * w * turn),
        ("stiffness", 3, (stiffness - mass * (swirl * w) ** 2) * np.eye(2) + (w * c * swirl + cross) * turn),
        ("mass", 3, mass * np.eye(2)),
    ]


@pytest.mark.parametrize(("swirl", "mass"), [(0.45, 0.0), (0.3, 0.4)])
def test_a_seal_is_not_internal_damping(swirl, mass):
    found = diagnosed(coefficients=seal(150.0, swirl, mass))
    assert ("seal", 3) in stated(found) and named(found) != {("internal_damping", 3)}
    assert found.best.cost < 1.2 * len(found.best.residual)
    (cause,) = [c for c in found.verdict.causes if c.effect == "seal"]
    assert cause.parameters["seal_damping"].value == pytest.approx(150.0, rel=0.1)
    assert cause.parameters["swirl_ratio"].value == pytest.approx(swirl, abs=0.05)
    assert cause.parameters["seal_fluid_mass"].value == pytest.approx(mass, abs=0.05)


def test_a_seal_has_a_stiffness_and_a_swirl_of_its_inlet():
    found = diagnosed(coefficients=seal(150.0, 0.0, stiffness=-6e4, cross=2e4))
    assert ("seal", 3) in stated(found)
    causes = [c for c in (*found.verdict.causes, *found.verdict.ambiguous_with) if c.effect == "seal"]
    assert causes[0].parameters["seal_stiffness"].value == pytest.approx(-6e4, rel=0.1)
    assert causes[0].parameters["seal_cross_stiffness"].value == pytest.approx(2e4, rel=0.2)


def bent(node, length=0.2, diameter=0.02, modulus=2.1e11):
    """Stiffness of the slender beam from a node to the next, on translations and slopes; Gasch et al., chapter 12."""
    rigidity = modulus * np.pi * diameter**4 / 64
    one = np.array([
        [12, 6 * length, -12, 6 * length],
        [6 * length, 4 * length**2, -6 * length, 2 * length**2],
        [-12, -6 * length, 12, -6 * length],
        [6 * length, 2 * length**2, -6 * length, 4 * length**2],
    ])  # fmt: skip
    found = np.zeros_like(MODEL.structure.mass)
    rows = [MODEL.structure.index(n, motion) for n in (node, node + 1) for motion in ("translation", "tilt")]
    found[np.ix_(rows, rows)] = rigidity / length**3 * one
    return found


def test_internal_damping_is_not_a_seal():
    found = diagnosed(rotating_damping=2e-4 * bent(2))
    assert ("internal_damping", 2) in stated(found)
    assert "seal" not in {effect for effect, _ in stated(found)}


def test_external_damping_is_a_seal_without_swirl_at_most():
    found = diagnosed(coefficients=seal(60.0, 0.0))
    assert named(found) == {("external_damping", 3)}


def test_a_support_that_lost_stiffness_along_one_direction_is_one_cause():
    along = np.array([np.cos(1.4), np.sin(1.4)])
    found = diagnosed(coefficients=lambda w: [("stiffness", 1, -1e5 * np.outer(along, along))])
    assert named(found) == {("support_loss", 1)}
    size = {name: one.value for name, one in found.verdict.causes[0].parameters.items()}
    assert size["support_stiffness_loss"] == pytest.approx(1e5, rel=0.2)
    assert size["direction_rad"] == pytest.approx(1.4, abs=0.1)


def coupling(*places):
    """Elliptic and constant forces of a coupling, N, on some (node, sign)."""
    sizes = {0: (3.0, -1.0), 1: (2.0, 1.0j), 2: (6.0, -2.0 + 1.0j), 3: (0.0, 1.0)}
    return lambda w: {n: [(node, sign * x, sign * y) for node, sign in places] for n, (x, y) in sizes.items()}


def test_a_coupling_has_any_polarisation():
    found = diagnosed(forces=coupling((3, 1)))
    assert named(found) == {("parallel_misalignment", 3)}
    size = {name: one.value for name, one in found.verdict.causes[0].parameters.items()}
    forward, backward = 6.0 + 1j * (-2.0 + 1.0j), 6.0 + 1j * (-2.0 - 1.0j)  # of x + j y, twice its harmonics
    assert size["misalignment_force_2X"] == pytest.approx(abs(forward) / 2, rel=0.02)
    assert size["misalignment_force_-2X"] == pytest.approx(abs(backward) / 2, rel=0.02)
    assert size["misalignment_force_0X"] == pytest.approx(abs(3.0 - 1.0j), rel=0.02)


def test_a_coupling_pushes_both_its_ends():
    found = diagnosed(forces=coupling((2, 1), (3, -1)))
    assert named(found) == {("parallel_misalignment", 2)} and found.verdict.causes[0].where == {"element": 2}


def test_a_sentence_names_the_harmonics_that_are_there():
    found = diagnosed(forces=lambda w: {2: [(3, 4.0, -4.0j)]})  # turns forward
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
