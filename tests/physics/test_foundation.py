"""Bearings on a foundation that moves, and probes that ride on it, against equations written out otherwise."""

import numpy as np
import pytest
from machines import disc, shaft
from named_machines import plant

from rotorstudy import build_model, harmonic_response, measured_response
from rotorstudy.blind.machines.effects import add_unbalance
from rotorstudy.diagnosis.search.candidates import candidates
from rotorstudy.diagnosis.search.places import places_of
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.equation_error import regression
from rotorstudy.inference.fit import chi_square_p_value, fit
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.response.measured import measured_response_and_jacobian
from rotorstudy.response.stability import eigenvalues, growth_of_free_motion

SPEEDS, NODES = np.array([90.0, 160.0, 280.0, 400.0]), (1, 5)
RIG = {
    "rotor": shaft(1.0, 4, disc(3, 20.0, 0.1, 0.05), outer_diameter_m=0.05),
    "bearings": [
        {"kind": "linear", "node": node, "label": label, "bearing_stiffness_N_per_m": 2e7,
         "bearing_damping_N_s_per_m": 2e3}
        for node, label in zip(NODES, ("DE", "NDE"), strict=True)
    ],
    "effects": [{"kind": "unbalance", "node": 3, "mass_kg": 20.0, "eccentricity_m": 1e-5}],
}  # fmt: skip
PEDESTALS = [
    {"kind": "linear", "node": node, "label": f"pedestal {node}", "coefficients": "anisotropic", "mass_kg": 30.0,
     "bearing_stiffness_xx_N_per_m": 8e6, "bearing_stiffness_yy_N_per_m": 5e6,
     "bearing_damping_xx_N_s_per_m": 1e3, "bearing_damping_yy_N_s_per_m": 2e3}
    for node in NODES
]  # fmt: skip
BLOCK = {"kind": "foundation_block", "node": 4, "second_node": 10, "label": "frame"}


def riding(to, node=1):
    return {"measurement": {"probes": [{"channel": "a", "node": node, "angle_deg": 45, "relative_to": to}]}}


def test_pedestals_are_those_that_another_bearing_eliminates():
    """Any kind of bearing may be what another one stands on."""
    series = [
        {"kind": "flexible_pedestal", "node": node, "label": str(node), "bearing_stiffness_N_per_m": {"xx": 2e7},
         "bearing_damping_N_s_per_m": {"xx": 2e3}, "pedestal_stiffness_N_per_m": {"xx": 8e6, "yy": 5e6},
         "pedestal_damping_N_s_per_m": {"xx": 1e3, "yy": 2e3}, "pedestal_mass_kg": {"xx": 30.0}}
        for node in NODES
    ]  # fmt: skip
    eliminated = harmonic_response(build_model(RIG | {"bearings": series}), SPEEDS, [1, -1])
    moving = harmonic_response(build_model(RIG | {"foundation": PEDESTALS}), SPEEDS, [1, -1])
    assert np.abs(moving[..., :10] - eliminated).max() < 1e-12 * np.abs(eliminated).max()
    assert np.abs(moving[..., 10:]).min() > 1e-9  # the housings move


def test_probes_on_a_housing_show_the_motion_against_it():
    absolute = build_model(RIG | {"foundation": PEDESTALS, "sensors": [1, 3]})
    relative = build_model(RIG | {"foundation": PEDESTALS, "sensors": [1, 3]} | riding("bearing DE"))
    motion, shown = harmonic_response(absolute, SPEEDS, [1]), measured_response(relative, SPEEDS, [1])
    journal, housing = (absolute.structure.index(1, what) for what in ("translation", "housing"))
    against = np.stack([motion[..., journal] - motion[..., housing], motion[..., absolute.structure.index(3)]], axis=-1)
    assert np.abs(shown - against).max() < 1e-12 * np.abs(motion).max()
    jacobian = measured_response_and_jacobian(relative, SPEEDS, [1]).jacobian
    step = 1e-6 * relative.theta
    for p in range(6):
        both = [measured_response(relative, SPEEDS, [1], relative.theta + sign * step * (np.arange(len(step)) == p))
                for sign in (1, -1)]  # fmt: skip
        slope = (both[0] - both[1]) / (2 * step[p])
        assert np.abs(jacobian[..., p] - slope).max() < 1e-6 * np.abs(slope).max()


def test_a_rotor_on_a_soft_foundation_has_its_frequencies():
    """A nearly rigid rotor on stiff bearings bounces with both pedestals: w^2 = (k1 + k2) / (m + m1 + m2)."""
    pedestals = [
        {"kind": "linear", "node": node, "label": f"pedestal {node}", "mass_kg": 30.0, "bearing_stiffness_N_per_m": 1e4,
         "bearing_damping_N_s_per_m": 0.0}
        for node in NODES
    ]  # fmt: skip
    model = build_model(RIG | {"foundation": pedestals})
    whole = 60.0 + model.structure.along @ model.structure.mass @ model.structure.along
    found = eigenvalues(model, [1e-3])[0].imag
    assert np.min(np.abs(found - np.sqrt(2e4 / whole))) < 2e-3 * np.sqrt(2e4 / whole)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"foundation": [PEDESTALS[0] | {"node": 3}]}, "node of a bearing"),
        ({"foundation": PEDESTALS, **riding("XX")}, "by its label or node"),
        (riding("DE"), "must be a bearing on the foundation"),
        ({"foundation": [{"kind": "foundation_block", "node": 1, "second_node": 1}]}, "another bearing"),
    ],
)
def test_what_is_refused(change, words):
    with pytest.raises(RotorstudyError, match=words):
        build_model(RIG | change)


@pytest.fixture(scope="module")
def compressor():
    """The compressor of the independent simulator on its films, linear at one speed, and its rig."""
    rotor, foundation = plant.compressor()
    rig = {
        "rotor": {
            "kind": "finite_element",
            "elements": [{"length_m": e.length, "outer_diameter_m": e.outer_diameter} for e in rotor.elements],
            "discs": [
                {"node": d.node + 1, "mass_kg": d.mass, "polar_moment_kg_m2": d.polar_moment,
                 "diametral_moment_kg_m2": d.diametral_moment} for d in rotor.discs
            ],
        },
        "bearings": [
            {"kind": "short_journal", "node": f.node + 1, "label": label, "diameter_m": f.diameter,
             "length_m": f.length, "radial_clearance_m": f.clearance, "viscosity_Pa_s": f.viscosity, "load_N": f.load}
            for f, label in zip(rotor.films, ("DE", "NDE"), strict=True)
        ],
        "foundation": [
            BLOCK | {"feet_m": list(foundation.feet), "centre_m": foundation.centre,
                     "radius_of_gyration_m": foundation.radius_of_gyration,
                     "foundation_mass_kg": foundation.mass,
                     "foundation_stiffness_xx_N_per_m": 2 * foundation.stiffness[0],
                     "foundation_stiffness_yy_N_per_m": 2 * foundation.stiffness[1],
                     "foundation_damping_xx_N_s_per_m": 2 * foundation.damping[0],
                     "foundation_damping_yy_N_s_per_m": 2 * foundation.damping[1]}
        ],
        "effects": [{"kind": "shaft_damping", "shaft_damping_s": 1e-6},
                    {"kind": "unbalance", "node": 12, "mass_kg": 26.0, "eccentricity_m": 1e-5}],
        "sensors": [4, 10, 12],
        "measurement": {"probes": [{"channel": name, "angle_deg": angle, "relative_to": "bearing", "node": node}
                                   for node in (4, 10) for name, angle in (("a", -45), ("b", 45))]},
    }  # fmt: skip
    return rotor, foundation, rig


def independent(rotor, foundation, speed):
    """Forward and backward 1X (harmonic, place) at the probes of nodes 3 and 9 and absolute at 11, by the simulator."""
    machine = plant.build_on_foundation(rotor, foundation, speed, {})
    machine.local.clear()  # what the films do beyond small motion about where they run at this speed
    add_unbalance(machine, 11, 26.0 * 1e-5)
    mass, damping, stiffness = machine.linear(speed)
    force = machine.harmonic[1, 2] * speed**2
    motion = np.linalg.solve(stiffness + 1j * speed * damping - speed**2 * mass, force)
    x, y = np.transpose(
        [plant.against_block(machine, foundation, node).T @ motion for node in (3, 9)] + [motion[44:46]]
    )
    return np.array([(x + 1j * y) / 2, np.conj(x - 1j * y) / 2])


@pytest.mark.parametrize("speed", [150.0, 300.0, 400.0])
def test_a_block_moves_as_that_of_the_independent_simulator(compressor, speed):
    """Matrices by numerical integration, films by integration of the pressure, gravity 9.80665 instead of 9.81."""
    rotor, foundation, rig = compressor
    found = measured_response(build_model(rig), [speed], [1, -1])[0]
    true = independent(rotor, foundation, speed)
    assert np.abs(found - true).max() < 2e-4 * np.abs(true).max()
    stiffer = dict(rig, foundation=[rig["foundation"][0] | {"radius_of_gyration_m": 0.5}])
    assert np.abs(measured_response(build_model(stiffer), [speed], [1, -1])[0] - true).max() > 2e-3 * np.abs(true).max()


def test_numbers_and_amplitudes_of_a_foundation_are_uncertain_like_others(compressor):
    from rotorstudy.model.rig_numbers import rig_with_changes, with_numbers

    model = with_numbers(build_model(compressor[2]), ["bearings[frame].radius_of_gyration_m"])
    assert {"foundation_mass[frame]", "bearings[frame].radius_of_gyration_m"} <= set(model.names)
    p = model.names.index("bearings[frame].radius_of_gyration_m")
    jacobian = measured_response_and_jacobian(model, [300.0], [1]).jacobian[..., p]
    ends = [compressor[2] | {"foundation": [compressor[2]["foundation"][0] | {"radius_of_gyration_m": 0.38 * (1 + d)}]}
            for d in (1e-4, -1e-4)]  # fmt: skip
    slope = np.subtract(*(measured_response(build_model(rig), [300.0], [1]) for rig in ends)) / 2e-4
    written = rig_with_changes(compressor[2], model, {model.names[p]: 0.5})
    assert written["foundation"][0]["radius_of_gyration_m"] == pytest.approx(0.57)
    assert written["bearings"] == compressor[2]["bearings"]
    assert np.abs(jacobian - slope).max() < 1e-4 * np.abs(slope).max()


def test_a_cracked_rotor_on_a_foundation_has_a_stability():
    """Of a crack of next to no depth, that of the sound rotor, by eigenvalues; without a mass there is none."""
    crack = {"kind": "open", "element": 2, "stiffness_loss": 1e-9, "weight_dominance": False}
    sound = build_model(RIG | {"foundation": PEDESTALS})
    cracked = build_model(RIG | {"foundation": PEDESTALS, "cracks": [crack]})
    growth = [growth_of_free_motion(model, SPEEDS) for model in (sound, cracked)]
    assert (growth[0] < -1.0).all() and np.abs(growth[1] / growth[0] - 1).max() < 1e-3
    massless = [{key: value for key, value in one.items() if key != "mass_kg"} for one in PEDESTALS]
    with pytest.raises(RotorstudyError, match="has no mass"):
        build_model(RIG | {"foundation": massless})


def test_equations_of_motion_are_not_solved_for_relative_motion():
    model = build_model(RIG | {"foundation": PEDESTALS, "sensors": [1, 3]} | riding("DE"))
    shown = measured_response(model, SPEEDS, [1, -1])
    data = Spectrum(shown, SPEEDS, np.array([1, -1]), (1, 3), independent_covariance(np.full(shown.shape, 1e-16)))
    with pytest.raises(RotorstudyError, match="relative to a bearing"):
        regression(model, data, ["bearing_damping[DE]"])


def test_a_fit_that_runs_away_finds_the_foundation_gradually(compressor):
    """Numbers of a rig that are 10 to 20 % off, and unbalances that are not known."""
    speeds, harmonics, noise = np.linspace(125.0, 420.0, 8), np.array([1, -1]), 2e-8
    unbalances = [
        {"kind": "unbalance", "node": node, "label": str(node), "mass_kg": 1.0, "eccentricity_m": size,
         "eccentricity_phase_rad": phase} for node, size, phase in ((1, 6e-4, 1.0), (12, 8e-4, 0.0), (14, 1e-3, 2.0))
    ]  # fmt: skip
    true = compressor[2] | {"effects": [compressor[2]["effects"][0], *unbalances], "sensors": [4, 10]}
    stated = true | {
        "foundation": [
            true["foundation"][0] | {"foundation_mass_kg": 1000.0, "radius_of_gyration_m": 0.35,
                                     "foundation_stiffness_xx_N_per_m": 1e8, "foundation_stiffness_yy_N_per_m": 2.1e8}
        ],
        "bearings": [one | {"radial_clearance_m": 1.08 * one["radial_clearance_m"]} for one in true["bearings"]],
        "effects": [true["effects"][0], *(one | {"eccentricity_m": 1e-6} for one in unbalances)],
    }  # fmt: skip
    shown = measured_response(build_model(true), speeds, harmonics)
    draws = np.random.default_rng(7).normal(0, noise, (2, *shown.shape))
    covariance = independent_covariance(np.full(shown.shape, noise**2))
    data = Spectrum(shown + draws[0] + 1j * draws[1], speeds, harmonics, (4, 10), covariance)
    films = {
        f"bearings[{label}].{key}": 0.1 for label in ("DE", "NDE") for key in ("radial_clearance_m", "viscosity_Pa_s")
    }
    known = {"default": 0.2, "rotor": 0.0, "eccentricity": 2000.0, "bearing_scale": 0.0,
             "bearings[frame].radius_of_gyration_m": 0.2, **films}  # fmt: skip
    whole, prior = base_model(build_model(stated), Settings(uncertainty=known, nuisance={}))
    gentle, rough = fit(whole, data, prior, from_afar=True), fit(whole, data, prior)
    assert chi_square_p_value(gentle.cost, data.data_count) > 1e-3
    assert rough.cost > 10 * gentle.cost  # negative control


def test_no_effect_of_the_library_fails_on_a_foundation():
    model = build_model(RIG | {"foundation": PEDESTALS, "sensors": [1, 3]} | riding("DE"))
    found, broken = candidates(model, Settings())
    assert broken == {} and {"bow", "bearing_coefficients", "transverse_crack"} <= {one.effect for one in found}
    rows = dict(places_of(model.structure))  # a force inside a bearing acts on journal and housing alike
    journal, housing = model.structure.index(1), model.structure.index(1, "housing")
    (inside,), (ground,) = rows["bearing", 1, "force"], rows["foundation", 1, "force"]
    assert inside[[journal, housing]].tolist() == [1, -1] and np.count_nonzero(inside) == 2
    assert ground[housing] == 1 and np.count_nonzero(ground) == 1
