"""Bounds with further measurements: known limits, and the shape of the shaft they rest on."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from machines import OFFSET_DISC, point
from one_line_errors import refused

from rotorstudy import Problem, build_model, cramer_rao_bound, harmonic_response, magnitude_and_phase, make_term
from rotorstudy.errors import UnidentifiableError
from rotorstudy.measurement.spectrum import independent_covariance
from rotorstudy.studies.analyses import identifiability, information
from rotorstudy.studies.config import ExtraMeasurement, load_study

ROOT = Path(__file__).parents[2]


STUDY = load_study(ROOT / "workflow" / "config" / "chapter_4.yaml")


@pytest.fixture(scope="module")
def found():
    return identifiability(STUDY).isel(case=0)


def test_the_bound_as_it_is_is_that_of_the_estimators(found):
    model, case = STUDY.rig("physical"), next(iter(STUDY.cases.values()))
    clean = STUDY.clean_spectrum(model, case.speeds)
    std = np.full(clean.amplitude.shape, float(found.noise) / np.sqrt(STUDY.record.samples))
    spectrum = replace(clean, covariance=independent_covariance(std**2))
    theta = model.theta[model.position(STUDY.unknowns)]
    bound = cramer_rao_bound(Problem(model, spectrum, tuple(STUDY.unknowns)), theta)
    names, values, bound = magnitude_and_phase(STUDY.unknowns, theta, bound)
    scale = np.where([n.endswith("_phase") for n in names], 1, np.abs(values))
    assert found.bound.sel(measurement="as it is").values == pytest.approx(np.sqrt(np.diag(bound)) / scale, rel=1e-9)


def test_four_times_the_record_halves_every_bound_and_a_second_probe_at_the_disc_is_worth_the_root_of_two():
    extra = {"longer": ExtraMeasurement(times_longer=4.0), "twice": ExtraMeasurement(stations_m=[0.2])}
    bound = identifiability(STUDY.model_copy(update={"extra_measurements": extra})).bound.isel(case=0)
    for name, worth in (("longer", 2), ("twice", np.sqrt(2))):
        ratio = bound.sel(measurement="as it is") / bound.sel(measurement=name)
        assert ratio.values == pytest.approx(worth, rel=1e-9)


def test_a_tilt_sensor_breaks_the_collinearity_that_makes_stiffness_44_weak(found):
    pair = {"parameter": "stiffness_loss_22", "other_parameter": "stiffness_loss_44"}
    assert float(found.correlation.sel(pair)) < -0.999
    bound = found.bound.sel(parameter="stiffness_loss_44")
    gain = bound.sel(measurement="as it is") / bound
    assert float(gain.sel(measurement="tilt of the disc, two probes 0.04 m apart")) > 30
    assert float(gain.sel(measurement="a second probe at 0.10 m")) > 40
    # the same probes half as far apart know the tilt half as well
    arms = [float(gain.sel(measurement=f"tilt of the disc, two probes {arm} m apart")) for arm in ("0.04", "0.02")]
    assert arms[0] / arms[1] == pytest.approx(2, rel=0.01)


def test_the_information_of_a_tilt_sensor_is_that_of_differences_of_what_it_shows():
    model, speeds = STUDY.rig("physical"), np.linspace(130.0, 310.0, 7)
    rows, relative = ExtraMeasurement(tilts=[1]).output_rows(model.structure, model.sensors)

    def shown(theta):
        found = (harmonic_response(model, speeds, STUDY.harmonics, theta) @ rows.T / (1e-9 * relative)).ravel()
        return np.concatenate([found.real, found.imag])

    steps = 1e-5 * np.diag(np.abs(model.theta))[model.position(STUDY.unknowns)]
    slopes = np.array([(shown(model.theta + s) - shown(model.theta - s)) / (2 * s.max()) for s in steps])
    found, without = (
        information(STUDY, model, speeds, STUDY.harmonics, rows[:count], 1e-9 * relative[:count]) for count in (2, 1)
    )
    scale = np.sqrt(np.outer(np.diag(found), np.diag(found)))
    assert slopes @ slopes.T / scale == pytest.approx(found / scale, abs=1e-7)
    assert np.abs(without - found).max() > 1e-3 * np.abs(found).max()  # negative control: without the tilt


def test_the_shaft_between_bearings_and_disc_bends_as_a_beam():
    shape = build_model({"rotor": OFFSET_DISC}).structure.shape_at
    assert shape(0.2) == pytest.approx([1.0, 0.0], abs=1e-12)
    assert shape(0.0) == pytest.approx([0.0, 0.0], abs=1e-12) and shape(0.36) == pytest.approx([0.0, 0.0], abs=1e-12)
    h = 1e-6
    for side in (-1, 1):
        assert (shape(0.2 + side * h) - shape(0.2)) / (side * h) == pytest.approx([0.0, 1.0], abs=1e-4)
    for end, side in ((0.0, 1), (0.36, -1)):  # no moment in the bearings
        curvature = (shape(end) - 2 * shape(end + side * 1e-3) + shape(end + side * 2e-3)) / 1e-6
        assert np.abs(curvature).max() < 1.0  # one step into the span; at the disc it is -75


def test_a_probe_off_the_shaft_or_on_a_shaft_without_shape_is_refused():
    structure = STUDY.rig("physical").structure
    refused(lambda: ExtraMeasurement(stations_m=[0.5]).output_rows(structure, (1,)), "0.5 m is not on the shaft")
    jeffcott = build_model({"rotor": point()}).structure
    refused(lambda: ExtraMeasurement(stations_m=[0.1]).output_rows(jeffcott, (1,)), "does not define the shaft's shape")


def test_too_few_equations_are_refused_and_what_trades_off_is_named():
    model = STUDY.rig("physical")
    rows, relative = ExtraMeasurement().output_rows(model.structure, model.sensors)
    with pytest.raises(UnidentifiableError, match="2 equations for 6 unknowns"):
        information(STUDY, model, [200.0], [1], rows, 1e-9 * relative)
    free = {"kind": "crack_force", "losses": ["stiffness_loss_22"], "harmonics": [1]}
    free["stiffness_loss_22_p1_N_per_m"] = 1e4
    alternative = model.without(["switching"]).plus(make_term("effect", free, model.structure, model.sensors))
    unknowns = STUDY.model_copy(update={"unknowns": ["eccentricity_real", "eccentricity_imag", "stiffness_loss_22_p1"]})
    with pytest.raises(UnidentifiableError) as caught:  # at one speed an unbalance is any force that turns
        information(unknowns, alternative, [200.0], STUDY.harmonics, rows, 1e-9 * relative)
    assert set(caught.value.parameters) == {"eccentricity_real", "stiffness_loss_22_p1"}
    assert information(unknowns, alternative, [200.0, 250.0], STUDY.harmonics, rows, 1e-9 * relative).shape == (3, 3)
