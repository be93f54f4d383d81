"""The pages of docs/: what they show is read by the program, and links lead somewhere."""

import re
from pathlib import Path

import yaml

from rotorstudy import build_model, harmonic_response
from rotorstudy.model.rig import OTHER, SECTIONS
from rotorstudy.studies.rig_check import check_rig

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs").glob("*.md"))


def dead_links(page, text):
    """Links of a page to files that do not exist, or to headings that their page does not have."""
    links = [link for link in re.findall(r"\]\(([^)]+)\)", text) if not link.startswith("http")]
    return [link for link in links if not leads_somewhere(page, *link.partition("#")[::2])]


def leads_somewhere(page, file, heading):
    other = page.parent / file if file else page
    if not heading or not other.exists():
        return other.exists()
    headings = re.findall(r"^#+ (.*)", other.read_text(encoding="utf-8"), re.MULTILINE)
    return heading in [re.sub(r"[^\w -]", "", one.lower()).replace(" ", "-") for one in headings]


def test_links_lead_somewhere():
    for page in [*PAGES, ROOT / "README.md", ROOT / "CHANGELOG.md"]:
        assert dead_links(page, page.read_text(encoding="utf-8")) == [], page.name
    text = "[a](nowhere.md#b) [c](#d) [e](https://example.org) [f](index.md) [g](diagnosis.md#settings) [h](api.md#i)"
    assert dead_links(ROOT / "docs" / "index.md", text) == ["nowhere.md#b", "#d", "api.md#i"]


def test_every_page_is_in_the_navigation_of_the_site():
    navigation = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["nav"]
    assert sorted(name for entry in navigation for name in entry.values()) == [page.name for page in PAGES]


def test_the_page_on_the_rig_file_explains_every_section(tmp_path):
    text = (ROOT / "docs" / "your_rig.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE)) == {*SECTIONS, *OTHER}
    (example,) = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    rig = yaml.safe_load(example.replace("2e7", "2.0e+7").replace("1e-5", "1.0e-5"))
    assert abs(harmonic_response(build_model(rig), [100.0], [1])[0, 0, 12]) > 1e-7  # its unbalance moves the disc
    (tmp_path / "rig.yaml").write_text(example, encoding="utf-8")
    assert {finding.name for finding in check_rig(tmp_path / "rig.yaml").findings} == {"measurement"}  # it has none
