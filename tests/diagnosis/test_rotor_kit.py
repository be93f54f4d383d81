"""A real rotor kit, updated by a baseline and two trial runs: what was screwed into its discs in other runs."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.stats import chi2

from rotorstudy.diagnosis.runs.joint import identify_runs
from rotorstudy.model.rig import RigFile

KIT = Path(__file__).parents[2] / "examples" / "rotor_kit"
# g mm at disc 1 and disc 2, in the sense of rotation
ADDED = {"A020": (24.0, 24.0), "A025": (3.0, -3.0), "B010": (-30.0j, 0.0)}
SUM = np.kron([1.0, 1.0], np.eye(2))


@pytest.fixture(scope="module")
def joint():
    """The runs with what is unknown, by a rig that was updated."""
    found = identify_runs(KIT / "updating.yaml", KIT / "rig.yaml")
    return identify_runs(KIT / "unknown.yaml", RigFile(KIT / "updated.yaml", found.rig)).joint


def discs(joint, name):
    """Unbalance of both discs in a run, (4,) real and imaginary parts in g mm, and its covariance."""
    names = [f"eccentricity[added {d}]_{part} @ {name}" for d in (1, 2) for part in ("real", "imag")]
    theta, covariance = joint.of(names)
    return 1e3 * theta, 1e6 * covariance


def test_what_was_screwed_in_lies_in_the_stated_regions(joint):
    for name, true in ADDED.items():
        theta, covariance = discs(joint, name)
        off = theta - np.column_stack([np.real(true), np.imag(true)]).ravel()
        assert off @ np.linalg.solve(covariance, off) < chi2.ppf(0.999, 4)
        assert np.hypot(*(SUM @ off)) < 8.0  # g mm, of up to 48: assemblies differ by 2.5 on average


def test_the_discs_are_known_less_than_their_sum(joint):
    """Two planes below the first critical speed: the split is not known, and the covariance says so."""
    _, covariance = discs(joint, "A020")
    one, both = np.trace(covariance[:2, :2]), np.trace(SUM @ covariance @ SUM.T)
    assert one > 4 * both


def test_without_the_trial_runs_the_sum_is_not_known_either(tmp_path):
    """The negative control."""
    added = {"unbalances": [{"node": "disc 1"}, {"node": "disc 2"}]}
    one = {"name": "A020", "records": [str(KIT / "runs/A020.csv")], **added}
    base = {"name": "baseline", "records": [str(KIT / "runs/BASE.csv")]}
    (tmp_path / "runs.yaml").write_text(yaml.safe_dump({"runs": [base, one]}))
    _, covariance = discs(identify_runs(tmp_path / "runs.yaml", KIT / "rig.yaml").joint, "A020")
    assert np.sqrt(np.trace(SUM @ covariance @ SUM.T)) > 10.0  # g mm
