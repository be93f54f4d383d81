"""Every effect and crack comes back from what it simulates, by every estimator that can."""

from dataclasses import replace

import numpy as np
import pytest
from two_rotors import CRACKS, HARMONICS, LOCAL, ROTORS, SPEEDS, parameters_of

from rotorstudy import Model, Problem, Spectrum, Term, make_term, measured_response, registry
from rotorstudy.errors import UnidentifiableError
from rotorstudy.measurement.spectrum import independent_covariance
from rotorstudy.model.cracks import crack_parameters
from rotorstudy.response.coupling import forced_harmonics

ROUND_TRIP = 1e-7  # relative: round-off 1e-16 of the largest harmonic, of which the weakest effect moves some 1e-7


@pytest.fixture(params=ROTORS)
def structure(request):
    return ROTORS[request.param]


def surroundings(structure):
    """Known terms that shake the rotor at many harmonics and damp it."""
    factors = dict.fromkeys(map(int, HARMONICS), 0.1)
    losses = registry().get("effect", "crack_force").function(structure, participation=factors)
    items = [
        {"kind": "external_damping", "external_damping_N_s_per_m": 100.0},
        {"kind": "unbalance", "eccentricity_m": 5e-6, "eccentricity_phase_rad": 0.5},
        {"kind": "crack_force", "participation": factors, **{p.key: p.typical for p in losses}},
    ]
    return tuple(make_term("effect", {**item, "label": "known"}, structure, structure.nodes) for item in items)


def round_trip(kind, parameters, structure, estimator, acts_on="rotor", share=0.7):
    """Estimated over true amplitudes minus one; the truth is a share of the typical values that a fit starts from."""
    values = {p.name: p.typical * (share * np.exp(0.5j) if p.is_complex else share) for p in parameters}
    sought = Term(kind, tuple(parameters), {}, acts_on, "checked")
    true = Model(structure, (*surroundings(structure), replace(sought, values=values)))
    model = Model(structure, (*surroundings(structure), sought))
    harmonics = np.union1d(HARMONICS, forced_harmonics(true))
    shown = measured_response(true, SPEEDS, harmonics)
    spectrum = Spectrum(shown, SPEEDS, harmonics, true.sensors, independent_covariance(np.zeros(shown.shape)))
    names = model.unknown_names()
    expected = true.theta[true.position(names)]
    return registry().get("estimator", estimator).function(Problem(model, spectrum, names)).theta / expected - 1


AFFINE = [
    effect
    for effect in registry().plugins["effect"].values()
    if effect.name not in LOCAL and not effect.changes_bearing
]


PLACED = [(e, name) for e in AFFINE for name, rotor in ROTORS.items() if e.places(rotor, rotor.nodes)]


def test_only_what_acts_on_tilts_finds_no_place_on_a_rotor():
    """So that the test below leaves nothing out that it could try."""
    without = {(e.name, name) for e in AFFINE for name in ROTORS} - {(e.name, name) for e, name in PLACED}
    assert {name for _, name in without} == {n for n, s in ROTORS.items() if not any(m == "tilt" for _, m in s.dofs)}
    assert {name for name, _ in without} == {"angular_misalignment", "couple_unbalance", "gyroscopic_error"}


@pytest.mark.parametrize(("effect", "rotor"), PLACED, ids=lambda part: getattr(part, "name", part))
def test_effect_comes_back_on_every_rotor_by_every_estimator_that_can(effect, rotor):
    structure = ROTORS[rotor]
    output = effect.acts_on == "output"
    # free crack forces at all harmonics cannot be told apart on the disc that tilts: see the next test
    options = {"harmonics": [1, 3, -1]} if effect.name == "crack_force" else {}
    places = effect.places(structure, structure.nodes)
    # a fit for two losses of a full crack has another minimum 40 % off
    share = 0.95 if effect.name == "breathing_crack" and len(structure.dofs) > 1 else 0.7
    parameters = parameters_of(effect.name, structure, **places[0], **options)
    reads = [np.any(e.matrix[:, 1:]) for p in parameters for e in p.entries if e.reads_motion or e.on == "static"]
    for estimator in ["maximum_likelihood"] if output or any(reads) else ["least_squares", "maximum_likelihood"]:
        off = round_trip(effect.name, parameters, structure, estimator, effect.acts_on, share)
        assert np.abs(off).max() < ROUND_TRIP


def test_both_parts_of_a_complex_amplitude_without_value_are_unknown():
    term = make_term("effect", {"kind": "unbalance"}, ROTORS["plain"], (1,))
    assert Model(ROTORS["plain"], (term,)).unknown_names() == ("eccentricity_real", "eccentricity_imag")


@pytest.mark.parametrize("n", [0, 2])
def test_free_crack_forces_are_refused_where_the_speed_cannot_tell_deflection_and_tilt_apart(n):
    """At 0X, and at 2X for a polar moment twice the diametral one, the tilt has no inertia: one shape at all speeds."""
    parameters = registry().get("effect", "crack_force").function(ROTORS["tilting"], harmonics=[1, n])
    with pytest.raises(UnidentifiableError, match="trade off") as refused:
        round_trip("crack_force", parameters, ROTORS["tilting"], "least_squares")
    assert refused.value.parameters == tuple(f"stiffness_loss_{k}_p{n}[checked]" for k in ("22", "44"))


@pytest.mark.parametrize("crack", CRACKS, ids=lambda c: c.name)
@pytest.mark.parametrize("estimator", ["least_squares", "maximum_likelihood"])
def test_crack_comes_back(crack, structure, estimator):
    parameters = crack_parameters(crack, structure, **crack.example)
    if len(parameters) > 1 and {entry.shift for entry in parameters[0].entries} <= {0, 2}:
        with pytest.raises(UnidentifiableError, match="trade off"):  # as two tests above
            round_trip(crack.name, parameters, structure, estimator)
        return
    assert np.abs(round_trip(crack.name, parameters, structure, estimator)).max() < ROUND_TRIP


@pytest.mark.parametrize("crack", CRACKS, ids=lambda c: c.name)
@pytest.mark.parametrize("estimator", ["least_squares", "maximum_likelihood"])
def test_crack_in_full_comes_back(crack, estimator):
    """Without weight dominance; every harmonic is measured, so that the equations are linear in it."""
    parameters = crack_parameters(crack, ROTORS["plain"], weight_dominance=False, **crack.example)
    assert np.abs(round_trip(crack.name, parameters, ROTORS["plain"], estimator)).max() < ROUND_TRIP


def test_a_table_that_changes_between_simulation_and_identification_does_not_come_back():
    (parameter,) = registry().get("effect", "internal_damping").function(ROTORS["plain"])
    calls = iter(range(10**6))
    fickle = [replace(entry, gain=lambda speed: (1 + next(calls)) * np.ones_like(speed)) for entry in parameter.entries]
    found = round_trip("fickle", [replace(parameter, entries=tuple(fickle))], ROTORS["plain"], "least_squares")
    assert np.abs(found).max() > 1e-3
