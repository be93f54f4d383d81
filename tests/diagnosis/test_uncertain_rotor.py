"""The numbers of a rotor move in the fits of a diagnosis, and an identification updates them."""

import numpy as np
import pytest
import yaml
from machines import SLOW, all_but, disc, shaft, spectrum_of, springs, unbalance
from one_line_errors import run

from rotorstudy import RotorstudyError, build_model, load_rig, measured_response, registry
from rotorstudy.commands.line import main
from rotorstudy.diagnosis.one_cause.identify import identify_cause
from rotorstudy.diagnosis.search import shape_fit
from rotorstudy.diagnosis.search.candidates import candidate
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.extend import extended_rig
from rotorstudy.diagnosis.verdict.investigate import investigate
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.estimate import estimate_rig
from rotorstudy.inference.prior import prior_of
from rotorstudy.inference.problem import Problem
from rotorstudy.model import estimated_rig
from rotorstudy.model.hinge import crack_at
from rotorstudy.model.rig_numbers import rig_with_changes, rotor_at, with_numbers

pytestmark = pytest.mark.usefixtures("right_conventions")

HARMONICS, SPEEDS = np.array([0, 1, -1, 2, -2]), [60.0, 90.0, 120.0, 150.0, 180.0, 230.0, 280.0]
# the mass of an unbalance is that of its node, so it changes with the disc
PUSHED = unbalance(2, 1e-5, 0.8, label="1"), unbalance(4, 8e-6, -1.0, label="2")
DAMPED = {"kind": "external_damping", "node": 3, "external_damping_N_s_per_m": 60.0}
ROTOR = shaft(0.6, 4, disc(2), disc(4, 1.5, 0.0030, 0.0015), pinned_nodes=[1, 5])
RIG = {"rotor": ROTOR, "effects": [DAMPED, *PUSHED], "sensors": [2, 3, 4]}
STRICT = {"uncertainty": {"default": 0.02}, "model_error": 2e-4, "model_floor": 2e-5, "nuisance": {}, "leave_out": SLOW}
HELD = {**STRICT, "uncertainty": {"default": 0.02, "rotor": 0}}
MODULUS = "rotor.youngs_modulus_Pa"


def with_changes(rig, **changes):
    return rig_with_changes(rig, build_model(rig), {f"rotor.{k}": v for k, v in changes.items()})


def record(rig, seed, noise=2e-9):
    return spectrum_of(build_model(rig), SPEEDS, HARMONICS, noise / np.sqrt(2), seed)


def test_a_clean_record_of_a_rotor_with_another_modulus_is_called_nothing_with_the_modulus_moved():
    spectrum = record(with_changes(RIG, youngs_modulus_Pa=0.01), 1)
    diagnosis = investigate(spectrum, build_model(RIG), settings=STRICT)
    assert diagnosis.verdict.verdict == "nothing"
    found = diagnosis.best.values
    # speed errors apart, the response shows stiffness over mass: the three numbers share the change by their variances
    assert found[MODULUS] - found["rotor.discs"] == pytest.approx(0.01, abs=1e-3)
    assert abs(found[MODULUS]) > 2e-3
    # negative control: with the rotor held something is claimed
    assert investigate(spectrum, build_model(RIG), settings=HELD).verdict.verdict != "nothing"


def test_an_added_mass_is_found_although_modulus_density_and_discs_are_uncertain():
    item = {"kind": "added_mass", "node": 3, "label": "x", "added_mass_kg": 0.4}
    true = with_changes({**RIG, "effects": [*RIG["effects"], item]}, youngs_modulus_Pa=0.004)
    few = STRICT | {"candidates_per_round": 4}
    verdict = investigate(record(true, 3), build_model(RIG), settings=few).verdict
    assert verdict.verdict in ("cause", "ambiguous")
    (cause,) = verdict.causes
    assert (cause.effect, cause.where) == ("added_mass", {"node": 3})
    mass = cause.parameters["added_mass"]
    assert abs(mass.value - 0.4) < 4 * mass.std


def test_the_extended_rig_has_the_new_numbers_and_their_covariance():
    true = with_changes(RIG, youngs_modulus_Pa=0.01, **{"discs[0]": 0.006})
    stated = {**STRICT, "uncertainty": {"default": 0.02, "rotor": 0, MODULUS: 0.01, "rotor.discs[0]": 0.01}}
    spectrum = record(true, 4)
    diagnosis = investigate(spectrum, build_model(RIG), settings=stated)
    assert diagnosis.verdict.verdict == "nothing"
    rig = yaml.safe_load(yaml.safe_dump(extended_rig(RIG, diagnosis)))
    found = diagnosis.best.values
    assert rig["rotor"]["youngs_modulus_Pa"] == pytest.approx(2.1e11 * (1 + found[MODULUS]), rel=2e-4)
    assert rig["rotor"]["discs"][0]["mass_kg"] == pytest.approx(2.0 * (1 + found["rotor.discs[0]"]), rel=2e-4)
    assert rig["rotor"]["discs"][1] == RIG["rotor"]["discs"][1]
    model = build_model(rig)
    assert {MODULUS, "rotor.discs[0]"} <= set(model.uncertainty.names)
    # the rig explains the record as the fit does: the unbalance of the new disc was estimated again
    off = spectrum.whitened(spectrum.amplitude - measured_response(model, SPEEDS, HARMONICS))
    assert np.sum(off**2) < 1.3 * len(off)
    # the next diagnosis starts from the new rotor, with what is now known of it
    known = investigate(record(true, 5), model, settings=stated)
    assert known.search.prior.by_name[MODULUS][0] == 0
    assert known.search.prior.by_name[MODULUS][1] < 0.01
    assert known.verdict.verdict == "nothing"


SHAPE = {"position_m": 0.25, "depth_ratio": 0.2, "angle_rad": 0.7}
CRACK = {"kind": "transverse_crack", **SHAPE, "flexibility_factor": 1.0}
LOOSE = Settings(uncertainty={"default": 0.02, "rotor": 0, MODULUS: 0.02}, nuisance={})


@pytest.mark.usefixtures("few_places", "few_shapes")
def test_a_crack_yields_by_the_modulus_that_is_found(monkeypatch):
    """Force and flexibility are both by the modulus: with that of the rig file, 2 % too low, they are 4 % too large."""
    cracked = {**RIG, "effects": [*RIG["effects"], {**CRACK, "breathing": "none"}]}
    true = build_model(with_changes(cracked, youngs_modulus_Pa=0.02))
    spectrum = spectrum_of(true, SPEEDS[::2], HARMONICS, 2e-10, 7)
    hinge = crack_at(true.structure, *SHAPE.values(), "elasticity")

    def off():
        found = identify_cause(spectrum, build_model(RIG), "transverse_crack", LOOSE)
        value, std = found.stated["flexibility_rad_per_N_m"]
        return value / hinge.open_compliance[0] - 1, std / value

    error, std = off()
    assert abs(error) < 3 * std < 0.015
    monkeypatch.setattr(shape_fit, "rotor_at", lambda structure, values: structure)  # negative control
    assert off()[0] == pytest.approx(0.04, abs=0.015)


def test_a_share_of_the_stiffness_is_one_of_the_modulus_that_is_found(monkeypatch):
    """Of an effect without a shape, too: as a share of the stiffness in the rig file, 2 % too low, it is 2 % larger."""
    cause = {"kind": "shaft_asymmetry", "element": 2, "shaft_asymmetry": 0.1, "shaft_asymmetry_phase_rad": 0.4}
    true = with_changes({**RIG, "effects": [*RIG["effects"], {**cause, "label": "x"}]}, youngs_modulus_Pa=0.02)
    spectrum = spectrum_of(build_model(true), SPEEDS, HARMONICS, 2e-10, 7)
    alone = LOOSE.model_copy(update={"leave_out": all_but("shaft_asymmetry"), "model_error": 1e-4, "model_floor": 1e-5})

    def off():
        (found,) = investigate(spectrum, build_model(RIG), settings=alone).verdict.causes
        assert found.where == {"element": 2}
        share = found.parameters["shaft_asymmetry"]
        return share.value / 0.1 - 1, share.std / 0.1

    error, std = off()
    assert abs(error) < 3 * std < 1e-3
    monkeypatch.setattr(shape_fit, "rotor_at", lambda structure, values: structure)  # negative control
    assert off()[0] == pytest.approx(0.02, abs=1e-3)


def test_a_crack_of_the_rig_is_a_share_of_the_modulus_that_is_identified(monkeypatch):
    """As a share of the modulus in the rig file, 2 % too low, the loss would be 2 % larger."""
    rig = {**RIG, "cracks": [{"kind": "open", "element": 2, "angle_rad": 0.3, "weight_dominance": False}]}
    true = {**rig, "cracks": [{**rig["cracks"][0], "stiffness_loss": 0.2}]}
    spectrum = spectrum_of(build_model(with_changes(true, youngs_modulus_Pa=0.02)), SPEEDS, HARMONICS, 1e-10, 3)
    names = (MODULUS, "stiffness_loss")

    def off():
        problem = Problem(with_numbers(build_model(rig), names), spectrum, names)
        found = estimate_rig(registry().get("estimator", "maximum_likelihood"), problem, rig)
        return found.theta - [0.02, 0.2], found.std

    error, std = off()
    assert (np.abs(error) < 4 * std).all() and std[1] < 1e-4
    monkeypatch.setattr(estimated_rig, "REBUILDS", 1)  # negative control
    assert off()[0] == pytest.approx([0.0, 0.004], abs=2e-4)


def test_no_rotor_is_built_of_a_modulus_below_zero_where_a_fit_tries_one():
    model = build_model({**RIG, "rotor": {**ROTOR, "theory": "timoshenko"}})
    softer, known = rotor_at(model.structure, {MODULUS: -0.9}).stiffness, 0.1 * model.structure.stiffness
    assert np.abs(softer - known).max() < 1e-12 * np.abs(known).max()
    with pytest.raises(NoSteadyState, match="youngs_modulus_Pa would be zero or negative"):
        rotor_at(model.structure, {MODULUS: -1.1})


def test_the_slope_by_the_modulus_has_what_the_crack_changes():
    model = build_model(RIG)
    whole, prior = base_model(model, LOOSE)
    crack = candidate(model, "transverse_crack", {}, SHAPE)
    spectrum = spectrum_of(model, SPEEDS, HARMONICS, 2e-9, 8)
    work, at = shape_fit.Work(model, whole, prior, spectrum, LOOSE), prior.names.index(MODULUS)
    theta, point = np.append(prior.mean, 1.0), shape_fit.point_of(work, crack)

    def shown(change):
        moved = theta + change * (np.arange(len(theta)) == at)
        return shape_fit.response_with_shape(work, [crack], moved, [point])

    ends, (_, slopes) = [shown(change)[0] for change in (1e-3, -1e-3)], shown(0.0)
    assert slopes[at] == pytest.approx((ends[0] - ends[1]) / 2e-3, rel=1e-3, abs=1e-5 * np.abs(slopes[at]).max())


@pytest.mark.parametrize("effect, where", [("transverse_crack", {}), ("pedestal_resonance", {"node": 1})])
def test_the_shape_of_a_cause_stays_as_it_is_where_its_rotor_follows_the_numbers(effect, where):
    """Usual sizes, which are the ends of its ranges, are those of the rig: a shape would else move at every fit."""
    model = build_model({**RIG, "rotor": shaft(0.6, 4, disc(2)), "bearings": springs((1, 5), 2e6, 400.0)})
    whole, prior = base_model(model, LOOSE)
    work = shape_fit.Work(model, whole, prior, spectrum_of(model, SPEEDS, HARMONICS, 2e-9, 9), LOOSE)
    ranges = shape_fit.ranges_of(work, candidate(model, effect, where))
    shape = {name: ends.value(0.3) for name, ends in ranges.items()}
    cause = candidate(model, effect, where, shape)
    moved = prior.mean + 0.02 * (np.array(prior.names) == MODULUS)
    (there,) = shape_fit.causes_at(work, [cause], moved, [shape_fit.point_of(work, cause)])
    assert there.shape == pytest.approx(shape, rel=1e-12)
    (other,) = shape_fit.causes_at(shape_fit.at_numbers(work, moved), [cause], moved, [np.full(len(shape), 0.3)])
    assert (other.shape == pytest.approx(shape, rel=1e-12)) == (effect == "transverse_crack")  # control


def test_a_geometry_that_is_25_per_cent_off_is_updated_by_identify(tmp_path, capsys, command):
    rig, records, out = tmp_path / "rig.yaml", tmp_path / "records.nc", tmp_path / "identified.yaml"
    given = {**RIG, "measurement": {"harmonics": HARMONICS.tolist()}}
    true = with_changes(given, **{"outer_diameter_m": 0.25, "discs[0]": -0.2})
    rig.write_text(yaml.safe_dump(true))
    run("simulate", rig, "--speeds", *SPEEDS, "--noise", "1e-6", "--out", records)
    rig.write_text(yaml.safe_dump(given))
    names = ["rotor.outer_diameter_m", "rotor.discs[0]", "eccentricity[1]", "eccentricity[2]", "external_damping"]
    identify = ["identify", str(records), "--rig", str(rig), "--rig-out", str(out), "--unknowns", *names]
    assert "rotor.outer_diameter_m" in command(*identify).out
    found = yaml.safe_load(out.read_text())
    assert found["rotor"]["outer_diameter_m"] == pytest.approx(0.025, rel=1e-4)
    assert found["rotor"]["discs"][0]["mass_kg"] == pytest.approx(1.6, rel=1e-3)
    model = load_rig(out)
    true_model = build_model(true)
    for name in ("eccentricity[1]_real", "eccentricity[2]_imag", "external_damping"):
        one, other = (m.theta[m.names.index(name)] for m in (model, true_model))
        assert one == pytest.approx(other, rel=1e-3)
    assert main([*identify[: -len(names)], "rotor.outer_diamete_m"]) == 1
    assert "did you mean 'rotor.outer_diameter_m'" in capsys.readouterr().err


def test_the_numbers_that_are_uncertain_are_those_stated_or_those_of_the_plugin():
    usual = {MODULUS: 0.005, "rotor.density_kg_per_m3": 0.005, "rotor.discs": 0.005}

    def free(**uncertainty):
        _, prior = base_model(build_model(RIG), Settings(uncertainty=uncertainty, nuisance={}))
        return {name: std for name, (_, std) in prior.by_name.items() if name.startswith("rotor.")}

    assert free(default=0.1) == usual
    assert free(default=0.1, rotor=0.02) == dict.fromkeys(usual, 0.02)
    assert free(default=0.1, **{MODULUS: 0.03}) == {**usual, MODULUS: 0.03}
    assert free(default=0.1, rotor=0, **{"rotor.discs[1].mass_kg": 0.02}) == {"rotor.discs[1].mass_kg": 0.02}
    assert free(default=0.1, **{MODULUS: 0}) == {name: std for name, std in usual.items() if name != MODULUS}
    assert free(default=0.1, rotor=0) == free(default=0) == {}


def test_a_prior_may_name_numbers_of_the_rotor():
    section = {"parameters": [MODULUS, "external_damping"], "standard_deviations": [0.002, 3.0],
               "correlations": [[1.0], [0.5, 1.0]]}  # fmt: skip
    model = build_model({**RIG, "prior": section})
    assert MODULUS in model.names
    prior = prior_of(model, {"default": 0.1})
    assert prior.part(section["parameters"]).covariance == pytest.approx(np.array([[4e-6, 3e-3], [3e-3, 9.0]]))
    plain = build_model(RIG)
    assert measured_response(model, SPEEDS, HARMONICS) == pytest.approx(measured_response(plain, SPEEDS, HARMONICS))
    with pytest.raises(RotorstudyError, match="did you mean"):
        build_model({**RIG, "prior": {**section, "parameters": ["rotor.density_kg", "external_damping"]}})
