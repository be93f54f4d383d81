"""The charts of pages in Chromium, by Playwright: zoom, values, 700 px, dark, print, nothing said or asked for."""

import json
import re

import numpy as np
import pytest
from one_line_errors import run
from page_checks import BROWSER

from rotorstudy.commands.line import main
from rotorstudy.presentation.pages import render

try:
    from playwright.sync_api import sync_playwright
except ImportError:
    sync_playwright = None

pytestmark = pytest.mark.skipif(
    not (BROWSER and sync_playwright),
    reason="charts are not opened: `make browser` installs Playwright, `apt install chromium` (or ROTORSTUDY_BROWSER) "
    "the browser",
)
RIG = "examples/jeffcott.yaml"


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """The pages of analyse and import; 10 speeds, so that there is a Bode plot."""
    folder = tmp_path_factory.mktemp("charts")
    speeds = list(map(str, np.linspace(80, 340, 10).round()))
    run("simulate", RIG, "--speeds", *speeds, "--noise", "1", "--rate", "2000", "--out", folder / "records.nc")
    run("import", folder / "records.nc", "--rig", RIG, "--out", folder / "spectrum.nc")
    analyse = ["analyse", RIG, "--records", str(folder / "records.nc"), "--units", "mil", "--speeds", "50", "400"]
    assert main([*analyse, "--out", str(folder / "analysis")]) == 0
    small = folder / "small.html"  # a harmonic is round-off, as in records without noise
    text = (folder / "spectrum_quality.html").read_text()
    small.write_text(re.sub(r'("(?:real|imag)": )\[\[\[[^,]+,', r"\1[[[1e-13,", text))
    assert small.read_text() != text
    return {"analyse": folder / "analysis" / "index.html", "import": folder / "spectrum_quality.html", "small": small}


@pytest.fixture(scope="module")
def chromium():
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture
def opened(chromium, pages):
    """A function that opens a page; what the console said and what was asked for must be nothing."""
    found, contexts = [], []

    def go(name, width=1400, scheme="light"):
        context = chromium.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: found.append(message.text))
        page.on("pageerror", lambda error: found.append(str(error)))
        page.on("request", lambda one: None if re.match("(file|data):", one.url) else found.append(one.url))
        page.goto(pages[name].as_uri())
        page.wait_for_selector(".uplot")
        return page

    yield go
    for context in contexts:
        context.close()
    assert found == []


def chart(page, number):
    """The area of a chart in the window, in the order of the page, after it was scrolled to."""
    area = page.locator(".u-over").nth(number)
    area.scroll_into_view_if_needed()
    return area.bounding_box(), page.locator("[data-zoomed]").nth(number)


def drag(page, box, start, end):
    page.mouse.move(box["x"] + start * box["width"], box["y"] + 0.3 * box["height"])
    page.mouse.down()
    page.mouse.move(box["x"] + end * box["width"], box["y"] + 0.7 * box["height"], steps=4)
    page.mouse.up()


def test_a_spectrum_of_many_decades_is_drawn(opened):
    """uPlot wants no label at some powers of ten; an exception would leave the place empty."""
    page = opened("small")
    page.locator("[name=speed]").fill("0")  # which has that harmonic
    page.wait_for_timeout(100)
    assert page.locator("figure .uplot").count() == 3


def test_dragging_zooms_amplitude_and_phase_together_and_a_double_click_resets(opened):
    page = opened("analyse")  # charts: Campbell, amplitude, phase, polar
    box, amplitude = chart(page, 1)
    phase = page.locator("[data-zoomed]").nth(2)
    assert amplitude.get_attribute("data-zoomed") == phase.get_attribute("data-zoomed") == "no"
    drag(page, box, 0.3, 0.6)
    assert amplitude.get_attribute("data-zoomed") == phase.get_attribute("data-zoomed") == "yes"
    assert page.locator("[data-zoomed]").nth(0).get_attribute("data-zoomed") == "no"  # the Campbell diagram stays
    page.mouse.dblclick(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert amplitude.get_attribute("data-zoomed") == "no"


def test_the_pointer_reads_values_in_the_units_of_the_reader(opened):
    """The amplitude under the pointer is that of the file: at the speed in the middle, in mil from peak to peak."""
    page = opened("analyse")
    box, amplitude = chart(page, 1)
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    told = amplitude.locator("output").inner_text()
    speed, value = re.match(r"([\d.]+) rpm: x ([\d.]+)", told).groups()
    assert told.endswith("mil pp")
    (data,) = re.findall(r'data-charts="bode".*?json">(.*?)</script>', page.content(), re.DOTALL)
    curve = json.loads(data)["views"][0]["charts"][0]["series"][0]
    near = int(np.argmin(np.abs(np.array(curve["x"]) - float(speed))))
    assert float(value) == pytest.approx(curve["y"][near], rel=1e-3)
    assert page.locator("[data-zoomed]").nth(2).locator("output").inner_text().startswith(speed)  # one cursor for both


def test_the_speed_is_chosen_and_an_orbit_says_where_the_shaft_is(opened):
    page = opened("import")
    view = page.locator("[data-charts=records]")
    first = view.locator("form output").inner_text()
    view.locator("input[type=range]").focus()
    page.keyboard.press("Home")
    assert view.locator("form output").inner_text() != first and "rpm" in first
    box, spectrum = chart(page, 2)
    for share in np.linspace(0.02, 0.98, 60):  # along the height where 1X stands
        page.mouse.move(box["x"] + box["width"] * 6.6 / 10.2, box["y"] + box["height"] * share)
        if told := spectrum.locator("output").inner_text():
            break
    assert re.match(r"measured.*, \d?-?\dX: [\d.e-]+ ± [\d.e-]+ µm", told)


@pytest.mark.parametrize("name", ["analyse", "import"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_charts_fit_a_narrow_window_in_light_and_dark(opened, name, scheme):
    page = opened(name, 700, scheme)
    assert page.evaluate("document.documentElement.scrollWidth") <= 700
    drawn = page.evaluate(
        "[...document.querySelectorAll('.uplot canvas')].map(one => new Set(one.getContext('2d').getImageData(0, 0, "
        "one.width, one.height).data).size)"
    )
    assert len(drawn) >= 3 and min(drawn) > 10  # not one colour: something is drawn in each


def test_print_shows_the_whole_of_a_long_list(chromium):
    page = chromium.new_page()
    empty = {"figures": {}, "charts": {}, "tables": dict.fromkeys(("loads", "criticals", "resonances", "growth_rate"))}
    page.set_content(render("rotor.html", title="", summary=[f"line {i}" for i in range(9)], **empty))
    assert page.locator("li:visible").count() == 6
    page.emulate_media(media="print")
    assert page.locator("li:visible").count() == 9
    page.close()


def test_print_shows_the_static_pictures(opened):
    page = opened("analyse")
    assert not page.locator(".fallback img").first.is_visible()
    page.emulate_media(media="print")
    assert page.locator(".fallback img").first.is_visible() and not page.locator(".uplot").first.is_visible()
    assert b"/Count 1\n" in page.pdf(format="A4")  # one page
    assert b"/Count 2\n" in opened("import").pdf(format="A4")  # and one for the tables of ten records
