"""HTML pages from templates; every page is a single self-contained file."""

import base64
import os
from functools import cache
from pathlib import Path


@cache
def _environment():
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("rotorstudy.presentation")
    return Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)


def render(template: str, **data) -> str:
    """A page from a template of `presentation/templates`; every value is escaped.

    template : name of the file. It extends `base.html`, which needs `title`, takes `links` (text -> address, shown at
               the top) and offers the blocks `style` and `content` and, as `show`, the macros of `macros.html`.
    data     : values by the names that the template uses; a missing one raises `jinja2.UndefinedError`
    """
    return _environment().get_template(template).render(**data)


def to_index(page: str | Path, index: str | Path | None) -> dict[str, str]:
    """Link from a page to the page of all results, as text -> relative address; none without one."""
    return {"All results": Path(os.path.relpath(index, Path(page).parent)).as_posix()} if index else {}


def inline_png(picture: bytes | str | Path) -> str:
    """A PNG, as bytes or the path of a file, as a data URI for `<img src>`."""
    content = picture if isinstance(picture, bytes) else Path(picture).read_bytes()
    return f"data:image/png;base64,{base64.b64encode(content).decode()}"
