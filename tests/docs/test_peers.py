"""What the pages say of other packages is what the rows of the benchmark say."""

import pandas as pd
from peers import run as peers


def test_the_numbers_beside_other_packages_are_those_of_the_rows():
    rows = pd.read_csv(peers.ROWS)
    for path, text in peers.pages(rows).items():
        assert text == path.read_text(encoding="utf-8"), f"{path.name}: run benchmarks/peers/run.py with --page"
    slower = peers.pages(rows.assign(ratio=0.5 * rows.ratio))  # other rows, other pages
    assert all(text != path.read_text(encoding="utf-8") for path, text in slower.items())


def test_the_costs_of_large_models_are_those_of_the_rows():
    import scaling  # which states the number of threads

    rows = pd.read_csv(scaling.ROWS)
    shown = scaling.PAGE.read_text(encoding="utf-8")
    assert scaling.page(rows) == shown, "run benchmarks/scaling.py --page"
    assert scaling.page(rows.assign(seconds=2 * rows.seconds)) != shown
