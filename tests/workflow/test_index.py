"""The index of the results: every page and figure is linked, headline results are quoted."""

import json
import re

from jobs.index_page import write_index

SUMMARY = "Something <is> missing."


def test_every_page_and_figure_is_linked(tmp_path):
    report = tmp_path / "report.rst"
    files = ["scoreboard.html", "scoreboard.csv", "chapter_2/tables/table_2_1.html", "chapter_2/figures/figure_2_4.png",
             "diagnosis/chapter_3/index.html", "diagnosis/chapter_3/verdict.json", "new_chapter/page.html"]  # fmt: skip
    for file in files:
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text("status\nreproduced\nreproduced\nexplained\n")
    (tmp_path / "diagnosis/chapter_3/verdict.json").write_text(json.dumps({"summary": SUMMARY}))
    write_index(tmp_path / "index.html", [tmp_path / file for file in files], report)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    links = re.findall(r'href="([^"#]+)"', page)
    assert set(links) == {file for file in files if file.endswith((".html", ".png"))}
    assert "Of 3 printed values: 2 reproduced, 1 explained." in page
    assert "measured records: chapter 3</a></h2>" in page and "<p>Something &lt;is&gt; missing.</p>" in page
    assert page.index("Something &lt;is") < page.index("Of 3 printed")  # what a machine owner wants to know comes first
    assert "**The thesis, recomputed.** Of 3 printed values: 2 reproduced, 1 explained." in report.read_text()
    assert f"chapter 3.** {SUMMARY}" in report.read_text()
    assert "New chapter" in page and "Blind tests" not in page
