"""What others printed of machines, each a rig file and a table beside it: our numbers agree, and wrong rigs do not."""

import re
from pathlib import Path

import pandas as pd
import pytest
import yaml
from one_line_errors import refused

from rotorstudy.model.rig_numbers import scaled
from rotorstudy.studies.published import COLUMNS, beside_printed

RIGS = sorted(Path(__file__).parent.glob("*.yaml"))


@pytest.mark.parametrize("rig", RIGS, ids=lambda path: path.stem)
def test_printed_numbers_agree(rig):
    rows = beside_printed(rig)
    assert rows.agrees.all(), rows[~rows.agrees].to_string()


@pytest.mark.parametrize("rig", RIGS, ids=lambda path: path.stem)
def test_they_do_not_if_the_numbers_of_the_rig_are_a_tenth_larger(rig, tmp_path):
    wrong, every = yaml.safe_load(rig.read_text()), re.compile(".*")
    (tmp_path / rig.name).write_text(yaml.safe_dump({key: scaled(part, every, 1.1) for key, part in wrong.items()}))
    rows = pd.read_csv(rig.with_suffix(".csv"), dtype=str, keep_default_na=False)
    rows[rows.value.astype(float) != 0].head(8).to_csv(tmp_path / rig.with_suffix(".csv").name, index=False)
    agree = beside_printed(tmp_path / rig.name).agrees.mean()
    # load and size cancel in the coefficients of a film, of which half then stay within their tolerance
    assert agree < 0.6 if "plain_journal" in rig.read_text() else agree == 0


def test_there_are_many():
    rows = pd.concat([pd.read_csv(rig.with_suffix(".csv")) for rig in RIGS])
    assert len(rows) > 600 and len(RIGS) > 30
    assert rows.source.notna().all()
    assert rows.tolerance.max() < 0.1


GOOD = dict(zip(COLUMNS, ["natural_frequency", "1", "", "", "10.0", "rad/s", "", "", "a book"], strict=True))
RIG = {"rotor": {"kind": "jeffcott", "mass_kg": 1.0, "stiffness_N_per_m": 100.0}}


def told(tmp_path, **row):
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(RIG))
    pd.DataFrame([GOOD | row]).to_csv(tmp_path / "rig.csv", index=False)
    return beside_printed(tmp_path / "rig.yaml").iloc[0]


def test_the_last_digit_printed_is_the_tolerance(tmp_path):
    assert told(tmp_path, value="10.0").agrees and told(tmp_path, value="10.04", tolerance="0.005", reason="old").agrees
    assert not told(tmp_path, value="10.04").agrees and not told(tmp_path, value="9.9").agrees


@pytest.mark.parametrize(
    "row, words",
    [
        ({"quantity": "natural_frequencies"}, "line 2.*did you mean 'natural_frequency'"),
        ({"unit": "1/min"}, "unknown unit '1/min'"),
        ({"speed": "100 1/min"}, "unknown unit of the speed '1/min'"),
        ({"value": "ten"}, "value 'ten'.* must be numbers"),
        ({"tolerance": "0.01"}, "a tolerance needs a reason"),
        ({"change": "bearings.left.x=1"}, r"change 'bearings\.left\.x=1'; expected section\.key=value"),
        ({"page": "7"}, "columns .*; expected"),
    ],
)
def test_a_wrong_row_is_refused(row, words, tmp_path):
    refused(lambda: told(tmp_path, **row), match=words)
