"""The motion from the receptances of the rotor without its bearings is that of the whole system of equations."""

import numpy as np
import pytest
from machines import disc, rig_of, shaft, springs, unbalance
from scipy.linalg import eigh

from rotorstudy import build_model, harmonic_response_and_jacobian
from rotorstudy.response import harmonic, solving
from rotorstudy.response.harmonic import positions
from rotorstudy.response.neighbourhood import Neighbourhood

SPEED, HARMONICS = np.array([60.0, 150.0, 400.0]), (0, 1, -1, 2, -2)
ADJOINT = 1e-8  # relative: the forces are not those of a motion, so that digits of the stiff elements are lost
AGREES = 1e-10  # relative: of 16 digits some four are lost, by the stiffness of bearings over that of a shaft


def rotor(*effects, count=6):
    shape, bearings = shaft(0.6, count, disc(3, 2.0, 5e-3, 2e-3)), springs((1, 1 + count), (2e6, 5e6), (300.0, 200.0))
    return build_model(rig_of(shape, bearings, unbalance(3, 1e-5), *effects, sensors=[3, 5]))


LOSSY = {"kind": "internal_damping", "node": 3, "internal_damping_N_s_per_m": 20.0}
SHAFT = {"kind": "shaft_damping", "shaft_damping_s": 1e-5}  # on all coordinates


def both_ways(model, monkeypatch, speed=SPEED):
    """Response and derivatives by the receptances, by the whole system, and whether the first were used."""
    used, own = [], solving.on_bearings
    monkeypatch.setattr(solving, "on_bearings", lambda *given: used.append(found := own(*given)) or found)
    fast = harmonic_response_and_jacobian(model, speed, HARMONICS)
    monkeypatch.setattr(solving, "are_few", lambda *_: False)
    return fast, harmonic_response_and_jacobian(model, speed, HARMONICS), bool(used)


@pytest.mark.parametrize("effects", [(), (SHAFT,), (SHAFT, {"kind": "unbalance", "node": 5, "label": "b",
                                                            "eccentricity_m": 2e-6})])  # fmt: skip
def test_it_is_that_of_the_whole_system(effects, monkeypatch):
    fast, whole, used = both_ways(rotor(*effects), monkeypatch)
    assert used
    for one, other in zip(fast, whole, strict=True):
        assert one == pytest.approx(other, rel=0, abs=AGREES * np.abs(other).max())


@pytest.mark.parametrize("effects", [(), (SHAFT,)])
def test_a_slender_shaft_is_solved_by_its_band(effects, monkeypatch):
    """30 short elements, whose stiffness is a million times that of the shaft: as many digits fewer are kept."""
    model = rotor(*effects, count=30)
    fast, whole, used = both_ways(model, monkeypatch)
    assert used
    for one, other in zip(fast, whole, strict=True):
        assert one == pytest.approx(other, rel=0, abs=100 * AGREES * np.abs(other).max())
    monkeypatch.setattr(harmonic, "NUMBERS_AT_ONCE", 1)
    parts = harmonic_response_and_jacobian(model, SPEED, HARMONICS)
    for one, other in zip(parts, whole, strict=True):
        assert one == pytest.approx(other, rel=0, abs=100 * AGREES * np.abs(other).max())


def test_where_the_rotor_resonates_without_its_bearings_the_whole_system_is_solved(monkeypatch):
    """At that speed the receptances are lost: with the springs alone, nothing damps a mode at -1X."""
    model = rotor()
    structure = model.structure
    own = eigh(structure.supported_stiffness, structure.mass + structure.gyroscopic, eigvals_only=True)
    speed = np.sqrt(own[:1])  # K + S - w^2 M - w^2 G is singular
    fast, whole, used = both_ways(model, monkeypatch, speed)
    assert not used
    assert np.array_equal(fast.response, whole.response)


@pytest.mark.parametrize(("harmonics", "needed"), [((1, 2), False), ((0, 1), True)])
def test_the_deflection_is_solved_only_where_a_force_depends_on_it(harmonics, needed, monkeypatch):
    """Internal damping has a static force across the deflection, which moves the mean alone."""
    model, asked, own = rotor(LOSSY), [], harmonic.static_deflection
    expected = harmonic_response_and_jacobian(model, SPEED, (0, 1, 2))
    monkeypatch.setattr(harmonic, "static_deflection", lambda *given, **more: asked.append(1) or own(*given, **more))
    found = harmonic_response_and_jacobian(model, SPEED, harmonics)
    assert bool(asked) is needed
    for one, other in zip(found, expected, strict=True):
        assert one == pytest.approx(other[:, list(harmonics)], rel=1e-9, abs=1e-12 * np.abs(other).max())


ASYMMETRIC = {"kind": "shaft_asymmetry", "element": 4, "shaft_asymmetry": 0.2}


@pytest.mark.parametrize("count", [6, 30])
@pytest.mark.parametrize("effects", [(), (LOSSY, SHAFT), (ASYMMETRIC, LOSSY)])
def test_forces_anywhere_show_at_the_sensors_what_the_adjoint_system_says(effects, count):
    """Against the motion by these forces, also where a shaft is solved by its band and where coefficients turn."""
    cross = {"kind": "cross_coupling", "node": 3, "cross_coupling_N_per_m": 3e4}
    near = Neighbourhood(rotor(cross, *effects, count=count), SPEED, (0, 1, -2), order=4)
    random, shape = np.random.default_rng(1), near.motion.amplitude.shape
    force = random.normal(size=shape) + 1j * random.normal(size=shape)
    (moved,) = near.moved_by(force[None])
    shown = near.model.seen(moved[:, positions(near.harmonics, near.blocks)])
    parts = np.moveaxis(force, 1, -1).copy().view(float)  # (speed, dof, component)
    found = np.einsum("wdc,dwcx->wx", parts, near.shown_by_units).reshape(shown.shape)
    assert found == pytest.approx(shown, rel=0, abs=ADJOINT * np.abs(shown).max())
