"""Links to files of the repository outside docs/ become their paths; the site has pages alone."""

import re

LINK = re.compile(r"\[`?([^\]`]+)`?\]\(\.\./([^)#]+)[^)]*\)")


def on_page_markdown(markdown, **_):
    """The text of a page with `[name](../path)` as `path`, and `[words](../path)` as words and `path`."""
    return LINK.sub(_path, markdown)


def _path(link):
    words, path = link.groups()
    return f"`{path}`" if path.endswith(words) else f"{words} (`{path}`)"
