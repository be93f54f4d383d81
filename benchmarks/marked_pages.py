"""Numbers of benchmarks in pages, between marks: <!-- name --> and <!-- end -->."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]


def with_numbers(text, mark, numbers):
    """A page with what stands between its marks replaced."""
    pattern = re.compile(rf"(<!-- {mark} -->\n).*?( *<!-- end -->)", re.DOTALL)
    return pattern.sub(lambda found: f"{found[1]}{numbers}\n{found[2]}", text)


def table(heads, rows):
    """Markdown table of texts or numbers."""
    lines = [" | ".join(map(str, row)) for row in (heads, *rows)]
    return "\n".join([f"| {lines[0]} |", "|---" * len(heads) + "|", *(f"| {line} |" for line in lines[1:])])


def write(texts):
    """Write {path: text}."""
    for path, text in texts.items():
        path.write_text(text, encoding="utf-8")
