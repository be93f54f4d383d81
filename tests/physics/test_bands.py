"""Systems of a slender shaft by their band against dense ones, the deflection they need, and the adjoint system."""

import numpy as np
import pytest
from machines import disc, rig_of, shaft, springs, unbalance

from rotorstudy import build_model, harmonic_response_and_jacobian
from rotorstudy.response import factorised, harmonic, solving
from rotorstudy.response.factorised import factorised_bands
from rotorstudy.response.harmonic import positions
from rotorstudy.response.neighbourhood import Neighbourhood
from rotorstudy.response.statics import static_deflection

SPEED, HARMONICS = np.array([60.0, 150.0, 400.0]), (0, 1, -1, 2, -2)
ADJOINT = 1e-8  # relative: the forces are not those of a motion, so that digits of the stiff elements are lost
AGREES = 1e-10  # relative


def rotor(*effects, count=6, **sections):
    shape, bearings = shaft(0.6, count, disc(3, 2.0, 5e-3, 2e-3)), springs((1, 1 + count), (2e6, 5e6), (300.0, 200.0))
    return build_model(rig_of(shape, bearings, unbalance(3, 1e-5), *effects, sensors=[3, 5], **sections))


LOSSY = {"kind": "internal_damping", "node": 3, "internal_damping_N_s_per_m": 20.0}
SHAFT = {"kind": "shaft_damping", "shaft_damping_s": 1e-5}  # on all coordinates
FEET = [{**one, "mass_kg": 30.0} for one in springs({1: "a", 31: "b"}, (8e6, 5e6), (1e3, 2e3))]


@pytest.mark.parametrize("more", [{}, {"foundation": FEET}], ids=["on the ground", "on feet"])
@pytest.mark.parametrize("effects", [(), (SHAFT,)])
def test_a_slender_shaft_is_solved_by_its_band(effects, more, monkeypatch):
    """30 short elements, whose stiffness is a million times that of the shaft: as many digits are lost, of 16."""
    model, used = rotor(*effects, count=30, **more), []

    def found():
        parts = harmonic_response_and_jacobian(model, SPEED, HARMONICS)
        return *parts, static_deflection(model, SPEED, model.theta).value

    monkeypatch.setattr(solving, "factorised_bands", lambda *given: used.append(1) or factorised_bands(*given))
    by_band = found()
    monkeypatch.setattr(harmonic, "NUMBERS_AT_ONCE", 1)
    in_parts = found()
    assert used
    for module in (solving, factorised):
        monkeypatch.setattr(module, "has_narrow_band", lambda *_: False)
    used.clear()
    by_dense = found()
    assert not used
    for one, parts, whole in zip(by_band, in_parts, by_dense, strict=True):
        assert one == pytest.approx(whole, rel=0, abs=AGREES * np.abs(whole).max())
        assert parts == pytest.approx(whole, rel=0, abs=AGREES * np.abs(whole).max())
    assert by_band[-1] == pytest.approx(by_dense[-1], rel=AGREES, abs=0)


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
