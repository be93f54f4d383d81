"""The study that puts crack models side by side: subcritical resonances, closed forms, steady state that is one."""

from pathlib import Path

import numpy as np
import pytest
from one_line_errors import refused

from rotorstudy import registry
from rotorstudy.model.kinds import Crack
from rotorstudy.response.floquet import periodic_growth_rate
from rotorstudy.store import as_complex
from rotorstudy.studies.cracks import compare, load_cracks

CONFIG = Path(__file__).parents[2] / "workflow" / "config" / "cracks.yaml"
CRACKS = registry().plugins["crack"]


STUDY = load_cracks(CONFIG)


@pytest.fixture(scope="module")
def data():
    return compare(STUDY)


def swept(data, crack, n):
    return np.abs(as_complex(data.swept_displacement.sel(crack=crack, harmonic=n)))


def test_every_crack_and_depth_of_the_zoo_is_there(data):
    assert list(data.crack.values) == list(CRACKS)
    assert list(data.depth.values) == list(registry().plugins["depth"])
    assert all(np.isfinite(data[name]).all() for name in data.data_vars if name != "depth_loss")


@pytest.mark.parametrize("name", CRACKS)
def test_critical_sub_speeds(data, name):
    """nX is highest at the natural frequency of the mean stiffness over n: half a speed step, and 0.5 % for the damping
    and the second order of the loss."""
    mean, sound = float(data.mean_natural_frequency.sel(crack=name)), float(data.natural_frequency)
    assert 0.96 * sound < mean < sound
    for n in (2, 3):
        height = swept(data, name, n)
        if height.max() < 1e-12:
            assert name == "open"  # the only one of ours that does not breathe
            continue
        peak = float(data.swept_speed[height.argmax()])
        assert peak == pytest.approx(mean / n, rel=5e-3, abs=0.25)
        assert height.max() > 10 * np.median(height)


def test_stiffness_over_a_turn(data):
    k = STUDY.shaft_stiffness
    stiffness = data.stiffness.sel(direction=["xi", "eta"])
    assert float(stiffness.max()) <= k * (1 + 1e-12)
    assert float(stiffness.min()) == pytest.approx(k * (1 - STUDY.loss_share))
    down, sideways = (data.stiffness.sel(direction=d).values for d in ("vertical", "horizontal"))
    assert np.allclose(down + sideways, stiffness.sum("direction"))  # the trace does not turn
    assert np.allclose(down[:, 0], stiffness.values[:, 0, 0]) and np.allclose(sideways[:, 0], stiffness.values[:, 1, 0])


@pytest.mark.parametrize("name", CRACKS)
def test_free_motion_decays_at_every_speed_of_the_sweep(name):
    """Otherwise there is no steady state to show; where parametric resonance threatens, 2 w_n / n, more closely."""
    natural = np.sqrt(0.98 * STUDY.shaft_stiffness / 2.0)
    near = [2 * natural / n * np.linspace(0.97, 1.03, 5) for n in (3, 4, 5)]
    swept = STUDY.swept
    speeds = np.concatenate([np.linspace(swept.first_rad_s, swept.last_rad_s, 12), *near])
    assert (periodic_growth_rate(STUDY.model(CRACKS[name]), speeds) < 0).all()


def test_a_crack_of_the_user_appears_by_itself(monkeypatch):
    def jammed(angle):
        """Half open all the time."""
        return 0 * angle + 0.5

    monkeypatch.setitem(CRACKS, "jammed", Crack("jammed", jammed, source="a test"))
    small = STUDY.model_copy(update={"swept": STUDY.swept.model_copy(update={"step_rad_s": 100.0})})
    assert "jammed" in compare(small).crack.values
    monkeypatch.undo()
    assert "jammed" not in compare(small).crack.values


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("section_geometry: {", "section_geometri: {"), "unknown crack 'section_geometri'"),
        (("depth_ratio: 0.25", "depth_ratio: 0.75"), "depth_ratio = 0.75"),
        (("kind: jeffcott, mass", "kind: jefcott, mass"), "unknown rotor"),
        (("loss_share: 0.1", "loss_share: 1.1"), "loss_share = 1.1"),
        (("swept:", "sweep:"), "unknown key 'sweep'"),
    ],
)
def test_a_wrong_configuration_is_told(tmp_path, change, words):
    (tmp_path / "cracks.yaml").write_text(CONFIG.read_text().replace(*change))
    refused(lambda: load_cracks(tmp_path / "cracks.yaml"), words)
