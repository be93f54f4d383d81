"""The stability margin in closed form, and what is said of it."""

import re

import numpy as np
import pytest
from machines import disc, film, jeffcott_rig, point, rig_of, shaft, springs
from test_random_rotor import in_frequency, rewritten

from rotorstudy import build_model
from rotorstudy.presentation.rotor_page import summary
from rotorstudy.response.whirl import Modes, damped_modes, time_invariant
from rotorstudy.studies.rotor_analysis import analyse_rotor
from rotorstudy.studies.stability_margin import first_forward, stability_margin

MASS, STIFFNESS, DAMPING = 2.0, 7.6e5, 60.0
JEFFCOTT = jeffcott_rig(None, external=DAMPING, rotor=point(MASS, STIFFNESS))
FREQUENCY = (STIFFNESS / MASS) ** 0.5


def test_the_margin_of_a_jeffcott_rotor():
    """Its decrement is 2 pi zeta / sqrt(1 - zeta^2); cross-coupling of c w_n takes it to zero (Alford 1965)."""
    found = stability_margin(build_model(JEFFCOTT), 400.0)
    zeta = DAMPING / (2 * MASS * FREQUENCY)
    assert found.log_decrement == pytest.approx(2 * np.pi * zeta / np.sqrt(1 - zeta**2), rel=1e-9)
    assert found.cross_coupling == pytest.approx(DAMPING * FREQUENCY, rel=1e-5)
    assert found.frequency == pytest.approx(FREQUENCY * np.sqrt(1 - zeta**2), rel=1e-9)
    swirl = {"kind": "cross_coupling", "cross_coupling_N_per_m": 1.01 * DAMPING * FREQUENCY}
    unstable = build_model(JEFFCOTT | {"effects": [*JEFFCOTT["effects"], swirl]})
    assert stability_margin(unstable, 400.0).cross_coupling == 0.0


@pytest.mark.parametrize("elements", [2, 24])
def test_a_rotor_without_damping_has_no_margin(elements):
    """Not the round-off of its eigenvalues, up to 5e-11 of them. Negative control: a decrement of 3e-6 has one."""

    def rig(damping):
        stations = disc(2, 3.0, 4e-3, 2e-3)
        return rig_of(shaft(1.0, elements, stations, outer_diameter_m=0.05), springs((1, elements + 1), 1e5, damping))

    found = stability_margin(build_model(rig(0.0)), 400.0)
    assert (found.log_decrement, found.cross_coupling) == (0.0, 0.0)
    text = said(rig(0.0), (400.0, 500.0))
    assert "logarithmic decrement 0;" in text and "to oppose cross-coupling: the margin is zero" in text
    assert stability_margin(build_model(rig(1e-3)), 400.0).cross_coupling > 0


def test_the_margin_is_that_of_the_first_forward_mode_where_another_one_lacks_damping():
    """The second mode of a shaft has a node at midspan, where the only damper is: hardly any swirl makes it grow."""
    discs = [disc(node, 3.0, 4e-3, 2e-3) for node in (2, 4)]
    damper = {"kind": "external_damping", "node": 3, "external_damping_N_s_per_m": 50.0}
    rig = rig_of(shaft(1.0, 4, *discs, outer_diameter_m=0.03, pinned_nodes=[1, 5]), [], damper)
    found = stability_margin(build_model(rig), 200.0)
    swirl = {"kind": "cross_coupling", "node": found.node, "cross_coupling_N_per_m": found.cross_coupling}
    swirled = build_model(rig | {"effects": [damper, swirl]})
    modes = Modes(*(part[0] for part in damped_modes(swirled, [200.0], 8)))
    first, growing = first_forward(modes, 200.0), modes.eigenvalue.real > 1e-6 * modes.frequency
    assert abs(modes.eigenvalue[first].real) < 1e-6 * modes.frequency[first] and 0.05 < found.log_decrement < 0.2
    assert modes.frequency[growing].min() > 2 * modes.frequency[first]  # negative control: the second has long grown


def test_a_part_that_is_stated_in_frequency_only_acts_at_the_frequency_of_the_mode():
    """A damper of gain j w c does as one of c d/dt; its share is not left out, nor that of a hysteretic one, K eta."""
    model = build_model(JEFFCOTT)
    there = rewritten(model, in_frequency)
    found, true = stability_margin(there, 400.0), stability_margin(model, 400.0)
    assert np.allclose(found, true, rtol=1e-6)
    assert time_invariant(there).names != model.names  # negative control
    loss = {"kind": "hysteretic_damping", "loss_factor": 0.01}
    found = stability_margin(build_model(jeffcott_rig(None, rotor=point(MASS, STIFFNESS)) | {"effects": [loss]}), 400.0)
    assert found.log_decrement == pytest.approx(0.01 * np.pi, rel=1e-3)


def test_the_first_forward_mode_is_the_least_damped_one_below_the_speed():
    """A mode of the shaft far above, however little damped, is driven by no swirl; nor is a backward one."""
    frequency, mixed, forward = np.array([50.0, 120.0, 210.0, 9000.0]), np.array([0.9, -0.9, 1.0, 1.0]), np.ones(4)

    def first(speed, direction, ratio=(0.3, 0.01, 0.05, 0.001)):
        decay = np.divide(ratio, np.sqrt(1 - np.square(ratio)))
        return first_forward(Modes(frequency * (1j - decay), None, None, direction), speed)

    assert first(400.0, mixed) == 2
    assert first(40.0, mixed) == 0
    assert first(400.0, -forward) is None
    assert first(40.0, forward, (0.95, 0.01, 0.01, 0.01)) == 1  # the first is no whirl
    # of a shaft on supports of two stiffnesses, whose low modes are thin ellipses, or lines, and not one far above
    assert first(100.0, np.array([-1e-3, 1e-3, 0.1, 0.9])) == 1
    assert first(100.0, np.array([-1e-17, 1e-17, 0.0, 0.9])) == 0
    assert first(400.0, np.array([-0.1, 0.1, 0.9, 1.0])) == 1  # nor the next one below the speed, which is damped more


def said(rig, operating):
    model = build_model(rig)
    analysis = analyse_rotor(model, None, 2 * operating[1])
    margin = stability_margin(model, operating[1])
    return " ".join(summary(analysis._replace(operating=operating, margin=margin)))


def test_a_sentence_for_each_margin():
    assert "is inside the operating range: too near, API 617 asks for" in said(JEFFCOTT, (500.0, 700.0))
    near = said(JEFFCOTT, (650.0, 700.0))
    assert re.search(r"The critical speed 588\d(\.\d)? rpm is 5.\d+ % below the operating range: too near", near)
    far = said(JEFFCOTT, (900.0, 1100.0))
    assert "31.5 % below the operating range; API 617 asks for" in far and "Oil whirl" not in far
    slow = said(JEFFCOTT, (1200.0, 1250.0))  # its mode is at 0.49 of the speed and little damped, but on no film
    assert "takes it to zero" in slow and "Oil whirl" not in slow


@pytest.mark.parametrize(("load", "warned"), [(30.0, True), (3000.0, False)])
def test_oil_whirl_is_said_in_words(load, warned):
    """Of a light rotor, whose journals run near the middle of their films; not of films that are loaded more."""
    films = [film(0.05, 0.02, 5e-5, 0.005, load_N=load, node=node, label=str(node)) for node in (1, 3)]
    text = said({"rotor": shaft(0.6, 2, outer_diameter_m=0.08), "bearings": films}, (500.0, 600.0))
    assert ("Oil whirl: a forward mode near half of the speed" in text) == warned
