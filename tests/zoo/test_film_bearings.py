"""Oil films against the Reynolds film integrated here, published numbers, and the speed where a journal whirls."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from journal_films import Film, running
from machines import disc, film, shaft
from one_line_errors import refused

from rotorstudy import Model, RotorstudyError, build_model, harmonic_response, make_term, registry, time_response
from rotorstudy.authoring.invariants.bench import bench_structure
from rotorstudy.blind.machines import film as independent
from rotorstudy.model.bearings import dynamic_stiffness
from rotorstudy.response.stability import eigenvalues, stability_threshold
from rotorstudy.response.statics import static_deflection

BENCH = bench_structure()
FREE = replace(BENCH, stiffness=np.zeros((1, 1)))
GRAVITY = 9.81
JOURNAL = film(0.1, 0.03, 1e-4, 0.1, load_N=525.0, bearing_scale=1.0)
DAMPER = film(0.1, 0.02, 2e-4, 0.01, kind="squeeze_film", eccentricity_ratio=0.4, bearing_scale=1.0)
DAMPER["centring_stiffness_N_per_m"] = 0.0
OPTIONS = ("diameter_m", "length_m", "radial_clearance_m", "viscosity_Pa_s", "load_N")
MODULE = sys.modules[registry().get("bearing", "short_journal").function.__module__]


def bearing(item, structure=BENCH):
    return make_term("bearing", item, structure, structure.nodes)


def simulated(item):
    """The film of the independent simulator, which integrates the pressure where it is positive."""
    return independent.Film(0, *map(item.get, OPTIONS))


@pytest.mark.parametrize("speed", [2.0, 20.0, 157.1, 900.0])
def test_journal_coefficients_are_the_derivatives_of_the_film_force(speed):
    at = independent.running_position(simulated(JOURNAL), speed)
    options = {key: JOURNAL[key] for key in OPTIONS}
    eccentricity, attitude = registry().get("bearing", "short_journal").running(speed, **options, load_angle_rad=0.0)
    assert np.hypot(*at) / JOURNAL["radial_clearance_m"] == pytest.approx(eccentricity, rel=1e-9)
    assert np.arctan2(*at[::-1]) == pytest.approx(attitude, rel=1e-9)  # from down, carried along with the spin
    linear = independent.bearing(simulated(JOURNAL), speed)
    stiffness, damping = linear.stiffness, linear.damping
    found = dynamic_stiffness(bearing(JOURNAL), [speed], [1])[0, 0]
    assert np.abs(found.real - stiffness).max() < 1e-8 * np.abs(stiffness).max()
    assert np.abs(found.imag / speed - damping).max() < 1e-8 * np.abs(damping).max()
    assert np.abs(found.real - stiffness.T).max() > 0.1 * np.abs(stiffness).max()  # axes matter


def lund(item, speed):
    """Stiffness at the threshold and (whirl over spin)^2 there of a rigid mass on a journal (Lund 1987)."""
    z = dynamic_stiffness(bearing(item), [speed], [1])[0, 0]
    k, c = z.real, z.imag / speed
    at = (k[0, 0] * c[1, 1] + k[1, 1] * c[0, 0] - k[0, 1] * c[1, 0] - k[1, 0] * c[0, 1]) / (c[0, 0] + c[1, 1])
    return at, ((at - k[0, 0]) * (at - k[1, 1]) - k[0, 1] * k[1, 0]) / np.linalg.det(c) / speed**2


def rigid(item):
    """A mass that weighs the load of its journal, free but for that."""
    load = item["load_N"]
    structure = replace(FREE, mass=np.array([[load / GRAVITY]]), static_load=np.array([load]))
    return Model(structure, (bearing(item, structure),))


@pytest.mark.parametrize("viscosity", [0.005, 0.02, 0.1, 10.0])
def test_a_rigid_rotor_starts_to_whirl_where_lund_says(viscosity):
    item = {**JOURNAL, "viscosity_Pa_s": viscosity}
    model = rigid(item)
    threshold = stability_threshold(model, 5000.0)
    stiffness, ratio = lund(item, threshold)
    assert stiffness == pytest.approx(model.structure.mass[0, 0] * ratio * threshold**2, rel=1e-6)
    values = eigenvalues(model, [threshold])[0]
    whirl = values[np.argmax(values.real)]
    assert abs(whirl.imag) == pytest.approx(np.sqrt(ratio) * threshold, rel=1e-6)
    assert 0.45 < np.sqrt(ratio) < 0.54
    assert stability_threshold(model, 5000.0, lowest=0.5 * threshold) == pytest.approx(threshold, rel=1e-8)
    assert stability_threshold(model, 0.99 * threshold) is None


def test_a_journal_at_a_crawl_and_at_rest():
    model = rigid(JOURNAL)
    assert (eigenvalues(model, [0.005, 0.1])[..., :].real < 0).all()
    refused(lambda: eigenvalues(model, [1e-12]), match=r"at 1e-12 rad/s the journal at node 1 .* above 0\.9")
    refused(lambda: eigenvalues(model, [1e9]), match=r"at 1e\+09 rad/s .* below 0\.00.*load_N")
    refused(lambda: stability_threshold(model, 5000.0, lowest=6000.0), "lowest")


PLAIN = {**JOURNAL, "kind": "plain_journal"}
LONG = sys.modules[registry().get("bearing", "plain_journal").function.__module__]
# length over diameter, eccentricity ratio, Sommerfeld number and attitude angle (degrees): Raimondi and Boyd 1958
FULL = [
    (1.0, 0.1, 1.33, 79.5), (1.0, 0.4, 0.264, 63.1), (1.0, 0.8, 0.0446, 36.24), (1.0, 0.9, 0.0188, 26.45),
    (0.5, 0.1, 4.31, 81.62), (0.5, 0.4, 0.779, 61.45), (0.5, 0.8, 0.0923, 33.31), (0.5, 0.9, 0.0313, 23.66),
    (0.25, 0.1, 16.2, 82.31), (0.25, 0.6, 1.07, 46.72), (0.25, 0.9, 0.0736, 21.85),
]  # fmt: skip
# length over diameter, Sommerfeld number, eccentricity ratio, attitude angle (degrees), two grooves of 20 degrees: Lund
# and Thomsen 1978, whose coefficients are in tests/published
GROOVED = [(0.5, 1.656, 0.244, 65.85), (0.5, 0.244, 0.655, 40.25), (1, 0.991, 0.150, 70.58), (1, 0.108, 0.650, 39.72)]


def long_film(length, sommerfeld, grooves):
    """Eccentricity ratio, attitude angle (degrees) and coefficients K (2, 2), C (2, 2) of a film."""
    rows = LONG.coefficients_over_eccentricity(length, grooves)
    e = LONG.eccentricity_ratio(sommerfeld, length, rows)
    _, attitude, stiffness, damping = LONG.running(e, length, rows)
    return e, np.degrees(attitude), stiffness, damping


@pytest.mark.parametrize("length, e, number, attitude", FULL)
def test_a_full_film_runs_where_published(length, e, number, attitude):
    """They take the pressure as zero where the film is widest, here it begins before: most at a small eccentricity."""
    rows = LONG.coefficients_over_eccentricity(length, "none")
    found, angle, _, _ = LONG.running(e, length, rows)
    assert found == pytest.approx(number, rel=0.025)
    assert np.degrees(angle) == pytest.approx(attitude, abs=0.6 + 5 * length * (1 - e) ** 2)


@pytest.mark.parametrize(("length", "number", "e", "attitude"), GROOVED)
def test_a_film_between_two_grooves_runs_where_published(length, number, e, attitude):
    found, angle, stiffness, _ = long_film(length, number, "two_axial")
    assert found == pytest.approx(e, abs=0.004) and angle == pytest.approx(attitude, abs=0.3)
    # negative control: neither a full film nor a short one
    short = MODULE.coefficients(MODULE.eccentricity_ratio(np.pi * number * length**2))[0]
    for other in (long_film(length, number, "none")[2], short):
        assert np.abs(other - stiffness).max() > 0.04 * np.abs(stiffness).max()


@pytest.mark.parametrize(("length", "e"), [(1.9, 0.95), (1.9, 0.965), (0.6, 0.93)])
@pytest.mark.parametrize("grooves", ["none", "two_axial"])
def test_damping_between_the_lines_of_the_table(length, e, grooves):
    """By the script that computed it; by a derivative at a fixed rupture boundary it was up to 2.6 % off."""
    _, attitude, _, found = LONG.running(e, length, LONG.coefficients_over_eccentricity(length, grooves))
    between = (attitude - 0.05, attitude + 0.05) if grooves == "two_axial" else None
    solved = running(Film(length, grooves == "two_axial", 144, 8), e, between)[3]
    assert np.abs(found - solved).max() < 0.012 * np.abs(solved).max()


def off_its_force(length, e, grooves):
    """Stiffness less the derivative of the force over the eccentricity, which it turns with, over the largest."""
    rows = LONG.coefficients_over_eccentricity(length, grooves)

    def force(e):
        number, attitude, *_ = LONG.running(e, length, rows)
        return -np.exp(-1j * attitude) / number  # radial + j tangential

    here, slope = force(e), (force(e + 1e-4) - force(e - 1e-4)) / 2e-4
    _, attitude, stiffness, _ = LONG.running(e, length, rows)
    c, s = np.cos(attitude), np.sin(attitude)
    stiffness = np.array([[c, s], [-s, c]]) @ stiffness @ [[c, -s], [s, c]]
    beside = 1j * here / e
    expected = -np.array([[slope.real, beside.real], [slope.imag, beside.imag]]) / abs(here)
    return np.abs(stiffness - expected).max() / np.abs(stiffness).max()


@pytest.mark.parametrize("length", [0.2, 0.5, 1.0, 1.9])
def test_the_stiffness_of_a_full_film_follows_from_its_force(length):
    """Negative control: that of a film with grooves, which is not alike in all directions, does not."""
    assert max(off_its_force(length, e, "none") for e in (0.2, 0.6, 0.9, 0.93, 0.96)) < 0.008
    assert off_its_force(length, 0.2, "two_axial") > 0.1


@pytest.mark.parametrize("speed", [40.0, 157.1, 600.0])
def test_a_film_of_small_length_is_that_of_a_short_bearing(speed):
    """At a tenth of the diameter to 1.5 % of the largest coefficient; negative control: 2 to 10 % at 0.4."""
    for length, viscosity, bounds in ((0.01, 2.0, (0.0, 0.015)), (0.04, 0.04, (0.02, 0.1))):
        found, short = (
            dynamic_stiffness(bearing({**item, "length_m": length, "viscosity_Pa_s": viscosity}), [speed], [1])[0, 0]
            for item in (PLAIN, JOURNAL)
        )
        for part in (np.real, np.imag):
            off = np.abs(part(found) - part(short)).max() / np.abs(part(short)).max()
            assert bounds[0] < off < bounds[1]


BAD = [
    ({**JOURNAL, "load_N": 0.0}, ["load_N = 0.0", "greater than 0"]),
    ({**JOURNAL, "load_N": -5.0}, ["load_N = -5.0", "greater than 0"]),
    ({k: v for k, v in JOURNAL.items() if k != "diameter_m"}, ["'diameter_m' is missing"]),
    ({**JOURNAL, "length_m": 0.06}, ["length_m / diameter_m = 0.6", "limited to 0.5", "plain_journal"]),
    ({**PLAIN, "length_m": 0.21}, ["length_m / diameter_m = 2.1", "outside 0.1 to 2", "speed_tabulated"]),
    ({**JOURNAL, "radial_clearance_m": 0.0}, ["radial_clearance_m = 0.0"]),
    ({**DAMPER, "eccentricity_ratio": 1.0}, ["eccentricity_ratio = 1.0", "less than 1"]),
    ({**DAMPER, "eccentricity_ratio": 0.0}, ["eccentricity_ratio = 0.0", "greater than 0"]),
    ({**DAMPER, "film": "3pi"}, ["film = '3pi'", "'2pi'"]),
]


@pytest.mark.parametrize("item, words", BAD, ids=lambda value: str(value)[:30])
def test_bad_input_is_refused(item, words):
    for good in (JOURNAL, DAMPER):
        bearing(good)
    refused(lambda: bearing(item), *words)


def rig_of_two_films(second, **first):
    """A shaft of 20 kg without weight of its own, at one third of its span, on films at nodes 1 and 4."""
    item = {k: v for k, v in JOURNAL.items() if k not in ("load_N", "bearing_scale")}
    return {
        "rotor": shaft(0.6, 3, disc(2, 20.0, 0.1, 0.05), density_kg_per_m3=1e-6),
        "bearings": [{**item, "node": 1, "label": "a", **first}, {**item, "node": second, "label": "b"}],
    }


def test_a_film_carries_by_default_its_part_of_the_weight():
    """Equilibrium: two thirds of 20 kg at one third of the span; the scale is 1, and a lifted bearing is refused."""
    stated, free = build_model(rig_of_two_films(4, load_N=20 * GRAVITY * 2 / 3)), build_model(rig_of_two_films(4))
    assert free.theta.tolist() == [1.0, 1.0]
    for one, other in zip(stated.unknowns, free.unknowns, strict=True):
        for entry, same in zip(one.entries, other.entries, strict=True):
            assert entry.gain_at(100.0, 1) == pytest.approx(same.gain_at(100.0, 1), rel=1e-8)
    overhung = rig_of_two_films(3)  # the disc hangs over the end at node 1
    first, second = overhung["bearings"]
    with pytest.raises(RotorstudyError, match=r"loads the bearing at node 4 by -"):
        build_model({**overhung, "bearings": [second, {**first, "node": 4}]})


def test_a_film_of_an_upright_rotor_carries_by_default_its_part_of_the_static_forces():
    upright = rig_of_two_films(4)
    upright["rotor"] |= {"gravity_m_per_s2": 0.0, "static_forces": [{"node": 3, "force_N": 90.0}]}
    assert [bearing.options["load_N"] for bearing in build_model(upright).structure.bearings] == pytest.approx([30, 60])


@pytest.mark.parametrize("film", ["pi", "2pi"])
@pytest.mark.parametrize("ratio", [0.05, 0.4, 0.8])
def test_damper_coefficients_are_those_of_the_film_on_its_orbit(film, ratio):
    """It pushes back K e along the radius, C w e along the path; a whole film pulls as the reversed motion pushes."""
    item, speed = {**DAMPER, "film": film, "eccentricity_ratio": ratio}, 88.0
    e = ratio * item["radial_clearance_m"]
    ahead, back = (independent.force(simulated(item), 0.0, (e, 0.0), (0.0, w * e)) for w in (speed, -speed))
    radial, tangential = ahead - back * (film == "2pi")
    found = dynamic_stiffness(bearing(item), [speed], [1])[0, 0]
    assert np.diag(found.real) == pytest.approx([-radial / e] * 2, rel=1e-9, abs=1e-9 * abs(tangential / e))
    assert np.diag(found.imag) == pytest.approx([-tangential / e] * 2, rel=1e-9)
    assert found[0, 1] == found[1, 0] == 0
    assert bool(found[0, 0].real > 0) is (film == "pi")


def test_a_damper_carries_by_its_spring_alone_and_the_whole_film_exists_in_time():
    structure = replace(FREE, static_load=np.array([2.0 * GRAVITY]))
    unbalance = make_term("effect", {"kind": "unbalance", "mass_kg": 2.0, "eccentricity_m": 1e-5}, structure, (1,))
    spring = {**DAMPER, "centring_stiffness_N_per_m": 1e5}
    half, whole = (
        Model(structure, (bearing({**spring, "film": film}, structure), unbalance)) for film in ("pi", "2pi")
    )
    for model in (half, whole):
        assert static_deflection(model, [88.0], model.theta).value == pytest.approx(2.0 * GRAVITY / 1e5)
    time = 0.5 + np.linspace(0, 2 * np.pi / 88.0, 8, endpoint=False)
    shown = time_response(whole, 88.0, time)[:, 0]
    expected = harmonic_response(whole, [88.0], [1])[0, 0, 0] * np.exp(88j * time)
    assert np.abs(shown - expected).max() < 1e-7 * np.abs(expected).max()
    refused(lambda: eigenvalues(half, [88.0]), "frequency")
