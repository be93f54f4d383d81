"""What every HTML page must hold: read as text always, and opened in headless Chromium where there is one.

Chromium is Debian's package `chromium`; ROTORSTUDY_BROWSER names another one. No library drives it: a page of frames,
one for each page and width, measures them and writes what it found into its own text, which `--dump-dom` prints.
"""

import html
import json
import os
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

WIDTHS = (1400, 700)  # pixels
BROWSER = os.environ.get("ROTORSTUDY_BROWSER") or next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None
)
OPTIONS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-extensions", "--disable-background-networking",
    "--allow-file-access-from-files", "--host-resolver-rules=MAP * ~NOTFOUND", "--enable-logging=stderr",
    "--virtual-time-budget=100000", "--dump-dom",
]  # fmt: skip
MEASURE = """
const show = (path, width) => new Promise(done => {
  const frame = document.createElement("iframe");
  frame.style.cssText = `width: ${width}px; height: 900px; border: 0`;
  frame.onload = () => {
    const page = frame.contentDocument, found = page.documentElement;
    const before = page.body.innerHTML;
    for (const one of page.querySelectorAll("input, select")) {
      if (one.type === "range") one.value = +one.value === +one.max ? one.min : one.max;
      if (one.type === "search") one.value = "no row has these words";
      one.dispatchEvent(new Event("input", {bubbles: true}));
    }
    const moved = page.body.innerHTML !== before;
    const broken = [...page.images].filter(one => one.loading != "lazy" && !one.naturalWidth).length;
    const asked = frame.contentWindow.performance.getEntriesByType("resource").map(one => one.name);
    const outside = asked.filter(name => !/^(file|data):/.test(name));
    done({path, width, wide: found.scrollWidth, tall: found.scrollHeight, broken, outside, moved});
    frame.remove();
  };
  frame.src = path;
  document.body.append(frame);
});
(async () => {
  const found = [];
  for (const [path, width] of PAGES) found.push(await show(path, width));
  document.body.textContent = "MEASURED" + JSON.stringify(found) + "END";
})();
"""


class _Reader(HTMLParser):
    """Collects what the checks of the text need."""

    def __init__(self):
        super().__init__()
        self.opened, self.outside, self.unnamed, self.style = [], [], 0, ""

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.opened.append((tag, given))
        loaded = given.get("src") or (given.get("href") if tag == "link" else None)
        if loaded and re.match(r"(\w+:)?//", loaded):
            self.outside.append(loaded)
        self.unnamed += tag == "img" and not given.get("alt")

    def handle_data(self, data):
        if self.opened and self.opened[-1][0] == "style":
            self.style += data


def problems_of_text(text):
    """What a page lacks, found in its text; an empty list for a good one."""
    page = _Reader()
    page.feed(text)
    tags = [tag for tag, _ in page.opened]
    found = [f"loads {address}" for address in page.outside + re.findall(r"(?:url\(|@import) *['\"]?(http\S+)", text)]
    if not any(tag == "meta" and given.get("name") == "viewport" for tag, given in page.opened):
        found.append("no viewport")
    if tags.count("title") != 1 or tags.count("h1") != 1:
        found.append("needs one title and one h1")
    if tags.count("table") != tags.count("caption"):
        found.append(f"{tags.count('table')} tables with {tags.count('caption')} captions")
    if unscoped := sum(tag == "th" and "scope" not in given for tag, given in page.opened):
        found.append(f"{unscoped} header cells without scope")
    if page.unnamed:
        found.append(f"{page.unnamed} images without alt")
    for wanted in ("prefers-color-scheme: dark", "@media print"):
        if wanted not in page.style:
            found.append(f"no {wanted}")
    return found


def seen_in_browser(paths, folder):
    """Pages opened at every width of WIDTHS; folder : of the page of frames and the profile of the browser.

    measured : of each page and width path, width, wide and tall (px), broken images, requests outside, moved
    console  : what the console said, such as errors of scripts
    """
    pages = [(Path(path).resolve().as_uri(), width) for path in paths for width in WIDTHS]
    frames = folder / "frames.html"
    script = MEASURE.replace("PAGES", json.dumps(pages))
    frames.write_text(f"<!doctype html><body><script>{script}</script>", encoding="utf-8")
    profile = f"--user-data-dir={folder / 'profile'}"
    done = subprocess.run(
        [BROWSER, *OPTIONS, profile, frames.as_uri()], capture_output=True, text=True, check=True, timeout=600
    )
    (told,) = re.findall("MEASURED(.*)END</body>", done.stdout, re.DOTALL)
    console = re.findall(r"CONSOLE[^\]]*\] (.*)", done.stderr)
    return json.loads(html.unescape(told)), console


def problems_seen(measured, console):
    """Console messages, requests outside, broken images, pages wider than the window, of `seen_in_browser`."""
    said = [*console]
    for one in measured:
        page = Path(one["path"]).name
        if one["wide"] > one["width"]:
            said.append(f"{page} is {one['wide']} px wide at {one['width']}")
        if one["broken"]:
            said.append(f"{page} has {one['broken']} broken images")
        said += [f"{page} asks for {address}" for address in one["outside"]]
    return said


def problems(paths, folder):
    """What is wrong with pages: in their text, and in the browser where there is one; folder : for its files."""
    paths = list(map(Path, paths))
    said = [f"{path}: {one}" for path in paths for one in problems_of_text(path.read_text(encoding="utf-8"))]
    return said + (problems_seen(*seen_in_browser(paths, folder)) if BROWSER else [])


def sheets(text, folder, unfolded=False):
    """Number of sheets on which Chromium prints a page; unfolded : with all that is folded on it open."""
    if unfolded:
        text = text.replace("details:not(.rest) { display: none; }", "").replace("<details", "<details open")
    page, pdf = folder / "printed.html", folder / "printed.pdf"
    page.write_text(text)
    options = ["--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder / 'profile'}"]
    subprocess.run([BROWSER, *options, f"--print-to-pdf={pdf}", page.as_uri()], check=True, capture_output=True)
    return len(re.findall(rb"/Type\s*/Page[^s]", pdf.read_bytes()))
