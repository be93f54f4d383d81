"""The search: pairs together, every place and shape within reach, one name for one fault, no fit that is rejected."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from machines import SLOW, all_but, disc, faulty, film, jeffcott_rig, rig_of, shaft, spectrum_of, springs, unbalance

from rotorstudy import build_model, registry
from rotorstudy.diagnosis.search import moves
from rotorstudy.diagnosis.search import search as search_module
from rotorstudy.diagnosis.search.candidates import candidate, candidates, with_shape
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.form_by_law import with_other_laws
from rotorstudy.diagnosis.search.form_fit import _Parameters
from rotorstudy.diagnosis.search.odds import Explanation, odds_of
from rotorstudy.diagnosis.search.parts import faults_of_several_parts
from rotorstudy.diagnosis.search.screening import Projection, screen
from rotorstudy.diagnosis.search.search import _due, _fit_best, base_model, begin, search
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.investigate import investigate
from rotorstudy.diagnosis.verdict.words import summary
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.inference.prior import Prior
from rotorstudy.model.terms import share_of
from rotorstudy.plugins import crack_at

pytestmark = pytest.mark.usefixtures("right_conventions", "begun_once")

HARMONICS = np.array([0, 1, -1, 2, -2, 3])
SPEEDS = np.array([120.0, 200.0, 280.0, 360.0, 440.0, 520.0])
KNOWN = Settings(uncertainty={"default": 0.02}, model_error=0.0, model_floor=0.0, leave_out=SLOW)
ONE = KNOWN.model_copy(update={"most_causes": 1, "candidates_per_round": 2})
JEFFCOTT = jeffcott_rig()
TWO_DISCS = rig_of(
    shaft(0.6, 4, disc(2), disc(4, 1.5, 0.0030, 0.0015)), springs({1: "left", 5: "right"}),
    unbalance(2, 1e-5, 0.8, label="disc 1"), unbalance(4, 8e-6, -1.0, label="disc 2"), sensors=[2, 3, 4]
)  # fmt: skip


MODEL = build_model(JEFFCOTT)
MORE = {"kind": "unbalance", "eccentricity_m": 2e-5}


def fault(kind, **values):
    return {"kind": kind, **values}


def measured(model, *faults, seed=1, noise=1e-7, speeds=SPEEDS):
    """Spectrum of a model with faults, with white noise (m)."""
    return spectrum_of(faulty(model, *faults), speeds, HARMONICS, noise / np.sqrt(2), seed)


def only(*effects, **changes):
    """The settings in which only some effects are tried."""
    return KNOWN.model_copy(update={"leave_out": all_but(*effects), **changes})


def started(settings, *faults, rig=TWO_DISCS, **record):
    """A search, not carried out, in records of a rig with faults."""
    model = build_model(rig)
    return begin(model, with_model_error(measured(model, *faults, **record), settings), settings)


def names(causes):
    return [(c.effect, c.where) for c in causes]


def with_3x(size):
    """Records of 20 um more unbalance, with some 3X (m) that no one cause explains together with it."""
    return measured(MODEL, MORE, fault("runout", node=1, harmonic=3, runout_3X_m=size), noise=2e-8)


@pytest.mark.parametrize("faults", [[], [fault("support_anisotropy", support_anisotropy_N_per_m=2e4)]])
def test_a_search_begins_where_its_rig_explains_more(monkeypatch, faults):
    """A fit that ended far from the best is made again from the rig with a free force; beside a fault it is not."""
    work = started(ONE, *faults, rig=JEFFCOTT)
    best = work.base
    far = fit(best.model, work.spectrum, best.prior, steps=0, start=best.theta * (1 if faults else 1.1))
    assert faults or far.cost > best.cost + 100
    monkeypatch.setattr(search_module, "fit", lambda *given, **way: far if "from_afar" in way else fit(*given, **way))
    begun = started(ONE, *faults, rig=JEFFCOTT)
    assert (begun.base is far) == bool(faults) and np.isclose(begun.base.cost, best.cost, rtol=1e-2)
    assert bool(search(begun).best.causes) == bool(faults)


@pytest.mark.parametrize(("size", "is_rejected"), [(0.0, False), (7e-7, True)])
def test_a_fit_that_is_rejected_is_no_cause_however_little_it_leaves(size, is_rejected):
    # forces of a coupling at 1X and 3X would explain both, if the readings were in another unit
    without = [*ONE.leave_out, "parallel_misalignment"]
    more = ONE.model_copy(update={"candidates_per_round": 5, "leave_out": without})
    found = investigate(with_3x(size), MODEL, settings=more).verdict
    assert (found.verdict == "unknown") == is_rejected
    assert (found.residual_p_value.after < ONE.significance) == is_rejected
    assert found.causes[0].effect in ("unbalance", "base_motion")  # equal on a rotor of one mass
    assert ("closest explanation" in found.summary) == is_rejected
    more = found.model_copy(update={"verdict": "unknown", "residual_share": 2.0, "outside_probability": 0.0})
    assert "closest" not in summary(more) and "leaves more than the rig does" in summary(more)


def test_without_any_effect_to_try_what_is_missing_is_unknown():
    found = [investigate(measured(MODEL, *faults), MODEL, settings=only()).verdict for faults in ((), (MORE,))]
    assert [one.verdict for one in found] == ["nothing", "unknown"]
    assert not found[1].causes and found[1].candidates == 0


def test_the_error_of_the_form_of_a_cause_widens_its_intervals_as_far_as_it_is_needed():
    exact = with_3x(0.0)
    pattern = 0.02 * np.resize([1, -1, 0.5, -0.5], len(exact.speed))[:, None, None]
    off = exact.with_amplitude(exact.amplitude + pattern * (exact.amplitude - measured(MODEL, noise=2e-8).amplitude))
    exact, off = (investigate(one, MODEL, settings=ONE) for one in (exact, off))
    assert exact.search.form_error < 0.5 * off.search.form_error and off.search.form_error <= ONE.form_error
    found = [f.verdict.causes[0].parameters["eccentricity"] for f in (exact, off)]
    assert found[1].std > 1.3 * found[0].std  # the unbalance of the rig and the probes give the rest
    assert [one.value for one in found] == pytest.approx([2e-5, 2e-5], abs=4 * found[1].std)


@pytest.mark.parametrize("stiffness", [5e4, 7e4])
def test_an_explanation_by_which_a_motion_grows_is_not_named_but_leads_to_others(stiffness, caplog):
    """Cross-coupling drives a whirl from c w_n = 6.2e4 N/m on; records beyond that can only be made in frequency."""
    caplog.set_level("INFO", "rotorstudy.diagnosis")
    known = ONE.model_copy(update={"uncertainty": {"default": 0.0}})  # damping may not make it stable
    spectrum = measured(MODEL, fault("cross_coupling", node=1, cross_coupling_N_per_m=stiffness))
    found = investigate(spectrum, MODEL, settings=known)
    is_possible = stiffness < 100 * np.sqrt(7.6e5 / 2.0)
    assert ("cross_coupling" in {c.effect for c in found.verdict.causes}) == is_possible
    assert any("cross_coupling" in str(kind) for kind in found.search.impossible) != is_possible
    assert any(record.message.startswith("trying moves from cross_coupling") for record in caplog.records)


def test_a_crack_is_tried_by_its_other_laws_in_the_shape_that_was_found():
    model = build_model(TWO_DISCS)
    every, _ = candidates(model, only("transverse_crack"))
    cause = every[0]
    current = SimpleNamespace(causes=(cause,), fit=SimpleNamespace(values=dict.fromkeys((*cause.names, "rig"), 1.0)))
    tried = moves.other_laws(SimpleNamespace(rig=model, candidates=every, settings=KNOWN), current)
    laws = [one.causes[0].variant["breathing"] for one in tried]
    assert sorted([cause.variant["breathing"], *laws]) == ["gradual", "none", "turning"]
    assert all(one.causes[0].shape == cause.shape and one.values == {"rig": 1.0} for one in tried)


@pytest.mark.parametrize(("stiffness", "is_unstable"), [(5e4, False), (7e4, True)])
def test_an_unstable_rig_is_told_and_no_fault_of_the_cause(stiffness, is_unstable):
    """The same cross-coupling, stated in the rig: records of an unbalance are still those of an unbalance."""
    stated = fault("cross_coupling", node=1, cross_coupling_N_per_m=stiffness)
    model = build_model(JEFFCOTT | {"effects": [*JEFFCOTT["effects"], stated]})
    known = ONE.model_copy(update={"uncertainty": {"default": 0.0}})
    found = investigate(measured(model, MORE), model, settings=known).verdict
    assert found.causes[0].effect in ("unbalance", "base_motion")  # equal on a rotor of one mass
    assert ("unstable rig" in {finding.name for finding in found.findings}) == is_unstable
    if is_unstable:  # records of a seal that is weaker than stated: the cause explains why the machine is stable
        weaker = fault("cross_coupling", node=1, cross_coupling_N_per_m=-3e4)
        found = investigate(measured(model, weaker), model, settings=known).verdict
        assert found.causes[0].effect == "cross_coupling"
        assert "unstable rig" not in {finding.name for finding in found.findings}


def test_columns_at_the_motion_of_the_true_cause_show_it_exactly_however_large_it_is():
    """Screened at the base, a stiffness that moves a critical speed explains little of what it does."""
    model = build_model(TWO_DISCS)
    spectrum = measured(model, fault("support_stiffness", node=2, support_stiffness_N_per_m=-2e5))
    whole, prior = base_model(model, KNOWN)
    every = [c for c in candidates(model, KNOWN)[0] if c.effect == "support_stiffness"]
    true = next(c for c in every if c.where == {"node": 2})
    extended = whole.plus(true.term)
    start = extended.filled([*prior.names, *true.names], [*prior.mean, -1.9e5])
    best = fit(extended, spectrum, prior.plus(Prior.independent(true.prior)), start=start)
    projected = Projection(best, spectrum, true.names).of(every)
    judged = {c.where["node"]: screen(projected, c) for c in every}
    assert judged[2].start == pytest.approx([-2e5], rel=0.01)
    assert max(judged, key=lambda node: judged[node].evidence) == 2


def test_two_causes_are_found_together_where_neither_explains_much_alone():
    model = build_model(TWO_DISCS)
    faults = (
        fault("cross_coupling", node=5, cross_coupling_N_per_m=3e4),
        fault("runout", node=3, harmonic=1, runout_1X_m=6e-6, runout_1X_phase_rad=1.0),
        fault("runout", node=3, harmonic=2, runout_2X_m=4e-6, runout_2X_phase_rad=-2.0),
    )
    few = KNOWN.model_copy(update={"candidates_per_round": 4})
    found = investigate(measured(model, *faults), model, settings=few)
    causes = sorted(names(found.verdict.causes), key=str)
    assert causes == [("cross_coupling", {"node": 5}), ("runout", {"node": 3, "harmonic": [1, 2]})]
    sizes = next(c for c in found.verdict.causes if c.effect == "runout").parameters
    assert sizes["runout_2X"].value == pytest.approx(4e-6, abs=4 * sizes["runout_2X"].std)


def test_a_bow_of_another_shape_is_one_cause():
    model = build_model(TWO_DISCS)
    bows = [fault("bow", node=n, bow_m=b, bow_phase_rad=p) for n, b, p in ((2, 2e-5, 0.3), (4, 1e-5, 2.0))]
    found = investigate(measured(model, *bows), model, settings=ONE)
    assert {c.effect for c in found.verdict.causes} == {"bow"} and len(found.verdict.causes) == 1


@pytest.mark.parametrize("seed", [1, 2])
def test_a_wide_prior_of_amplitudes_widens_no_error_of_form(seed, monkeypatch):
    """The negative control judges that error by the widest prior, and loses odds by it."""
    moments = {"misalignment_moment_1X_N_m": 0.7, "misalignment_moment_2X_N_m": 2.0}
    odds, bent = [], fault("angular_misalignment", node=1, **moments)
    for narrowed in (_Parameters.narrowed, lambda self, theta, *linearised: linearised):
        monkeypatch.setattr(_Parameters, "narrowed", narrowed)
        work = started(KNOWN, bent, noise=1e-6, seed=seed)
        (cause,) = (c for c in work.candidates if c.effect == "angular_misalignment" and c.where == {"node": 1})
        odds.append(odds_of(work.explain((cause,), {})))
    assert odds[0] > odds[1] + 2


def test_a_fault_counts_with_its_places_that_were_not_fitted():
    """As if all were fitted; the negative control is those that were."""
    bent = fault("bow", element=2, last_element=3, bow_angle_rad=1e-4, bow_angle_skew_rad=0.0)
    work, whole = (started(only("bow", "unbalance", most_causes=1), bent, noise=5e-6) for _ in "ab")
    every = [odds_of(whole.explain((c,), {})) for c in whole.candidates if c.effect == "bow"]
    found = search(work)
    some = [odds_of(e) for e in found.explanations if e.faults == {"bow"}]
    shares = {
        faults: sum(w for e, w in found.posterior() if e.faults == faults) for faults in map(frozenset, ({"bow"}, ()))
    }
    counted = np.log(shares[frozenset({"bow"})] / shares[frozenset()])
    assert counted == pytest.approx(np.logaddexp.reduce(every), abs=0.1)
    assert np.logaddexp.reduce(some) < counted - 0.5 and len(some) < len(every) / 4
    found.impossible.update({named: SimpleNamespace(named=named) for named in found.unfitted})  # these do not count
    alone = sum(w for e, w in found.posterior() if e.faults == {"bow"}) / found.posterior()[-1][1]
    assert np.log(alone) == pytest.approx(np.logaddexp.reduce(some), abs=1e-6)


@pytest.mark.parametrize("runouts", [{1: 2e-6, 2: 4e-6, 3: 1e-6}, {2: 4e-6}])
def test_the_parts_of_a_fault_are_tried_together_and_only_those_that_the_data_support(runouts):
    model = build_model(TWO_DISCS)
    faults = (fault("runout", node=3, harmonic=n, **{f"runout_{n}X_m": a}) for n, a in runouts.items())
    spectrum = measured(model, *faults)
    work = begin(model, spectrum, ONE)
    projected, usable = work.project(work.base, work.candidates)
    tried = {parts[0].fault: parts for parts, _ in faults_of_several_parts(work, projected, usable)}
    found = [cause.where["harmonic"] for cause in tried.get("runout, node 3", ())]
    assert sorted(found) == (list(runouts) if len(runouts) > 1 else [])


def test_a_damping_below_the_stated_one_is_a_change_that_may_be_negative():
    speeds = np.array([450.0, 560.0, 600.0, 616.0, 640.0, 700.0])
    less = fault("external_damping", external_damping_N_s_per_m=-40.0)
    found = investigate(measured(MODEL, less, speeds=speeds), MODEL, hold_out=[], settings=KNOWN)
    ((effect, _),) = names(found.verdict.causes)
    damping = found.verdict.causes[0].parameters["external_damping"]
    assert effect == "external_damping" and damping.value == pytest.approx(-40, abs=4 * damping.std)
    # negative control: what the rig has none of cannot become negative
    driven = fault("internal_damping", internal_damping_N_s_per_m=-40.0)
    found = investigate(measured(MODEL, driven, speeds=speeds), MODEL, hold_out=[], settings=KNOWN)
    assert "internal_damping" not in {c.effect for c in found.verdict.causes}


def test_parameters_share_what_acts_alike():
    model = build_model(TWO_DISCS)
    more = faulty(model, fault("external_damping", node=1), fault("internal_damping", node=1))
    damping, internal = (term.unknowns[0] for term in more.terms[-2:])
    shares = {u.name: share_of(damping, u) for u in model.rotor_unknowns}
    assert {name for name, share in shares.items() if share} == {"bearing_damping[left]"}
    assert shares["bearing_damping[left]"] == pytest.approx(1.0)
    assert share_of(internal, damping) == 0.0 and share_of(damping, internal) == pytest.approx(1.0)
    assert share_of(replace(damping, entries=damping.entries[:0]), damping) == 0.0


BOTH = {"added_mass, node 3", "shaft_damping"}
WRONG = {"static_preload, node 3", "shaft_damping"}


def begun():
    """A search by some effects, not carried out."""
    faults = fault("added_mass", node=3, added_mass_kg=0.3), fault("shaft_damping", shaft_damping_s=2e-5)
    return started(only("added_mass", "shaft_damping", "static_preload"), *faults, noise=2e-8)


def test_a_wrong_cause_is_exchanged_for_the_true_one():
    work = begun()
    wrong = work.explain([c for c in work.candidates if c.cause in WRONG], {})
    best = max(moves.exchanges(work, wrong), key=lambda one: one.log_odds)
    assert {c.cause for c in best.causes} == BOTH
    found = work.explain(best.causes, best.values)
    assert odds_of(found) > odds_of(wrong) + 5


def test_a_cause_is_exchanged_where_the_others_alone_allow_no_steady_motion(monkeypatch):
    """Such as a rub beside a support that was wrongly softened; its error of form is then left out."""
    work = begun()
    wrong = work.explain([c for c in work.candidates if c.cause in WRONG], {})
    usual = sorted(str(names(one.causes)) for one in moves.exchanges(work, wrong))

    def fails(*_):
        raise NoSteadyState("no steady state at 25 rad/s")

    monkeypatch.setattr(moves, "predicted", fails)
    again = replace(work, rests={})  # beside which others were exchanged already
    assert sorted(str(names(one.causes)) for one in moves.exchanges(again, wrong)) == usual != []


def test_causes_are_not_exchanged_nor_fitted_again_from_nearly_the_same_shapes():
    """And again from other shapes, or without any: from other values of the rig a fit may end elsewhere."""
    work = begun()
    wrong = work.explain([c for c in work.candidates if c.cause in WRONG], {})
    assert moves.exchanges(work, wrong) and moves.exchanges(work, wrong)
    seals = [candidate(work.rig, "seal", {"node": 3}, {"swirl_ratio": ratio}) for ratio in (0.3, 0.32, 0.5)]
    work.note(work.starts, seals[:1])
    assert [work.was_tried(work.starts, [one]) for one in seals] == [True, True, False]


def crack_by_another_law():
    """A Search that knows a coupling and another law of the crack in its records."""
    crack = fault("breathing_crack", crack="switching", crack_angle_rad=1.1, stiffness_loss_N_per_m=2e4)
    work = started(only("breathing_crack", "parallel_misalignment"), crack, rig=JEFFCOTT, noise=1e-8)
    known = {"crack": "power_cosine", "opened_by": "weight"}, {}  # the only law of a crack, and the coupling
    return replace(work, candidates=[c for c in work.candidates if c.variant in known])


@pytest.mark.parametrize("is_by_its_own", [True, False])
def test_a_crack_by_another_law_is_judged_with_the_largest_error_of_its_own(is_by_its_own, monkeypatch):
    """Negative control: with the usual error it promises less than a coupling reaches, and is not fitted."""
    work = crack_by_another_law()
    if not is_by_its_own:
        monkeypatch.setattr(moves, "largest_error", lambda *_: work.settings.form_error)
    named = search(work).best.named
    assert named == ({"breathing_crack"} if is_by_its_own else {"parallel_misalignment, node 1"})


def test_a_cause_that_cannot_come_near_the_best_is_not_judged_again():
    """Negative control: while nothing is known that explains the records, it is."""
    work = crack_by_another_law()
    motion = work.free_forces[0].fitted
    near = moves.additions(work, work.nothing, [motion])
    far = [one._replace(log_odds=one.log_odds - 1e5 * (one.causes[0].effect == "breathing_crack")) for one in near]

    def judged(found):
        return {one.causes[0].effect for some in moves.of_inexact_form(work, [motion], found) for one in some}

    assert "breathing_crack" in judged(far)
    coupling = next(one for one in near if one.causes[0].effect == "parallel_misalignment")
    work.explain(coupling.causes, coupling.values)
    assert "breathing_crack" in judged(near) and judged(far) == {"parallel_misalignment"}


@pytest.mark.parametrize("has_shifts", [True, False])
def test_a_fault_beside_another_is_sought_from_place_to_place(has_shifts, monkeypatch):
    """Here from two nodes beside the true one, and by nothing else; the negative control stays where it began."""
    wrong = {"added_mass, node 1", "shaft_damping"}

    def begin_there(work):
        causes = tuple(c for c in work.candidates if c.cause in wrong)
        yield [[moves.Proposal(causes, {}, np.inf)]]

    monkeypatch.setattr(search_module, "single_causes", begin_there)
    monkeypatch.setattr(search_module, "moves_from", lambda *_: [])
    monkeypatch.setattr(search_module, "pairs", lambda _: [])
    if not has_shifts:
        monkeypatch.setattr(search_module, "shifts", lambda *_: [])
    assert search(begun()).best.named == (BOTH if has_shifts else wrong)


def bow(first, last):
    return {f"bow, element {first}" + f", last_element {last}" * (last > first)}


def test_what_a_fault_brings_moves_with_it_and_a_stretch_with_one_end_or_both():
    work = started(only("added_mass", "unbalance", "bow", "delay"))

    def next_to(*causes):
        chosen = [next(c for c in work.candidates if c.cause == name) for name in causes]
        values = {name: 1.0 for c in chosen for name in c.names}
        current = SimpleNamespace(causes=tuple(chosen), fit=SimpleNamespace(values=values))
        return [({c.cause for c in moved} - {*causes}, start) for moved, start in moves.shifts(work, current)]

    heavy = next_to("added_mass, node 2", "unbalance, node 2")
    assert [one for one, _ in heavy] == [{f"added_mass, node {n}", f"unbalance, node {n}"} for n in (1, 3)]
    (unbalance,) = (c for c in work.candidates if c.cause == "unbalance, node 3")
    assert {heavy[1][1][name] for name in unbalance.names} == {1.0}
    bent = [one for one, _ in next_to("bow, element 2, last_element 3")]
    assert bent == [bow(*ends) for ends in [(1, 2), (1, 3), (1, 4), (2, 2), (2, 4), (3, 3), (3, 4)]]
    assert [one for one, _ in next_to("bow, element 4")] == [bow(3, 3), bow(3, 4)]
    assert not next_to("bow, element 1", "bow, element 4")  # one fault at two places
    assert not next_to(next(c.cause for c in work.candidates if c.effect == "delay"))


@pytest.mark.parametrize("is_rejected", [True, False])
def test_moves_are_tried_from_the_best_that_can_be_true_however_unlikely_beside_a_rejected_rig(is_rejected):
    """An impossible one of the same effect does not hide it; without cause to doubt the rig it must be likely."""

    def explained(name, odds):
        causes = [SimpleNamespace(effect=name.split(",")[0], variant={})] if name else []
        return SimpleNamespace(causes=causes, kind=name, faults={name}, log_posterior_odds=odds)

    nothing, far, best = explained("", 0.0), explained("bow", -9.0), explained("seal, node 5", -3.0)
    better, worse = explained("seal, node 2", 9.0), explained("seal, node 2", -20.0)
    rig = SimpleNamespace(is_rejected=lambda _: is_rejected)
    given = {"nothing": nothing, "explanations": [nothing, far, best], "settings": KNOWN, "base": rig}
    for impossible, first in ((better, [better]), (worse, [best] * is_rejected)):
        work = SimpleNamespace(**given, impossible={impossible.kind: impossible}, is_doubtful=False)
        assert _due(work, []) == [nothing]
        assert _due(work, [nothing]) == first
        assert _due(work, [nothing, impossible]) == [best] * is_rejected
        assert _due(work, [nothing, impossible, best]) == []


def with_a_mass(other, bow_rad, noise, off=0.0):
    """A search by a mass, a bow and another effect, begun, of a mass at node 2 and of a bow, if it is not zero.

    off : by what share the change is wrong, up and down from speed to speed
    """
    model, settings = build_model(TWO_DISCS | {"sensors": [1, 2, 3, 4]}), only("added_mass", "bow", other)
    faults = [fault("added_mass", node=2, added_mass_kg=0.05)]
    faults += [fault("bow", element=1, bow_angle_rad=bow_rad, bow_angle_skew_rad=0.0)] if bow_rad else []
    found, plain = measured(model, *faults, noise=noise), measured(model, noise=noise)
    pattern = off * np.resize([1, -1, 0.5, -0.5], len(SPEEDS))[:, None, None]
    found = found.with_amplitude(found.amplitude + pattern * (found.amplitude - plain.amplitude))
    return begin(model, with_model_error(found, settings), settings)


def test_an_unbalance_that_a_mass_brings_is_no_fault_that_another_law_is_like():
    """Alone it is one; a pair of the mass and a bow has no form of it. It was a KeyError."""
    work = with_a_mass("unbalance", 1e-3, noise=1e-7)
    chosen = [next(c for c in work.candidates if c.cause == n) for n in ("unbalance, node 2", "added_mass, node 2")]
    bent = next(c for c in work.candidates if c.cause == "bow, element 1")
    alone, both = work.explain(chosen[:1], {}), work.explain((*chosen, bent), {})
    assert alone.named < both.named and not alone.faults < both.faults
    weighed = with_other_laws(work).found
    assert weighed[alone.kind].like == frozenset() and odds_of(weighed[alone.kind]) == odds_of(alone)


@pytest.mark.parametrize("are_two", [True, False])
def test_two_faults_are_found_where_one_explains_them_by_a_large_error_of_form(are_two):
    """A coupling, whose form is known to a third, explains the records of a mass and a bow beside each other."""
    best = search(with_a_mass("parallel_misalignment", bow_rad=1e-4 * are_two, noise=3e-7)).best
    bow = {"bow, element 1"} if are_two else set()
    assert best.named - {"unbalance, node 2"} == {"added_mass, node 2", *bow}


@pytest.mark.parametrize("are_two", [True, False])
def test_a_further_fault_is_worth_its_prior_odds_beside_an_error_of_form(are_two):
    """What a mass changes is off by 5 % from speed to speed: its error of form explains that, and no other fault."""
    work = with_a_mass("shaft_damping", bow_rad=2e-6 * are_two, noise=3e-8, off=0.05)
    mass = work.explain(tuple(c for c in work.candidates if c.cause == "added_mass, node 2"), {})
    more = moves.additions(work, mass, [mass.fit])
    assert bool(more) == are_two
    if are_two:
        assert names(max(more, key=lambda one: one.log_odds).causes)[-1] == ("bow", {"element": 1})


@pytest.mark.parametrize("is_free", [True, False])
def test_a_further_fault_is_judged_with_the_shapes_of_the_others_free(is_free, monkeypatch):
    """A mass that a crack explains by twice the depth, elsewhere; in that shape, held, nothing is missing."""
    shape = {"position_m": 0.36, "depth_ratio": 0.2, "angle_rad": 0.7}
    crack = fault("transverse_crack", **shape, breathing="gradual", flexibility_factor=1.0)
    faults = crack, fault("added_mass", node=4, added_mass_kg=0.3)
    work = started(only("added_mass", "transverse_crack"), *faults, rig=TWO_DISCS | {"sensors": [2, 4]})
    law = next(c for c in work.candidates if c.variant.get("breathing") == "gradual")
    one = work.explain((with_shape(work.rig, law, shape, work.settings.prior_width),), {})
    if not is_free:
        monkeypatch.setattr(moves, "slopes_of", lambda *_: [])
    more = moves.additions(work, one, [one.fit], [c for c in work.candidates if c.effect == "added_mass"])
    assert (("added_mass", {"node": 4}) in [names(two.causes)[-1] for two in more]) == is_free


@pytest.mark.parametrize("may_be_stressed", [True, False])
def test_a_crack_held_open_by_a_residual_stress_is_one_fault(may_be_stressed, monkeypatch):
    """By 30 % of the moment of the weight; a crack without such a stress needs a bend of the shaft beside it."""
    rig, shape = TWO_DISCS | {"sensors": [1, 2, 3, 4]}, {"position_m": 0.36, "depth_ratio": 0.25, "angle_rad": 0.7}
    hinge = crack_at(build_model(rig).structure, *shape.values(), "elasticity", False, 0.0)
    opened = -0.3 * abs(hinge.static_moment)
    crack = fault("transverse_crack", **shape, flexibility_factor=1.0, closing_moment_N_m=opened)
    if not may_be_stressed:
        monkeypatch.setitem(registry().get("effect", "transverse_crack").any_form[1], "closing_moment_share", (0, 1e-6))
    work = started(only("bow", "transverse_crack"), crack, rig=rig, noise=3e-9)
    assert (search(work).best.named == {"transverse_crack"}) == may_be_stressed


@pytest.mark.parametrize(("form", "is_doubtful"), [(0.0, False), (1.0, False), (10.0, True)])
def test_an_explanation_is_doubtful_whose_form_must_err_more_than_noise_beside_a_further_fault(form, is_doubtful):
    """It leaves as little as one in its own form, and is not rejected."""
    work = begun()
    known = search(work).best
    assert known.named == BOTH
    columns = form * np.eye(work.spectrum.data_count)[:, :40]
    fitted = replace(known.fit, misfit=float(work.spectrum.data_count - 40))
    one = replace(known, fit=fitted, spectrum=work.spectrum.with_shared_error(columns))
    found = replace(work, found={**work.found, one.kind: one}, free_forces=[])
    assert (found.is_rejected, found.is_doubtful) == (False, is_doubtful)


@pytest.mark.parametrize(("beside", "promised", "is_doubtful", "is_fitted"), [
    ((), -40, False, False), ((), -20, False, True), ((), -40, True, True), (("shaft_damping",), -40, False, True)
])  # fmt: skip
def test_a_single_fault_is_fitted_if_it_may_lead_near_the_best_one_fitted_before(
    beside, promised, is_doubtful, is_fitted, monkeypatch
):
    """Within 30 of log odds, if the best one is not doubtful; of two faults the promise is no limit."""
    work, fitted = begun(), []
    by_name = {c.cause: c for c in work.candidates}
    first = by_name["added_mass, node 3"]
    other = tuple(by_name[name] for name in ("static_preload, node 3", *beside))

    def explain(work, causes, values):
        fitted.append(causes)
        work.found[len(fitted)] = Explanation(causes, work.base, 1000.0 if causes == (first,) else 0.0)
        return work.found[len(fitted)]

    monkeypatch.setattr(Search, "explain", explain)
    monkeypatch.setattr(Search, "is_doubtful", is_doubtful)
    _fit_best(work, [[moves.Proposal((first,), {}, 1010.0)], [moves.Proposal(other, {}, 1000.0 + promised)]])
    assert fitted == [(first,), other][: 1 + is_fitted]


@pytest.mark.parametrize("on_films", [True, False])
def test_where_a_cause_changes_the_films_others_are_judged_on_these(on_films):
    """Of one fault on springs, the rest were judged at the same motion (negative control)."""
    films = [film(0.03, 0.012, 4e-5, 0.02, node=node, label=f"{node}") for node in (1, 5)]
    rig = TWO_DISCS | ({"bearings": films} if on_films else {})
    work = started(only("static_preload", "parallel_misalignment"), rig=rig)
    cause = next(c for c in work.candidates if c.effect == "parallel_misalignment" and c.where == {"node": 3})
    groups = moves.moves_from(work, work.explain((cause,), dict.fromkeys(cause.names, 0.0)))
    assert (("static_preload", {"node": 3}) in [names(p.causes)[0] for some in groups for p in some]) == on_films


@pytest.mark.usefixtures("few_shapes")
@pytest.mark.parametrize(("true", "is_sought"), [
    (fault("added_mass", node=2, added_mass_kg=0.1), False),
    (fault("transverse_crack", position_m=0.22, depth_ratio=0.3, flexibility_factor=1.0), True),
])  # fmt: skip
def test_a_crack_is_sought_only_where_bending_moments_may_explain_the_records(true, is_sought):
    """Where a mass explains them, no moment in an element comes near. Negative control: a crack."""
    tried = "transverse_crack", "added_mass", "unbalance", "support_stiffness"
    work = started(only(*tried, model_error=1e-3), true, noise=2e-9)
    *first, (found, *_), _ = moves.single_causes(work)
    assert bool(first) == (not is_sought)  # a mass that promises more than the best force
    assert ("transverse_crack" in {p.causes[0].effect for p in found}) == is_sought
    assert max(found, key=lambda one: one.log_odds).causes[0].effect == true["kind"]
