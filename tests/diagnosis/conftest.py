"""What tests of the diagnosis share."""

import pytest
import yaml
from one_line_errors import RIG

from rotorstudy.commands.line import main


@pytest.fixture
def spectrum(tmp_path):
    """An imported spectrum of the rig, and the rig file."""
    rig, out = tmp_path / "rig.yaml", tmp_path / "spectrum.nc"
    rig.write_text(yaml.safe_dump(RIG))
    simulated = ["simulate", str(rig), "--speeds", "100", "200", "--noise", "1", "--rate", "2000"]
    assert main([*simulated, "--out", str(tmp_path / "records.nc")]) == 0
    assert main(["import", str(tmp_path / "records.nc"), "--rig", str(rig), "--out", str(out)]) == 0
    return out, rig
