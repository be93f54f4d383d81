"""Links to files of the repository outside docs/ become their paths; the site has pages alone."""

import re


def on_page_markdown(markdown, **_):
    """The text of a page with `[text](../path)` as `path`."""
    return re.sub(r"\[`?([^\]`]+)`?\]\(\.\./([^)#]+)[^)]*\)", r"`\2`", markdown)
