"""A disc with two different diametral moments of inertia I + A and I - A, which rotate with it.

In rotating axes, tilt psi = r e^{jwt}, its equation has constant coefficients (H. Yamamoto and Y. Ishida, Linear and
Nonlinear Rotordynamics, Wiley 2012, ch. 5): with the polar moment P and the stiffness k,

    I (r'' + 2jw r' - w^2 r) - jwP (r' + jw r) + A (conj(r)'' + w^2 conj(r)) + k r = moment.
"""

from dataclasses import replace

import numpy as np
import pytest
from machines import free_motion, in_x_and_y, spectrum_of
from one_line_errors import refused
from scipy.linalg import expm

from rotorstudy import Model, check_stable, harmonic_response, make_term, registry, time_response
from rotorstudy.authoring.invariants import outcomes
from rotorstudy.authoring.invariants.bench import tilting_bench
from rotorstudy.diagnosis.verdict.investigate import investigate
from rotorstudy.model.registry import Registry, plugin_folders, using
from rotorstudy.response.stability import periodic_growth_rate

FILE = '''import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter


def tilting_nodes(structure, sensors):
    return [{"node": node} for node, motion in structure.dofs if motion == "tilt"]


@Effect(source="Yamamoto and Ishida 2012, ch. 5", fold=2, checked="the speeds between which it is unstable",
        places=tilting_nodes)
def asymmetric_disc(structure, node: int = 1):
    """A disc whose diametral moments of inertia differ: M = -d/dt (A e^{2jwt} conj(dpsi/dt))."""
    tilt = structure.unit(node, "tilt")
    here = -np.outer(tilt, tilt)
    entries = Entry(here, "conj", 2, 2), Entry(2j * here, "conj", 1, 2, gain=lambda speed: speed)
    return [Parameter("inertia_difference", "kg m2", entries, typical=TYPICAL, is_complex=True)]
'''
TRANSVERSE, POLAR, DIFFERENCE = 0.004, 0.0025, 3e-4 * np.exp(0.7j)
TILTING = replace(tilting_bench(), mass=np.diag([2.0, TRANSVERSE]), gyroscopic=np.diag([0.0, POLAR]))
SPRING = TILTING.stiffness[1, 1]
EDGES = np.sqrt(SPRING / (TRANSVERSE - POLAR + abs(DIFFERENCE) * np.array([1, -1])))  # rad/s, of the unstable speeds


@pytest.fixture
def zoo(tmp_path):
    """Function from a typical size, kg m2, to a library with that effect."""

    def made(typical):
        file = tmp_path / f"asymmetric_{typical}.py"
        file.write_text(FILE.replace("TYPICAL", str(typical)))
        return Registry(plugin_folders(), entry_points=False, files=[file])

    return made


def term(kind, structure, **values):
    made = make_term("effect", {"kind": kind, "node": 1, "label": "hidden"}, structure, structure.nodes)
    return replace(made, values=values)


def disc(structure, value=DIFFERENCE):
    return term("asymmetric_disc", structure, inertia_difference=value)


def in_rotating_axes(structure, speed):
    """Real mass, damping and stiffness matrices in rotating axes, with the asymmetry of the tilt."""
    mass, gyroscopic, stiffness = structure.mass, structure.gyroscopic, structure.stiffness
    on_conj = np.diag([0, DIFFERENCE])

    damping = 1j * speed * (2 * mass - gyroscopic)
    rest = stiffness - speed**2 * (mass - gyroscopic) + 0j
    return in_x_and_y(mass + 0j, on_conj), in_x_and_y(damping, 0 * on_conj), in_x_and_y(rest, speed**2 * on_conj)


def test_the_free_motion_is_that_of_constant_coefficients_in_rotating_axes(zoo):
    speed, time = 900.0, np.linspace(0, 0.02, 7)
    start = np.array([1e-5, -2e-5j]), np.array([3e-3j, 1e-2])
    with using(zoo(3e-4)):
        model = Model(replace(TILTING, static_load=np.zeros(2)), (disc(TILTING),))
        found = time_response(model, speed, time, start=start)
    matrix = free_motion(*in_rotating_axes(TILTING, speed))
    displacement, velocity = start[0], start[1] - 1j * speed * start[0]
    initial = np.concatenate([part for one in (displacement, velocity) for part in (one.real, one.imag)])
    moved = np.array([expm(matrix * t) @ initial for t in time])
    expected = (moved[:, :2] + 1j * moved[:, 2:4]) * np.exp(1j * speed * time)[:, None]
    assert np.abs(found - expected).max() < 1e-7 * np.abs(expected).max()  # of the integrator


def test_the_rotor_is_unstable_between_two_speeds(zoo):
    """Statically in rotating axes, where k - (I - P) w^2 lies between -A w^2 and A w^2; it has tilt alone."""
    structure = replace(TILTING, stiffness=np.diag(np.diag(TILTING.stiffness)))
    speeds = np.array([0.5 * EDGES[0], 0.98 * EDGES[0], 1.02 * EDGES[0], EDGES.mean(), 0.98 * EDGES[1], 1.1 * EDGES[1]])
    expected = [np.linalg.eigvals(free_motion(*in_rotating_axes(structure, w))).real.max() for w in speeds]
    with using(zoo(3e-4)):
        model = Model(structure, (disc(structure),))
        found = periodic_growth_rate(model, speeds)
        check_stable(model, speeds[:2])
        refused(lambda: check_stable(model, speeds[2:3]), "a free motion grows")
    grows = (speeds > EDGES[0]) & (speeds < EDGES[1])
    assert ((found > 1) == grows).all()
    assert found[grows] == pytest.approx(np.array(expected)[grows], rel=1e-3)  # 256 steps a revolution


def test_a_couple_unbalance_turns_the_disc_as_its_two_moments_of_inertia_allow(zoo):
    speed, moment = 1500.0, 0.3 - 0.1j
    with using(zoo(3e-4)):
        push = term("couple_unbalance", TILTING, couple_unbalance=moment / speed**2)
        model = Model(TILTING, (disc(TILTING), push))
        found = harmonic_response(model, [speed], [1])[0, 0]
    *_, stiffness = in_rotating_axes(TILTING, speed)
    still = np.linalg.solve(stiffness, [0, moment.real, 0, moment.imag])
    assert found == pytest.approx(still[:2] + 1j * still[2:], rel=1e-9)


@pytest.mark.parametrize(("typical", "words"), [(3e-4, []), (3e-3, ["overflow"])])
def test_the_checks_of_effects_hold_and_refuse_a_negative_moment_of_inertia(zoo, typical, words):
    with using(zoo(typical)):  # the disc of the bench has 0.0024 kg m2
        checked = outcomes(registry().get("effect", "asymmetric_disc"))
    found = [one.wrong for one in checked if one.state == "fails"]
    assert len(found) == len(words) and all(map(str.__contains__, found, words)), found


def test_a_diagnosis_finds_it(zoo):
    speeds, harmonics = np.array([700.0, 1100.0, 1500.0, 1900.0, 2200.0]), np.array([1, -1])
    with using(zoo(3e-4)):
        effects = {"external_damping": 90.0, "unbalance": 2e-5 + 0j, "couple_unbalance": 1e-6j}
        amplitudes = "external_damping", "eccentricity", "couple_unbalance"
        known = [term(kind, TILTING, **{name: effects[kind]}) for kind, name in zip(effects, amplitudes, strict=True)]
        rig, others = Model(TILTING, tuple(known)), {"asymmetric_disc", "bow", "added_mass", *effects}
        data = spectrum_of(rig.plus(disc(TILTING)), speeds, harmonics, 1e-9)
        left_out = [name for name in registry().plugins["effect"] if name not in others]
        verdict = investigate(data, rig, hold_out=[], settings={"leave_out": left_out}).verdict
    assert not verdict.broken_plugins
    (found,) = verdict.causes
    assert found.effect == "asymmetric_disc"
    size = found.parameters["inertia_difference"]
    assert size.value == pytest.approx(abs(DIFFERENCE), abs=3 * size.std)
