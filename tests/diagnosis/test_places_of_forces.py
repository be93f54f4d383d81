"""What the best of all forces at a place leaves: no shape of a cause there leaves less, so others are not scanned."""

import numpy as np
import pytest
from test_resultant import RIG

from rotorstudy.diagnosis.search.free_forces import free_force_columns, left_by_free_forces
from rotorstudy.diagnosis.search.screening import Projection
from rotorstudy.diagnosis.search.search import begin
from rotorstudy.diagnosis.search.shape_scan import scan
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.model.rig import build_model
from rotorstudy.model.rig_items import make_term
from rotorstudy.response.measured import measured_response

UNBALANCE = {"kind": "unbalance", "node": 3, "mass_kg": 0.8, "eccentricity_m": 5e-5}
MODEL, NOISE = build_model(RIG | {"effects": [UNBALANCE], "sensors": [2, 5, 8]}), 1e-8
SPEEDS, HARMONICS, FAULTY, OTHER = np.array([90.0, 105.0, 126.0]), np.array([0, 1, -1, 2, -2, 3, -3]), 3, 7
LIMIT = 1500.0  # of the cost, which is 16700 without a cause


def begun(harmonics=HARMONICS):
    """A Search in records of a rotor that touches a ring at one disc."""
    item = {"kind": "rub", "node": FAULTY, "label": "hidden", "rub_stiffness_N_per_m": 1e6, "clearance_m": 2e-5}
    rubbing = MODEL.plus(make_term("effect", item, MODEL.structure, MODEL.sensors))
    shown = measured_response(rubbing, SPEEDS, harmonics)
    draws = np.random.default_rng(1).normal(0, NOISE, (2, *shown.shape))
    covariance = independent_covariance(np.full(shown.shape, NOISE**2))
    data = Spectrum(shown + draws[0] + 1j * draws[1], SPEEDS, harmonics, MODEL.sensors, covariance)
    exact = {"model_error": 1e-4, "model_floor": 1e-4}
    settings = Settings(uncertainty={"default": 0.02}, nuisance={}, most_causes=1, **exact)
    return begin(MODEL, with_model_error(data, settings), settings)


@pytest.fixture(scope="module")
def work():
    return begun()


def left(work, fitted, *nodes):
    """Cost that free forces at some nodes leave, each alone."""
    near = Projection(fitted, work.spectrum).near
    return left_by_free_forces(fitted, work.spectrum, [MODEL.structure.unit(node)[None] for node in nodes], near)


def as_stated(work):
    """The fit of the rig at its stated values."""
    return work.held((), dict(zip(MODEL.names, MODEL.stated.tolist(), strict=True)))


def test_a_free_force_leaves_what_least_squares_leave(work):
    """With all its parts and the free parameters as columns of one system."""
    near, fitted = Projection(work.base, work.spectrum).near, work.base
    columns = free_force_columns(near, work.spectrum, [MODEL.structure.unit(OTHER)])[0]
    force = np.zeros((len(SPEEDS), columns.shape[1], len(SPEEDS), columns.shape[2]))
    force[range(len(SPEEDS)), :, range(len(SPEEDS))] = columns
    force = force.reshape(len(fitted.residual), -1)
    whitener = fitted.prior.whitener
    system = np.block([[fitted.jacobian, force], [whitener, np.zeros((len(whitener), force.shape[1]))]])
    right = np.concatenate([fitted.residual, whitener @ (fitted.prior.mean - fitted.free)])
    system = system / np.linalg.norm(system, axis=0)
    off = right - system @ np.linalg.lstsq(system, right, rcond=None)[0]
    assert left(work, fitted, OTHER)[0] == pytest.approx(off @ off, rel=1e-6)


def test_a_force_at_the_node_of_a_fault_explains_it_and_one_elsewhere_does_not(work):
    here, elsewhere = left(work, as_stated(work), FAULTY, OTHER)
    assert here < len(work.base.residual) < LIMIT < elsewhere


def test_places_where_no_force_explains_enough_are_not_scanned(work):
    """The negative control: without a limit they are."""
    rubs = [c for c in work.candidates if c.effect == "rub" and c.where["node"] in (FAULTY, OTHER)]
    rubs = list({c.cause: c for c in rubs}.values())
    assert {one.cause.where["node"] for one in scan(work, as_stated(work), rubs, most_left=LIMIT)} == {FAULTY}
    assert {one.cause.where["node"] for one in scan(work, as_stated(work), rubs)} == {FAULTY, OTHER}


def test_nothing_is_left_out_where_harmonics_without_their_opposite_were_measured():
    """A force at an opposite that was not measured may act through an anisotropic support."""
    alone = begun(np.array([0, 1, 2]))
    assert left(alone, alone.base, FAULTY, OTHER) == [0.0, 0.0]


def test_causes_without_a_steady_motion_are_not_held(work, monkeypatch):
    def fails(*_, **__):
        raise NoSteadyState("jumps")

    assert work.held((), {}) is not None
    monkeypatch.setattr("rotorstudy.diagnosis.search.explanations.fit", fails)
    assert work.held((), {}) is None
