"""Put the rows of a run of benchmarks/peers/run.py into docs and README: python benchmarks/peers/page.py OUT

The rows go to `docs/peers.csv`. What follows from them stands between marks in `docs/peers.md` and in the README; a
test compares both with the file.
"""

import sys
import textwrap
from pathlib import Path

import pandas as pd

sys.path.insert(0, str(Path(__file__).parents[1]))
from marked_pages import with_numbers

ROOT = Path(__file__).parents[2]
ROWS = ROOT / "docs/peers.csv"
PAGE, README = ROOT / "docs/peers.md", ROOT / "README.md"


def numbers(rows):
    """Markdown table."""
    lines = [
        "| task | beside | rotorstudy, s | other, s | ratio | rotorstudy, MB | other, MB | difference |",
        "|---" * 8 + "|",
    ]
    for row in rows.to_dict("records"):
        seconds = " | ".join(_rounded(row[name]) for name in ("rotorstudy s", "other s", "ratio"))
        memory = f"{row['rotorstudy MB']:.0f} | {row['other MB']:.0f}"
        lines.append(f"| {row['task']} | {row['other package']} | {seconds} | {memory} | {row['difference']:.1g} |")
    return "\n".join(lines)


def sentence(rows):
    """What is faster and what slower than ROSS, for the README."""
    rows = rows[rows["other package"] == "ROSS"]

    def told(some, ratio):
        return ", ".join(f"{row.task} ({_rounded(ratio(row.ratio))} times)" for row in some.itertuples())

    faster, slower = rows[rows.ratio >= 1].sort_values("ratio"), rows[rows.ratio < 1]
    text = (
        f"On the shaft of Chapter 6, rotorstudy was faster than ROSS in {len(faster)} of {len(rows)} tasks: least in "
        f"{told(faster[:1], lambda r: r)}, most in {told(faster[-1:], lambda r: r)}."
    )
    if len(slower):
        text += f" ROSS was faster in {told(slower, lambda r: 1 / r)}."
    return textwrap.fill(text, 130)


def _rounded(value):
    """Two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):.6g}"


def pages(rows):
    """{path: text} of the pages with the numbers of some rows."""
    page, readme = (path.read_text(encoding="utf-8") for path in (PAGE, README))
    return {
        PAGE: with_numbers(page, "numbers", numbers(rows)),
        README: with_numbers(readme, "peers", sentence(rows)),
    }


def main():
    """Copy the rows, write the pages."""
    pd.read_csv(Path(sys.argv[1]) / "peers.csv").to_csv(ROWS, index=False, float_format="%.4g")
    for path, text in pages(pd.read_csv(ROWS)).items():
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
