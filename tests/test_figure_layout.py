"""Titles and labels stay inside a figure, and logarithmic axes have plain numbers."""

import pytest

from rotorstudy.presentation.plots import figure, save_figure

LONG = "A title of many words that is a good deal wider than one column of a journal can ever show"


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
