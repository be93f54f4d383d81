"""Cracks: published numbers, closed forms, two at once, any position."""

from dataclasses import replace
from math import comb

import numpy as np
import pytest

from rotorstudy import RotorstudyError, build_model, harmonic_response, registry, time_response
from rotorstudy.authoring.invariants.bench import bench_structure
from rotorstudy.errors import PluginError
from rotorstudy.model.cracks import crack_series, participation_factors
from rotorstudy.model.depth import compliance, depth_ratio_of, stiffness_loss
from rotorstudy.model.kinds import Crack
from rotorstudy.model.rig_items import make_term

CRACKS = registry().plugins["crack"]
JEFFCOTT = {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5}
DAMPING = {"kind": "external_damping", "external_damping_N_s_per_m": 100.0}
HARMONICS = [0, 1, 2, 3, 4, -1, -2, -3]
SHAFT = {"diameter_m": 0.02, "span_m": 0.45}


def rig(*cracks, unbalance_phase_rad=0.3, rotor=JEFFCOTT):
    unbalance = {"kind": "unbalance", "eccentricity_m": 2e-5, "eccentricity_phase_rad": unbalance_phase_rad}
    return build_model({"rotor": rotor, "cracks": list(cracks), "effects": [DAMPING, unbalance]})


def crack(kind, loss=1.2e5, **options):
    given = {**CRACKS[kind].example, "weight_dominance": False, **options}
    return {"kind": kind, "stiffness_loss_N_per_m": loss, **given}


# --- breathing functions


def test_cosine_to_the_second_power_is_breathing_and_its_mean_is_a_binomial():
    angle = np.linspace(-7, 7, 200)
    power, cosine = CRACKS["power_cosine"], CRACKS["breathing"]
    assert np.abs(power.function(angle, 2, 0.3) - cosine.function(angle, 0.3)).max() < 1e-15
    assert np.abs(power.function(angle, 4, 0.3) - cosine.function(angle, 0.3)).max() > 0.1
    for exponent in (2, 4, 10):
        assert power.series(20, exponent)[0][0] == comb(exponent, exponent // 2) / 2**exponent


def test_participation_factors_in_closed_form():
    """(1 + cos a) / 2 cos a e^{ja}; an open crack; one as soft in eta as in xi does not shift harmonics by two."""
    n = [-2, -1, 0, 1, 2, 3, 4]
    assert np.allclose(participation_factors(CRACKS["breathing"], n), np.array([0, 1, 2, 2, 2, 1, 0]) / 8, atol=1e-15)
    assert np.allclose(participation_factors(CRACKS["open"], n, None, {"eta_share": 0.2}), [0, 0, 0.6, 0, 0.4, 0, 0])
    even = participation_factors(CRACKS["breathing"], n, None, {"eta_share": 1.0})
    assert np.allclose(even, [0, 0.25, 0.5, 0.25, 0, 0, 0])


def test_participation_factors_of_the_thesis():
    printed = {
        0: 0.25,
        1: 0.31830,
        2: 0.25,
        3: 0.10610,
        5: -0.02122,
        7: 0.00909,
        -1: 0.10610,
        -3: -0.02122,
        -5: 0.00909,
    }
    found = participation_factors(CRACKS["switching"], printed)
    assert np.abs(found - list(printed.values())).max() < 1e-5  # some are cut, not rounded
    assert np.abs(participation_factors(CRACKS["breathing"], printed) - list(printed.values())).max() > 0.01


def test_switching_cut_short_is_its_first_terms():
    angle = np.linspace(0, 7, 300)
    options = {"terms": 3}
    given = np.abs(CRACKS["switching"].function(angle, **options))
    closed = 0.5 + 2 / np.pi * (np.cos(angle) - np.cos(3 * angle) / 3 + np.cos(5 * angle) / 5)
    assert np.abs(given - np.abs(closed)).max() < 1e-14
    assert max(crack_series(CRACKS["switching"], 15, options)) == 5
    assert max(crack_series(CRACKS["switching"], 15)) == 15
    whole, cut, low = (
        harmonic_response(rig(crack("switching", **more)), [120.0], HARMONICS)[0, :, 0]
        for more in ({}, {"terms": 3}, {"order": 5})
    )
    assert np.array_equal(cut, low)  # the option of the plugin and that of the engine mean one thing
    assert np.abs(cut / whole - 1).max() > 1e-4


def overshoot(terms):
    return CRACKS["switching"].function(np.linspace(0, np.pi, 20001), terms).max() - 1


def test_switching_cut_short_overshoots_as_said():
    assert overshoot(1) == pytest.approx(2 / np.pi - 0.5)
    assert overshoot(200) == pytest.approx(0.0895, abs=2e-4)  # Gibbs


@pytest.mark.parametrize("depth_ratio", [0.05, 0.15, 0.25, 0.4, 0.5])
def test_section_geometry_has_the_angles_and_moments_in_closed_form(depth_ratio):
    """Closed forms: area moments of the open section, angles where it begins and ends to shut."""
    mu, function = 2 * depth_ratio, CRACKS["section_geometry"].function
    root = np.sqrt(mu * (2 - mu))
    area = np.pi - np.arccos(1 - mu) + (1 - mu) * root
    down = 2 * root**3 / (3 * area)
    in_xi = np.pi / 8 + ((1 - mu) * (2 * mu**2 - 4 * mu + 1) * root + np.arcsin(1 - mu)) / 4 - area * down**2
    segment = (3 * np.arccos(1 - mu) - (1 - mu) * (3 + 2 * root**2) * root) / 12  # of the eta moment
    share = segment / (np.pi / 4 - in_xi)
    assert np.abs(function(0.0, depth_ratio) - [1, share, 0]).max() < 1e-9
    begins, ends = np.arctan((down + 1 - mu) / root), np.pi / 2 + np.arccos(1 - mu)
    inside, just = function(np.linspace(0, begins, 20), depth_ratio), function(begins + 0.05, depth_ratio)
    assert np.abs(inside - inside[:, :1]).max() < 1e-9 and just[0] < 1 - 1e-4
    assert np.abs(function(np.linspace(ends, np.pi, 20), depth_ratio)).max() < 1e-9
    assert function(ends - 0.1, depth_ratio)[0] > 1e-8


def test_section_geometry_by_counting_small_squares():
    """Neutral axis, moments and product of a half-shut crack, by brute force on a fine grid."""
    depth_ratio, angle, count = 0.3, 1.4, 2001
    grid = (np.arange(count) + 0.5) / count * 2 - 1
    xi, eta = np.meshgrid(grid, grid, indexing="ij")
    disc, cell = xi**2 + eta**2 < 1, (2 / count) ** 2
    below = xi * np.cos(angle) - eta * np.sin(angle)

    def moments(carries):
        area = carries.sum() * cell
        first = [np.sum(part[carries]) * cell for part in (xi, eta)]
        pairs = [(xi, xi, 0, 0), (eta, eta, 1, 1), (xi, eta, 0, 1)]
        return np.array([np.sum((a * b)[carries]) * cell - first[i] * first[j] / area for a, b, i, j in pairs])

    neutral, crack_area = 0.0, disc & (xi > 1 - 2 * depth_ratio)
    for _ in range(60):
        carries = disc & ~(crack_area & (below > neutral))
        neutral = below[carries].mean()
    fully = moments(disc) - moments(disc & ~crack_area)
    expected = (moments(disc) - moments(carries)) / fully[0]
    found = CRACKS["section_geometry"].function(angle, depth_ratio)
    assert np.abs(found - expected).max() < 2e-3 and np.abs(expected).min() > 0.05


def test_a_series_by_fourier_transform_is_as_good_as_said():
    for name, off in (("switching", 2e-4), ("breathing", 1e-14), ("power_cosine", 1e-14)):
        plugin = CRACKS[name]
        by_hand = crack_series(plugin, 9, plugin.example)
        found = crack_series(replace(plugin, series=None), 9, plugin.example)
        assert set(found) == set(by_hand)
        assert max(np.abs(found[k] - by_hand[k]).max() for k in found) < off


# --- response


def test_open_crack_is_the_asymmetric_shaft():
    """In the frame that turns, 2X is a constant load: R_2 in closed form, highest at half of the mean frequency."""
    m, k, loss, share, g = 2.0, 7.6e5, 1.2e5, 0.2, 9.81
    undamped = build_model({"rotor": JEFFCOTT, "cracks": [crack("open", loss, eta_share=share)]})
    mean, half = k - loss * (1 + share) / 2, loss * (1 - share) / 2
    for w in (100.0, 200.0, 250.0, 330.0):
        found = harmonic_response(undamped, [w], [0, 2, 1])[0, :, 0] + [m * g / k, 0, 0]
        matrix = [[mean, -half], [-half, mean - m * (2 * w) ** 2]]  # on R_0 and conj-coupled R_2
        assert np.abs(found[:2] - np.linalg.solve(matrix, [m * g, 0])).max() < 1e-12 * np.abs(found).max()
    speeds = np.arange(280.0, 310.0, 0.02)
    second = np.abs(harmonic_response(rig(crack("open", loss, eta_share=share)), speeds, [2])[:, 0, 0])
    # R_2 is singular where (k_xi k_eta) = mean m (2w)^2: near half the mean frequency
    singular = np.sqrt((mean**2 - half**2) / (mean * m)) / 2
    assert speeds[second.argmax()] == pytest.approx(singular, rel=2e-3)
    assert singular == pytest.approx(np.sqrt(mean / m) / 2, rel=5e-3)


def test_open_crack_splits_the_natural_frequency():
    """Turning shaft, exact in its own frame: it is unstable between sqrt(k_eta/m) and sqrt(k_xi/m), nowhere else."""
    loss, share = 1.2e5, 0.2
    model = build_model({"rotor": JEFFCOTT, "cracks": [crack("open", loss, eta_share=share)]})
    low, high = (np.sqrt((7.6e5 - part * loss) / 2.0) for part in (1.0, share))

    def growth(w):
        """Of the constant equations in the frame that turns, 1/s."""
        stiff = np.array([[low**2 - w**2, 0], [0, high**2 - w**2]])
        turning = np.block([[np.zeros((2, 2)), np.eye(2)], [-stiff, np.array([[0, 2 * w], [-2 * w, 0]])]])
        return np.linalg.eigvals(turning).real.max()

    for w, unstable in ((low * 0.99, False), ((low + high) / 2, True), (high * 1.01, False)):
        assert (growth(w) > 1e-6) == unstable
        grown = np.abs(time_response(model, w, np.arange(1, 61) * 2 * np.pi / w, relative_tolerance=1e-9)[:, 0])
        assert (grown[-1] > 30 * grown[:20].max()) == unstable


@pytest.mark.parametrize("name", CRACKS)
def test_vibration_peaks_at_a_half_and_a_third_of_the_natural_frequency(name):
    """2X near w_n / 2; 3X near w_n / 3 for cracks that breathe; w_n that of the mean stiffness."""
    loss = 6e4
    model = build_model(
        {
            "rotor": JEFFCOTT,
            "cracks": [crack(name, loss)],
            "effects": [{**DAMPING, "external_damping_N_s_per_m": 20.0}],
        }
    )
    mean = crack_series(CRACKS[name], 0, CRACKS[name].example)[0].real
    natural = np.sqrt((7.6e5 - loss * (mean[0] + mean[1]) / 2) / 2.0)
    series = crack_series(CRACKS[name], 3, CRACKS[name].example)
    for n in (2, 3):
        speeds = natural / n * np.linspace(0.9, 1.1, 401)
        height = np.abs(harmonic_response(model, speeds, [n])[:, 0, 0])
        if n == 3 and set(series) == {0}:
            assert height.max() < 1e-12  # a crack that does not breathe has no 3X
            continue
        assert speeds[height.argmax()] * n == pytest.approx(natural, rel=5e-3)
        assert height.max() > 5 * height[0]


# --- several cracks, and where they are


@pytest.mark.parametrize("name", CRACKS)
def test_two_cracks_at_two_positions_agree_with_time_integration(name):
    model = rig(crack(name, angle_rad=0.7), crack("breathing", 5e4, angle_rad=-1.9, label="second"))
    w = 210.0
    time = 30 * 2 * np.pi / w + np.arange(256) / 256 * 2 * np.pi / w
    z = time_response(model, w, time, relative_tolerance=1e-9)[:, 0]
    found = np.array([np.mean(z * np.exp(-1j * n * w * time)) for n in HARMONICS])
    expected = harmonic_response(model, [w], HARMONICS)[0, :, 0]
    # the damper leaves e^-22 of the transient; what is cut off after order 15 of a sudden opening moves 1e-5
    assert np.abs(found - expected).max() < (1e-5 if name == "switching" else 2e-8) * np.abs(expected).max()
    elsewhere = harmonic_response(
        rig(crack(name, angle_rad=0.7), crack("breathing", 5e4, label="second")), [w], HARMONICS
    )
    assert np.abs(elsewhere[0, :, 0] - expected).max() > 1e-3 * np.abs(expected).max()


@pytest.mark.parametrize("name", CRACKS)
@pytest.mark.parametrize("dominance", [True, False])
def test_a_turned_phase_mark_turns_the_harmonics_and_nothing_else(name, dominance):
    """All that is on the shaft moved by one angle ahead of the mark is the same motion, earlier: R_n e^{jn angle}."""
    angle, speeds = 0.9, [120.0, 300.0, 700.0]
    first, second = (
        harmonic_response(
            rig(
                crack(name, angle_rad=by, weight_dominance=dominance),
                crack("breathing", 5e4, angle_rad=1.0 + by, label="second", weight_dominance=dominance),
                unbalance_phase_rad=0.3 + by,
            ),
            speeds,
            HARMONICS,
        )[..., 0]
        for by in (0.0, angle)
    )
    turn = np.exp(1j * angle * np.array(HARMONICS))
    assert np.abs(second - first * turn).max() < 1e-11 * np.abs(first).max()
    assert np.abs(second - first / turn).max() > 1e-2 * np.abs(first).max()


def test_two_cracks_at_one_place_are_one_of_their_sum_and_opposite_notches_are_one_notch():
    one = harmonic_response(rig(crack("switching", 1.2e5)), [200.0], HARMONICS)
    two = harmonic_response(rig(crack("switching", 8e4), crack("switching", 4e4, label="b")), [200.0], HARMONICS)
    assert np.allclose(one, two, rtol=1e-12, atol=1e-20)
    notch, other = (harmonic_response(rig(crack("open", angle_rad=a)), [200.0], HARMONICS) for a in (0.0, np.pi))
    assert np.allclose(notch, other, rtol=1e-9, atol=1e-18)
    breathing, other = (
        harmonic_response(rig(crack("breathing", angle_rad=a)), [200.0], HARMONICS) for a in (0.0, np.pi)
    )
    assert not np.allclose(breathing, other, rtol=1e-3, atol=1e-9)


def test_two_notches_across_each_other_make_a_round_shaft():
    cracks = [crack("open", eta_share=0.0, angle_rad=a, label=f"{a:.1f}") for a in (0.4, 0.4 + np.pi / 2)]
    softer = rig(rotor={**JEFFCOTT, "stiffness_N_per_m": 7.6e5 - 1.2e5})
    found, expected = (harmonic_response(model, [200.0], [0, 1, 2, -2])[0, :, 0] for model in (rig(*cracks), softer))
    assert np.abs(found - expected)[1:].max() < 1e-12 * np.abs(expected).max()


def shaft_with(*cracks):
    rotor = {
        "kind": "finite_element",
        "elements": [{"length_m": 0.6, "count": 3}],
        "outer_diameter_m": 0.02,
        "pinned_nodes": [1, 4],
        "discs": [{"node": 2, "mass_kg": 3.0, "polar_moment_kg_m2": 0.004, "diametral_moment_kg_m2": 0.003}],
    }
    dampers = [{**DAMPING, "node": node, "label": f"at {node}"} for node in (2, 3)]
    return build_model({"rotor": rotor, "cracks": list(cracks), "effects": dampers})


PLACED = [
    {"kind": "breathing", "element": 2, "angle_rad": 0.5, "label": "left", "eta_share": 0.2, "stiffness_loss": 0.3},
    {"kind": "section_geometry", "element": 3, "angle_rad": -1.2, "label": "right", "stiffness_loss": 0.4},
    {"kind": "power_cosine", "node": 2, "angle_rad": 2.0, "label": "node", "stiffness_loss_22_N_per_m": 1e4},
]
PLACED[-1]["stiffness_loss_44_N_m"] = 40.0


def test_cracks_at_different_nodes_of_a_shaft_agree_with_time_integration():
    cracks, w, every = [{**c, "weight_dominance": False} for c in PLACED], 60.0, np.arange(-35, 36)
    model = shaft_with(*cracks)
    assert model.names[:4] == (
        "stiffness_loss[left]",
        "stiffness_loss[right]",
        "stiffness_loss_22[node]",
        "stiffness_loss_44[node]",
    )
    expected = harmonic_response(model, [w], every, order=35)[0]
    time = np.arange(128) / 128 * 2 * np.pi / w
    start = expected.sum(axis=0), (1j * every * w) @ expected
    z = time_response(model, w, time + time[1], start=start, relative_tolerance=1e-8)
    found = np.exp(-1j * np.outer(every, time + time[1]) * w) @ z / len(time)
    assert np.abs(found - expected).max() < 1e-5 * np.abs(expected).max()
    for i in range(3):
        moved = [{**c, "angle_rad": 0.0} if i == j else c for j, c in enumerate(cracks)]
        others = harmonic_response(shaft_with(*moved), [w], every, order=35)[0]
        assert np.abs(others - expected).max() > 1e-3 * np.abs(expected).max()


def test_small_cracks_at_different_nodes_add_up_and_need_labels():
    small = [{k: 1e-5 * v if k.startswith("stiffness_loss") else v for k, v in c.items()} for c in PLACED]
    sets = [small, *([c] for c in small)]
    changes = [harmonic_response(shaft_with(*some), [60.0], HARMONICS) for some in sets]
    changes = [change - harmonic_response(shaft_with(), [60.0], HARMONICS) for change in changes]
    assert np.abs(changes[0] - sum(changes[1:])).max() < 1e-4 * np.abs(changes[0]).max()
    assert all(np.abs(changes[0] - change).max() > 1e-2 * np.abs(changes[0]).max() for change in changes[1:])
    with pytest.raises(RotorstudyError, match="label"):
        shaft_with(*[{k: v for k, v in c.items() if k != "label"} for c in PLACED[:2]])


# --- depth

STRIPS = registry().get("depth", "strip_integration")
# (a / R, c44, c55) of the table PAPADOPOULOS.csv of ROSS, in (1 - nu^2) / (E R^3); c44 there counts half the crack
TABULATED = [
    (0.01, 1.37749e-07, 9.57316e-05),
    (0.1, 0.000425851, 0.0277722),
    (0.25, 0.0103483, 0.243694),
    (0.5, 0.12323, 1.22153),
    (0.8, 0.827564, 3.97355),
]


@pytest.mark.parametrize(("deep", "c44", "c55"), TABULATED)
def test_strip_integration_is_the_published_table(deep, c44, c55):
    xi, eta = compliance(STRIPS, deep / 2, diameter_m=2.0, youngs_modulus_Pa=1.0, poissons_ratio=0.0)
    assert xi == pytest.approx(c55, rel=5e-6)
    assert eta == pytest.approx(2 * c44, rel=5e-6)


def test_strip_integration_of_a_shallow_crack_in_closed_form():
    """Depth a << R: stress intensity factor 1.122, edge of a parabola: c55 = 64 1.122^2 (4 / 15) sqrt(2) a^2.5 / pi."""
    for deep, off in ((1e-4, 2e-3), (1e-5, 2e-4)):
        xi, _ = compliance(STRIPS, deep / 2, diameter_m=2.0, youngs_modulus_Pa=1.0, poissons_ratio=0.0)
        assert xi == pytest.approx(64 * 1.122**2 * 4 / 15 * np.sqrt(2) * deep**2.5 / np.pi, rel=off)


def test_loss_of_stiffness_is_that_of_a_shaft_with_a_hinge():
    """Beam elements with a rotational spring at mid-span, the disc beside it."""
    young, span, diameter = 2.1e11, SHAFT["span_m"], SHAFT["diameter_m"]
    rigidity, c = young * np.pi / 64 * diameter**4, compliance(STRIPS, 0.35, diameter_m=diameter)
    h = span / 2
    tilting = np.diag([1, h, 1, h])  # from displacements to a beam of unit length
    beam = tilting @ [[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]] @ tilting * rigidity / h**3
    k = 48 * rigidity / span**3
    for hinge, loss in zip(c, stiffness_loss(STRIPS, 0.35, k, span, diameter_m=diameter), strict=True):
        whole = np.zeros((7, 7))  # z, tilt left; z, tilt before the hinge, tilt after it; z, tilt right
        for place in ([0, 1, 2, 3], [2, 4, 5, 6]):
            whole[np.ix_(place, place)] += beam
        whole[np.ix_([3, 4], [3, 4])] += np.array([[1, -1], [-1, 1]]) / hinge
        free = [1, 2, 3, 4, 6]
        soft = 1 / np.linalg.inv(whole[np.ix_(free, free)])[1, 1]
        assert k - soft == pytest.approx(loss, rel=1e-9)
        assert k - soft > 1e-3 * k


def test_depth_in_a_rig_is_the_loss_it_means_and_comes_back():
    depth = {"kind": "strip_integration", "depth_ratio": 0.3, **SHAFT}
    item = {"kind": "breathing", "depth": depth}
    model = build_model({"rotor": JEFFCOTT, "cracks": [item]})
    loss = stiffness_loss(STRIPS, 0.3, 7.6e5, SHAFT["span_m"], diameter_m=SHAFT["diameter_m"])
    assert model.theta == [loss.xi] and 0.02 * 7.6e5 < loss.xi < 0.2 * 7.6e5
    same = crack("breathing", loss.xi, eta_share=loss.eta / loss.xi, weight_dominance=True)
    means = build_model({"rotor": JEFFCOTT, "cracks": [same]})
    assert np.array_equal(*(harmonic_response(m, [90.0], [0, 1, 2]) for m in (model, means)))
    back = depth_ratio_of(STRIPS, model.theta[0], 7.6e5, SHAFT["span_m"], diameter_m=SHAFT["diameter_m"])
    assert back == pytest.approx(0.3, abs=1e-12)
    stated = build_model({"rotor": JEFFCOTT, "cracks": [{**item, "eta_share": 0.0}]})
    assert not np.array_equal(*(harmonic_response(m, [90.0], [0, 1, 2]) for m in (model, stated)))


def test_depth_sets_the_geometry_of_a_crack_that_has_one():
    depth = {"kind": "strip_integration", "depth_ratio": 0.4, **SHAFT}
    cracks = [{"kind": "section_geometry", "depth": depth, **more} for more in ({}, {"depth_ratio": 0.4})]
    one, other = (build_model({"rotor": JEFFCOTT, "cracks": [c]}) for c in cracks)
    assert np.array_equal(harmonic_response(one, [90.0], [2]), harmonic_response(other, [90.0], [2]))


DEPTH = {"kind": "strip_integration", "depth_ratio": 0.3, **SHAFT}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"depth": {**DEPTH, "depth_ratio": 0.6}},
            ["depth_ratio = 0.6", "cracks[0]", "from 0 to 0.5"],
        ),
        ({"depth": {**DEPTH, "depth_ratio": -0.1}}, ["depth_ratio = -0.1", "from 0 to 0.5"]),
        ({"stiffness_loss_N_per_m": 2e4}, ["stiffness_loss_N_per_m = 20000.0", "its depth gives", "one of the two"]),
        ({"kind": "section_geometry", "depth_ratio": 0.1}, ["depth_ratio = 0.1", "its depth gives 0.3"]),
        ({"depth": {**DEPTH, "span_m": 0.7}}, ["span_m = 0.7", "48 E I / L^3", "7.6e+05"]),
        ({"depth": {**DEPTH, "span": 0.7}}, ["unknown key 'span'", "did you mean 'span_m'"]),
        ({"depth": {**DEPTH, "kind": "strip_integral"}}, ["unknown depth", "did you mean 'strip_integration'"]),
        ({"depth": {**DEPTH, "span_m": "0.4"}}, ["span_m = '0.4'", "without quotes"]),
        ({"depth": 0.3}, ["depth = 0.3", "'kind'"]),
        ({"depth": {k: v for k, v in DEPTH.items() if k != "diameter_m"}}, ["'diameter_m' is missing"]),
        ({"eta_share": 1.5}, ["eta_share = 1.5", "less than or equal to 1"]),
        ({"kind": "power_cosine", "exponent": 3}, ["exponent = 3", "multiple of 2"]),
        ({"angle_rad": "up"}, ["angle_rad = 'up'", "number"]),
    ],
)
def test_what_is_wrong_with_a_crack_item_is_said(changes, words):
    item = {"kind": "breathing", "depth": DEPTH, **changes}
    with pytest.raises(RotorstudyError) as said:
        build_model({"rotor": JEFFCOTT, "cracks": [item]})
    for word in words:
        assert word in str(said.value)


def test_depth_on_a_rotor_with_more_coordinates_is_refused():
    disc = {"polar_moment_kg_m2": 5e-3, "diametral_moment_kg_m2": 2e-3, "a_m": 0.2, "b_m": 0.16, "diameter_m": 0.015}
    with pytest.raises(RotorstudyError, match="stiffness_loss_22"):
        build_model(
            {"rotor": {"kind": "offset_disc", "mass_kg": 2.0, **disc}, "cracks": [{"kind": "open", "depth": DEPTH}]}
        )


def test_a_loss_beyond_the_deepest_crack_has_no_depth():
    with pytest.raises(RotorstudyError, match="outside the range of 'strip_integration'"):
        depth_ratio_of(STRIPS, 7e5, 7.6e5, SHAFT["span_m"], diameter_m=SHAFT["diameter_m"])


def test_an_option_that_every_crack_has_is_refused(monkeypatch):
    monkeypatch.setitem(CRACKS, "wrong", Crack("wrong", lambda angle, node=1.0: 0 * angle, source="none"))
    with pytest.raises(PluginError, match="option 'node' is reserved for all cracks"):
        make_term("crack", {"kind": "wrong"}, bench_structure(), (1,))
