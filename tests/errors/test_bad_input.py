"""Every mistake gets one line that says what was wrong with which value, where, what is allowed, and what to do."""

import copy

import numpy as np
import pytest
from one_line_errors import refused

from rotorstudy import Record, build_model, full_spectrum, load_rig, measured_response, registry
from rotorstudy.measurement.records import keyphasor_signal, reference_signal
from rotorstudy.response.series import synthesize

RIG = {
    "rotor": {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5},
    "cracks": [{"kind": "switching", "stiffness_loss_N_per_m": 2.5e5}],
    "effects": [
        {"kind": "external_damping", "external_damping_N_s_per_m": 100.0},
        {"kind": "unbalance", "eccentricity_m": 5e-6, "eccentricity_phase_rad": 0.5},
    ],
}


def changed(*path, to=None, drop=False):
    rig = copy.deepcopy(RIG)
    part = rig
    for key in path[:-1]:
        part = part[key]
    if drop:
        del part[path[-1]]
    else:
        part[path[-1]] = to
    return lambda: measured_response(build_model(rig, "rig.yaml"), [88.0], [0, 1])


def test_the_rig_itself_is_right():
    build_model(RIG)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            changed("rotor", "kind", to="jefcott"),
            ["unknown rotor 'jefcott'", "did you mean 'jeffcott'", "rig.yaml, rotor"],
        ),
        (changed("cracks", 0, "kind", to="swich"), ["unknown crack 'swich'", "switching", "rig.yaml, cracks[0]"]),
        (changed("effects", 1, "kind", to="unbalanced"), ["unknown effect", "'unbalance'", "effects[1]"]),
        (changed("effects", 1, "kind", drop=True), ["key 'kind' is missing", "effects[1]"]),
        (changed("rotor", "kind", drop=True), ["key 'kind' is missing", "rotor"]),
        (changed("rotor", drop=True), ["section 'rotor' is missing", "rig.yaml"]),
        (changed("rotor", "mass_kg", drop=True), ["key 'mass_kg' is missing", "rig.yaml, rotor"]),
        (changed("rotor", "mass_kg", to=-2.0), ["mass_kg = -2.0", "greater than 0"]),
        (changed("rotor", "mass_kg", to=0), ["mass_kg = 0", "greater than 0"]),
        (changed("rotor", "mass_kg", to="heavy"), ["mass_kg = 'heavy'", "number"]),
        (changed("rotor", "mass_kg", to=float("nan")), ["mass_kg = nan"]),
        (changed("rotor", "mass_kg", to=float("inf")), ["mass_kg = inf"]),
        (changed("rotor", "stiffness_N_per_m", to=-1.0), ["stiffness_N_per_m = -1.0", "greater than 0"]),
        (
            changed("rotor", "stiffnes_N_per_m", to=1.0),
            ["unknown key 'stiffnes_N_per_m'", "did you mean 'stiffness_N_per_m'"],
        ),
        (changed("cracks", 0, "stiffness_loss_N_per_m", to="2.5e5"), ["'2.5e5'", "without quotes"]),
        (changed("cracks", 0, "stiffness_loss", to=1.0), ["unknown key 'stiffness_loss'", "'stiffness_loss_N_per_m'"]),
        (changed("cracks", 0, "order", to=-3), ["order = -3", "greater than or equal to 1"]),
        (changed("effects", 1, "eccentricity_mm", to=1.0), ["unknown key 'eccentricity_mm'", "'eccentricity_m'"]),
        (
            changed("effects", 1, "eccentricity_m", drop=True),
            ["eccentricity_phase_rad", "no magnitude", "eccentricity_m"],
        ),
        (changed("effects", 1, "eccentricity_m", to=float("nan")), ["eccentricity_m = nan", "finite"]),
        (changed("effects", 0, "external_damping_N_s_per_m", drop=True), ["no value for external_damping"]),
        (changed("effects", 1, "node", to=3), ["unknown translation at node '3'", "known: 1"]),
        (changed("sensors", to=[2]), ["node 2", "does not exist", "[1]"]),
        (changed("bearing", to=[]), ["unknown section 'bearing'", "did you mean 'bearings'"]),
        (changed("effects", 0, to=copy.deepcopy(RIG["effects"][1])), ["'eccentricity_real'", "label"]),
        (changed("effects", to={"kind": "unbalance"}), ["effects", "list"]),
        (changed("rotor", to="jeffcott"), ["rotor", "kind"]),
    ],
    ids=lambda part: part[0] if isinstance(part, list) else "",
)
def test_a_wrong_rig_is_refused(change, words):
    refused(change, *words)


def test_a_label_tells_two_of_a_kind_apart():
    rig = copy.deepcopy(RIG)
    rig["effects"].append({"kind": "unbalance", "label": "second", "eccentricity_m": 1e-6})
    assert "eccentricity[second]_real" in build_model(rig).names


H = [0, 1, 2, 3, 5, 7, -1, -3, -5]
W = 88.0
REGRESSION = registry().get("spectrum", "regression")


def record(samples=2000, turns=10.0, **changes):
    time = np.arange(samples) * (turns * 2 * np.pi / W / samples)
    parts = {
        "time": time,
        "displacement": synthesize(np.ones(len(H)), W, H, time)[None],
        "speed": W,
        "sensors": (1,),
        "reference": reference_signal(W, H, time),
        "keyphasor": keyphasor_signal(W, time + 0.01),
        "where": "rec.nc",
    }
    for name, change in changes.items():
        parts[name] = change(parts[name]) if callable(change) else change
    return Record(**parts)


def hole(signal):
    signal = np.array(signal)
    signal[..., 100] = np.nan
    return signal


def without_pulses(signal):
    signal = signal.copy()
    signal[: len(signal) // 2] = 0
    return signal


def test_the_record_itself_is_right():
    for phase in ("reference", "keyphasor", "none"):
        full_spectrum([record()], H, REGRESSION, phase)


@pytest.mark.parametrize(
    ("wrong", "phase", "words"),
    [
        (record(speed=0.0), "none", ["rec.nc", "speed 0", "> 0"]),
        (record(speed=-88.0), "none", ["speed -88", "> 0"]),
        (record(samples=12), "none", ["12 samples are too few for 9 harmonics", "19"]),
        (record(turns=0.8), "none", ["0.80 revolutions", "at least one"]),
        (record(samples=120), "none", ["harmonic 7", "Nyquist", "up to"]),
        (record(displacement=hole), "none", ["displacement has NaN", "first at"]),
        (record(reference=hole), "reference", ["reference has NaN"]),
        (record(keyphasor=hole), "keyphasor", ["keyphasor has NaN"]),
        (record(reference=None), "reference", ["no reference signal", "keyphasor"]),
        (record(keyphasor=None), "keyphasor", ["no keyphasor", "reference"]),
        (record(keyphasor=without_pulses), "keyphasor", ["5 keyphasor pulses in 10.0 revolutions", "one a revolution"]),
        (
            record(keyphasor=lambda s: keyphasor_signal(2 * W, record().time)),
            "keyphasor",
            ["keyphasor pulses", "one a revolution"],
        ),
        (record(keyphasor=lambda s: 0 * s), "keyphasor", ["0 keyphasor pulses"]),
        (record(reference=lambda s: 0 * s), "reference", ["reference signal has no harmonic"]),
        (record(time=lambda t: t**1.01), "none", ["not evenly spaced"]),
        (record(time=lambda t: t[:-1]), "none", ["samples of displacement but 1999 of time"]),
        (record(reference=lambda s: s[:-1]), "reference", ["1999 samples of reference but 2000 of time"]),
        (record(), "refrence", ["unknown phase 'refrence'", "did you mean 'reference'"]),
    ],
    ids=lambda part: part[0] if isinstance(part, list) else "",
)
def test_a_wrong_record_is_refused(wrong, phase, words):
    refused(lambda: full_spectrum([wrong], H, REGRESSION, phase), *words)


def test_files_that_are_not_there_or_not_yaml_are_named(tmp_path):
    refused(lambda: load_rig(tmp_path / "none.yaml"), "none.yaml", "does not exist")
    (tmp_path / "list.yaml").write_text("- a\n- b\n")
    refused(lambda: load_rig(tmp_path / "list.yaml"), "list.yaml", "expected keys and values")
    (tmp_path / "bad.yaml").write_text("rotor: {kind: jeffcott\n")
    refused(lambda: load_rig(tmp_path / "bad.yaml"), "bad.yaml", "not valid YAML")


def test_a_parameter_without_its_label_is_that_of_all_labels():
    unbalances = [{"kind": "unbalance", "label": label, "eccentricity_m": 1e-6} for label in "ab"]
    model = build_model({"rotor": RIG["rotor"], "effects": unbalances})
    assert model.unknown_names(["eccentricity"]) == model.names
    assert model.unknown_names(["eccentricity[b]"]) == model.names[2:]


def test_parameters_asked_for_by_a_wrong_name_are_refused():
    refused(
        lambda: build_model(RIG).unknown_names(["excentricity"]), "unknown parameter 'excentricity'", "eccentricity"
    )
