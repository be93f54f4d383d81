"""Mistakes beyond test_bad_input.py: none may escape as another error, or pass in silence with a wrong number."""

import copy

import numpy as np
import pytest
import yaml
from one_line_errors import refused

from rotorstudy import (
    Problem,
    Record,
    Spectrum,
    build_model,
    full_spectrum,
    load_rig,
    measured_response,
    read_measurement,
    registry,
)
from rotorstudy.measurement.records import keyphasor_signal, records_dataset, reference_signal
from rotorstudy.measurement.spectrum import independent_covariance
from rotorstudy.response.series import synthesize
from rotorstudy.store import save
from rotorstudy.studies.config import load_study

RIG = {
    "rotor": {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5},
    "effects": [
        {"kind": "external_damping", "external_damping_N_s_per_m": 100.0},
        {"kind": "unbalance", "eccentricity_m": 5e-6, "eccentricity_phase_rad": 0.5},
    ],
}
H, W = [0, 1, 2, -1], 88.0
TURN = 2 * np.pi / W
TIME = np.arange(4000) * 10 * TURN / 4000  # ten whole turns
METHODS = list(registry().plugins["spectrum"].values())
ESTIMATORS = list(registry().plugins["estimator"].values())


def rig(*path, to):
    changed = copy.deepcopy(RIG)
    part = changed
    for key in path[:-1]:
        part = part[key]
    part[path[-1]] = to
    return changed


def with_effect(**effect):
    return {**RIG, "effects": [*RIG["effects"], effect]}


def test_the_rig_itself_is_right():
    assert build_model(RIG).sensors == (1,)
    assert build_model(rig("sensors", to=[1])).sensors == (1,)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (rig("sensors", to=1), ["rig.yaml", "sensors"]),
        (rig("sensors", to=[1, 1]), ["sensors", "1"]),  # twice the data that there are
        (rig("rotor", "kind", to=["jeffcott"]), ["rig.yaml, rotor", "kind"]),
        (rig("effects", 0, "kind", to={}), ["rig.yaml, effects[0]", "kind"]),
        (rig("effects", 0, to="unbalance"), ["rig.yaml, effects[0]", "kind"]),
        (rig("effects", 0, "node", to="one"), ["node = 'one'", "effects[0]", "integer"]),
        (rig("effects", 0, "node", to=1.5), ["node = 1.5", "effects[0]"]),
        (with_effect(kind="runout", node=4, runout_1X_m=1e-6), ["node", "4", "known: 1"]),
        (with_effect(kind="sensor_gap", node=4, sensor_gap_m=1e-3), ["node", "4", "known: 1"]),
        (with_effect(kind="bow", node=4, bow_m=1e-3), ["node '4'", "known: 1"]),
        (rig("rotor", "mass_kg", to=True), ["mass_kg = True", "rig.yaml, rotor", "number"]),  # YAML reads yes as True
        (rig("rotor", "mass_kg", to=None), ["mass_kg = None", "number"]),
        (rig("rotor", "gravity_m_per_s2", to=-1.0), ["gravity_m_per_s2 = -1.0", "greater than or equal to 0"]),
        (rig("effects", 0, "external_damping_N_s_per_m", to=True), ["external_damping_N_s_per_m = True", "number"]),
        (rig("effects", 0, "external_damping_N_s_per_m", to=[1.0]), ["= [1.0]", "effects[0]", "number"]),
        (rig("effects", 0, "external_damping_N_s_per_m", to=None), ["= None", "effects[0]", "number"]),
        (rig("effects", 1, "eccentricity_phase_rad", to=float("inf")), ["eccentricity_phase_rad = inf", "finite"]),
        (with_effect(kind="crack_force", participation=[1, 2]), ["participation = [1, 2]", "effects[2]", "dict"]),
        (with_effect(kind="crack_force", harmonics=[1, 1]), ["stiffness_loss_p1"]),
        ({**RIG, 1: 2}, ["unknown section '1'", "known: bearings, cracks"]),
        ({}, ["section 'rotor' is missing in rig.yaml"]),
        (None, ["rig.yaml"]),
    ],
    ids=lambda part: part[0] if isinstance(part, list) else "",
)
def test_a_wrong_rig_is_refused(wrong, words):
    refused(lambda: build_model(wrong, "rig.yaml"), *words)


def test_a_rig_entry_without_items_is_a_rig_without_them():
    assert build_model(rig("effects", to=None)).names == ()


def test_a_node_that_is_text_is_not_answered_with_itself():
    """Now: `unknown translation at node '1' in the rotor; did you mean '1'?`"""
    message = refused(lambda: build_model(rig("sensors", to=["1"])))
    assert "did you mean '1'" not in message


def test_a_number_in_quotes_is_told_to_be_written_without_them():
    def message(value):
        return refused(
            lambda: build_model(rig("effects", 1, "eccentricity_m", to=value)), f"eccentricity_m = {value!r}"
        )

    assert "without quotes" in message("5.0e6")
    assert "without quotes" in message("0.5")
    assert "without quotes" not in message("small")


def test_a_model_without_parameters_says_so_when_asked_for_unknowns():
    """Now: `the rig gives every parameter a value; name the unknown ones (of )`."""
    message = refused(lambda: build_model({"rotor": RIG["rotor"]}).unknown_names())
    assert "(of )" not in message


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"", ["expected keys and values", "x.yaml"]),
        (b"3\n", ["expected keys and values"]),
        (b"rotor:\n\tkind: x\n", ["line 2", "not valid YAML"]),
        (b"rotor: !!python/object:os.system {}\n", ["line 1", "not valid YAML"]),
        (b"a: \x00b\n", ["not valid YAML"]),
        (b"\xff\xfe\x00\xd8", ["x.yaml"]),  # a binary file given by mistake
        (b"rotor: {kind: jeffcott, mass_kg: 2, mass_kg: 3, stiffness_N_per_m: 1}\n", ["mass_kg", "twice"]),
        (b"rotor: {kind: jeffcott, mass_kg: 2020-01-01, stiffness_N_per_m: 1}\n", ["line 1", "timestamp"]),
    ],
    ids=["empty", "number", "tab", "tag", "nul", "binary", "key twice", "date"],
)
def test_a_file_that_is_no_rig_is_refused_with_its_name(tmp_path, text, words):
    (tmp_path / "x.yaml").write_bytes(text)
    refused(lambda: load_rig(tmp_path / "x.yaml"), "x.yaml", *words)


def test_files_that_are_folders_or_missing_are_refused(tmp_path):
    for load in (load_rig, load_study):
        refused(lambda load=load: load(tmp_path), str(tmp_path))
        refused(lambda load=load: load(tmp_path / "none.yaml"), "none.yaml", "does not exist")


MODEL = build_model(RIG)


@pytest.mark.parametrize("speed", [0.0, -5.0, np.nan, np.inf])
def test_a_speed_at_which_there_are_no_harmonics_is_refused(speed):
    refused(lambda: measured_response(MODEL, [88.0, speed], [1]), f"speed {speed:g} rad/s", "> 0")


@pytest.mark.parametrize("harmonics", [[1, 1], [1.5]])
def test_harmonics_that_are_not_distinct_whole_numbers_are_refused_by_a_simulation(harmonics):
    """Now: [1, 1] gives two zeros in silence, [1.5] an IndexError."""
    refused(lambda: measured_response(MODEL, [88.0], harmonics), "harmonic")


def test_resonance_without_damping_is_refused():
    """Now: infinite harmonics (one coordinate), or a LinAlgError (several)."""
    undamped = {
        "rotor": {"kind": "jeffcott", "mass_kg": 1.0, "stiffness_N_per_m": 1e4},
        "effects": [{"kind": "unbalance", "eccentricity_m": 1e-6}],
    }
    assert np.isfinite(measured_response(build_model(undamped), [99.0], [1])).all()
    with np.errstate(all="ignore"):
        refused(lambda: measured_response(build_model(undamped), [100.0], [1]), "100 rad/s")


def record(**changes):
    parts = {
        "time": TIME,
        "displacement": synthesize(np.ones(len(H)), W, H, TIME)[None],
        "speed": W,
        "sensors": (1,),
        "reference": reference_signal(W, H, TIME),
        "keyphasor": keyphasor_signal(W, TIME + 0.01),
        "where": "rec.nc",
    }
    return Record(**{**parts, **changes})


def marks(*turns):
    """A keyphasor with a pulse at each of these turns."""
    return sum(keyphasor_signal(W, TIME - t * TURN) * (abs(TIME - t * TURN) < TURN / 2) for t in turns)


REGULAR = np.arange(10) + 0.3


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
@pytest.mark.parametrize("harmonics", [[], [1, 1, 2], [1.5]])
def test_harmonics_that_are_not_distinct_whole_numbers_are_refused_by_a_spectrum(method, harmonics):
    """Now: [] ValueError, [1, 1] LinAlgError (regression) or accepted (fft), [1.5] the value of 1X in silence."""
    refused(lambda: full_spectrum([record()], harmonics, method, "none"), "harmonic")


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (record(displacement=record().displacement[0]), ["rec.nc", "displacement"]),
        (record(sensors=(1, 2)), ["rec.nc", "sensors"]),
        (record(time=np.where(TIME[5] == TIME, np.nan, TIME)), ["rec.nc", "time"]),
        (record(time=0 * TIME), ["rec.nc", "time"]),
        (record(time=TIME[::-1]), ["rec.nc", "increasing"]),
        (record(speed=np.nan), ["rec.nc", "speed nan"]),
    ],
    ids=lambda part: " ".join(part) if isinstance(part, list) else "",
)
def test_a_wrong_record_is_refused(method, wrong, words):
    full_spectrum([record()], H, method, "none")
    refused(lambda: full_spectrum([wrong], H, method, "none"), *words)


def test_no_records_at_all_are_refused(tmp_path):
    refused(lambda: full_spectrum([], H, METHODS[0], "none"), "no record")
    data = records_dataset([record(), record(speed=100.0)]).isel(speed=slice(0, 0))
    save(data, tmp_path / "empty.nc")
    rig = tmp_path / "rig.yaml"
    rig.write_text(yaml.safe_dump(RIG))
    refused(lambda: read_measurement(tmp_path / "empty.nc", rig), "no record")
    refused(lambda: read_measurement([], rig), "no record")


def test_one_missing_pulse_is_bridged():
    expected = np.exp(2j * np.pi * 0.3 * np.array(H))[:, None]
    for pulses in (REGULAR, np.delete(REGULAR, 4)):
        found = full_spectrum([record(keyphasor=marks(*pulses))], H, METHODS[0], "keyphasor").amplitude[0]
        # flanks by straight lines between samples 0.016 rad apart on pulses 0.1 rad wide: 0.016^2 / 0.1 / 8 at worst
        assert found == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize(
    "pulses",
    [
        np.delete(REGULAR, [3, 4, 5]),
        np.concatenate([REGULAR, REGULAR + 0.5]),
        [
            *REGULAR,
            4.8,
        ],  # half-way: now turns 1X by 0.05 turns, though the stated covariance grows with it
        [*np.delete(REGULAR, 6), 4.8],  # one lost and one spurious: the count is right, the marks are not
    ],
    ids=["three missing", "double", "one spurious", "one missing, one spurious"],
)
def test_a_keyphasor_whose_pulses_are_not_one_a_turn_is_refused(pulses):
    refused(
        lambda: full_spectrum([record(keyphasor=marks(*pulses))], H, METHODS[0], "keyphasor"), "rec.nc", "keyphasor"
    )


def spectrum(**changes):
    amplitude = measured_response(MODEL, [88.0, 308.0], H)
    covariance = independent_covariance(np.full(amplitude.shape, 1e-18))
    parts = {"amplitude": amplitude, "speed": np.array([88.0, 308.0]), "harmonics": np.array(H), "sensors": (1,)}
    return Spectrum(**{**parts, "covariance": covariance, **changes})


@pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda e: e.name)
@pytest.mark.parametrize(
    ("wrong", "names", "words"),
    [
        (spectrum(amplitude=spectrum().amplitude * np.nan), ("external_damping",), ["NaN"]),
        (spectrum(covariance=spectrum().covariance * np.nan), ("external_damping",), ["covariance"]),
        (spectrum(sensors=(2,)), ("external_damping",), ["sensors"]),
        (spectrum(speed=np.array([88.0, 0.0])), ("external_damping",), ["speed 0", "> 0"]),
        (spectrum(), (), ["unknown"]),
        (spectrum(), ("external_dampin",), ["did you mean 'external_damping'"]),
        (spectrum(), ("external_damping", "external_damping"), ["external_damping"]),
    ],
    ids=["NaN harmonics", "NaN covariance", "other sensors", "speed zero", "no unknowns", "misspelt", "twice"],
)
def test_a_problem_that_cannot_be_solved_is_refused(estimator, wrong, names, words):
    assert estimator.function(Problem(MODEL, spectrum(), ("external_damping",))).theta == pytest.approx(100.0)
    refused(lambda: estimator.function(Problem(MODEL, wrong, names)), *words)
