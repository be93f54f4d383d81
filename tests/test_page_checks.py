"""The checks of pages find what is wrong with a bad one."""

import pandas as pd
import pytest
from page_checks import BROWSER, problems_of_text, problems_seen, seen_in_browser

from rotorstudy.presentation.pages import cells, render

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
