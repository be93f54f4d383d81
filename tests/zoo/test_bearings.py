"""Bearings: their force on a whirling orbit by hand, the response they give, and what is refused."""

import numpy as np
import pytest
from machines import disc, shaft
from one_line_errors import refused

from jobs.bearing_figures import bearing_coefficients, plot_bearing_coefficients
from rotorstudy import Model, RotorstudyError, build_model, eigenvalues, harmonic_response, make_term, registry
from rotorstudy.model.entries import apply_entries
from rotorstudy.response.integration import force_in_time

PLAIN = {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5}
SHAFT = shaft(0.6, 4, disc(2, 2.0, 0.004, 0.002))
STRUCTURE = build_model({"rotor": PLAIN}).structure
K = {"xx": 3e5, "xy": 0.7e5, "yx": -0.4e5, "yy": 1.8e5}
C = {"xx": 300.0, "xy": -20.0, "yx": 35.0, "yy": 150.0}
SPEED = 88.0


def coefficients(stiffness, damping):
    """Rig keys of the full bearing."""
    keys = {f"bearing_stiffness_{ab}_N_per_m": value for ab, value in stiffness.items()}
    return {**keys, **{f"bearing_damping_{ab}_N_s_per_m": value for ab, value in damping.items()}}


FULL = {"kind": "linear", "coefficients": "full", **coefficients(K, C)}
OF_AXES = coefficients({ab: K[ab] for ab in ("xx", "yy")}, {ab: C[ab] for ab in ("xx", "yy")})
ANISOTROPIC = {"kind": "linear", "coefficients": "anisotropic", **OF_AXES}
ISOTROPIC = {"kind": "linear", "bearing_stiffness_N_per_m": 3e5, "bearing_damping_N_s_per_m": 300.0}
TABLE = {  # at 88 rad/s, 0.4 of the way from 80 to 100, it is FULL
    "kind": "speed_tabulated", "speeds_rad_per_s": [50.0, 80.0, 100.0, 400.0], "bearing_scale": 1.0,
    "stiffness_N_per_m": {ab: [0.0, k - 4e4, k + 6e4, 2 * k] for ab, k in K.items()},
    "damping_N_s_per_m": {ab: [0.0, c - 40.0, c + 60.0, 2 * c] for ab, c in C.items()},
}  # fmt: skip


def term(item, structure=STRUCTURE):
    return make_term("bearing", item, structure, structure.nodes)


def forces(item):
    """Force on an elliptic orbit that holds two harmonics and a static part, in time and in harmonics; (time,)."""
    time = np.linspace(0, 2 * np.pi / SPEED, 64, endpoint=False)
    harmonics = np.arange(-4, 5)
    amplitude = np.zeros((1, 9, 1), complex)
    amplitude[0, [2, 3, 4, 5, 6], 0] = [1e-6j, 3e-6, 2e-6 + 1e-6j, 5e-6 - 2e-6j, -1e-6]
    turning = np.exp(1j * np.outer(time, harmonics) * SPEED)
    z, velocity = turning @ amplitude[0], turning @ (1j * harmonics[:, None] * SPEED * amplitude[0])
    found = term(item)
    pairs = list(zip(found.theta, found.unknowns, strict=True))
    total = sum(theta * force_in_time(u.entries, SPEED, time, z, velocity) for theta, u in pairs)
    column = sum(theta * apply_entries(u.entries, amplitude, [SPEED], harmonics)[0] for theta, u in pairs)
    return z[:, 0], velocity[:, 0], total[:, 0], (turning @ column)[:, 0]


def by_hand(z, velocity, k, c):
    """-(K r + C dr/dt) with r = (x, y)."""
    square = [np.array([[m["xx"], m["xy"]], [m["yx"], m["yy"]]]) for m in (k, c)]
    x_y = -(square[0] @ [z.real, z.imag] + square[1] @ [velocity.real, velocity.imag])
    return x_y[0] + 1j * x_y[1]


ZERO, NOTHING = {"xy": 0.0, "yx": 0.0}, dict.fromkeys(K, 0.0)
CASES = [
    (FULL, K, C),
    (ANISOTROPIC, {**K, **ZERO}, {**C, **ZERO}),
    (ISOTROPIC, {**ZERO, "xx": 3e5, "yy": 3e5}, {**ZERO, "xx": 300.0, "yy": 300.0}),
    (TABLE, K, C),
    ({**TABLE, "bearing_scale": 0.5}, {ab: k / 2 for ab, k in K.items()}, {ab: c / 2 for ab, c in C.items()}),
    ({**TABLE, "stiffness_N_per_m": {"yy": [1e5] * 4}, "damping_N_s_per_m": None}, {**NOTHING, "yy": 1e5}, NOTHING),
]
NAMES = ["full", "anisotropic", "isotropic", "table", "half the table", "table without damping, of one direction"]


@pytest.mark.parametrize("item, k, c", CASES, ids=NAMES)
def test_the_force_on_a_whirling_orbit(item, k, c):
    z, velocity, in_time, in_harmonics = forces(item)
    expected = by_hand(z, velocity, k, c)
    size = np.abs(expected).max()
    assert np.abs(in_time - expected).max() < 1e-12 * size
    assert np.abs(in_harmonics - expected).max() < 1e-12 * size
    swapped = {"xx": "yy", "xy": "yx", "yx": "xy", "yy": "xx"}
    if k["xx"] != k["yy"]:
        assert np.abs(by_hand(z, velocity, {ab: k[swapped[ab]] for ab in k}, c) - in_time).max() > 1e-2 * size


def test_a_table_is_linear_between_its_speeds_and_ends_where_it_ends():
    unbalance = {"kind": "unbalance", "eccentricity_m": 1e-5}
    tabulated, linear = (build_model({"rotor": PLAIN, "bearings": [b], "effects": [unbalance]}) for b in (TABLE, FULL))
    at = [harmonic_response(model, [SPEED], [1, -1]) for model in (tabulated, linear)]
    assert np.abs(at[0] - at[1]).max() < 1e-12 * np.abs(at[1]).max()
    near = [harmonic_response(model, [SPEED + 1.0], [1, -1]) for model in (tabulated, linear)]
    assert np.abs(near[0] - near[1]).max() > 1e-4 * np.abs(near[1]).max()
    both = harmonic_response(tabulated, [50.0, 400.0], [1])  # the ends belong to it
    assert np.isfinite(both).all()
    for speed in (49.0, 401.0):
        with pytest.raises(RotorstudyError, match=f"speed {speed:g} rad/s is outside .* node 1, 50 to 400 rad/s"):
            harmonic_response(tabulated, [88.0, speed], [1])


BAD = [
    (FULL, ["nodes [1, 2, 3, 4, 5]", "choose one with 'node:'"]),
    ({**FULL, "node": 6}, ["unknown node '6' in the rotor", "known: 1, 2, 3, 4, 5"]),
    ({**FULL, "node": "left"}, ["node = 'left'", "integer"]),
    ({**FULL, "node": 1, "coefficients": "orthotropic"}, ["coefficients = 'orthotropic'", "'isotropic'"]),
    ({**FULL, "node": 1, "coefficients": "isotropic"}, ["unknown key 'bearing_stiffness_xx_N_per_m'"]),
    ({**ISOTROPIC, "node": 1, "bearing_damping_N_s_per_m": "1e3"}, ["bearing_damping_N_s_per_m = '1e3'"]),
    ({**TABLE, "node": 1, "speeds_rad_per_s": [50.0, 80.0, 80.0, 400.0]}, ["must be strictly increasing"]),
    ({**TABLE, "node": 1, "speeds_rad_per_s": []}, ["speeds_rad_per_s = []", "at least 1"]),
    ({**TABLE, "node": 1, "speeds_rad_per_s": [50.0, 80.0]}, ["stiffness_N_per_m.xx has 4 values for 2 speeds"]),
    ({**TABLE, "node": 1, "stiffness_N_per_m": {}, "damping_N_s_per_m": {}}, ["has no direction", "xx, yy, xy or yx"]),
    ({**TABLE, "node": 1, "stiffness_N_per_m": {"xz": [1.0] * 4}}, ["unknown key 'stiffness_N_per_m.xz'"]),
    ({**TABLE, "node": 1, "stiffness_N_per_m": {"xx": [1.0, 2.0, float("nan"), 1.0]}}, ["stiffness_N_per_m.xx[2]"]),
    ({**TABLE, "node": 1, "scale": 1.0}, ["unknown key 'scale'", "bearing_scale"]),
]


@pytest.mark.parametrize("item, words", BAD, ids=lambda value: str(value)[:30])
def test_bad_input_is_refused(item, words):
    shaft = build_model({"rotor": SHAFT}).structure
    for good in (FULL, ISOTROPIC, TABLE):
        term({**good, "node": 1}, shaft)
    refused(lambda: term(item, shaft), *words)


def test_a_rigid_support_has_no_bearing_and_two_bearings_need_labels():
    held = build_model({"rotor": {**SHAFT, "pinned_nodes": [1, 5]}}).structure
    refused(lambda: term({**ISOTROPIC, "node": 1}, held), "unknown translation at node '1'")
    free = build_model({"rotor": SHAFT}).structure
    terms = [term({**ISOTROPIC, "node": node}, free) for node in (1, 5)]
    refused(lambda: Model(free, tuple(terms)), match=r"share the parameter 'bearing_stiffness'.*'label:'")


def test_the_added_mass_of_a_table_has_inertia_and_no_weight():
    seal = {"kind": "speed_tabulated", "speeds_rad_per_s": [0.0, 100.0], "stiffness_N_per_m": {"xx": [2e4, 2e4]}}
    seal |= {"mass_kg": {"xx": [1.0, 1.0], "yy": [0.0, 1.0]}}
    speeds = np.array([50.0, 100.0])
    unbalance = {"kind": "unbalance", "eccentricity_m": 1e-5}
    found = harmonic_response(
        build_model({"rotor": PLAIN, "bearings": [seal], "effects": [unbalance]}), speeds, [0, 1, -1]
    )
    x = 2e-5 * speeds**2 / (7.8e5 - 3.0 * speeds**2)
    y = 2e-5 * speeds**2 / (7.6e5 - (2 + speeds / 100) * speeds**2)
    assert found[:, 1:, 0] == pytest.approx(np.transpose([x + y, x - y]) / 2, rel=1e-12)
    assert found[:, 0, 0] == pytest.approx(0, abs=1e-15)


def test_the_mass_of_a_bearing_moves_with_the_journal():
    model = build_model({"rotor": PLAIN, "bearings": [{**ISOTROPIC, "bearing_damping_N_s_per_m": 0.0, "mass_kg": 0.5}]})
    assert np.abs(eigenvalues(model, [1.0])[0]) == pytest.approx(np.sqrt((7.6e5 + 3e5) / 2.5), rel=1e-12)
    assert model.structure.static_load[0] == pytest.approx(2.0 * 9.81, rel=1e-12)


def test_the_keys_of_values_tell_which_coefficients_a_bearing_has():
    keys = coefficients({"xx": 3e5, "yy": 1.8e5}, {"xx": 300.0, "yy": 150.0})
    found, stated = term({"kind": "linear", **keys}), term(ANISOTROPIC)
    assert (found.options, found.values) == (stated.options, stated.values)
    assert term({"kind": "linear", **coefficients(K, C)}).options["coefficients"] == "full"
    mixed = {"kind": "linear", "bearing_stiffness_N_per_m": 1e5, **keys}
    for wrong in (mixed, {"kind": "linear", "coefficients": "isotropic", **keys}):
        refused(lambda: term(wrong), "unknown key 'bearing_stiffness_xx_N_per_m'")


def test_numbers_of_numpy_are_numbers():
    bearing = {**ISOTROPIC, "node": np.int64(1), "bearing_stiffness_N_per_m": np.float64(3e5)}
    rig = {"rotor": {**SHAFT, "pinned_nodes": np.array([5])}, "bearings": [bearing], "sensors": [np.int32(2)]}
    assert build_model(rig).sensors == (2,) and build_model(rig).structure.bearing_nodes == (1,)
    with pytest.raises(RotorstudyError, match=r"node '0' .* numbered from 1 "):
        build_model({**rig, "bearings": [{**bearing, "node": np.int64(0)}]})


def test_a_kind_that_no_plugin_has_points_to_the_one_that_describes_it():
    words = "unknown bearing 'tilting_pad'", "'tilting pad' is described by speed_tabulated"
    refused(lambda: term({**ISOTROPIC, "kind": "tilting_pad"}), *words)
    assert "described" not in refused(lambda: term({**ISOTROPIC, "kind": "velcro"}), "unknown bearing 'velcro'")


def test_every_bearing_is_compared_and_a_speed_it_refuses_is_left_out():
    bearings = registry().plugins["bearing"].values()
    data = bearing_coefficients(bearings, np.array([50 * np.pi, 900.0, 1200.0]))
    assert list(data.bearing.values) == sorted(plugin.name for plugin in bearings)
    journal = data.sel(bearing="short_journal").isel(speed=0)  # the textbook's example, see test_film_bearings
    assert journal.stiffness.values / 1e6 == pytest.approx([8.815, 25.06, -16.39, 12.81], rel=4e-4)
    assert journal.damping.values / 1e3 == pytest.approx([294.9, 81.92, 81.92, 232.9], rel=3e-4)
    table = data.stiffness.sel(bearing="speed_tabulated", direction="xx").values  # ends at 1000 rad/s
    assert table[:2] == pytest.approx(np.interp([50 * np.pi, 900.0], [0, 1000], [3e5, 2e5])) and np.isnan(table[2])
    assert data.stiffness.attrs["units"] == "N/m" and data.damping.attrs["units"] == "N s/m"
    picture = plot_bearing_coefficients(data)
    assert len(picture.axes) == 2 * len(bearings)
    assert all("(" in panel.get_ylabel() for panel in picture.axes)
