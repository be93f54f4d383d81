"""A shaft on two journals, and all bearings of the zoo side by side."""

import numpy as np
import pytest
from machines import disc, film, rig_of, shaft, unbalance

from jobs.bearing_figures import bearing_coefficients, plot_bearing_coefficients
from rotorstudy import build_model, eigenvalues, harmonic_response, registry, stability_threshold

SHAFT = shaft(1.0, 4, disc(3, 80.0, 0.9, 0.5), outer_diameter_m=0.06)
BEARINGS = registry().plugins["bearing"].values()


def journals(viscosity=0.05):
    """A shaft on two journals, which share its weight by default."""
    film_ = film(0.1, 0.03, 1e-4, viscosity)
    bearings = [{**film_, "node": node, "label": f"{node}"} for node in (1, 5)]
    return build_model(rig_of(SHAFT, bearings, unbalance(3, 1e-5, mass_kg=80.0), sensors=[1, 3, 5]))


def test_unbalance_on_journals_goes_backward_too_and_oil_whip_starts_near_twice_the_first_mode():
    model = journals()
    forward, backward = np.abs(harmonic_response(model, [100.0], [1, -1])[0, :, model.structure.index(3)])
    assert forward > backward > 1e-3 * forward
    threshold = stability_threshold(model, 2000.0)
    values = eigenvalues(model, [threshold])[0]
    whirl = abs(values[np.argmax(values.real)].imag)
    assert 0.45 < whirl / threshold < 0.52
    for factor, grows in ((0.99, False), (1.01, True)):
        assert bool(eigenvalues(model, [factor * threshold]).real.max() > 0) is grows


def test_every_bearing_is_compared_and_a_speed_it_refuses_is_left_out():
    data = bearing_coefficients(BEARINGS, np.array([50 * np.pi, 900.0, 1200.0]))
    assert list(data.bearing.values) == sorted(plugin.name for plugin in BEARINGS)
    journal = data.sel(bearing="short_journal").isel(speed=0)  # the textbook's example, see test_film_bearings
    assert journal.stiffness.values / 1e6 == pytest.approx([8.815, 25.06, -16.39, 12.81], rel=4e-4)
    assert journal.damping.values / 1e3 == pytest.approx([294.9, 81.92, 81.92, 232.9], rel=3e-4)
    table = data.stiffness.sel(bearing="speed_tabulated", direction="xx").values  # ends at 1000 rad/s
    assert table[:2] == pytest.approx(np.interp([50 * np.pi, 900.0], [0, 1000], [3e5, 2e5])) and np.isnan(table[2])
    assert data.stiffness.attrs["units"] == "N/m" and data.damping.attrs["units"] == "N s/m"
    picture = plot_bearing_coefficients(data)
    assert len(picture.axes) == 2 * len(BEARINGS)
    assert all("(" in panel.get_ylabel() for panel in picture.axes)
