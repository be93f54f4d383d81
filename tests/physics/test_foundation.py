"""Bearings on a foundation that moves, and probes that ride on it, against equations written out otherwise."""

from dataclasses import replace
from itertools import chain

import numpy as np
import pytest
import yaml
from machines import all_but, disc, errors_of_derivatives, film, readings, shaft, spectrum_of, springs, unbalance
from named_machines import plant
from one_line_errors import refused
from uff_files import write_mobilities

from rotorstudy import build_model, harmonic_response, load_rig, make_term, measured_spectrum
from rotorstudy.blind.machines.contacts import one_sided
from rotorstudy.blind.machines.effects import add_unbalance
from rotorstudy.blind.machines.files import discs_section, stretches
from rotorstudy.blind.machines.machine import LocalForce
from rotorstudy.blind.machines.stepping import steady_state
from rotorstudy.diagnosis.search import moves
from rotorstudy.diagnosis.search.candidates import candidates
from rotorstudy.diagnosis.search.film_error import with_film_error
from rotorstudy.diagnosis.search.places import places_of
from rotorstudy.diagnosis.search.search import base_model, begin
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import CannotAct, RotorstudyError
from rotorstudy.inference import fit as fit_module
from rotorstudy.inference.equation_error import regression
from rotorstudy.inference.fit import chi_square_p_value, fit
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.measurement.findings import errors_among
from rotorstudy.presentation.rotor_files import analyse_files
from rotorstudy.response.measured import measured_response
from rotorstudy.response.stability import growth_of_free_motion
from rotorstudy.response.statics import static_deflection
from rotorstudy.studies.rig_check import check_rig
from rotorstudy.studies.rotor_analysis import analyse_rotor
from rotorstudy.studies.stability_margin import stability_margin

SPEEDS, NODES = np.array([90.0, 160.0, 280.0, 400.0]), (1, 5)
RIG = {"rotor": shaft(1.0, 4, disc(3, 20.0, 0.1, 0.05), outer_diameter_m=0.05),
       "bearings": springs({1: "DE", 5: "NDE"}, 2e7, 2e3), "effects": [unbalance(3, 1e-5, mass_kg=20.0)]}  # fmt: skip


def pedestals(stiffness, damping, mass=30.0):
    return [one | {"mass_kg": mass} for one in springs({n: f"pedestal {n}" for n in NODES}, stiffness, damping)]


PEDESTALS = pedestals((8e6, 5e6), (1e3, 2e3))
BLOCK = {"kind": "foundation_block", "node": 4, "second_node": 10, "label": "frame"}


def riding(to, node=1):
    return {"measurement": {"probes": [{"channel": "a", "node": node, "angle_deg": 45, "relative_to": to}]}}


def test_pedestals_are_those_that_another_bearing_eliminates():
    """At harmonics of both signs, and under the weight; any kind of bearing may be what another one stands on."""
    series = [
        {"kind": "flexible_pedestal", "node": node, "label": str(node), "bearing_stiffness_N_per_m": {"xx": 2e7},
         "bearing_damping_N_s_per_m": {"xx": 2e3}, "pedestal_stiffness_N_per_m": {"xx": 8e6, "yy": 5e6},
         "pedestal_damping_N_s_per_m": {"xx": 1e3, "yy": 2e3}, "pedestal_mass_kg": {"xx": 30.0}}
        for node in NODES
    ]  # fmt: skip
    push = {f"misalignment_force_{n}X_N": 20.0 for n in (0, 2, -2, 3, -3)}
    push |= {"kind": "parallel_misalignment", "node": 2, "harmonics": [0, 2, -2, 3, -3]}
    rig, every = RIG | {"effects": [*RIG["effects"], push]}, [0, 1, -1, 2, -2, 3, -3]
    eliminated, single = build_model(rig | {"bearings": series}), build_model(rig | {"foundation": PEDESTALS})
    heavier = build_model(rig | {"foundation": [{**one, "mass_kg": 33.0} for one in PEDESTALS]})
    expected, moving, other = (harmonic_response(one, SPEEDS, every) for one in (eliminated, single, heavier))
    size = np.abs(expected).max(axis=(0, 2), keepdims=True)
    assert (np.abs(moving[..., :10] - expected) / size).max() < 1e-10
    off = (np.abs(other[..., :10] - expected) / size).max(axis=(0, 2))
    assert off[1:].min() > 1e-3  # negative control, at every harmonic but the mean
    assert np.abs(moving[..., 10:]).min() > 1e-9  # the housings move
    at = [static_deflection(one, SPEEDS, one.theta).value[:, :10] for one in (single, eliminated)]
    assert np.abs(at[0] - at[1]).max() < 1e-10 * np.abs(at[1]).max()


def test_probes_on_a_housing_show_the_motion_against_it():
    absolute = build_model(RIG | {"foundation": PEDESTALS, "sensors": [1, 3]})
    relative = build_model(RIG | {"foundation": PEDESTALS, "sensors": [1, 3]} | riding("bearing DE"))
    motion, shown = harmonic_response(absolute, SPEEDS, [1]), measured_response(relative, SPEEDS, [1])
    journal, housing = (absolute.structure.index(1, what) for what in ("translation", "housing"))
    against = np.stack([motion[..., journal] - motion[..., housing], motion[..., absolute.structure.index(3)]], axis=-1)
    assert np.abs(shown - against).max() < 1e-12 * np.abs(motion).max()
    assert errors_of_derivatives(relative, SPEEDS, [1], 1e-5 * relative.theta[:6]).max() < 1e-6


def test_what_linear_films_leave_out_follows_from_the_orbit_in_the_bearing():
    """Of the orbit r in a film, not of z: r²/c at 2X, and three products of size r³/c² at 1X."""
    ends = dict(zip(NODES, ("DE", "NDE"), strict=True))
    films = [film(0.05, 0.02, 1e-4, 0.02, node=node, label=label) for node, label in ends.items()]
    soft = pedestals(2e5, 20.0, mass=5.0)
    probes = [
        {"channel": f"{angle} {node}", "node": node, "angle_deg": angle, "relative_to": f"bearing {label}"}
        for node, label in ends.items()
        for angle in (45, -45)
    ]
    rig = RIG | {"bearings": films, "foundation": soft, "sensors": [*NODES], "measurement": {"probes": probes}}
    model, speed, every = build_model(rig), np.array([90.0]), np.array([1, 2])
    swing, orbit = (abs(f(model, speed, [1])[0, 0, 0]) for f in (harmonic_response, measured_response))
    assert swing > 15 * orbit  # negative control: of it, the error would be far larger
    record = spectrum_of(model, speed, every, 1e-12)
    error = np.sqrt(with_film_error(record, model).variance[0, :, 0])
    expected = orbit * np.array([np.sqrt(3) * (orbit / 1e-4) ** 2, orbit / 1e-4])
    assert np.abs(np.log(error / expected)).max() < np.log(2.0)  # the rotor answers otherwise at 2X


def on_casing(node=101, bearing="DE", **changes):
    """A velocity transducer on the housing of a bearing, beside the probe that rides on it."""
    probes = riding("bearing DE")["measurement"]["probes"]
    casing = {"channel": "v", "node": node, "angle_deg": 0, "unit": "mm/s", "on": bearing, **changes}
    return {"foundation": PEDESTALS, "sensors": [1, node], "measurement": {"probes": [*probes, casing]}}


def test_a_transducer_on_a_housing_shows_its_motion():
    model = build_model(RIG | on_casing())
    motion, shown = harmonic_response(model, SPEEDS, [1]), measured_response(model, SPEEDS, [1])
    housing = motion[..., model.structure.index(1, "housing")]
    assert np.abs(shown[..., 1] - housing).max() < 1e-12 * np.abs(motion).max()
    assert model.structure.index(101) == model.structure.index(1, "housing") and 101 not in model.structure.nodes
    assert {c.where["node"] for c in candidates(model, Settings())[0] if c.effect == "runout"} == {1}


@pytest.mark.usefixtures("unrendered", "few_speeds")
def test_a_machine_with_a_transducer_on_a_housing_is_drawn(tmp_path):
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(RIG | on_casing()))
    analyse_files(tmp_path / "rig.yaml", tmp_path / "out")
    assert (tmp_path / "out" / "figures" / "mode_shapes.png").exists()


@pytest.mark.usefixtures("few_speeds")
@pytest.mark.parametrize("in_file", [False, True])
def test_velocities_and_accelerations_of_casings_are_read_as_displacements(in_file, tmp_path):
    """Of cosines with offsets whose derivatives are written out; units in the rig file, or in the header alone."""
    speed, time = 200.0, np.arange(4000) / 4000
    x = 20e-6 * np.cos(speed * time + 0.3) + 4e-6 * np.cos(2 * speed * time - 1.0)
    velocity = -speed * (20e-6 * np.sin(speed * time + 0.3) + 8e-6 * np.sin(2 * speed * time - 1.0))
    acceleration = -(speed**2) * (20e-6 * np.cos(speed * time + 0.3) + 16e-6 * np.cos(2 * speed * time - 1.0))
    key = np.exp(-0.5 * (np.angle(np.exp(1j * speed * time)) / 0.1) ** 2)
    rows = np.column_stack([time, 1e3 * (velocity + 1e-3), (acceleration + 0.1) / 9.80665, 1e6 * x, key])
    header = "time,v (mm/s),a (g),d,key" if in_file else "time,v,a,d,key"
    np.savetxt(tmp_path / "r.csv", rows, delimiter=",", header=header, comments="")
    probes = [
        {"channel": "v", "node": 101, "angle_deg": 0, "unit": "mm/s", "on": "DE"},
        {"channel": "a", "node": 105, "angle_deg": 0, "unit": "g", "on": "bearing NDE"},
        {"channel": "d", "node": 1, "angle_deg": 0, "unit": "um", "relative_to": "DE"},
    ]
    for probe in probes[:2] if in_file else ():
        probe["channel"] += f" ({probe.pop('unit')})"
    measurement = {"probes": probes, "keyphasor": {"channel": "key"}, "harmonics": [1, -1, 2, -2, 0]}
    rig = RIG | {"foundation": PEDESTALS, "measurement": measurement}
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig))
    assert not errors_among(check_rig(tmp_path / "rig.yaml").findings)
    spectrum, model, _ = measured_spectrum([tmp_path / "r.csv"], tmp_path / "rig.yaml")
    assert spectrum.sensors == model.sensors == (1, 101, 105)
    shown = spectrum.amplitude[0]
    assert np.abs(shown[0, 0] / 10e-6 - np.exp(0.3j)) < 1e-3
    assert np.abs(shown[:4, 1:] - shown[:4, :1]).max() < 1e-3 * 10e-6
    assert spectrum.covariance[0, 1:, 4, 4].min() > 1e-9 > spectrum.covariance[0, 0, 4, 4]  # of the mean


@pytest.mark.usefixtures("few_speeds")
def test_a_measured_foundation_moves_as_the_block_that_it_was_measured_on(compressor, tmp_path):
    """Receptances of the block, by its equations written out: motion at the feet over force there."""
    machine, rig = compressor
    (foundation,) = machine.blocks
    frequency = np.linspace(2.0, 120.0, 600)
    w, model = 2 * np.pi * frequency, build_model(rig)
    rows = ["frequency_Hz,response,force,real,imaginary"]
    places = [model.structure.node_positions[node] for node in (4, 10)]
    for axis, k, c in zip("xy", foundation.stiffness, foundation.damping, strict=True):
        arms = [np.array([1.0, foot - foundation.centre]) for foot in foundation.feet]
        feet = sum(np.outer(arm, arm) for arm in arms)
        inertia = foundation.mass * np.diag([1.0, foundation.radius_of_gyration**2])
        stiffness = (k + 1j * w * c)[:, None, None] * feet - (w**2)[:, None, None] * inertia
        at = np.array([[1.0, place - foundation.centre] for place in places])
        shown = (1j * w)[:, None, None] * (at @ np.linalg.inv(stiffness) @ at.T)  # a mobility
        rows += [
            f"{f:.6f},{(4, 10)[i]}{name},{(4, 10)[j]}{name},{h[i, j].real:.9e},{h[i, j].imag:.9e}"
            for f, h in zip(frequency, shown, strict=True) for i, j in ((0, 0), (0, 1), (1, 1))
            for name in [{"x": "z", "y": "x"}[axis]]
        ]  # fmt: skip
    (tmp_path / "frame.csv").write_text("\n".join(rows))
    measured = {"kind": "foundation_receptance", "node": 4, "other_nodes": [10], "label": "frame", "file": "frame.csv",
                "quantity": "mobility", "axes": {"x": "-z", "y": "x"}}  # fmt: skip
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig | {"foundation": [measured]}))
    by_table = load_rig(tmp_path / "rig.yaml")
    found, criticals = measured_response(by_table, SPEEDS, [1, -1]), criticals_of(by_table)
    true = measured_response(model, SPEEDS, [1, -1])
    assert np.abs(found - true).max() < 1e-3 * np.abs(true).max()  # lines of 0.2 Hz, linear between them
    assert len(criticals) == 4 and np.allclose(criticals, criticals_of(model), rtol=1e-3)
    margin, margin_of_block = (np.array(stability_margin(one, 400.0)) for one in (by_table, model))
    assert np.allclose(margin, margin_of_block, rtol=1e-3)
    swapped = dict(measured, file=str(tmp_path / "frame.csv"), axes={"x": "x", "y": "z"})
    wrong = build_model(rig | {"foundation": [swapped]})
    other = measured_response(wrong, SPEEDS, [1, -1])
    assert np.abs(other - true).max() > 0.05 * np.abs(true).max()  # negative control
    assert not np.allclose(criticals_of(wrong)[:4], criticals, rtol=1e-2)
    assert abs(stability_margin(wrong, 400.0).cross_coupling / margin[4] - 1) > 0.05
    write_mobilities(tmp_path / "frame.uff", rows[1:], w)
    in_uff = {"kind": "foundation_receptance", "node": 4, "other_nodes": [10], "axes": {"x": "z", "y": "-x"}}
    in_uff["file"] = str(tmp_path / "frame.uff")
    found = measured_response(build_model(rig | {"foundation": [in_uff]}), SPEEDS, [1, -1])
    assert np.abs(found - true).max() < 1e-3 * np.abs(true).max()
    in_uff["axes"] = {}
    refused(lambda: build_model(rig | {"foundation": [in_uff]}), "no response at 4y")


def criticals_of(model):
    """That show as resonances below 450 rad/s."""
    return [one.speed for one in analyse_rotor(model, 50.0, 450.0).resonant]


def test_a_changed_foundation_is_one_built_otherwise():
    model = build_model(RIG | {"foundation": PEDESTALS})
    change = {"kind": "foundation_change", "node": 1, "change_of_bearing_stiffness_xx": -0.3,
              "change_of_bearing_stiffness_yy": 0.2}  # fmt: skip
    changed = model.plus(make_term("effect", change, model.structure, model.sensors))
    other = {"bearing_stiffness_xx_N_per_m": 0.7 * 8e6, "bearing_stiffness_yy_N_per_m": 1.2 * 5e6}
    built = build_model(RIG | {"foundation": [PEDESTALS[0] | other, PEDESTALS[1]]})
    found, true = (measured_response(one, SPEEDS, [1, -1]) for one in (changed, built))
    assert np.abs(found - true).max() < 1e-12 * np.abs(true).max()
    assert np.abs(measured_response(model, SPEEDS, [1, -1]) - true).max() > 0.01 * np.abs(true).max()


@pytest.mark.parametrize("effect", [{"kind": "seal"}, {"kind": "cross_coupling"}, {"kind": "rub", "clearance_m": 1e-6}])
def test_what_acts_between_rotor_and_casing_does_not_feel_that_both_move_as_one_body(effect, compressor):
    """The casing stands on the frame, also beyond its bearings; on the ground it feels that motion."""
    _, rig = compressor

    def felt(foundation):
        structure = build_model(rig | {"foundation": foundation, "measurement": {}}).structure
        at = structure.node_positions
        together = np.array([1e-5 * (1 + at[node]) * (motion != "tilt") for node, motion in structure.dofs])
        (parameter, *_) = make_term("effect", {**effect, "node": 12}, structure, (4, 10)).parameters
        matrix = parameter.force.matrix if parameter.force else parameter.entries[0].matrix
        return np.abs(matrix @ together).max()

    assert felt(rig["foundation"]) < 1e-18
    assert felt([]) > 1e-6  # negative control


def test_a_changed_foot_of_a_block_is_one_of_two_blocks():
    """One of its feet alone at three tenths less: the block on that foot less its share, and no other foot."""
    block = {"kind": "foundation_block", "node": 1, "second_node": 5, "label": "frame", "feet_m": [0.1, 0.7],
             "foundation_mass_kg": 60.0, "foundation_stiffness_xx_N_per_m": 8e6,
             "foundation_stiffness_yy_N_per_m": 5e6, "foundation_damping_xx_N_s_per_m": 1e3,
             "foundation_damping_yy_N_s_per_m": 2e3}  # fmt: skip
    model = build_model(RIG | {"foundation": [block]})
    places = [c.where for c in candidates(model, Settings())[0] if c.effect == "foundation_change"]
    assert places == [{"node": 1}, {"node": 1, "foot": 1}, {"node": 1, "foot": 2}]
    change = {"kind": "foundation_change", "node": 1, "change_of_foundation_stiffness_xx": -0.3,
              "change_of_foundation_stiffness_yy": -0.3}  # fmt: skip
    lost = {f"foundation_{part}_N_per_m": -0.15 * block[f"foundation_{part}_N_per_m"]
            for part in ("stiffness_xx", "stiffness_yy")}  # fmt: skip
    lost |= dict.fromkeys([key for key in block if key.startswith(("foundation_mass", "foundation_damping"))], 0.0)
    alone = block | lost | {"feet_m": [0.7], "label": "lost"}
    true = measured_response(build_model(RIG | {"foundation": [block, alone]}), SPEEDS, [1, -1])

    def error(foot):
        term = make_term("effect", {**change, "foot": foot}, model.structure, model.sensors)
        return np.abs(measured_response(model.plus(term), SPEEDS, [1, -1]) - true).max() / np.abs(true).max()

    assert error(2) < 1e-12 and error(1) > 0.01 and error(None) > 0.01
    with pytest.raises(CannotAct, match="foot 3"):
        error(3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"foundation": [PEDESTALS[0] | {"node": 3}]}, "node of a bearing"),
        ({"foundation": PEDESTALS, **riding("XX")}, "by its label or node"),
        (riding("DE"), "must be a bearing on the foundation"),
        (on_casing(node=3), "no node of the rotor"),
        (on_casing(bearing="XX"), "by its label or node"),
        (on_casing(relative_to="DE"), "not both"),
        ({"foundation": [{"kind": "foundation_block", "node": 1, "second_node": 1}]}, "another bearing"),
    ],
)
def test_what_is_refused(change, words):
    refused(lambda: build_model(RIG | change), words)


@pytest.fixture(scope="module")
def compressor():
    """The compressor of the independent simulator on its films, linear at one speed, and its rig."""
    machine = plant.compressor()
    rotor, (block,) = machine.rotor, machine.blocks
    rig = {
        "rotor": {"kind": "finite_element", "elements": stretches(rotor.elements), "discs": discs_section(rotor)},
        "bearings": [
            film(f.diameter, f.length, f.clearance, f.viscosity, node=f.node + 1, label=label, load_N=f.load)
            for f, label in zip(rotor.films, ("DE", "NDE"), strict=True)
        ],
        "foundation": [
            BLOCK | {"feet_m": list(block.feet), "centre_m": block.centre,
                     "radius_of_gyration_m": block.radius_of_gyration,
                     "foundation_mass_kg": block.mass,
                     **{f"foundation_stiffness_{a}{a}_N_per_m": 2 * block.stiffness[i] for i, a in enumerate("xy")},
                     **{f"foundation_damping_{a}{a}_N_s_per_m": 2 * block.damping[i] for i, a in enumerate("xy")}}
        ],
        "effects": [{"kind": "shaft_damping", "shaft_damping_s": 1e-6},
                    {"kind": "unbalance", "node": 12, "mass_kg": 26.0, "eccentricity_m": 1e-5}],
        "sensors": [4, 10, 12],
        "measurement": {"probes": [{"channel": name, "angle_deg": angle, "relative_to": "bearing", "node": node}
                                   for node in (4, 10) for name, angle in (("a", -45), ("b", 45))]},
    }  # fmt: skip
    return machine, rig


def independent(plant_machine, speed):
    """Forward and backward 1X (harmonic, place) at the probes of nodes 3 and 9 and absolute at 11, by the simulator."""
    machine = replace(plant_machine, speeds=np.array([speed]), unbalance={}).build()
    machine.local.clear()  # what the films do beyond small motion about where they run at this speed
    add_unbalance(machine, 11, 26.0 * 1e-5)
    mass, damping, stiffness = machine.linear(speed)
    force = machine.harmonic[1, 2] * speed**2
    motion = np.linalg.solve(stiffness + 1j * speed * damping - speed**2 * mass, force)
    x, y = np.transpose([plant_machine.against_block(machine, node).T @ motion for node in (3, 9)] + [motion[44:46]])
    return np.array([(x + 1j * y) / 2, np.conj(x - 1j * y) / 2])


@pytest.mark.parametrize("speed", [150.0, 300.0, 400.0])
def test_a_block_moves_as_that_of_the_independent_simulator(compressor, speed):
    """Matrices by numerical integration, films by integration of the pressure, gravity 9.80665 instead of 9.81."""
    machine, rig = compressor
    found = measured_response(build_model(rig), [speed], [1, -1])[0]
    true = independent(machine, speed)
    assert np.abs(found - true).max() < 2e-4 * np.abs(true).max()
    stiffer = dict(rig, foundation=[rig["foundation"][0] | {"radius_of_gyration_m": 0.5}])
    assert np.abs(measured_response(build_model(stiffer), [speed], [1, -1])[0] - true).max() > 2e-3 * np.abs(true).max()


def test_a_foot_that_lifts_is_that_of_the_independent_simulator(compressor):
    """Under the bearing at node 4 half of the stiffness of a foot is lost upward, on films that are linear."""
    machine, rig = compressor
    standing, speed, (block,) = replace(machine, speeds=np.array([350.0]), unbalance={}), 350.0, machine.blocks
    loose, loss, housing = standing.build(), 0.5 * block.stiffness[0], {"foundation": 4}
    loose.local.clear()
    loose.harmonic[0, 0][:] = 0  # motion about rest
    add_unbalance(loose, 11, 26.0 * 1e-5)
    selection = np.zeros((loose.size, 2))
    selection[standing.block_slice(loose, 0)] = block.motion_at(machine.rotor.positions[3]).T
    loose.local.append(LocalForce(selection, one_sided(loss, np.inf, np.pi), "foot"))
    steady = standing.shown_by(steady_state(loose, [speed], 128), loose)
    harmonics = [1, -1, 2, -2]
    true = steady.harmonics((3, 9), harmonics)[0]
    effect = {"kind": "looseness", "lift_m": 0.0, "stiffness_lost_in_lift_N_per_m": loss}

    def off(place):
        model = build_model(rig | {"effects": [*rig["effects"], effect | place]})
        found = measured_response(model, [speed], harmonics)[0, :, :2]
        return np.abs(found - true).max(axis=1) / np.abs(true).max(axis=1)

    assert off(housing).max() < 0.02  # of 2X, which needs higher ones than are carried
    assert off(housing)[:2].max() < 1e-3 and off({"node": 4})[2:].max() > 0.5  # negative control: in the bearing


def test_a_foot_that_lifts_is_sought_at_the_motion_with_a_force_there(compressor):
    """Where a force elsewhere explains about as much, and is the first of those at which shapes are scanned."""
    _, rig = compressor
    speeds, harmonics = np.linspace(150.0, 400.0, 6), np.array([1, -1, 2, -2])
    loss = {"kind": "looseness", "foundation": 4, "lift_m": 0.0, "stiffness_lost_in_lift_N_per_m": 2e7}
    files = rig | {"sensors": [4, 10]}
    shown = measured_response(build_model(files | {"effects": [*rig["effects"], loss]}), speeds, harmonics)
    settings = Settings(leave_out=all_but("looseness"), uncertainty={"default": 0.0}, nuisance={}, model_error=0.02)
    record = with_model_error(readings(shown, speeds, harmonics, (4, 10), 1e-8), settings)
    work = begin(build_model(files), record, settings)
    fitted = [one for one in work.free_forces if one.fitted is not None]
    there = next(one for one in fitted if one.where == {"foundation": 4})
    elsewhere = next(one for one in fitted if one.where != there.where)
    as_good = {"log_odds": there.log_odds + 1, "left": there.left}

    def promised(*forces):
        groups = chain(*moves.single_causes(replace(work, free_forces=forces)))
        return max(one.log_odds for one in chain(*groups) if one.causes[0].where == there.where)

    alone = promised(there)
    assert promised(elsewhere._replace(**as_good), there) == pytest.approx(alone, abs=1.0)
    assert promised(elsewhere._replace(**as_good)) < alone - 100  # negative control


def test_another_block_is_told_by_steps_of_a_fit(compressor, monkeypatch):
    """A frame that is softer by a quarter, which no force at one place moves so, seen at the bearings alone."""
    machine, rig = compressor
    (block,) = machine.blocks
    softer = replace(machine, blocks=(replace(block, stiffness=tuple(0.75 * k for k in block.stiffness)),))
    speeds, harmonics = np.linspace(125.0, 420.0, 6), np.array([1, -1])
    shown = np.array([independent(softer, speed)[:, :2] for speed in speeds])
    tried = all_but("foundation_change", "added_mass", "support_anisotropy", "support_stiffness", "shaft_asymmetry")
    settings = Settings(leave_out=tried, uncertainty={"default": 0.0}, nuisance={}, model_error=0.02)
    record = with_model_error(readings(shown, speeds, harmonics, (4, 10), 1e-8), settings)
    work = begin(build_model(rig | {"sensors": [4, 10]}), record, settings)

    def most_promising():
        proposals = moves.additions(work, work.nothing, [work.free_forces[0].fitted])
        return max(proposals, key=lambda one: one.log_odds)

    best = most_promising()
    (cause,) = best.causes
    assert cause.cause == "foundation_change, node 4"
    assert [best.values[name] for name in cause.names] == pytest.approx([-0.25, -0.25], abs=0.02)
    monkeypatch.setattr(moves, "needs_fit", lambda cause, structure: False)  # negative control: linear columns
    assert most_promising().causes[0].effect != "foundation_change"


def test_a_cracked_rotor_on_a_foundation_has_a_stability():
    """Of a crack of next to no depth, that of the sound rotor, by eigenvalues; without a mass there is none."""
    crack = {"kind": "open", "element": 2, "stiffness_loss": 1e-9, "weight_dominance": False}
    sound = build_model(RIG | {"foundation": PEDESTALS})
    cracked = build_model(RIG | {"foundation": PEDESTALS, "cracks": [crack]})
    growth = [growth_of_free_motion(model, SPEEDS) for model in (sound, cracked)]
    assert (growth[0] < -1.0).all() and np.abs(growth[1] / growth[0] - 1).max() < 1e-3
    massless = [{key: value for key, value in one.items() if key != "mass_kg"} for one in PEDESTALS]
    refused(lambda: build_model(RIG | {"foundation": massless}), "has no mass")


def test_equations_of_motion_are_not_solved_for_relative_motion():
    model = build_model(RIG | {"foundation": PEDESTALS, "sensors": [1, 3]} | riding("DE"))
    with pytest.raises(RotorstudyError, match="relative to a bearing"):
        regression(model, spectrum_of(model, SPEEDS, [1, -1], 1e-8), ["bearing_damping[DE]"])


@pytest.mark.parametrize(
    ("mass", "radius", "stiffness", "clearance", "share", "from_a_draw"),
    [
        pytest.param(1000.0, 0.35, (1e8, 2.1e8), 1.08, 0.2, False, id="gradually"),
        # resonances on the other side of a speed: neither way without draws of the prior finds them
        pytest.param(1158.0, 0.38, (5.9e7, 1.3e8), 0.94, 0.3, True, id="from_a_draw"),
    ],
)
def test_a_fit_that_runs_away_finds_the_foundation(
    mass, radius, stiffness, clearance, share, from_a_draw, compressor, monkeypatch
):
    """Numbers of a rig that are off by up to 35 %, and unbalances that are not known."""
    speeds, harmonics, noise = np.linspace(125.0, 420.0, 8), np.array([1, -1]), 2e-8
    sizes = ((1, 6e-4, 1.0), (12, 8e-4, 0.0), (14, 1e-3, 2.0))
    unbalances = [unbalance(*one, label=str(one[0]), mass_kg=1.0) for one in sizes]
    true = compressor[1] | {"effects": [compressor[1]["effects"][0], *unbalances], "sensors": [4, 10]}
    stated = true | {
        "foundation": [
            true["foundation"][0] | {"foundation_mass_kg": mass, "radius_of_gyration_m": radius,
                                     **{f"foundation_stiffness_{d}_N_per_m": k
                                        for d, k in zip(("xx", "yy"), stiffness, strict=True)}}
        ],
        "bearings": [one | {"radial_clearance_m": clearance * one["radial_clearance_m"]} for one in true["bearings"]],
        "effects": [true["effects"][0], *(one | {"eccentricity_m": 1e-6} for one in unbalances)],
    }  # fmt: skip
    data = spectrum_of(build_model(true), speeds, harmonics, noise, 7)
    films = {
        f"bearings[{label}].{key}": 0.1 for label in ("DE", "NDE") for key in ("radial_clearance_m", "viscosity_Pa_s")
    }
    known = {"default": share, "rotor": 0.0, "eccentricity": 2000.0, "bearing_scale": 0.0,
             "bearings[frame].radius_of_gyration_m": share, **films}  # fmt: skip
    whole, prior = base_model(build_model(stated), Settings(uncertainty=known, nuisance={}))
    tried, own = [], fit_module._gradually
    monkeypatch.setattr(fit_module, "_gradually", lambda *given: tried.append(own(*given)) or tried[-1])
    gentle = fit(whole, data, prior, from_afar=True)
    assert chi_square_p_value(gentle.cost, data.data_count) > 1e-3
    rough = tried[0].misfit if from_a_draw else fit(whole, data, prior).cost  # negative control
    assert rough > 10 * gentle.cost


def test_no_effect_of_the_library_fails_on_a_foundation():
    model = build_model(RIG | {"foundation": PEDESTALS, "sensors": [1, 3]} | riding("DE"))
    found, broken = candidates(model, Settings())
    assert [one.where for one in found if one.effect == "looseness" and "foundation" in one.where]
    assert broken == {} and {"bow", "bearing_coefficients", "transverse_crack"} <= {one.effect for one in found}
    rows = dict(places_of(model.structure))  # a force inside a bearing acts on journal and housing alike
    journal, housing = model.structure.index(1), model.structure.index(1, "housing")
    (inside,), (ground,) = rows["bearing", 1, "force"], rows["foundation", 1, "force"]
    assert inside[[journal, housing]].tolist() == [1, -1] and np.count_nonzero(inside) == 2
    assert ground[housing] == 1 and np.count_nonzero(ground) == 1
