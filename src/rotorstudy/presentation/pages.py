"""HTML pages from templates; every page is a single self-contained file."""

import base64
import os
from functools import cache
from pathlib import Path


@cache
def _environment():
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("rotorstudy.presentation")
    made = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    made.globals["vendored"] = _vendored
    return made


def _vendored(name):
    """The text of a script or a style beside the templates, to be put into a page as it is."""
    from markupsafe import Markup

    return Markup((Path(__file__).with_name("templates") / name).read_text(encoding="utf-8"))


def render(template: str, **data) -> str:
    """A page from a template of `presentation/templates`; every value is escaped.

    template : it extends `base.html`, which needs `title` and takes `links` (text -> address, shown at the top)
    data     : values by the names that the template uses; a missing one raises `jinja2.UndefinedError`
    """
    return _environment().get_template(template).render(**data)


def to_index(page: str | Path, index: str | Path | None) -> dict[str, str]:
    """Link from a page to the page of all results, as text -> relative address; none without one."""
    return {"All results": address(page, index)} if index else {}


def address(page: str | Path, target: str | Path) -> str:
    """Address of a file, relative to a page that links to it."""
    return Path(os.path.relpath(target, Path(page).parent)).as_posix()


def pictures(files, titles):
    """{name: title, caption, source} of figures; files: name -> PNG, titles: name -> (title, caption), in order."""
    shown = {name: told for name, told in titles.items() if name in files}
    return {name: {"title": a, "caption": b, "source": inline_png(files[name])} for name, (a, b) in shown.items()}


def inline_png(picture: bytes | str | Path) -> str:
    """A PNG, as bytes or the path of a file, as a data URI for `<img src>`."""
    content = picture if isinstance(picture, bytes) else Path(picture).read_bytes()
    return f"data:image/png;base64,{base64.b64encode(content).decode()}"
