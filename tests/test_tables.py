"""Pages for readers: order, units, and cells."""

import numpy as np
import pandas as pd

from rotorstudy.presentation.pages import Table, cells, to_index, write_html
from thesis.scoreboard import in_table_order, side_by_side


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
