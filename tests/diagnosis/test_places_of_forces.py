"""A force of any law at one place is the hypothesis of a fault that the library lacks."""

from dataclasses import replace

import numpy as np
import pytest
from machines import SLOW, faulty, jeffcott, spectrum_of
from test_resultant import RIG

from rotorstudy import RotorstudyError, build_model
from rotorstudy.diagnosis.search import free_force
from rotorstudy.diagnosis.search.moves import PAIRS, pairs
from rotorstudy.diagnosis.search.odds import odds_of
from rotorstudy.diagnosis.search.search import begin, search
from rotorstudy.diagnosis.search.shown_forces import free_force_columns
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.inference.prediction import neighbourhood, predicted, with_model_error

UNBALANCE = {"kind": "unbalance", "node": 3, "mass_kg": 0.8, "eccentricity_m": 5e-5}
MODEL, NOISE = build_model(RIG | {"effects": [UNBALANCE], "sensors": [2, 5, 8]}), 1e-8
SPEEDS, HARMONICS, FAULTY, OTHER = np.array([90.0, 105.0, 126.0]), np.array([0, 1, -1, 2, -2, 3, -3]), 3, 7
LIMIT = 1500.0  # of the cost, which is 16700 without a cause


def begun(is_clean=False, is_exact=False, model=MODEL):
    """A Search in records of a rotor that touches a ring at one disc, or of a sound one, that may equal its rig."""
    item = {"kind": "rub", "node": FAULTY, "label": "hidden", "rub_stiffness_N_per_m": 1e6, "clearance_m": 2e-5}
    rubbing = faulty(model, item)
    data = spectrum_of(model if is_clean else rubbing, SPEEDS, HARMONICS, NOISE, 1)
    if is_exact:
        data = replace(data, amplitude=predicted(model, data, model.stated))
    left = sorted({*SLOW} - {"rub", "looseness"})
    exact = {"model_error": 1e-4, "model_floor": 1e-4}
    settings = Settings(uncertainty={"default": 0.02}, nuisance={}, most_causes=1, leave_out=left, **exact)
    return begin(model, with_model_error(data, settings), settings)


def without_contacts(work):
    """The Search carried out without the true effect in the library."""
    others = [c for c in work.candidates if c.effect not in ("rub", "looseness")]
    return search(replace(work, candidates=others, found={frozenset(): work.nothing}, screened=[]))


@pytest.fixture(scope="module")
def work():
    return begun()


@pytest.fixture(scope="module")
def known(work):
    """The Search carried out, with the true effect in the library."""
    return search(replace(work, found={frozenset(): work.nothing}, screened=[]))


def test_a_force_at_the_node_of_a_fault_explains_it_and_one_elsewhere_does_not(work):
    left = {one.where["node"]: one.left for one in work.free_forces if one.motion == "force"}
    assert left[FAULTY] < 2 * len(work.base.residual) < LIMIT < left[OTHER]
    assert (work.free_forces[0].where, work.free_forces[0].motion) == ({"node": FAULTY}, "force")


def test_a_moment_that_shows_only_round_off_shows_nothing():
    """In the middle of a symmetric rotor, to a probe there; negative controls: to one beside it, and a force there."""
    shown = {}
    for sensor in (5, 4):
        model = build_model(RIG | {"effects": [UNBALANCE | {"node": 5}], "sensors": [sensor]})
        data, rows = spectrum_of(model, SPEEDS, HARMONICS, NOISE, 1), model.structure.unit
        near = neighbourhood(model, data, model.stated)
        shown[sensor] = np.abs(free_force_columns(near, data, [rows(5, "tilt"), rows(5)])).max(axis=(1, 2, 3))
    assert shown[5][0] == 0.0 < shown[5][1] and shown[4].min() > 0


def test_what_does_not_fit_into_memory_is_refused(work, monkeypatch):
    monkeypatch.setattr(free_force, "MOST_BYTES", 1e5)
    with pytest.raises(RotorstudyError, match=r"3 speeds, 7 harmonics and 3 nodes need .* GB.*give fewer speeds"):
        free_force.free_forces(work)


def test_its_probability_decides_whether_a_fault_is_unknown(work, known):
    """Without the effect in the library; the negative control has it, and a record that misses nothing is clean."""
    unknown = without_contacts(work)
    assert unknown.outside_probability > 0.99
    assert [one.where for one in unknown.outside_places(0.99)] == [{"node": FAULTY}]
    assert known.outside_probability < 0.01 and known.best.named == {f"rub, node {FAULTY}"}
    assert sum(share for _, share in known.posterior()) + known.outside_probability == pytest.approx(1.0)
    assert begun(is_clean=True).outside_probability < 0.1


def test_a_force_that_nothing_shows_is_as_likely_as_before_the_measurement(work):
    """At no harmonic there is one; the negative control touches a ring."""
    exact = begun(is_clean=True, is_exact=True)
    before = np.log(free_force.PRIOR / len(exact.free_forces) / len(free_force.SHARES))
    assert [one.log_odds for one in exact.free_forces] == pytest.approx(len(exact.free_forces) * [before], abs=1e-3)
    assert min(one.log_odds for one in work.free_forces) > before + 100


def test_each_harmonic_of_a_force_is_as_likely_as_not_absent():
    """Present, absent where a force a tenth as large would be seen, and one at which nothing would be (control)."""
    gram = np.diag([0.0, *[1e12] * 2, *[1e12] * 2, *[0.0] * 2])
    at = np.repeat([0, 1, 2], 2)
    each = [free_force._log_prior(np.array(sizes), gram, at) for sizes in ([1.0, 0, 0], [1.0, 1.0, 0], [0, 0, 0])]
    scales = len(free_force.SCALES)
    assert each == pytest.approx([-np.log(4 * scales), -2 * np.log(2 * scales), 0.0], abs=1e-3)


def test_a_fault_that_the_library_lacks_does_not_widen_the_set_of_those_that_it_has(work, known):
    """It is told beside them. Negative control: all of them hold the true one for certain."""
    rival = work.free_forces[0]._replace(log_odds=odds_of(known.best) - 3.0)
    doubtful = replace(known, free_forces=(rival,))
    assert 0.01 < doubtful.outside_probability < 0.1
    assert [one.named for one, _ in doubtful.credible(0.99)] == [known.best.named]
    assert len(doubtful.credible(2.0)) > 1


def test_a_force_as_free_as_the_data_is_judged_by_its_evidence():
    """One orbit does not tell where it acts, but that no cause of a library does; negative control: with the cause."""
    work = begun(model=build_model(RIG | {"effects": [UNBALANCE], "sensors": [5]}))
    unknown, known = without_contacts(work), search(work)
    assert unknown.outside_probability > 0.99 and len(unknown.outside_places(0.9)) > 10
    assert {c.effect for c in known.best.causes} == {"rub"} and known.outside_probability < 0.01


def test_two_faults_are_proposed_at_the_two_places_where_forces_explain_most():
    """A bow and a preload, each judged beside a free force at the place of the other.

    Negative control: at one place, no force explains them.
    """
    bow = {"kind": "bow", "element": 2, "label": "a", "bow_angle_rad": 1e-3, "bow_angle_skew_rad": 0.0}
    preload = {"kind": "static_preload", "node": OTHER, "label": "b", "static_preload_N": 400.0}
    both = faulty(MODEL, bow, preload | {"static_preload_phase_rad": 2.0})
    settings = Settings(uncertainty={"default": 0.02}, nuisance={})
    data = with_model_error(spectrum_of(both, SPEEDS, HARMONICS, 1e-6, 1), settings)
    work = begin(MODEL, data, settings)
    assert work.free_forces[0].left > 2 * data.data_count
    (one, errors), (other, _) = free_force.two_forces(work)
    assert {free_force.FREE_FORCE, free_force.OTHER_FORCE} < {*one.names} and len(errors) == data.data_count
    assert max(one.misfit, other.misfit) < 2 * data.data_count
    named = {frozenset(c.cause for c in proposal.causes) for proposal in pairs(work)}
    assert {"bow, element 2", f"static_preload, node {OTHER}"} in named and len(named) <= PAIRS


def test_where_there_is_one_place_there_are_no_pairs():
    settings = Settings(uncertainty={"default": 0.02}, nuisance={})
    model = jeffcott(effects=[])
    both = faulty(model, {"kind": "static_preload", "label": "b", "static_preload_N": 4.0})
    data = with_model_error(spectrum_of(both, SPEEDS, HARMONICS, NOISE, 1), settings)
    assert pairs(begin(model, data, settings)) == []
