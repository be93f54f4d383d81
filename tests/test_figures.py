"""Figures fit on a page and on a screen, their texts inside; phases of 180 and -180 degrees stand side by side."""

from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

from rotorstudy.measurement.conventions import Conventions
from rotorstudy.presentation.diagnosis_figures import in_words, some_speeds
from rotorstudy.presentation.plots import STYLE, figure, save_figure
from rotorstudy.presentation.probe_figures import APART, probe_picture, spread
from thesis.figures.estimates import bias, errors_and_bounds
from thesis.figures.full_spectra import phases_near, phases_of

TALLEST = 1800  # pixels; shown at half its size a figure then fits in a window of 900
LONG = "A title of many words that is a good deal wider than one column of a journal can ever show"


def names(count):
    return [f"parameter_{i}" for i in range(count)]


def test_phases_are_moved_beside_those_they_are_compared_with():
    assert np.allclose(phases_near([-179.0, 10.0, 179.0], np.array([180.0, 20.0, -180.0])), [181.0, 10.0, -181.0])
    # half a revolution apart there is no beside; and none leaves the axis
    assert np.allclose(phases_near([-90.0], np.array([170.0])), [-90.0])
    amplitude = np.exp(1j * np.deg2rad([-178.0, 0.0, 45.0]))
    assert np.allclose(phases_of(amplitude, -np.ones(3) + 1e-3j, [-1, 0, 1], [1, -1]), [45.0, 182.0])


def test_errors_of_many_parameters_fit_in_a_window():

    def scattered(n):
        """A study with n parameters."""
        dims = ("noise_model", "estimator", "parameter", "noise", "trial")
        found = {"estimate": (dims, np.full((1, 2, n, 2, 3), 1.1)), "true": (("parameter",), np.ones(n))}
        found["cramer_rao"] = ("noise_model", "parameter", "noise"), np.full((1, n, 2), 0.05)
        labels = {"noise_model": ["white"], "estimator": ["a", "b"], "parameter": names(n), "noise": [1.0, 5.0]}
        return xr.Dataset(found, labels)

    few, many = scattered(6), scattered(14)
    wrong = xr.Dataset(
        {"relative_error": (("known", "case", "estimator", "parameter", "percent"), np.ones((2, 1, 2, 14, 3)))},
        {"known": ["mass_kg", "youngs_modulus_Pa"], "case": ["c"], "estimator": ["a", "b"], "parameter": names(14),
         "percent": [-1.0, 1.0, 5.0]},
    )  # fmt: skip
    units = dict.fromkeys(names(14), "N s/m")
    config = SimpleNamespace(reported=units)
    given = {"one": few}, {"one": few, "two": few}, {"one": many, "two": many}
    pictures = [errors_and_bounds(one, units, "few or many") for one in given]
    for picture in (*pictures, bias(config, wrong, "bias", {"c": "a case"})):
        assert picture.get_size_inches()[1] * STYLE["savefig.dpi"] <= TALLEST
        plt.close(picture)


def test_labels_of_probes_that_are_close_do_not_cover_each_other():
    given = [0.8, 0.8, 0.97, -0.8]  # the phase mark at a probe, another ten degrees beside it
    found = np.sort(spread(given) % (2 * np.pi))
    assert np.diff([*found, found[0] + 2 * np.pi]).min() >= APART
    assert spread(given)[3] == -0.8  # one that stands alone stays
    assert np.array_equal(spread([0.0, 2.0]), [0.0, 2.0]) and np.array_equal(spread([1.0]), [1.0])


def test_the_title_above_the_probes_of_one_node_fits():
    given = {"probes": [{"channel": "probe", "node": 1, "angle_deg": 45}], "rotation": "against_angles"}
    picture = probe_picture(Conventions.model_validate(given), [1])
    assert inside(picture, picture._suptitle)
    plt.close(picture)


def test_options_of_an_explanation_are_labelled_with_their_units():
    keys = "pedestal_resonance, node 1, natural_frequency_rad_per_s 3772, frequency_ratio 2.5, bearing_time_s 5.74e-04"
    words = "pedestal resonance, node 1, natural frequency 36000 rpm, frequency ratio 2.5, bearing time 0.574 ms"
    assert in_words(keys) == words
    both = in_words("rub, clearance_m 5e-05 + support_loss, direction_rad -1.327")
    assert both == "rub, clearance 50 µm + support loss, direction -76 °"
    crack = in_words("transverse_crack, position_m 0.21, closing_moment_N_m 3")
    assert crack == "transverse crack, position 210 mm, closing moment 3 N m"
    assert in_words("runout, harmonic -1") == "runout, harmonic -1"


def test_of_hundreds_of_speeds_a_picture_shows_some():
    data = xr.Dataset(coords={"speed": np.linspace(50.0, 400.0, 460)})
    shown = some_speeds(data, 40).speed.values
    assert len(shown) == 40 and (shown[0], shown[-1]) == (50.0, 400.0) and np.ptp(np.diff(shown)) < 1.0
    assert some_speeds(data.isel(speed=slice(9)), 40).sizes["speed"] == 9


def inside(picture, text):
    picture.draw_without_rendering()  # else where the last file had it, which may have another resolution
    seen, whole = text.get_window_extent(), picture.get_window_extent()
    return whole.x0 <= seen.x0 and seen.x1 <= whole.x1


@pytest.mark.parametrize("place", ["figure", "panel", "axis"])
def test_a_text_wider_than_the_figure_is_broken_into_lines(place, tmp_path):
    picture, axes = figure()
    write = {"figure": picture.suptitle, "panel": axes[0, 0].set_title, "axis": axes[0, 0].set_xlabel}[place]
    text = write(LONG)
    assert not inside(picture, text)
    save_figure(picture, tmp_path / "a.svg")
    assert inside(picture, text) and text.get_text().replace("\n", " ") == LONG
    short = write("A title that fits")
    save_figure(picture, tmp_path / "a.svg")
    assert short.get_text() == "A title that fits"


def test_a_title_over_a_narrow_panel_beside_long_labels_fits(tmp_path):
    picture, axes = figure(width=2.93)
    axes[0, 0].set_ylabel("hidden")
    axes[0, 0].set_yticks([0, 1], ["internal damping", "open crack form"])
    said = "First answer right in 91 % of cases of every size; box: right, dashed: declared confounder"
    text = axes[0, 0].set_title(said)
    save_figure(picture, tmp_path / "a.svg")
    assert inside(picture, text)


def test_a_logarithmic_axis_has_plain_numbers_up_to_a_hundred():
    picture, axes = figure()
    axes[0, 0].loglog([0.03, 500], [0.03, 5e4])
    picture.draw_without_rendering()
    labels = [text.get_text() for text in axes[0, 0].get_yticklabels()]
    assert any(label.endswith("{100}$") for label in labels) and any("10^{4}" in label for label in labels)
