"""A bearing on a pedestal against the same machine with the pedestal as a further mass."""

import numpy as np
import pytest
from machines import disc, shaft

from rotorstudy import Entry, Model, Parameter, RotorstudyError, Term, build_model, harmonic_response, make_term
from rotorstudy.model.entries import planar_entries
from rotorstudy.model.structure import Structure
from rotorstudy.response.statics import static_deflection

HARMONICS = [0, 1, 2, 3, -1, -2, -3]
SPEEDS = np.array([60.0, 120.0, 400.0, 900.0])
PEDESTAL = {
    "kind": "flexible_pedestal",
    "bearing_stiffness_N_per_m": {"xx": 2e6, "yy": 1.5e6},
    "bearing_damping_N_s_per_m": {"xx": 400.0, "yy": 300.0},
    "pedestal_stiffness_N_per_m": {"xx": 4e6, "yy": 1e6},
    "pedestal_damping_N_s_per_m": {"xx": 500.0, "yy": 900.0},
    "pedestal_mass_kg": {"xx": 20.0, "yy": 35.0},
    "bearing_scale": 1.0,
}
SHAFT = build_model({"rotor": shaft(0.6, 4, disc(2, 2.0, 0.004, 0.002))}).structure


def extended(structure):
    """The shaft with one more coordinate, the pedestal's node 99, without weight."""
    size = len(structure.dofs)

    def grown(matrix):
        return np.pad(matrix, [(0, 1)] * np.ndim(matrix))

    return Structure(
        mass=grown(structure.mass),
        stiffness=grown(structure.stiffness),
        gyroscopic=grown(structure.gyroscopic),
        static_load=grown(structure.static_load),
        dofs=(*structure.dofs, (99, "translation")),
    ), np.eye(size + 1)[size]


def explicit(item, structure, node):
    """Terms of the bearing between shaft and pedestal and of the pedestal on the ground, on the extended shaft."""
    larger, foot = extended(structure)
    between, ground = np.outer(larger.unit(node) - foot, larger.unit(node) - foot), np.outer(foot, foot)
    entries = []
    for name, matrix, order in (
        ("bearing_stiffness_N_per_m", between, 0),
        ("bearing_damping_N_s_per_m", between, 1),
        ("pedestal_stiffness_N_per_m", ground, 0),
        ("pedestal_damping_N_s_per_m", ground, 1),
        ("pedestal_mass_kg", ground, 2),
    ):
        for direction, value in item[name].items():
            entries += planar_entries(direction, -value * matrix, order)
    parameter = Parameter("explicit", "1", tuple(entries), typical=1.0)
    return larger, Term("explicit", (parameter,), {"explicit": 1.0}, carries=True)


def forces(structure):
    """Given forces at every harmonic of both signs, and a cross-coupled bearing at the other end."""
    items = [Entry((1 + 0.3j * n) * structure.unit(2), on="one", shift=n) for n in HARMONICS]
    shaking = Term("shaking", (Parameter("force", "N", tuple(items), 1.0),), {"force": 3.0})
    cross = {"bearing_stiffness_xx_N_per_m": 3e5, "bearing_stiffness_xy_N_per_m": 5e4}
    cross |= {"bearing_stiffness_yx_N_per_m": -2e4, "bearing_stiffness_yy_N_per_m": 2e5}
    cross |= {
        f"bearing_damping_{ab}_N_s_per_m": c for ab, c in zip(("xx", "xy", "yx", "yy"), (90, 5, 3, 60), strict=True)
    }
    other = {"kind": "linear", "coefficients": "full", "node": 1, "label": "other", **cross}
    return shaking, make_term("bearing", other, structure, structure.nodes)


def both(item=PEDESTAL, node=5):
    larger, term = explicit(item, SHAFT, node)
    series = make_term("bearing", {**item, "node": node}, SHAFT, SHAFT.nodes)
    return Model(SHAFT, (*forces(SHAFT), series)), Model(larger, (*forces(larger), term))


def test_it_is_the_explicit_pedestal_at_harmonics_of_both_signs():
    series, full = both()
    found = harmonic_response(series, SPEEDS, HARMONICS)
    expected = harmonic_response(full, SPEEDS, HARMONICS)[..., :-1]
    size = np.abs(expected).max(axis=(1, 2), keepdims=True)
    assert (np.abs(found - expected) / size).max() < 1e-10
    # negative control: gains of the mirrored harmonic, not conjugated, are another machine
    wrong = [
        Entry(e.matrix, e.on, gain=lambda w, n, g=e.gain: np.conj(g(w, n)), frequency_only=True)
        for e in series.terms[-1].parameters[0].entries
        if e.on == "conj"
    ]
    right = [e for e in series.terms[-1].parameters[0].entries if e.on == "z"]
    mixed = Term("wrong", (Parameter("wrong", "1", (*right, *wrong), 1.0),), {"wrong": 1.0}, carries=True)
    off = harmonic_response(Model(SHAFT, (*forces(SHAFT), mixed)), SPEEDS, HARMONICS)
    assert (np.abs(off - expected) / size).max() > 1e-3


def test_it_carries_the_shaft_as_the_explicit_one_does():
    series, full = both()
    found, expected = (static_deflection(m, SPEEDS, m.theta).value for m in (series, full))
    assert np.abs(found - expected[:, :-1]).max() < 1e-11 * np.abs(expected).max()
    assert np.abs(expected[:, -1]).min() > 1e-6  # the foot moves too, 3 micrometres


def test_one_value_serves_both_directions():
    isotropic = {**PEDESTAL}
    for name in ("bearing_stiffness_N_per_m", "pedestal_stiffness_N_per_m", "pedestal_mass_kg"):
        isotropic[name] = {"xx": PEDESTAL[name]["xx"]}
    for name in ("bearing_damping_N_s_per_m", "pedestal_damping_N_s_per_m"):
        isotropic.pop(name)
    same = {k: {"xx": v["xx"], "yy": v["xx"]} if isinstance(v, dict) else v for k, v in isotropic.items()}
    found, expected = (harmonic_response(both_ends, SPEEDS, [1, -1]) for both_ends in (series(isotropic), series(same)))
    assert np.array_equal(found, expected)


def series(item):
    return Model(SHAFT, (*forces(SHAFT), make_term("bearing", {**item, "node": 5}, SHAFT, SHAFT.nodes)))


def test_an_undamped_pedestal_in_resonance_and_bad_numbers_are_refused():
    free = {**PEDESTAL, "pedestal_stiffness_N_per_m": {"xx": 2e6}, "pedestal_mass_kg": {"xx": 100.0}}
    free |= {"bearing_stiffness_N_per_m": {"xx": 2e6}}
    free.pop("bearing_damping_N_s_per_m")
    free.pop("pedestal_damping_N_s_per_m")
    harmonic_response(series(free), [100.0], [1])
    with pytest.raises(RotorstudyError, match=r"speed 200 rad/s, harmonic -?1: the undamped pedestal at node 5"):
        harmonic_response(series(free), [100.0, 200.0], [1])
    for key, value in (("pedestal_stiffness_N_per_m", 0.0), ("pedestal_mass_kg", -1.0)):
        with pytest.raises(RotorstudyError, match=rf"{key}\.xx = {value}"):
            series({**PEDESTAL, key: {"xx": value}})
    with pytest.raises(RotorstudyError, match="zz"):
        series({**PEDESTAL, "pedestal_mass_kg": {"xx": 1.0, "zz": 1.0}})
