"""Files of receptances of a foundation are read as other tables are, or refused in one line."""

import numpy as np
import pytest
from one_line_errors import refused
from uff_files import write_mobilities

from rotorstudy.measurement.receptances import receptances_in

RECEPTANCES = "frequency_Hz,response,force,real,imaginary\n5,4x,4x,1e-8,-2e-9\n6,4x,4x,3e-8,-4e-9\n"


@pytest.mark.parametrize("end", ["", ",", "# by hand"])
def test_receptances_are_read_as_other_tables_are(tmp_path, end):
    path = tmp_path / "frame.csv"
    head, *rows = RECEPTANCES.splitlines()
    path.write_text("\ufeff" + "\n".join([head, *(f"{row}{',' * (end == ',')}" for row in rows), end * (end != ",")]))
    _, found = receptances_in(path)
    assert found["4x", "4x"].tolist() == [1e-8 - 2e-9j, 3e-8 - 4e-9j]
    path.write_text(RECEPTANCES.replace("-2e-9", "1e-10"))  # noise on little damping
    assert len(receptances_in(path)[0]) == 2


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("5,4x,4x,", "5,4x,4x,1,"), "line 2: 6 cells, and the header names 5 columns"),  # would be 1 + 1e-8j
        (("5,4x,4x,1e-8,", "5,4x,4x,"), "line 2: 4 cells"),
        (("1e-8", "x"), "line 2, column 'real': 'x' is not a number"),
        (("real", "Re"), "needs the columns frequency_Hz"),
        (("6,4x", "5,4x"), "must increase from above zero, but 5 Hz after 5 Hz"),
        (("5,4x", "-5,4x"), "-5 Hz after 0 Hz"),
        (("6,4x,4x,3e-8,-4e-9\n", ""), "give two or more"),
        (("8,-", "8,"), "the motion at 4x runs ahead of a force there at 100 % of the frequencies"),
    ],
)
def test_receptances_of_another_layout_are_refused(tmp_path, change, words):
    (tmp_path / "frame.csv").write_text(RECEPTANCES.replace(*change))
    refused(lambda: receptances_in(tmp_path / "frame.csv"), words)


@pytest.mark.parametrize(
    ("label", "unit", "wrong"),
    [("ordinate", "g", True), ("ordinate", "mm/s", True), ("orddenom", "lbf", True), ("ordinate", "m/s", False)],
)
def test_receptances_of_uff_in_other_units_are_refused(tmp_path, label, unit, wrong):
    rows = RECEPTANCES.split()[1:]
    write_mobilities(tmp_path / "frame.uff", rows, np.array([30.0, 40.0]), **{f"{label}_axis_units_lab": unit})
    if wrong:
        refused(lambda: receptances_in(tmp_path / "frame.uff"), f"is in '{unit}'; export it in SI units")
    else:
        assert len(receptances_in(tmp_path / "frame.uff")[0]) == 2
