"""Negative controls: for every check of every kind a plugin that breaks it, and for every claim one each way."""

from dataclasses import replace

import numpy as np
import pytest

from rotorstudy import Entry, NonlinearForce, Parameter, RotorstudyError, Structure, registry
from rotorstudy.authoring.invariants import INVARIANTS, outcomes
from rotorstudy.authoring.invariants.base import BrokenInvariant, claimed, kind_of, numbers_checked, stated
from rotorstudy.authoring.invariants.crack import depth_keeps_to_its_range
from rotorstudy.authoring.invariants.spectrum import spectrum_is_exact, spectrum_tolerates_outliers
from rotorstudy.model.entries import planar_entries
from rotorstudy.model.kinds import Bearing, Crack, CrackDepth, Effect, Estimator, Feared, Rotor, SpectrumMethod

ZOO = registry()
SAYS = {"source": "none", "checked": "nothing at all"}


class Forgetful(Entry):
    """Its gain in frequency depends on the harmonic, though it claims to exist in time."""

    def gain_at(self, speed, harmonic):
        return np.ones(np.broadcast_shapes(np.shape(speed), np.shape(harmonic))) * (1 + 0.01 * np.asarray(harmonic))


def rotor(mass=1.0, load=9.81, loss=1.0):
    structure = Structure(mass * np.eye(1), np.eye(1), np.zeros((1, 1)), load * np.ones(1), ((1, "translation"),),
                          {"stiffness_loss": (loss * np.eye(1), "N/m", 0.3)})  # fmt: skip
    return Rotor("wrong", lambda: structure, **SAYS)


def crack(function, series=None, **more):
    return Crack("wrong", function, series=series, **SAYS, **more)


def cosine(angle):
    return (1 + np.cos(angle)) / 2


def drifting_series():
    """A series that is another one at each call."""
    calls = iter(range(1000))
    return lambda order: {0: 0.5 + 0.1 * next(calls)}


def depth(xi, eta=lambda d: 0.5 * d, valid=(0.0, 0.5)):
    return CrackDepth("wrong", lambda depth_ratio: (xi(depth_ratio), eta(depth_ratio)), valid=valid, **SAYS)


def term(kind, *entries, typical=1.0, unit="N/m", **more):
    return kind("wrong", lambda structure: [Parameter("k", unit, entries, typical)], **SAYS, **more)


def pushing(push):
    """An effect whose force in time is a function of the displacement (..., time, coordinate)."""
    force = NonlinearForce(np.eye(1), lambda displacement, velocity, deflection: push(displacement))
    return Effect("wrong", lambda structure, node=None: [Parameter("k", "N/m", (), 1.0, force=force)], **SAYS)


def with_a_stop(gap):
    """A bearing with a spring, and a stop that never acts."""
    force = NonlinearForce(np.eye(1), lambda z, *_: -np.maximum(np.abs(z) - gap, 0.0) * np.sign(z))
    parameters = [Parameter("k", "N/m", (spring(-1.0),), 1e6), Parameter("stop", "N/m", (), 1e6, force=force)]
    return Bearing("wrong", lambda structure, node=None: parameters, **SAYS)


def planar(stiffness=(), damping=()):
    """A bearing with some coefficients {direction: value}."""
    entries = [e for ab, k in dict(stiffness).items() for e in planar_entries(ab, np.array([[-k]]), 0)]
    return [*entries, *(e for ab, c in dict(damping).items() for e in planar_entries(ab, np.array([[-c]]), 1))]


def spring(stiffness=-1e5, **more):
    return Entry(stiffness * np.eye(1), **more)


def effect(**more):
    return replace(ZOO.get("effect", "external_damping"), name="wrong", **more)


def spectrum(like, change, **more):
    """A method whose amplitude and covariance are changed from those of a good one."""

    def function(signal, time, speed, harmonics):
        return change(*ZOO.get("spectrum", like).function(signal, time, speed, harmonics))

    return SpectrumMethod("wrong", function, **SAYS, **more)


def sure_of_marks(signal, time, speed, harmonics, marks):
    amplitude, covariance = ZOO.get("spectrum", "order_tracking").function(signal, time, speed, harmonics, marks)
    return amplitude, 0.1 * covariance


def estimator(change):
    return Estimator("wrong", lambda problem: change(ZOO.get("estimator", "least_squares").function(problem)), **SAYS)


def singular():
    return Estimator("wrong", lambda problem: np.linalg.inv(np.zeros((2, 2))), **SAYS)


def flipped(kind, name, flag):
    """A plugin of the library that claims what it does not hold, or does not claim what it holds."""
    plugin = ZOO.get(kind, name)
    return replace(plugin, **{flag: not getattr(plugin, flag)})


def undefined(speed):
    return np.where(speed == 150, np.nan, 1)


ALONG_ETA = {0: (0.5, 0.1, 0), 1: (0.25, 0, 0), -1: (0.25, 0, 0)}
DRIVES = {"xx": 300.0, "xy": 90.0, "yx": 90.0, "yy": 20.0}
PEDESTAL = ZOO.get("bearing", "flexible_pedestal")


def half(a):
    return np.stack([0.5 + 0 * a, 0.5 + 0 * a, 0 * a])


EVERY = {check.__name__: check for check in (stated, numbers_checked, *(c for own in INVARIANTS.values() for c in own))}
CONTROLS = [
    ("stated", crack(lambda a: a), "no docstring"),
    ("stated", replace(ZOO.get("effect", "bow"), source=""), "no source"),
    (
        "stated",
        replace(ZOO.get("effect", "bow"), base_rate=-1.0),
        "base_rate = -1.0 in @Effect of 'bow': input should be",
    ),
    ("numbers_checked", replace(ZOO.get("effect", "bow"), checked="theory"), "checked = 'theory' says too little"),
    ("rotor_is_mechanical", rotor(mass=-1.0), "mass matrix is not positive"),
    ("rotor_is_mechanical", rotor(mass=1j), "mass is not real"),
    ("rotor_weighs", rotor(load=0.0), "static load is zero"),
    ("rotor_losses_take_away", rotor(loss=-1.0), "adds stiffness"),
    ("rotor_numbers_move", rotor(), "none of its numbers"),
    ("rotor_numbers_move", replace(ZOO.get("rotor", "jeffcott"), uncertain={"weight": 0.01}), "'weight' is no option"),
    ("crack_is_bounded", crack(lambda a: 0.5 + 0.6 * np.cos(a)), "goes from -0.1 to 1.1"),
    ("crack_is_bounded", crack(lambda a: np.stack([0 * a, 1.2 + 0 * a, 0 * a])), "along eta"),
    ("crack_is_bounded", crack(lambda a: np.nan * a), "NaN"),
    ("crack_is_bounded", crack(lambda a: np.stack([a, a])), r"shape \(2, 4000\)"),
    ("crack_never_stiffens", crack(lambda a: half(a) + [[0], [0], [0.6]] + 0 * a), "negative eigenvalue"),
    ("crack_never_stiffens", crack(lambda a: half(a) + [[0.3], [0.3], [0.5]] + 0 * a), "1.3 times the loss"),
    ("crack_is_periodic", crack(lambda a: (1 + np.cos(a / 2)) / 2), "a revolution later"),
    ("crack_is_symmetric", crack(lambda a: (1 + np.sin(a)) / 2, symmetric=True), "opening and closing"),
    ("crack_is_symmetric", crack(lambda a: half(a) + [[0], [0], [0.1]] + 0 * a, symmetric=True), "opening and closing"),
    ("crack_series_is_the_function", crack(cosine, lambda n: {0: 0.5, 1: 0.25}), "coefficient -1"),
    ("crack_series_is_the_function", crack(cosine, lambda n: {0: 0.4, 1: 0.25, -1: 0.25}), "0"),
    ("crack_series_is_the_function", crack(cosine, lambda n: ALONG_ETA), "along eta"),
    ("crack_force_is_its_table", crack(lambda a: a, drifting_series()), "force of one unit"),
    ("crack_is_found_again", crack(lambda a: 0 * a, lambda n: {0: 0.0}), "stiffness_loss"),
    ("crack_is_bounded", crack(lambda a, share: share + 0 * a), "key 'share' is missing in example of 'wrong'"),
    (
        "depth_is_monotone",
        replace(ZOO.get("depth", "elasticity"), example={}),
        "key 'diameter_m' is missing in example",
    ),
    ("depth_is_monotone", depth(lambda d: d + 1e-3), "zero depth"),
    ("depth_is_monotone", depth(lambda d: d * (0.6 - d)), "does not increase"),
    ("depth_is_monotone", depth(lambda d: 0.4 * d), "larger along eta"),
    ("depth_is_monotone", depth(lambda d: d / (0.5 - d) if d < 0.5 else np.inf), "two finite"),
    ("depth_keeps_to_its_range", depth(lambda d: d, valid=(0.5, 0.2)), "not a valid range"),
    ("depth_comes_back", depth(lambda d: d, lambda d: 2 * d), "more along xi, and not all"),
    ("depth_comes_back", depth(lambda d: d * (0.6 - d), lambda d: 0.4 * d * (0.6 - d)), "of a smaller depth too"),
    ("term_states_units", term(Bearing, spring(), typical=0.0), "typical size 0"),
    ("term_is_one_table", term(Bearing, Forgetful(np.eye(1), gain=np.ones_like)), "differ"),
    ("term_is_found_again", term(Bearing, spring(0.0)), "do not depend on k"),
    ("bearing_is_finite", term(Bearing, spring(gain=undefined)), "not finite at 150 rad/s"),
    ("bearing_carries", term(Bearing, spring(order=1)), "no static stiffness"),
    ("bearing_carries", term(Bearing, spring(1e5)), "rises against its weight"),
    ("bearing_numbers_exist", replace(ZOO.get("bearing", "linear"), uncertain={"clearance_m": 0.1}), "no number"),
    ("bearing_numbers_exist", replace(PEDESTAL, uncertain={"pedestal_mass_kg": 3}), "10 %"),
    ("bearing_takes_energy", term(Bearing, spring(order=1, stiffness=300.0), positive_damping=True), "gains energy"),
    ("bearing_takes_energy", term(Bearing, *planar(damping=DRIVES), positive_damping=True), "energy from its damping"),
    ("bearing_takes_energy", term(Bearing, spring(), positive_damping=True), "loses no energy"),
    ("bearing_is_symmetric", term(Bearing, *planar({"xy": 3e4, "yx": -3e4}), symmetric=True), "drive a whirl"),
    ("bearing_is_symmetric", term(Bearing, *planar(damping={"xy": 20.0}), symmetric=True), "xy and yx differ"),
    ("effect_offers_places", effect(places=lambda structure, sensors: []), "no place"),
    ("effect_offers_places", effect(places=lambda structure, sensors: {"node": 1}), "must give a list of options"),
    ("effect_offers_places", effect(places=lambda structure: []), r"places\(structure, sensors\): .* takes 1"),
    ("effect_offers_places", effect(places=lambda structure, sensors: [{}, {}]), "twice"),
    ("effect_offers_places", effect(places=lambda structure, sensors: [{"node": 7}]), "own place"),
    ("effect_names_exist", effect(positive=("drag",)), r"unknown parameter 'drag'.*known: external_damping"),
    ("effect_names_exist", effect(confounders={"unbalanc": "the speed"}), "did you mean 'unbalance'"),
    ("effect_names_exist", effect(feared=Feared("size", 3.0)), "unknown option or parameter 'size'"),
    ("effect_shape_is_open", effect(shape={"clearance_m": (0, 1)}), "not an option"),
    ("effect_shape_is_open", effect(shape={"node": (1, 0)}), "range"),
    ("effect_shape_is_open", effect(shape={"gap_m": (0, 1, "frequency")}), "'frequency', of rad/s"),
    ("effect_shape_is_open", effect(shape={"gap_m": (0, 1, "lenght")}), "did you mean 'length'"),
    ("term_states_units", term(Effect, spring(), typical=0.0), "typical size 0"),
    ("term_states_units", term(Effect, spring(), unit=""), "no unit"),
    ("term_states_units", term(Effect, spring(), unit="N/metre"), "unknown unit 'metre' in 'N/metre' of k"),
    ("term_is_one_table", term(Effect, Forgetful(np.eye(1), gain=np.ones_like)), "differ"),
    ("term_is_one_table", pushing(lambda z: -1e3 * z * (1 + (z.shape[-2] > 1))), "differ by"),
    ("term_is_one_table", pushing(lambda z: np.zeros_like(z)), "zero on the bench, which vibrates by"),
    ("term_is_one_table", with_a_stop(1.0), "zero on the bench, which vibrates by"),
    ("term_is_found_again", term(Effect, spring(0.0)), "do not depend on k"),
    ("spectrum_is_exact", spectrum("fft", lambda a, c: (a * 1.001, c)), "is off by"),
    ("spectrum_covariance_is_honest", spectrum("fft", lambda a, c: (a, c / 4)), "times the scatter"),
    (
        "spectrum_follows_the_marks",
        SpectrumMethod("wrong", sure_of_marks, uses_marks=True, **SAYS),
        "times the scatter",
    ),
    ("estimator_is_exact", estimator(lambda e: replace(e, theta=1.001 * e.theta)), "off by 0.001"),
    ("estimator_handles_rank_deficiency", singular(), "LinAlgError: Singular matrix; without handles_.* must"),
    ("estimator_covariance_is_honest", estimator(lambda e: replace(e, covariance=e.covariance / 4)), "variance"),
]
CLAIMS = [  # check, kind and plugin, the claim of it that is turned round, what is said
    ("crack_is_symmetric", "crack", "breathing", "symmetric", "set symmetric=True"),
    ("bearing_takes_energy", "bearing", "linear", "positive_damping", "set positive_damping=True"),
    ("bearing_is_symmetric", "bearing", "short_journal", "symmetric", "drive a whirl"),
    ("bearing_is_symmetric", "bearing", "linear", "symmetric", "set symmetric=True"),
    ("spectrum_is_exact_at_any_length", "spectrum", "fft", "any_length", "is off by"),
    ("spectrum_is_exact_at_any_length", "spectrum", "regression", "any_length", "set any_length=True"),
    ("spectrum_tolerates_wrong_speed", "spectrum", "fft", "tolerates_wrong_speed", "is off by"),
    ("spectrum_tolerates_wrong_speed", "spectrum", "fft_multiples", "tolerates_wrong_speed", "is off by"),
    ("spectrum_tolerates_wrong_speed", "spectrum", "sine_fit", "tolerates_wrong_speed", "set tolerates_wrong"),
    ("spectrum_tolerates_outliers", "spectrum", "regression", "tolerates_outliers", "is off by"),
    ("spectrum_tolerates_outliers", "spectrum", "robust_regression", "tolerates_outliers", "set tolerates_out"),
    ("spectrum_follows_the_marks", "spectrum", "regression", "uses_marks", "no argument 'marks'"),
    ("spectrum_follows_the_marks", "spectrum", "order_tracking", "uses_marks", "set uses_marks=True"),
    ("estimator_uses_covariance", "estimator", "least_squares", "uses_covariance", "does not change"),
    ("estimator_uses_covariance", "estimator", "huber", "uses_covariance", "set uses_covariance=True"),
    ("estimator_fits_output", "estimator", "least_squares", "fits_output", "maximum_likelihood"),
    ("estimator_fits_output", "estimator", "huber", "fits_output", "set fits_output=True"),
    ("estimator_handles_rank_deficiency", "estimator", "huber", "handles_rank_deficiency", "damping"),
    ("estimator_handles_rank_deficiency", "estimator", "ridge", "handles_rank_deficiency", "set handles"),
    ("estimator_tolerates_outliers", "estimator", "maximum_likelihood", "tolerates_outliers", "an outlier"),
    ("estimator_tolerates_outliers", "estimator", "huber", "tolerates_outliers", "set tolerates_outliers=True"),
]
CONTROLS += [(check, flipped(*claim), said) for check, *claim, said in CLAIMS]


@pytest.mark.parametrize(
    ("check", "plugin", "said"), [pytest.param(*row, id=f"{row[0]}-{row[1].name}-{row[2]}") for row in CONTROLS]
)
def test_a_wrong_plugin_fails_the_check_it_breaks(check, plugin, said, monkeypatch):
    if plugin.name == "wrong":
        monkeypatch.setitem(ZOO.plugins[kind_of(plugin)], "wrong", plugin)
    with pytest.raises((BrokenInvariant, RotorstudyError), match=said):
        EVERY[check](plugin)


def test_every_check_has_a_control_and_every_claim_one_each_way():
    assert {name for name, _, _ in CONTROLS} == set(EVERY)
    flags = {name: check.flag for name, check in EVERY.items() if hasattr(check, "flag")}
    tried = {(name, getattr(plugin, flags[name])) for name, plugin, _ in CONTROLS if name in flags}
    assert tried == {(name, claimed) for name in flags for claimed in (True, False)}


def test_a_claim_that_is_not_made_is_reported_apart():
    found = {outcome.statement: outcome.state for outcome in outcomes(ZOO.get("spectrum", "fft"))}
    assert found[spectrum_is_exact.__doc__] == "holds"
    assert found[spectrum_tolerates_outliers.__doc__] == "not claimed"
    assert "fails" not in found.values()


def test_a_plugin_that_neither_claims_nor_refuses_is_told_to_refuse():
    @claimed("fits_output", refused_with=RotorstudyError)
    def check(plugin):
        raise BrokenInvariant("off by 0.1")

    with pytest.raises(BrokenInvariant, match="without fits_output it must raise RotorstudyError"):
        check(ZOO.get("estimator", "least_squares"))


def test_a_depth_that_takes_anything_fails_its_range(monkeypatch):
    monkeypatch.setattr("rotorstudy.model.cracks.compliance", lambda plugin, d, **options: np.ones(2))
    with pytest.raises(BrokenInvariant, match="it accepts the depth ratio"):
        depth_keeps_to_its_range(ZOO.get("depth", "strip_integration"))
