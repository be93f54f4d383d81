"""A diagnosis in other units of mass, length and time is the same: what is usual follows from the rotor itself."""

import re
from functools import cache

import numpy as np
import pytest
from machines import SLOW, disc, full_bearing, point, readings, rig_of, shaft

from rotorstudy import build_model, measured_response, registry
from rotorstudy.diagnosis.search.candidates import candidates, with_vibration
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.investigate import investigate
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.response.neighbourhood import Neighbourhood

pytestmark = pytest.mark.usefixtures("right_conventions")

HARMONICS = np.array([0, 1, -1, 2, -2, 3])
# kg m s: a turbine, a gram-sized rotor that is stiff and fast; and a thousand times all forces of the issue
SI = (1.0, 1.0, 1.0)
UNITS = {"turbine": (1000.0, 10.0, 3.0), "micro": (1e-6, 0.01, 0.02), "heavy": (1000.0, 1.0, 1.0)}

SPRING = {"kind": "linear", "bearing_stiffness_N_per_m": 2e5, "bearing_damping_N_s_per_m": 100.0}
JEFFCOTT = rig_of(point(gravity_m_per_s2=9.81), [SPRING], {"kind": "unbalance", "eccentricity_m": 5e-6})
SHAFT = rig_of(
    shaft(0.6, 3, disc(2), youngs_modulus_Pa=2.1e11, density_kg_per_m3=7850.0, gravity_m_per_s2=9.81),
    [full_bearing(n, 3e6 * np.eye(2), 1e3 * np.eye(2), label=f"bearing {n}") for n in (1, 4)],
    {"kind": "unbalance", "node": 2, "eccentricity_m": 1e-5},
    {"kind": "external_damping", "node": 2, "external_damping_N_s_per_m": 60.0}, sensors=[2, 3]
)  # fmt: skip
SPEEDS = {"jeffcott": np.array([250.0, 400.0, 500.0, 640.0, 900.0]), "shaft": np.array([120.0, 200.0, 280.0, 330.0])}
NOT_OFFERED = {  # effects that need a tilt, or a bearing with numbers, and the crack of the other kind of rotor
    "jeffcott": {"angular_misalignment", "bearing_change", "couple_unbalance", "foundation_change", "gyroscopic_error",
                 "transverse_crack"},
    "shaft": {"bearing_change", "breathing_crack", "foundation_change"},
}  # fmt: skip
RIGS = {"jeffcott": JEFFCOTT, "shaft": SHAFT}


def dimension(unit):
    """Exponents (mass, length, time) of an SI unit written as `N s/m` or `N_s_per_m`."""
    known = {"kg": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2), "Pa": (1, -1, -2), "rad": (0, 0, 0)}
    total, sign = np.zeros(3), 1
    for word in re.split(r"[ _]|(/)", unit.replace("per", "/")):
        if word == "/":
            sign = -1
        elif word and word != "1":
            name, power = re.fullmatch(r"([A-Za-z]+)(\d*)", word).groups()
            total += sign * int(power or 1) * np.array(known[name])
    return total


def factor(unit, scale):
    """By what a number in an SI unit is multiplied if mass, length and time are."""
    return float(np.prod(np.array(scale) ** dimension(unit)))


def key_unit(key):
    """The unit at the end of a key; none for a name without."""
    found = re.search(r"_((?:kg|m|s|N|Pa|rad)(?:_(?:per_)?(?:kg|m|s|N|rad)\d?)*)$", key)
    return found.group(1) if found else "1"


def rescaled(item, scale, key=""):
    """A rig with every number multiplied as its key says."""
    if isinstance(item, dict):
        return {name: rescaled(value, scale, name) for name, value in item.items()}
    if isinstance(item, list):
        return [rescaled(value, scale, key) for value in item]
    return item * factor(key_unit(key), scale) if isinstance(item, float) else item


def hidden_in(rig, *items):
    return {**rig, "effects": [*rig["effects"], *({**item, "label": f"hidden {i}"} for i, item in enumerate(items))]}


def record(rig, speeds, scale=SI, noise=2e-8):
    """Harmonics of the rig in SI, as the scale shows them; the noise is the same in every scale."""
    model = build_model(rig)
    shown, std = measured_response(model, speeds, HARMONICS), noise / np.sqrt(2)
    return readings(shown * scale[1], speeds / scale[2], HARMONICS, model.sensors, std * scale[1], 7)


@cache
def offered(name, scale):
    """Term -> (candidate, (unknown, component) change of the whitened spectrum by one unit of each amplitude)."""
    spectrum = with_model_error(record(RIGS[name], SPEEDS[name], scale), Settings())
    model = with_vibration(build_model(rescaled(RIGS[name], scale)), spectrum)
    whole, _ = base_model(model, Settings())
    every, broken = candidates(model, Settings())
    assert not broken
    near, found = Neighbourhood(whole, spectrum.speed, spectrum.harmonics, np.nan_to_num(whole.stated), order=7), {}
    for one in every:
        changes = near.changes_by_output if one.term.acts_on_output else near.changes_by_forces
        change = changes([(one.term.unknowns, None)])
        found[one.term.label] = one, spectrum.whitened(np.moveaxis(change, -1, 0))
    return found


@pytest.mark.parametrize(("name", "units"), [*(("jeffcott", units) for units in UNITS), ("shaft", "turbine")])
def test_every_candidate_is_expected_as_large_in_any_units(name, units):
    """Of every effect at every place: what one standard deviation of the prior changes, and the range of its shape."""
    scale = UNITS[units]
    here, there = offered(name, SI), offered(name, scale)
    assert list(here) == list(there)
    known = {e.name for e in registry().plugins["effect"].values() if e.candidate}
    assert known - {one.effect for one, _ in here.values()} == NOT_OFFERED[name]
    for label, (one, change) in here.items():
        other, other_change = there[label]
        std, other_std = (np.array([c.prior[n][1] for n in c.names])[:, None] for c in (one, other))
        size = np.abs(change * std).max()
        # the matrices of a shaft have condition numbers of 1e7, the search for a contact ends at 1e-9 of the motion
        assert np.abs(change * std - other_change * other_std).max() <= 1e-6 * size, label
        for option, value in one.shape.items():
            assert other.shape[option] == pytest.approx(value * factor(key_unit(option), scale), rel=1e-9), label
        # negative control: a size in SI of the first rotor
        if {u.unit for u in one.term.unknowns} <= {"kg", "m", "N s/m"} and units != "heavy":
            assert np.abs(change * std - other_change * std).max() >= 0.5 * size, label


HIDDEN = {
    "anisotropy": ("jeffcott", {"kind": "support_anisotropy", "support_anisotropy_N_per_m": 2e4}),
    "rub": (
        "jeffcott",
        {"kind": "rub", "rub_stiffness_N_per_m": 2e5, "clearance_m": 6e-6, "friction_ratio": 0.2},
    ),
    # small enough that the fit of the rig alone converges: steps that lead nowhere magnify round-off
    "moment": ("shaft", {"kind": "angular_misalignment", "node": 3, "misalignment_moment_2X_N_m": 0.3,
                         "misalignment_moment_1X_N_m": 0.1}),
}  # fmt: skip


def diagnosed(rig, hidden, speeds, scale):
    left_out = sorted({*SLOW, "seal", "support_loss"} - {hidden["kind"]})  # all effects: the test above
    settings = Settings(most_causes=1, candidates_per_round=4, leave_out=left_out)
    spectrum = record(hidden_in(rig, hidden), speeds, scale)
    return investigate(spectrum, build_model(rescaled(rig, scale)), settings=settings)


@pytest.mark.parametrize("case", HIDDEN)
def test_a_whole_diagnosis_is_the_same_in_any_units(case):
    name, hidden = HIDDEN[case]
    scale = UNITS["turbine"]
    speeds = SPEEDS[name][1:4] if case == "rub" else SPEEDS[name]  # a contact is slow to fit
    one, other = (diagnosed(RIGS[name], hidden, speeds, s) for s in (SI, scale))
    one, other = one.verdict, other.verdict
    assert one.verdict == other.verdict == "cause"
    assert one.log_posterior_odds == pytest.approx(other.log_posterior_odds, abs=1e-4)
    for these, those in ((one.causes, other.causes), (one.ambiguous_with, other.ambiguous_with)):
        for a, b in zip(these, those, strict=True):
            assert (a.effect, a.where) == (b.effect, b.where)
            assert a.posterior_probability == pytest.approx(b.posterior_probability, abs=1e-6)
            for key, found in a.parameters.items():
                unit = found.unit or key_unit(key)
                assert b.parameters[key].value == pytest.approx(found.value * factor(unit, scale), rel=1e-4), key
    for a, b in zip(one.detection_limit, other.detection_limit, strict=True):
        assert (a.effect, a.where) == (b.effect, b.where)
        assert a.of_typical == pytest.approx(b.of_typical, rel=1e-6)
