"""A wrongly stated measuring convention is told before any cause is blamed, and no right one is accused."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from machines import all_but, disc, rig_of, spectrum_of, springs, unbalance

from rotorstudy import build_model
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.investigate import investigate
from rotorstudy.diagnosis.verdict.wrong_convention import _accepted
from rotorstudy.model.structure import Reading
from rotorstudy.response.statics import static_deflection

pytestmark = pytest.mark.usefixtures("begun_once")

SPEEDS = np.array([60.0, 110.0, 180.0])
HARMONICS = np.array([0, 1, -1, 2, -2])
NOISE = 3e-8
BLAMED = (  # causes that wrong conventions look like
    *("unbalance", "bow", "static_preload", "gravity_direction", "support_stiffness", "stiffness_error"),
    *("probe_gain", "probe_angle", "phase_reference", "reversed_probe", "swapped_probes", "ac_coupling"),
)
QUICK = {"most_causes": 1, "candidates_per_round": 1, "leave_out": all_but(*BLAMED)}
STRETCHES = [{"length_m": length, "count": 1, "outer_diameter_m": 0.02} for length in (0.2, 0.4, 0.2)]
DISCS = [disc(2, 2.0, 4e-3, 2.1e-3), disc(3, 1.0, 2e-3, 1.1e-3)]
STEEL = {"outer_diameter_m": 0.02, "youngs_modulus_Pa": 2.1e11, "density_kg_per_m3": 7800.0}
RIG = rig_of(
    {"kind": "finite_element", "elements": STRETCHES, "discs": DISCS, **STEEL}, springs((1, 4), 1.3e6),
    unbalance(2, 2e-5, 0.4, label="2"), {"kind": "shaft_asymmetry", "shaft_asymmetry": 0.02},
    {"kind": "external_damping", "node": 2, "label": "2", "external_damping_N_s_per_m": 20.0}, sensors=[2, 3]
)  # fmt: skip
MODEL = build_model(RIG)


def measured(changes=(), seed=1, rig=RIG):
    """Spectrum with noise of a rig with further effects."""
    model = build_model({**rig, "effects": [*rig["effects"], *changes]})
    return spectrum_of(model, SPEEDS, HARMONICS, NOISE / np.sqrt(2), seed)


def read_wrongly(spectrum, change):
    """The spectrum of the record in time z (speed, time, sensor) over a revolution, after `change` of z."""
    samples = 16  # more than twice the highest harmonic
    turning = np.exp(2j * np.pi * np.outer(np.arange(samples), HARMONICS) / samples)
    z = np.einsum("th,whs->wts", turning, spectrum.amplitude)
    amplitude = np.einsum("th,wts->whs", turning.conj(), change(z)) / samples
    scale = np.linalg.norm(amplitude) / np.linalg.norm(spectrum.amplitude)  # the noise is read wrongly too
    return replace(spectrum, amplitude=amplitude, covariance=spectrum.covariance * scale**2)


def at(sensor, change):
    """A change of one sensor."""

    def changed(z):
        return np.stack([change(z[..., s]) if s == sensor else z[..., s] for s in range(z.shape[-1])], axis=-1)

    return changed


SAG = static_deflection(MODEL, SPEEDS, MODEL.theta[: len(MODEL.rotor_unknowns)]).value[..., MODEL.measured]
WRONG = {
    "all readings are 0.03937 times": lambda z: z / 25.4,
    "all readings are 0.5 times": lambda z: z / 2,
    "readings at node 3 are 0.03937 times": at(1, lambda z: z / 25.4),
    "of probe 'x' at node 2 are 0.03937 times": at(0, lambda z: z.real / 25.4 + 1j * z.imag),
    "of probe 'y' at node 3 are 2 times": at(1, lambda z: z.real + 2j * z.imag),
    "probes are turned by 90 degrees": lambda z: z * -1j,
    "phase mark is 90 degrees": lambda z: np.roll(z, -4, axis=1),
    "gravity points -90 degrees": lambda z: np.roll(z, -4, axis=1) * -1j,
    "turns in the other sense": np.conj,
    "nodes are in the reverse order": lambda z: z[..., ::-1],
    "count from the unloaded line": lambda z: z + SAG[:, None],
}


@pytest.mark.parametrize("expected", WRONG)
def test_a_wrong_convention_is_told_and_no_cause_blamed(expected):
    verdict = investigate(read_wrongly(measured(), WRONG[expected]), MODEL, settings=QUICK).verdict
    assert verdict.measuring_chain and expected in verdict.measuring_chain.hypothesis, verdict.summary
    assert verdict.verdict == "unknown" and not verdict.causes and not verdict.ambiguous_with
    assert verdict.findings[0].name == "measuring chain" and verdict.measuring_chain.remedy in verdict.summary


def test_a_probe_at_45_degrees_read_in_another_unit_is_told():
    """The hypothesis follows the axes of the probes; along x and y it would be one for each of two probes."""
    spectrum = read_wrongly(measured(), at(1, one_probe_at_45_degrees_halved))
    reading = Reading({node: {"left": -np.pi / 4, "right": np.pi / 4} for node in MODEL.sensors})
    verdict = investigate(spectrum, build_model(RIG, reading=reading), settings=QUICK).verdict
    assert "of probe 'right' at node 3 are 0.5 times" in verdict.measuring_chain.hypothesis
    assert not verdict.causes


def one_probe_at_45_degrees_halved(z):
    turned = z * np.exp(-0.25j * np.pi)
    return (turned.real / 2 + 1j * turned.imag) * np.exp(0.25j * np.pi)


def test_a_wrong_unit_beside_a_fault_is_told():
    """The fault would be found beside a gain error of the probes that no probe can have."""
    factor = 1 / 25.4
    spectrum = read_wrongly(measured(FAULTS[:1]), lambda z: z * factor)
    settings = {"most_causes": 2, "candidates_per_round": 1, "leave_out": all_but("unbalance", "probe_gain")}
    verdict = investigate(spectrum, MODEL, settings=settings).verdict
    assert f"all readings are {factor:.4g} times" in verdict.measuring_chain.hypothesis, verdict.summary
    assert verdict.verdict == "unknown" and not verdict.causes


FAULTS = [
    unbalance(3, 2e-5, 1.0, label="more"),
    {"kind": "bow", "node": 2, "label": "more", "bow_m": 2e-5, "bow_phase_rad": -2.0},
    {"kind": "static_preload", "node": 2, "label": "more", "static_preload_N": 30.0, "static_preload_phase_rad": 0.3},
    {"kind": "reversed_probe", "node": 3, "probe": "x", "reversed_probe_x": 1.0},
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault["kind"])
def test_a_fault_is_not_taken_for_a_convention(fault):
    """Negative control: faults that look like a unit (bow, unbalance), a zero (preload) and a sign (reversed probe)."""
    verdict = investigate(measured([fault]), MODEL, settings=QUICK).verdict
    assert verdict.measuring_chain is None
    assert fault["kind"] in {cause.effect for cause in (*verdict.causes, *verdict.ambiguous_with)}, verdict.summary


def test_a_clean_record_is_not_accused():
    verdict = investigate(measured(), MODEL, settings=QUICK).verdict
    assert verdict.measuring_chain is None and verdict.verdict == "nothing"


@pytest.mark.parametrize(("beside", "cost", "is_told"), [(0, 5e3, True), (1, 5e3, False), (1, 90.0, True)])
def test_what_a_convention_leaves_is_excused_by_a_fault_once(beside, cost, is_told):
    """A twentieth of the excess error, or noise: a fault that was found beside it excuses no more than noise."""

    def fitted(cost):
        return SimpleNamespace(cost=cost, penalty=1.0, names=["a", "b"], residual=np.zeros(100), evidence=-cost / 2,
                               model=MODEL)  # fmt: skip

    hypothesis = SimpleNamespace(name="the unit is another", remedy="state it")
    tested = SimpleNamespace(hypothesis=hypothesis, fit=fitted(cost), log_factor=0.0)
    cause = SimpleNamespace(effect="unbalance", where={"node": 2})
    explained = SimpleNamespace(causes=(cause,) * beside, fit=fitted(cost), log_posterior_odds=0.0)
    work = SimpleNamespace(settings=Settings())
    assert (_accepted(tested, explained, fitted(2e6), 0.0, work) is not None) == is_told
