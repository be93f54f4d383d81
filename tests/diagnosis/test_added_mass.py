"""A mass that is added weighs: it sags the rotor as much as it slows it, which no loss of stiffness does."""

import numpy as np
import pytest
from machines import SLOW, disc, readings, rig_of, shaft, unbalance

from rotorstudy import build_model, measured_response
from rotorstudy.diagnosis.search.candidates import candidates
from rotorstudy.diagnosis.search.odds import FURTHER_FAULT, PriorOdds, faults_of
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.investigate import investigate

pytestmark = pytest.mark.usefixtures("right_conventions")

SPEEDS, HARMONICS = np.array([120.0, 180.0, 240.0, 290.0, 420.0]), np.array([0, 1, -1, 2])
NOISE = 2e-8  # m, of each harmonic


def rig(disc_mass=2.0, gravity=9.81, effects=()):
    known = unbalance(3, 1e-5, mass_kg=2.0), {"kind": "external_damping", "node": 3, "external_damping_N_s_per_m": 40.0}
    rotor = shaft(0.6, 6, disc(3, disc_mass), pinned_nodes=[1, 7], gravity_m_per_s2=gravity)
    return rig_of(rotor, [], *known, *effects, sensors=[2, 3, 5])


def shown(built, nominal):
    """Harmonics of a rotor as probes show them that were zeroed on the nominal one at rest."""
    found = measured_response(built, SPEEDS, HARMONICS)
    sag = built.structure.static_deflection - nominal.structure.static_deflection
    found[:, list(HARMONICS).index(0)] += sag[nominal.measured]
    return found


@pytest.mark.parametrize("gravity", [9.81, 0.0])
def test_an_added_mass_is_a_rotor_built_with_it_and_sags_as_it(gravity):
    nominal, heavier = build_model(rig(gravity=gravity)), build_model(rig(2.05, gravity))
    item = {"kind": "added_mass", "node": 3, "added_mass_kg": 0.05}
    added = build_model(rig(gravity=gravity, effects=[item]))
    expected = shown(heavier, nominal)
    found = shown(added, nominal)
    assert np.abs(found - expected).max() < 1e-11 * np.abs(expected).max()
    still = list(HARMONICS).index(0)
    assert np.abs(found[:, still]).any() == (gravity > 0)  # negative control: a vertical rotor does not sag


SOFTER = {"kind": "support_stiffness", "node": 3, "support_stiffness_N_per_m": -8e3}


@pytest.mark.parametrize(
    ("built", "cause"),
    [
        (rig(2.05), "added_mass"),
        (rig(effects=[SOFTER]), "support_stiffness"),
        (rig(effects=[{"kind": "stiffness_error", "stiffness_error": -0.025}]), "stiffness_error"),
    ],
    ids=["mass", "softer support", "softer shaft"],
)
def test_fifty_grams_are_named_as_such_and_a_loss_of_stiffness_too(built, cause):
    verdict = diagnosed(built, {"default": 0.1, "rotor": 0.0})
    (found,) = verdict.causes
    assert found.effect == cause and found.where in ({"node": 3}, {}), verdict.summary
    assert verdict.verdict in ("cause", "ambiguous") and found.posterior_probability > 0.9
    # a seal of which the direct stiffness alone is felt is a support stiffness exactly
    assert {one.effect for one in verdict.ambiguous_with} <= (
        {"seal", "added_mass"} if cause == "support_stiffness" else set()
    )
    if cause == "added_mass":
        assert found.parameters["added_mass"].value == pytest.approx(0.05, rel=0.03)


def test_fifty_grams_are_among_the_causes_if_modulus_and_disc_mass_are_uncertain():
    """By half a per cent, as the plugin of the rotor states: with both, a softer support shows nearly the same."""
    verdict = diagnosed(rig(2.05), {"default": 0.1})
    assert "added_mass" in {cause.effect for cause in (*verdict.causes, *verdict.ambiguous_with)}


def diagnosed(built, uncertainty):
    """Verdict on a record of a rotor, by the nominal rig."""
    nominal = build_model(rig())
    found = shown(build_model(built), nominal)
    record = readings(found, SPEEDS, HARMONICS, nominal.sensors, NOISE / np.sqrt(2), 3)
    settings = {"most_causes": 1, "candidates_per_round": 3, "uncertainty": uncertainty, "leave_out": SLOW}
    return investigate(record, nominal, settings=settings).verdict


def test_the_unbalance_of_an_eccentric_mass_is_a_part_of_it():
    """As likely as not beside the mass at its node; elsewhere, or beside another cause, a fault of its own."""
    found, _ = candidates(build_model(rig()), Settings())
    cause = {(c.effect, c.where.get("node")): c for c in found if not c.shape}
    mass, here, elsewhere = cause["added_mass", 3], cause["unbalance", 3], cause["unbalance", 2]
    softer, prior = cause["support_stiffness", 3], PriorOdds(found, Settings(), build_model(rig()).structure)
    (parts,) = faults_of((here, mass)).values()
    assert [c.effect for c in parts] == ["added_mass", "unbalance"]
    assert len(faults_of((mass, elsewhere))) == len(faults_of((softer, here))) == 2
    assert prior.log_odds((mass, here)) == pytest.approx(prior.log_odds((mass,)) + np.log(0.5))
    alone = prior.log_odds((mass,)) + prior.log_odds((elsewhere,))
    assert prior.log_odds((mass, elsewhere)) == pytest.approx(alone + np.log(FURTHER_FAULT))
