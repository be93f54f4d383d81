"""What changed between two states: what both share cancels, and what changed is found and sized."""

from dataclasses import replace
from types import SimpleNamespace

import machines
import numpy as np
import pytest
import yaml
from machines import SLOW, disc, faulty, jeffcott_rig, readings, rig_of, shaft, spectrum_of, write_harmonics
from one_line_errors import refused
from page_checks import BROWSER, problems, sheets

from rotorstudy import build_model, measured_response, measured_response_and_jacobian
from rotorstudy.commands.line import main
from rotorstudy.diagnosis.runs import compare as runs_compare
from rotorstudy.diagnosis.runs.compare import _with_common_probes, _with_scatter, compare, known_as_before
from rotorstudy.diagnosis.runs.turned_mark import without_turn
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.search.shown_forces import least_squares
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.investigate import investigate
from rotorstudy.diagnosis.verdict.words import summary
from rotorstudy.measurement.spectrum import along_probes

pytestmark = pytest.mark.usefixtures("undrawn")

HARMONICS, NOISE = np.array([1, -1, 2]), 2e-8
SPEEDS = np.array([200.0, 300.0, 400.0, 480.0])
CHAIN = {"probe_gain": 0.05, "probe_angle": 0.09}
SETTINGS = Settings(nuisance=CHAIN, hold_out_rad_s=[], leave_out=SLOW)
RIG = jeffcott_rig(5e-6, 0.52)
TRUE = yaml.safe_load(yaml.safe_dump(RIG))
TRUE["effects"][0]["external_damping_N_s_per_m"] = 112.0
TRUE["effects"][1]["eccentricity_m"] = 5.4e-6
SMALL = (2e-6, 0.01, 0.01)  # of a chain whose records pass the checks of their quality
CHANGE = {"kind": "unbalance", "label": "change", "eccentricity_m": 2e-7, "eccentricity_phase_rad": -1.0}


def state(seed, change=None, sizes=(20e-6, 0.05, 0.09), speeds=SPEEDS):
    """A state seen through a runout (m), a gain error and a probe angle (rad) that all states share."""
    model = build_model(TRUE)
    if change:
        model = faulty(model, change)
    draws = np.random.default_rng(5).normal(size=(2, 1, 3, 1))
    shown = measured_response(model, speeds, HARMONICS) * (1 + sizes[1]) * np.exp(-1j * sizes[2])
    shown = shown + sizes[0] * (draws[0] + 1j * draws[1]) / 2
    return readings(shown, speeds, HARMONICS, (1,), NOISE, seed)


def test_a_model_counted_from_an_earlier_state_shows_the_difference_of_the_two():
    base = build_model(RIG)
    stiff = {"kind": "stiffness_error", "label": "cause", "stiffness_error": 0.02}
    changed = faulty(base, stiff)
    difference = replace(changed, before=frozenset(base.names))
    shown = measured_response(difference, SPEEDS, HARMONICS)
    expected = measured_response(changed, SPEEDS, HARMONICS) - measured_response(base, SPEEDS, HARMONICS)
    np.testing.assert_array_equal(shown, expected)
    steps = 1e-4 * np.array(changed.typical)  # central differences: truncation of 1e-8 of the change per step
    assert machines.errors_of_derivatives(difference, SPEEDS, HARMONICS, steps).max() < 1e-5


def test_a_change_is_found_that_one_state_alone_cannot_show():
    """4 % of the unbalance changes, under a runout four times the vibration."""
    before, after = state(1), state(2, CHANGE)
    found = compare(before, after, build_model(RIG), settings=SETTINGS).diagnosis.verdict
    causes = [*found.causes, *found.ambiguous_with]
    (cause,) = [c for c in causes if c.effect == "unbalance"]
    size, phase = cause.parameters["eccentricity"], cause.parameters["eccentricity_phase"]
    assert abs(size.value - 2e-7) < 3 * size.std + 0.05 * 2e-7  # the gain is off by 5 %
    assert abs(np.angle(np.exp(1j * (phase.value + 1.0)))) < 3 * phase.std + 0.09  # and the angle
    assert size.std < 0.25 * 2e-7  # 4 % of the vibration, of which runs differ by 0.7 % at each of four speeds
    alone = investigate(after, build_model(RIG), settings=SETTINGS).verdict
    assert not any(c.effect == "unbalance" for c in alone.causes)  # the runout hides it


def test_nothing_is_claimed_where_nothing_changed():
    for seed in range(2):
        found = compare(state(10 + seed), state(20 + seed), build_model(RIG), settings=SETTINGS).diagnosis.verdict
        assert found.verdict == "nothing"
        assert found.detection_limit[0].amplitude > 0
    said = summary(found, of_change=True)
    assert said.startswith("Nothing changed") and "Smallest changes" in said and "missing" not in said


def test_the_floor_of_the_model_error_cancels():
    """A rig that states 5 % of the vibration at every harmonic hides no change of 1 %; runs that differ by 10 % do."""
    rough = SETTINGS.model_copy(update={"model_floor": 0.05})
    found = compare(state(1), state(2, CHANGE), build_model(RIG), settings=rough).diagnosis.verdict
    assert "unbalance" in [c.effect for c in (*found.causes, *found.ambiguous_with)]
    differing = rough.model_copy(update={"repeatability": 0.1})
    found = compare(state(1), state(2, CHANGE), build_model(RIG), settings=differing).diagnosis.verdict
    assert found.verdict == "nothing"


def test_what_differs_from_run_to_run_does_not_cancel():
    settings = SETTINGS.model_copy(update={"run_to_run": ["eccentricity"], "uncertainty": {"default": 0.1}})
    model = build_model(RIG)
    whole, prior = base_model(replace(model, before=frozenset(model.names)), settings)
    stated = base_model(model, settings)[1]
    name = "eccentricity_real"
    assert name not in whole.earlier.names
    assert prior.std[prior.names.index(name)] == pytest.approx(np.sqrt(2) * stated.std[stated.names.index(name)])
    scattered = compare(state(1), state(2, CHANGE), model, settings=settings).diagnosis.verdict
    assert scattered.verdict == "nothing"  # within what two runs differ by


def test_what_all_probes_share_from_run_to_run_is_no_change():
    """A phase mark between two samples turns all readings of one speed, in the later state alone."""
    before, after = state(1), state(2)
    model, settings = _with_scatter(known_as_before(build_model(RIG), before, SETTINGS)[0], SPEEDS, after, SETTINGS)
    whole, prior = base_model(model, settings)
    name = f"mark of the run at {SPEEDS[1]:.6g} rad/s"
    assert name not in whole.earlier.names
    assert prior.std[prior.names.index(name)] == pytest.approx(np.sqrt(2) * SETTINGS.repeatability)
    theta = whole.filled(prior.names, prior.mean)
    _, slopes = measured_response_and_jacobian(whole, SPEEDS, HARMONICS, theta)
    column = slopes[..., whole.names.index(name)]
    np.testing.assert_allclose(column[1], 1j * HARMONICS[:, None] * after.amplitude[1], rtol=1e-12)
    assert not column[[0, 2, 3]].any()


def test_states_that_cannot_be_compared():
    before, model = state(1), build_model(RIG)
    apart = replace(state(2), speed=SPEEDS * 1.1)
    refused(lambda: compare(before, apart, model, settings=SETTINGS), "no speed is common")
    refused(lambda: compare(before, state(2).at_harmonics([1, 2]), model, settings=SETTINGS), "different harmonics")
    refused(lambda: compare(before, state(1), model, settings=SETTINGS), "same harmonics at every speed")
    rounded = before.with_amplitude(before.amplitude * (1 + 1e-15))  # the same records, with one probe less
    fewer = rounded.along(np.where(np.arange(len(before.sensors)), np.nan, 0.4))
    refused(lambda: compare(before, fewer, model, settings=SETTINGS), "same harmonics at every speed")


def test_a_speed_of_one_state_only_is_told():
    part = state(2).at_speeds([0, 1, 2])
    found = compare(state(1), part, build_model(RIG), settings=SETTINGS)
    (told,) = [one for one in found.diagnosis.verdict.findings if one.name == "speeds of one state"]
    assert told.severity == "note" and "3 others are" in told.text
    np.testing.assert_array_equal(found.difference.speed, SPEEDS[:3])


def test_states_of_which_neither_is_compared_at_half_of_its_speeds_are_doubtful():
    apart = state(2, speeds=SPEEDS * [1.0, 1.02, 1.02, 1.02])
    verdict = compare(state(1), apart, build_model(RIG), settings=SETTINGS).diagnosis.verdict
    assert "Check the records first: speeds of one state" in summary(verdict, of_change=True)


def test_speeds_within_a_percent_are_those_of_the_other_state():
    """The model says what their difference changes, here twelve times the noise."""
    before, after = state(1), state(2, speeds=SPEEDS * (1 + np.array([0.009, -0.008, 0.0095, 0.006])))
    found = compare(before, after, build_model(RIG), settings=SETTINGS)
    assert found.diagnosis.verdict.verdict == "nothing"
    apart = np.abs(after.amplitude - before.amplitude).max()
    assert apart > 10 * NOISE and np.abs(found.difference.amplitude).max() < apart / 2


def test_a_speed_before_is_compared_with_one_speed_after():
    """Two speeds after within 1 % of the same one before: its noise must not count twice."""
    twice = state(2)
    twice = twice.at_speeds([0, 0, 1, 2, 3])
    speed = twice.speed.copy()
    speed[0] *= 1.003
    found = compare(state(1), replace(twice, speed=speed), build_model(RIG), settings=SETTINGS)
    np.testing.assert_array_equal(found.after.speed, SPEEDS)
    told = [one.text for one in found.diagnosis.verdict.findings if one.name == "speeds of one state"]
    assert len(told) == 1 and f"{speed[0]:.4g} rad/s" in told[0]


@pytest.mark.usefixtures("unhidden")
def test_the_command_writes_a_page_that_says_what_changed(tmp_path, capsys):
    rig = {**RIG, "measurement": {"harmonics": [1, -1, 2], "table_noise_m": NOISE},
           "diagnosis": {"nuisance": CHAIN, "hold_out_rad_s": [], "leave_out": SLOW, "most_causes": 1}}  # fmt: skip
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(rig))
    for name, one in (("before", state(1, None, SMALL)), ("after", state(2, CHANGE, SMALL))):
        write_harmonics(tmp_path / f"{name}.csv", one)
    states = [f"--{name}={tmp_path / name}.csv" for name in ("before", "after")]
    assert main(["compare", *states, f"--rig={tmp_path / 'rig.yaml'}", f"--out={tmp_path / 'out'}"]) == 0
    assert capsys.readouterr().out.startswith("Something changed")
    page = (tmp_path / "out" / "index.html").read_text()
    assert "What changed in rig" in page and "Both states" in page
    assert problems([tmp_path / "out" / "index.html"], tmp_path) == []
    assert (tmp_path / "out" / "figures" / "two_states.png").is_file()
    if BROWSER:
        assert sheets(page, tmp_path) == 1 < sheets(page, tmp_path, unfolded=True)
    build_model(yaml.safe_load((tmp_path / "out" / "extended_rig.yaml").read_text()))


def test_a_rig_that_misses_the_state_before_misses_as_much_of_the_change():
    """The error of the rig is that of its prediction of the change too; a rig that fits keeps the stated one."""
    before = state(1, sizes=SMALL)
    _, notes, error = known_as_before(build_model(RIG), before, SETTINGS)
    assert notes == [] and error == SETTINGS.model_error  # negative control
    bent = replace(before, amplitude=before.amplitude * (1 + 0.2 * np.cos(5 * SPEEDS))[:, None, None])
    _, (note,), error = known_as_before(build_model(RIG), bent, SETTINGS)
    assert note.name == "state before not explained" and error > 10 * SETTINGS.model_error
    assert f"error of {100 * error:.3g} %" in note.text


def on_pedestals(share):
    """A rotor on pedestals, the left one stiffer along x and softer along y by a share, the other softer along x."""
    item = {"kind": "flexible_pedestal", "bearing_stiffness_N_per_m": {"xx": 5e7}, "pedestal_mass_kg": {"xx": 30.0},
            "bearing_damping_N_s_per_m": {"xx": 4000.0}, "pedestal_damping_N_s_per_m": {"xx": 2000.0}}  # fmt: skip
    stiffness = {1: {"xx": 2e7 * (1 + share), "yy": 1.2e7 * (1 - share)}, 5: {"xx": 2e7 / (1 + share), "yy": 1.2e7}}
    rotor = shaft(1.0, 4, disc(2, 22.0, 0.25, 0.13), outer_diameter_m=0.06)
    bearings = [{**item, "node": n, "label": str(n), "pedestal_stiffness_N_per_m": k} for n, k in stiffness.items()]
    lossy = {"kind": "shaft_damping", "shaft_damping_s": 1e-5}
    pushed = {"kind": "unbalance", "node": 2, "unbalance_kg_m": 2e-4}
    return build_model(rig_of(rotor, bearings, lossy, pushed, sensors=[1, 5]))


@pytest.mark.parametrize(("uncertainty", "told"), [({}, False), ({"bearings": 0}, True)])
def test_a_pedestal_that_is_off_is_fitted_to_the_state_before(uncertainty, told):
    """Negative control: held, its error is that of the prediction of the change."""
    before = spectrum_of(on_pedestals(0.12), SPEEDS, HARMONICS, 1e-7, 3)
    _, notes, _ = known_as_before(on_pedestals(0.0), before, Settings(uncertainty=uncertainty))
    assert [note.name for note in notes] == ["state before not explained"] * told


@pytest.mark.parametrize("turn", [0.5, -0.06, 3.0])
def test_a_phase_mark_that_was_moved_is_told(turn):
    """Runout and vibration turned alike; a change of the rotor or of nothing is no turn."""
    before, after = state(1), state(2)
    turned = replace(after, amplitude=after.amplitude * np.exp(1j * turn * HARMONICS)[:, None])
    back, (found,) = without_turn(before, turned, SETTINGS)
    assert found.name == "phase mark moved" and found.severity == "warning"
    np.testing.assert_allclose(back.amplitude, after.amplitude, atol=5e-3 * np.abs(after.amplitude).max())
    large = {**CHANGE, "eccentricity_m": 2e-6}
    for other in (after, state(2, CHANGE), state(2, large)):  # negative controls
        assert without_turn(before, other, SETTINGS) == (other, [])


@pytest.mark.parametrize("turn", [0.5, -0.1, 3.0])
def test_a_phase_mark_that_was_moved_beside_a_change_of_the_unbalance_is_told(turn, monkeypatch):
    """The size of the change follows from the state turned back. Negative controls: changes without a turn."""
    large = {**CHANGE, "eccentricity_m": 2e-6}
    given = SimpleNamespace()
    monkeypatch.setattr(runs_compare, "investigate", lambda *at, **more: vars(given).update(at=at, **more))

    def compared(after):
        compare(state(1), after, build_model(RIG), settings=SETTINGS)
        return given.at[0], [one.name for one in given.findings]

    after = state(2, large)
    difference, names = compared(replace(after, amplitude=after.amplitude * np.exp(1j * turn * HARMONICS)[:, None]))
    assert names == ["phase mark moved"]
    true = after.amplitude - state(1).amplitude
    assert np.abs(difference.amplitude - true).max() < 0.1 * np.abs(true).max()
    runout = after.amplitude + 2e-6 * np.exp(0.3j) * (HARMONICS == 1)[:, None]
    bow = {"kind": "bow", "label": "change", "bow_m": 1e-6}
    for other in (after, replace(after, amplitude=runout), state(2, bow)):
        assert compared(other)[1] == []


def test_a_probe_that_died_between_the_states_leaves_the_motion_along_the_other():
    both = [one.at_harmonics([1, -1]) for one in (state(1), state(2, {**CHANGE, "eccentricity_m": 2e-6}))]
    single = both[1].along([0.7])
    before, after, (told,) = _with_common_probes(both[0], single)
    assert told.name == "probe of one state" and before.single_probes == after.single_probes == [1]
    assert before.data_count == both[0].data_count / 2
    expected = along_probes(both[0].amplitude, both[0].harmonics, np.array([0.7]))
    np.testing.assert_allclose(before.amplitude, expected)
    assert _with_common_probes(*both) == (*both, [])  # negative control
    other = both[0].along([0.7 + np.pi / 2])  # motions along two axes have no difference
    refused(lambda: compare(other, single, build_model(RIG), settings=SETTINGS), "different directions of single")
    verdict = compare(both[0], single, build_model(RIG), settings=SETTINGS).diagnosis.verdict
    assert verdict.verdict in ("cause", "ambiguous")
    assert "unbalance" in [one.effect for one in [*verdict.causes, *verdict.ambiguous_with]]


def test_free_forces_of_fewer_data_than_parts_are_those_of_least_length():
    generator = np.random.default_rng(3)
    matrices, right = generator.normal(size=(5, 2, 4)), generator.normal(size=(5, 2))
    found = least_squares(matrices, right)
    np.testing.assert_allclose((matrices @ found[..., None])[..., 0], right, atol=1e-12)
    np.testing.assert_allclose(
        found, [np.linalg.lstsq(m, r, rcond=None)[0] for m, r in zip(matrices, right, strict=True)]
    )
    tall = np.swapaxes(matrices, -1, -2)  # negative control: more data than parts
    assert least_squares(tall, generator.normal(size=(5, 4))).shape == (5, 2)
