"""What readers see: figures that fit, tables with order and units, numbers as people read them, sound pages."""

from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from page_checks import BROWSER, problems_of_text, problems_seen, seen_in_browser

from rotorstudy import RotorstudyError
from rotorstudy.measurement.conventions import Conventions
from rotorstudy.model.shown_units import asked, shown_for
from rotorstudy.presentation.diagnosis_figures import in_words, some_speeds
from rotorstudy.presentation.pages import Table, cells, render, to_index, write_html
from rotorstudy.presentation.plots import STYLE, figure, save_figure
from rotorstudy.presentation.probe_figures import APART, probe_picture, spread
from rotorstudy.units import ends_of_interval, interval, number, p_value, percent, quantity, spins, um, with_interval
from thesis.figures.estimates import bias, errors_and_bounds
from thesis.figures.full_spectra import phases_near, phases_of
from thesis.scoreboard import in_table_order, side_by_side

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


def scored(**columns):
    base = {"table": "5.6", "case": "15 Hz", "item": "1", "unit": "m", "published": 1e-5, "computed": 2e-5}
    return pd.DataFrame({key: [value] for key, value in {**base, "status": "explained", **columns}.items()})


def test_tables_stand_in_the_order_people_count():
    names = ["4.10", "5.6", "4.9", "5.5", "2.2"]
    ordered = in_table_order(pd.concat([scored(table=name) for name in names]))
    assert list(ordered.table) == ["2.2", "4.9", "4.10", "5.5", "5.6"]


def test_lengths_are_shown_in_micrometres_and_nothing_else_is():
    both = pd.concat([scored(), scored(case="phase", unit="rad", published=1.0, computed=2.0)], ignore_index=True)
    shown = side_by_side(both, ["item"], ["case"])
    assert shown["15 Hz (µm): thesis"].item() == 10.0 and shown["15 Hz (µm): here"].item() == 20.0
    assert shown["phase (rad): here"].item() == 2.0
    assert both.computed[0] == 2e-5


def test_numbers_are_marked_rounded_and_written_out(tmp_path):
    table = pd.DataFrame({"a": [63637.4, np.nan], "b": ["x < y", None], "c": ["long " * 30, ""]})
    write_html(tmp_path / "page.html", Table(table, "Title", "Note.", 4, {"Heading": table}))
    page = (tmp_path / "page.html").read_text()
    assert '<th scope="col">a</th>' in page and "<h2>Heading</h2>" in page and 'name="viewport"' in page
    assert '<td class="number">63640</td>' in page and '<td class="number"></td>' in page
    assert '<td class="short">x &lt; y</td>' in page and '<td class="long">' in page


def test_a_note_can_be_a_list_of_points(tmp_path):
    write_html(tmp_path / "page.html", Table(pd.DataFrame({"a": [1]}), "Title", ["First.", "One.", "Two."]))
    assert "<p>First.</p>\n<ul>\n<li>One.</li>\n<li>Two.</li>\n</ul>\n" in (tmp_path / "page.html").read_text()


def test_columns_of_one_quantity_stand_under_one_heading_and_symbols_keep_their_form(tmp_path):
    table = pd.DataFrame(
        {"item": [1], "c_H (N s/m): thesis": [20.5], "c_H (N s/m): here": [20.0], "noise_percent": [1]}
    )
    write_html(tmp_path / "page.html", Table(table, "Title", "Note."))
    page = (tmp_path / "page.html").read_text()
    assert '<th scope="colgroup" colspan="2">c_H (N s/m)</th>' in page
    assert '<th scope="col">thesis</th><th scope="col">here</th><th scope="col">noise (%)</th>' in page
    assert cells(table[["item"]])["groups"] == [] == cells(table.iloc[:, :2])["groups"]  # one column is no group


def test_a_long_text_can_stand_below_its_row(tmp_path):
    table = pd.DataFrame({"value": [1.0, 2.0], "status": ["explained", "reproduced"], "reason": ["round-off", np.nan]})
    write_html(tmp_path / "page.html", Table(table, "Title", below="reason"), {"All results": "../index.html"})
    page = (tmp_path / "page.html").read_text()
    assert page.count('<td class="below" colspan="2"><div>round-off</div>') == page.count('class="below"') == 1
    assert '<th scope="col">reason</th>' not in page and '<td class="short doubtful">explained</td>' in page
    assert '<a href="../index.html">All results</a>' in page


def test_a_page_links_to_the_index_from_its_folder():
    assert to_index("results/chapter_2/tables/a.html", "results/index.html") == {"All results": "../../index.html"}
    assert to_index("results/zoo.html", None) == {}


def test_numbers_are_written_with_the_digits_that_are_known():
    assert quantity(1.2345678e-5, "m", 1.04e-7) == "12.35 ± 0.10 µm"
    assert quantity(24980.3, "N/m", 35.8) == "24980 ± 36 N/m"
    assert quantity(0.0300064, "1", 6.8e-5) == "0.030006 ± 0.000068"
    assert quantity(1.184e7, "N/m", 5.4e5) == "1.184e+07 ± 0.054e+07 N/m"
    assert quantity(3.2e-6, "1", 4.1e-7) == "3.20e-06 ± 0.41e-06" and quantity(0.5, "1", 2e-12) == "0.5 ± 2e-12"
    assert quantity(0.6, "1", None) == "0.6" and quantity(5.0, "N", 120.0) == "0 ± 120 N"
    assert quantity(0.5, "rad", np.nan) == "28.6 °" and quantity(2e-3, "s") == "2 ms"


def test_numbers_have_no_exponent_unless_they_are_very_large_or_small():
    plain = [number(x) for x in (1140.4, 760000.0, 3.14159, 2.5e9, np.inf)]
    assert plain == ["1140", "760000", "3.14", "2.5e+09", "inf"]
    assert [number(x) for x in (6.83e-5, 0.00012, 4.2e-9, 0.0)] == ["6.83e-05", "0.00012", "4.2e-09", "0"]
    assert [um(5.55e-5), um(0.0123), quantity(1.23456e-4, "m", digits=4)] == ["56 µm", "12000 µm", "123.5 µm"]


def test_speeds_are_written_in_both_units():
    assert spins([300.0]) == "2865 rpm (300 rad/s)"
    assert spins([300.0, 350.0, 377.0]) == "2865, 3342 and 3600 rpm (300, 350 and 377 rad/s)"
    assert quantity(300.0, "rad/s", 0.5) == "2864.8 ± 4.8 rpm"
    assert spins(np.linspace(100.0, 300.0, 20)) == "20 speeds from 954.9 rpm (100 rad/s) to 2865 rpm (300 rad/s)"


def test_p_values_say_what_they_do_not_resolve():
    assert [p_value(p) for p in (1.0, 0.4, 0.0123, 1e-9)] == ["p = 1", "p = 0.4", "p = 0.012", "p < 1e-6"]
    assert percent(1.234, 2) == "120 %"


def test_an_interval_holds_95_percent():
    assert interval("m", 1e-7, ends_of_interval(1.2e-5, 1e-7)) == "11.80 to 12.20 µm"
    low, high = (float(end) for end in interval("1", 1.0, ends_of_interval(10.0, 1.0)).split(" to "))
    assert (low, high) == pytest.approx((10 - 1.96, 10 + 1.96), abs=0.05)


def test_an_estimate_is_written_with_the_digits_that_are_known():
    ends = ends_of_interval(0.5, 1.4, 0.0)
    assert with_interval(100.23, 4.0, "N/m").strip() == "100.2 ± 4.0 N/m (95 %: 92.4 to 108.1)"
    assert with_interval(4.512e-6, 1.4e-6, "1").strip() == "4.5e-06 ± 1.4e-06 (95 %: 1.8e-06 to 7.3e-06)"
    assert with_interval(23.3, 12.0, "1").strip() == "23 ± 12 (95 %: 0 to 47)"  # -0.2 rounds to zero, without a sign
    assert with_interval(0.5, 0.1, "rad").strip() == "28.6 ± 5.7 ° (95 %: 17.4 to 39.9)"
    assert with_interval(-7.9e-7, 1.9e-7, "m").strip() == "-0.79 ± 0.19 µm (95 %: -1.16 to -0.42)"
    assert with_interval(0.21, 0.0004, "m").strip().startswith("0.21000 ± 0.00040 m")
    assert with_interval(0.5, 1.4, "g mm", ends).strip() == "0.5 ± 1.4 g mm (95 %: 0.0 to 3.2)"
    assert with_interval(0.5, 31.4, "rad") == quantity(0.5, "rad", 31.4) == "any angle"
    assert with_interval(1e7, 2e5, "N/m").strip() == "1.000e+07 ± 0.020e+07 N/m (95 %: 0.961e+07 to 1.039e+07)"


@pytest.mark.parametrize(
    ("words", "length", "unbalance"),
    [(["mil", "oz", "in"], "mil", "oz in"), (["g", "mm"], "um", "g mm"), (["mil"], "mil", "oz in")],
)
def test_units_of_two_words_need_no_quotes_and_an_unbalance_follows_the_length(words, length, unbalance):
    with asked(words), shown_for({}) as shown:
        assert (shown.length, shown.unbalance) == (length, unbalance)
    with asked(words), shown_for({"units": ["g mm"]}) as shown:  # what a rig states stands, unless --units says more
        assert shown.unbalance == (unbalance if "oz" in words else "g mm")
    with pytest.raises(RotorstudyError, match="unknown unit 'oz'"), asked(["oz"]):
        pass


BAD = """<!doctype html><html><head><title>a</title><link rel="stylesheet" href="https://example.org/a.css"></head>
<body><table><tr><th>wide</th></tr></table><img src="nowhere.png"><p style="width: 1000px">wide</p>
<script>undefined_function()</script></body></html>"""


def good():
    table = cells(pd.DataFrame({"c": ["d"], "below": ["of d"]}), below="below")
    links = {"home": "index.html"}
    return render("tables.html", title="a", note=["b"], tables={"": table}, choose=["c"], marks={}, links=links)


PAGES = {"good": good(), "bad": BAD}


def test_a_bad_page_is_seen_in_its_text():
    assert problems_of_text(good()) == []
    assert problems_of_text(BAD) == [
        "loads https://example.org/a.css", "no viewport", "needs one title and one h1", "1 tables with 0 captions",
        "1 header cells without scope", "1 images without alt", "no prefers-color-scheme: dark", "no @media print",
    ]  # fmt: skip


@pytest.mark.skipif(not BROWSER, reason="no Chromium found: pages are read, not opened")
def test_a_bad_page_is_seen_in_the_browser(tmp_path):
    for name, text in PAGES.items():
        (tmp_path / f"{name}.html").write_text(text)
    (fine, quiet), (wrong, console) = (seen_in_browser([tmp_path / f"{name}.html"], tmp_path) for name in PAGES)
    assert problems_seen(fine, quiet) == []
    assert [one["moved"] for one in [*fine, *wrong]] == [True, True, False, False]  # the filter of rows works
    said = " ".join(problems_seen(wrong, console))
    for wanted in (
        "undefined_function is not defined",
        "bad.html is 1008 px wide at 700",
        "1 broken",
        "asks for https",
    ):
        assert wanted in said
