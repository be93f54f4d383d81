"""What tests of the diagnosis share."""

import numpy as np
import pytest
import yaml
from one_line_errors import RIG

from rotorstudy.commands.line import main
from rotorstudy.diagnosis.one_cause import over_forms


@pytest.fixture
def spectrum(tmp_path):
    """An imported spectrum of the rig, and the rig file."""
    rig, out = tmp_path / "rig.yaml", tmp_path / "spectrum.nc"
    rig.write_text(yaml.safe_dump(RIG))
    simulated = ["simulate", str(rig), "--speeds", "100", "200", "--noise", "1", "--rate", "2000"]
    assert main([*simulated, "--out", str(tmp_path / "records.nc")]) == 0
    assert main(["import", str(tmp_path / "records.nc"), "--rig", str(rig), "--out", str(out)]) == 0
    return out, rig


@pytest.fixture
def few_places(monkeypatch):
    """Intervals from fewer places and forms, where test_one_cause.py holds the same from all of them."""
    few = {"FORMS": (0.5, 0.0, 1.0), "PLACES": 8, "ABOUT": 2.0 * np.arange(-2, 3), "CLOSER": 1}
    for name, value in few.items():
        monkeypatch.setattr(over_forms, name, value)
