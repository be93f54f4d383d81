"""The package's predictions of machines that share nothing with it."""

import numpy as np
import pytest
from balance import balanced
from machines import pedestal_resonance

from foreign.small_cases import HARMONICS, distance, exact_model, special
from rotorstudy import make_term
from rotorstudy.blind.machines.cases import draw_case
from rotorstudy.blind.machines.contacts import add_misalignment
from rotorstudy.blind.machines.effects import add_bow, add_pedestal, add_thermal_bow, bow_by_kink
from rotorstudy.blind.machines.faults import add_crack
from rotorstudy.blind.machines.machine import build
from rotorstudy.response.floquet import periodic_growth_rate
from rotorstudy.response.stability import growth_rate

pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")


@pytest.mark.parametrize("mass", [1e-3, 0.1, 30.0, 1e4])
@pytest.mark.parametrize("seed", [1, 2])  # between bearings; the disc overhung
def test_a_healthy_machine_is_predicted(mass, seed):
    """To round-off: both elements are exact, and the simulator propagates linear machines exactly."""
    case = draw_case(seed, "healthy", speeds=3, steps=32, modes=None, mass=mass, count=7)
    assert (case.rotor.bearings[-1].node < 7) == (seed == 2)
    harmonics = [0, 1, -1, 2, -2]

    def off(*errors):
        return distance(case, harmonics, exact_model(case, errors=errors))

    assert off(0, 0, 0) < 1e-8
    assert off(0.02, 0, 0) > 1e-3  # of the modulus
    assert off(0, 0.05, 0) > 1e-4  # of the bearings


@pytest.mark.parametrize(
    ("place", "add", "angle"),
    [
        ({"element": 2, "last_element": 4}, lambda machine: add_thermal_bow(machine, [1, 2, 3], 10.0, 0.4), 0.4),
        ({"element": 4}, lambda m: add_bow(m, bow_by_kink(m.rotor, 2, 1e-3 * np.exp(0.3j))), 0.3 - np.pi),
    ],
)
def test_a_hotter_side_and_a_kink_are_bows_of_a_stretch(place, add, angle):
    """Both loads are combinations of the two of the stretch, to round-off, and not of those of its neighbour."""
    case = draw_case(5, "healthy", speeds=3, steps=32, modes=None, count=7)
    structure, machine = exact_model(case).structure, build(case.rotor)
    add(machine)
    offset = {"translation": 0, "tilt": 3}
    true = np.array([machine.harmonic[1, 0][4 * (node - 1) + offset[motion]] for node, motion in structure.dofs])

    def columns(where):
        term = make_term("effect", {"kind": "bow", **where}, structure, structure.nodes)
        return np.array([unknown.entries[0].matrix for unknown in term.unknowns[::2]]).T

    def left(of):
        return np.abs(of @ np.linalg.lstsq(of, true, rcond=None)[0] - true).max() / np.abs(true).max()

    assert left(columns(place)) < 1e-9
    assert left(columns({"element": 5, "last_element": 6})) > 0.1
    # the angle of the constant one is that of the side to which the shaft bulges
    assert np.angle(np.vdot(columns(place)[:, 0], true)) == pytest.approx(angle, abs=0.05)


def test_an_asymmetric_stretch_is_predicted():
    """Its 2X by the weight agrees with the integration in time, whose error falls with the square of its 256 steps."""
    case = draw_case(3, "asymmetry", speeds=3, count=4, modes=None, visible=0.02)
    truth = case.effects[0]
    first, last = truth["elements"][0], truth["elements"][-1]
    assert last - first + 1 < 4  # not of the whole shaft
    effect = {"kind": "shaft_asymmetry", "shaft_asymmetry": truth["share"], "element": first, "last_element": last}
    turned = effect | {"shaft_asymmetry_phase_rad": 2 * truth["phase_rad"]}
    assert distance(case, [2], exact_model(case, turned)) < 5e-4
    assert distance(case, [2], exact_model(case, effect)) > 0.1  # another direction


@pytest.mark.parametrize("kind", ["parallel_misalignment", "angular_misalignment"])
def test_the_coupling_of_a_misaligned_shaft_acts_on_its_motion(kind):
    """k (1 + d e^{2jwt} conj) (o + r e^{jwt} - y): a constant part, 1X and 2X, and a stiffness with an asymmetry d."""
    share, turn = 0.2, np.exp(0.7j)

    def misaligned(draw):
        sag = np.abs(draw.rest(1)).max()
        first, length = draw.rotor.elements[0], draw.rotor.positions[-1]
        bending = kind == "angular_misalignment"
        size, stiffness = (4 * sag / length, 0.1 * first.bending_stiffness / first.length) if bending else (
            sag, 0.2 * draw.rotor.bearings[0].stiffness[0, 0])  # fmt: skip
        add_misalignment(draw.machine, 0, stiffness, size * turn, 0.1 * size, share, bending)
        return {"stiffness": stiffness, "offset": size * turn, "run_out": 0.1 * size}

    case = special(1, misaligned, modes=None)
    k, offset, run_out = (case.effects[0][name] for name in ("stiffness", "offset", "run_out"))
    load, unit = ("moment", "N_m") if kind == "angular_misalignment" else ("force", "N")
    forces = {0: k * offset, 1: k * (1 + share) * run_out, 2: k * share * np.conj(offset)}
    effect = {"kind": kind, "node": 1, "harmonics": list(forces), "coupled": True}
    for n, force in forces.items():
        effect[f"misalignment_{load}_{n}X_{unit}"] = abs(force)
        effect[f"misalignment_{load}_{n}X_phase_rad"] = np.angle(force)
    stiffness = "N_m" if kind == "angular_misalignment" else "N_per_m"

    def off(share):
        coupling = {"coupling_stiffness": k, "coupling_asymmetry": share * k}
        more = effect | {f"{name}_{stiffness}": value for name, value in coupling.items()}
        return distance(case, [0, 1, -1, 2], exact_model(case, more))

    assert off(share) < 1e-3  # of 128 steps a turn
    assert off(0.0) > 5e-3


def test_two_cracks_are_predicted():
    """The simulator leaves out the moment by the weight within an element, 1 % here; multipliers give the growth."""
    places = [(0, 0.6, 0.5, 0.4, "gradual"), (1, 0.4, 0.35, 2.9, "switching")]

    def add(draw):
        for place in places:
            add_crack(draw.machine, *place)
        return {}

    case = special(1, add, speeds=3, steps=256, modes=None)
    laws = {"gradual": "gradual", "switching": "sudden"}
    start, lengths = case.rotor.positions, [element.length for element in case.rotor.elements]
    cracks = [
        {"kind": "transverse_crack", "label": f"in element {i + 1}", "position_m": float(start[i] + at * lengths[i]),
         "depth_ratio": depth / 2, "angle_rad": angle, "breathing": laws[kind], "flexibility_factor": 1.0}
        for i, at, depth, angle, kind in places
    ]  # fmt: skip

    def off(*chosen):
        return distance(case, HARMONICS[1:], exact_model(case, *chosen), order=20)

    size = off()
    assert off(*cracks) < 0.02 * size
    assert min(off(cracks[0]), off(cracks[1])) > 0.05 * size
    speed = case.steady.speed
    growth = np.log(case.steady.multipliers) * speed / (2 * np.pi)
    cracked, sound = exact_model(case, *cracks), exact_model(case)
    bare = growth_rate(sound, speed)
    assert np.abs(periodic_growth_rate(cracked, speed) - growth).max() < 0.1 * np.abs(bare - growth).max()


def test_a_pedestal_with_a_resonance_along_each_direction_is_predicted():
    """Behind a bearing with cross stiffnesses, whose loss the effect has to first order in the share of the bearing."""
    ratio = 0.1  # of the damping of both together to the critical one

    def add(draw):
        bearing, mass = draw.rotor.bearings[0], 0.5 * draw.rotor.mass
        stiff, damped = np.diag(bearing.stiffness), np.diag(bearing.damping)
        feet = stiff * [3.0, 2.0]
        natural = np.sqrt((stiff + feet) / mass)
        add_pedestal(draw.machine, bearing, mass, np.diag(feet), np.diag(2 * ratio * natural * mass - damped))
        both = np.linalg.inv(bearing.stiffness + np.diag(feet))
        loss = bearing.stiffness @ both @ bearing.stiffness
        return {"natural": natural, "bearing_time_s": damped[0] / stiff[0], "loss": loss}

    case = special(8, add, speeds=3, steps=256, modes=None)
    assert abs(case.rotor.bearings[0].stiffness[0, 1]) > 0.03 * case.rotor.bearings[0].stiffness[0, 0]
    truth = case.effects[0]
    effect = pedestal_resonance(truth["natural"], ratio, truth["bearing_time_s"], truth["loss"])

    def off(**other):
        return distance(case, [1, -1], exact_model(case, *([effect | other] if other else [])))

    cross = {f"stiffness_loss_at_rest_{ab}_N_per_m": 0.0 for ab in ("xy", "yx")}
    assert off(node=1) < 2e-3  # of second order: a cross stiffness of 6 % times a share of 30 % squared
    assert min(off(frequency_ratio=1.0), off(**cross), off(bearing_time_s=0.0)) > 5e-3
    assert off() > 0.1


def test_intervals_of_a_balancing_hold_as_often_as_they_say():
    """95 %; the 12 intervals of a machine stand and fall together, so that the mean of six scatters by 6 %."""

    def shares(seeds, **options):
        """Means over machines, of the intervals of the vibration left and of the next reading that hold the truth."""
        return np.mean([list(balanced(seed, **options).values()) for seed in seeds], axis=0)

    assert np.all(shares(range(1, 7)) > 0.8)
    # negative control: an uncertainty that is stated too small
    left, _ = shares((1, 2), share=0.05)
    assert left < 0.7
