"""Machines on oil films whose clearance differs from the rig file: the numbers of bearings move in every fit."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import yaml
from machines import SLOW, all_but, disc, readings, rig_of, shaft, unbalance

from rotorstudy import Problem, build_model, measured_response, measured_response_and_jacobian, registry
from rotorstudy.blind.machines import rig_items
from rotorstudy.blind.machines.beam import Element
from rotorstudy.blind.machines.contacts import add_elliptic_forces
from rotorstudy.blind.machines.effects import add_preload, add_unbalance
from rotorstudy.blind.machines.film import Film, add_film, bearing, running_position
from rotorstudy.blind.machines.machine import GRAVITY, Disc, Rotor, build
from rotorstudy.blind.machines.stepping import steady_state
from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.runs.compare import compare
from rotorstudy.diagnosis.search import film_error, moves
from rotorstudy.diagnosis.search.film_error import with_film_error
from rotorstudy.diagnosis.search.moves import additions, loading_films
from rotorstudy.diagnosis.search.search import begin
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict import sought, wrong_convention
from rotorstudy.diagnosis.verdict.extend import extended_rig
from rotorstudy.inference.estimate import estimate_rig
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.model.rig_numbers import with_numbers

pytestmark = pytest.mark.usefixtures("right_conventions")

SPEEDS, HARMONICS, NODES = np.array([90.0, 120.0, 150.0, 180.0, 210.0, 240.0]), np.array([1, -1, 2, -2]), (0, 2, 6)
SHAFT = Element(length=0.15, outer_diameter=0.06, youngs_modulus=2.1e11, density=7850.0)
DISCS = (Disc(2, 20.0, 0.2, 0.11), Disc(4, 30.0, 0.4, 0.21))
LEFT = Film(node=0, diameter=0.06, length=0.03, clearance=1e-4, viscosity=0.02, load=320.0)
FILMS = (LEFT, replace(LEFT, node=6, load=350.0))
UNBALANCE = {2: 20 * 1e-5 * np.exp(0.4j), 4: 30 * 8e-6 * np.exp(-2j)}  # kg m
CLEARANCE = "bearings[left].radial_clearance_m"
ML = registry().get("estimator", "maximum_likelihood")
KNOWN = {"default": 0.01, "rotor": 0.0, "eccentricity": 0.05, "bearing_scale": 0.0}
STRICT = {"model_error": 1e-3, "model_floor": 1e-4, "nuisance": {}, "leave_out": SLOW, "candidates_per_round": 4}


def motion_on(films, speeds, harmonics, heavier=1.0, add=None):
    """Harmonics (speed, harmonic, sensor), m, on linear films; add(machine, speed) : what acts beside the unbalance."""
    shown = np.empty((len(speeds), len(harmonics), len(NODES)), complex)
    for i, speed in enumerate(speeds):
        machine = build(Rotor((SHAFT,) * 6, DISCS, tuple(bearing(film, speed) for film in films)))
        for node, value in UNBALANCE.items():
            add_unbalance(machine, node, heavier * abs(value), np.angle(value))
        if add:
            add(machine, speed)
        shown[i] = steady_state(machine, [speed], steps=32).harmonics(NODES, harmonics)[0]
    return shown


def seen(shown, std, seed=None, speeds=SPEEDS, harmonics=HARMONICS):
    """A Spectrum of harmonics that the sensors show, as `readings` has it."""
    return readings(shown, speeds, harmonics, [node + 1 for node in NODES], std, seed)


def true_spectrum(films, seed, noise=3e-9):
    """What the sensors show of the machine on these films, with noise."""
    return seen(motion_on(films, SPEEDS, HARMONICS), noise / np.sqrt(2), seed)


def rms_left(spectrum, shown, order):
    """Of an order, in standard deviations, of what some harmonics leave of a spectrum."""
    off = spectrum.by_harmonic(spectrum.whitened(spectrum.amplitude - shown))
    return float(np.sqrt(np.mean(off[:, np.abs(spectrum.harmonics) == order] ** 2)))


def rig(*effects, heavier=1.0, loads=True):
    """The rig file of the machine on the films as drawn, with effects; without loads those of the weight are taken."""
    discs = [disc(d.node + 1, d.mass, d.polar_moment, d.diametral_moment) for d in DISCS]
    rotor = shaft(0.9, 6, *discs, outer_diameter_m=0.06, gravity_m_per_s2=GRAVITY)
    bearings = [
        rig_items.film(0.06, 0.03, 1e-4, film.viscosity, node=film.node + 1, label=label, load_N=film.load)
        for film, label in zip(FILMS, ("left", "right"), strict=True)
    ]
    for one in bearings if not loads else ():
        del one["load_N"]
    pushed = [
        unbalance(n + 1, heavier * abs(u), float(np.angle(u)), label=str(n), mass_kg=1.0) for n, u in UNBALANCE.items()
    ]
    return rig_of(rotor, bearings, *pushed, *effects, sensors=[node + 1 for node in NODES])


@pytest.fixture(scope="module")
def worn():
    """A healthy machine whose left bearing has a clearance 10 % above the drawing."""
    return true_spectrum((replace(FILMS[0], clearance=1.1e-4), FILMS[1]), 1)


def test_a_machine_on_films_is_predicted():
    true = motion_on(FILMS, SPEEDS, HARMONICS)
    assert np.abs(measured_response(build_model(rig()), SPEEDS, HARMONICS) - true).max() < 1e-6 * np.abs(true).max()


def test_a_larger_clearance_is_identified_within_its_interval(worn):
    names = [CLEARANCE, "eccentricity[2]", "eccentricity[4]"]
    model = with_numbers(build_model(rig()), names)
    found = estimate_rig(ML, Problem(model, worn, model.unknown_names(names)), rig())
    value, std = found.theta[0], found.std[0]
    assert abs(value - 0.1) < 3 * std < 0.03
    assert found.misfit < 1.5 * worn.data_count
    # negative control: as drawn it does not explain the record
    held = estimate_rig(ML, Problem(model, worn, model.unknown_names(names[1:])), rig())
    assert held.misfit > 20 * worn.data_count


def test_an_uncertain_clearance_moves_and_is_reported_and_is_no_fault(worn):
    stated = {**STRICT, "uncertainty": {**KNOWN, CLEARANCE: 0.04, "bearings[right].radial_clearance_m": 0.04}}
    diagnosis = investigate(worn, build_model(rig()), settings=Settings(**stated))
    assert diagnosis.verdict.verdict == "nothing"
    (moved,) = (row for row in diagnosis.verdict.base_parameters if row.name == CLEARANCE)
    assert moved.value == pytest.approx(0.1, abs=3 * moved.std) and moved.stated == 0
    assert moved.stated_std == 0.04 and 2 < moved.moved_sigma < 3
    after = yaml.safe_load(yaml.safe_dump(extended_rig(rig(), diagnosis)))
    assert after["bearings"][0]["radial_clearance_m"] == pytest.approx(1.1e-4, rel=3 * moved.std)
    assert CLEARANCE in build_model(after).uncertainty.names
    # negative control: held as drawn, the same record is of a faulty machine
    held = investigate(worn, build_model(rig()), settings=Settings(**STRICT, uncertainty=KNOWN))
    assert held.verdict.verdict != "nothing"


# of the effects that act alike, so that the search is short; with all of them the same is named
ALIKE = {"bearing_change", "bearing_coefficients", "external_damping", "stiffness_error", "support_stiffness"}
ALIKE |= {"unbalance"}


def verdict_on(spectrum):
    settings = Settings(**{**STRICT, "leave_out": all_but(*ALIKE)}, uncertainty=KNOWN)
    return investigate(spectrum, build_model(rig()), settings=settings)


@pytest.mark.parametrize(
    ("number", "changed", "share"),
    [("radial_clearance_m", {"clearance": 1.35e-4}, 0.35), ("viscosity_Pa_s", {"viscosity": 0.012}, -0.4)],
)
def test_a_film_that_changed_is_named_with_its_number(number, changed, share):
    """A clearance 35 % larger, oil 40 % thinner: told from each other, and from free coefficients."""
    spectrum = true_spectrum((replace(LEFT, **changed), FILMS[1]), 3, noise=3e-8)
    diagnosis = verdict_on(spectrum)
    (cause,) = diagnosis.verdict.causes
    assert (cause.effect, cause.where) == ("bearing_change", {"node": 1, "number": number})
    size = cause.parameters["bearing_change"]
    assert size.value == pytest.approx(share, abs=3 * size.std) and size.std < 0.05
    extended = build_model(extended_rig(rig(), diagnosis))
    stated = dict(zip(extended.names, extended.stated, strict=True))
    assert [value for name, value in stated.items() if name.startswith("bearing_change")] == [size.value]


def test_a_change_of_films_is_promised_by_steps_of_a_fit_too(monkeypatch):
    """From the rig as fitted, whatever columns at another motion promise. Negative control: nothing without them."""
    spectrum = true_spectrum((replace(LEFT, viscosity=0.012), FILMS[1]), 3, noise=3e-8)
    settings = Settings(**{**STRICT, "leave_out": all_but(*ALIKE)}, uncertainty=KNOWN)
    work = begin(build_model(rig()), spectrum, settings)
    monkeypatch.setattr(moves, "additions", lambda *_: [])

    def promised():
        return [one for groups in moves.single_causes(work) for group in groups for one in group]

    best = max(promised(), key=lambda one: one.log_odds)
    (cause,) = best.causes
    assert cause.where == {"node": 1, "number": "viscosity_Pa_s"}
    assert best.values[cause.names[0]] == pytest.approx(-0.4, abs=0.03)
    monkeypatch.setattr(moves, "by_steps_of_a_fit", lambda *_: [])
    assert not promised()


CHANGED = replace(LEFT, clearance=1.35e-4)


def moved_by(film, speeds):
    """How far the sensors see the shaft from where it ran on LEFT, (speed, sensor), m, on another left film."""
    moved = [np.subtract(*(running_position(one, w) for one in (film, LEFT))) @ [1, 1j] for w in speeds]
    return np.outer(moved, [1, 2 / 3, 0])


def test_a_film_that_changed_moves_its_journal():
    """0X counts from where the journal ran, and the shaft tilts about the other film."""
    change = {"kind": "bearing_change", "node": 1, "number": "radial_clearance_m", "bearing_change": 0.35}
    model = build_model(rig(change))
    found, true = measured_response_and_jacobian(model, SPEEDS, [0]), moved_by(CHANGED, SPEEDS)
    assert np.abs(found.response[:, 0] - true).max() < 1e-4 * np.abs(true).max() and np.abs(true).max() > 3e-5
    up, down = (moved_by(replace(LEFT, clearance=(1.35 + step) * 1e-4), SPEEDS) for step in (1e-4, -1e-4))
    (slope,) = np.moveaxis(found.jacobian[:, 0], -1, 0)[[name.startswith("bearing_change") for name in model.names]]
    assert np.abs(slope - (up - down) / 2e-4).max() < 1e-4 * np.abs(slope).max()
    # a rig with the other number counts from there (negative control)
    worn = rig()
    worn["bearings"][0]["radial_clearance_m"] = 1.35e-4
    assert not measured_response(build_model(worn), SPEEDS, [0]).any()


FEW = SPEEDS[[0, 2, 3, 5]]
DRIFTED = np.outer(np.linspace(0, 1, 4), [5e-6j, 0, 0])  # at one bearing, up to 5 % of its clearance


@pytest.mark.parametrize(
    ("film", "means", "is_named"),
    [
        (CHANGED, moved_by(CHANGED, FEW), True),
        (LEFT, moved_by(CHANGED, FEW), False),  # a journal that moved, and vibrates as before
        (LEFT, DRIFTED, False),
        (LEFT, DRIFTED, True),  # negative control: without the allowance for drift
    ],
)
def test_means_are_data_of_a_comparison_as_far_as_probes_keep_their_place(film, means, is_named, monkeypatch):
    """A film that changed is named; a drift names nothing."""
    harmonics = np.array([0, 1, -1, 2, -2])
    shown = np.array([on_true_films(tuple(FEW), tuple(harmonics), films=(one, FILMS[1])) for one in (LEFT, film)])
    shown[1, :, 0] += means
    before, after = (seen(one, 1e-7, seed, FEW, harmonics) for seed, one in enumerate(shown))
    settings = Settings(
        leave_out=all_but("bearing_change", "bearing_coefficients", "static_preload"), uncertainty=KNOWN
    )
    if means is DRIFTED and is_named:
        monkeypatch.setattr(film_error, "DRIFT", 0.0)
        settings = settings.model_copy(update={"nuisance": settings.nuisance | {"sensor_gap": 1e-9}})
    verdict = compare(before, after, build_model(rig()), settings=settings).diagnosis.verdict
    assert (verdict.verdict != "nothing") == is_named
    if film is CHANGED:
        (cause,) = verdict.causes
        assert cause.effect == "bearing_change" and cause.where == {"node": 1, "number": "radial_clearance_m"}


def test_a_spring_at_the_film_is_no_change_of_its_numbers():
    spring = {"kind": "support_stiffness", "node": 1, "support_stiffness_N_per_m": 1e6}
    sprung, sound = (measured_response(build_model(one), SPEEDS, HARMONICS) for one in (rig(spring), rig()))
    spectrum = true_spectrum(FILMS, 4, noise=3e-8)
    (cause,) = verdict_on(replace(spectrum, amplitude=spectrum.amplitude + sprung - sound)).verdict.causes
    assert cause.effect == "support_stiffness"


@cache
def on_true_films(speeds, harmonics, heavier=1.0, preload=0.0, twice=0.0, films=FILMS):
    """Harmonics (speed, harmonic, sensor), m, on films whose force is that of Reynolds' equation at every instant.

    speeds, harmonics : tuples;  heavier : times the unbalance
    preload, twice : constant force, and forward one at 2X, at node 4, N
    """

    def add(machine, speed):
        for film, linear in zip(films, machine.rotor.bearings, strict=True):
            add_film(machine, film, linear, [speed])
        add_preload(machine, 3, abs(preload), np.angle(preload))
        add_elliptic_forces(machine, 3, {(2, 0): (twice, 0.0)})

    return motion_on(films, np.array(speeds), np.array(harmonics), heavier, add)


TWO = (90.0, 210.0)  # of the speeds
FAR_ASIDE = 500.0 * np.exp(2.5j)  # a constant force, up and aside, by more than the weight


@pytest.fixture(scope="module")
def far_aside():
    """What the sensors show of it."""
    return seen(on_true_films(tuple(SPEEDS[::2]), tuple(HARMONICS), 0.3, FAR_ASIDE), 1e-8, None, SPEEDS[::2])


@pytest.mark.parametrize("effect", [
    {"kind": "static_preload", "node": 4, "static_preload_N": 400.0, "static_preload_phase_rad": 1.9},
    {"kind": "parallel_misalignment", "node": 4, "harmonics": [0],
     "misalignment_force_0X_N": 400.0, "misalignment_force_0X_phase_rad": 1.9},
])  # fmt: skip
def test_a_constant_force_changes_the_load_of_the_films_and_with_it_their_coefficients(effect):
    """In size and direction, by 35 degrees; and it moves the journals, by half of the clearance."""
    aside = on_true_films(TWO, (1, -1, 0), 0.3, 400.0 * np.exp(1.9j))
    speeds, harmonics, true = TWO, np.array([1, -1]), aside[:, :2]
    model, sound = (build_model(rig(*one, heavier=0.3, loads=False)) for one in ([effect], []))
    mean = measured_response(model, speeds, [0])[:, 0, ::2]  # at the films
    assert np.abs(mean - aside[:, 2, ::2]).max() < 0.02 * np.abs(mean).max()  # what the orbit adds to the mean
    found = measured_response_and_jacobian(model, speeds, [*harmonics, 0])
    size = np.abs(true).max()
    assert np.abs(found.response[:, :2] - true).max() < 2e-3 * size  # of a film that is integrated over fewer points
    # negative control: with the load of the weight
    assert np.abs(measured_response(sound, speeds, harmonics) - true).max() > 0.2 * size
    for p in np.flatnonzero([name.endswith(("_real", "_imag")) and "eccent" not in name for name in model.names]):
        step = np.zeros(len(model.names))
        step[p] = 0.5
        ends = (measured_response(model, speeds, [*harmonics, 0], model.theta + sign * step) for sign in (1, -1))
        slope = np.subtract(*ends)
        assert np.abs(found.jacobian[..., p] - slope).max() < 1e-5 * np.abs(slope).max()


def test_the_place_of_a_force_that_changes_films_by_much_is_told_by_steps_of_a_fit(far_aside, monkeypatch):
    """What the rig with linear films promises is most at another node."""
    settings = Settings(leave_out=all_but("static_preload"), uncertainty=KNOWN, nuisance={})
    work = begin(build_model(rig(heavier=0.3, loads=False)), far_aside.at_harmonics([1, -1]), settings)

    def most_promising():
        return max(additions(work, work.nothing, [work.free_forces[0].fitted]), key=lambda one: one.log_odds)

    best = most_promising()
    (cause,) = best.causes
    assert cause.where == {"node": 4}
    assert complex(*(best.values[name] for name in cause.names)) == pytest.approx(FAR_ASIDE, rel=5e-3)
    monkeypatch.setattr(moves, "STEPS", 0)  # negative control: nothing but where it begins
    assert most_promising().log_odds < best.log_odds - 100
    monkeypatch.setattr(moves, "needs_fit", lambda cause, structure: False)  # negative control: linear films
    assert most_promising().causes[0].where != {"node": 4}


def test_the_place_of_a_coupling_that_loads_films_is_told_by_steps_of_a_fit(far_aside):
    """A misalignment at rest, of more than the weight, with amplitudes of all other harmonics and a stiffness."""
    settings = Settings(leave_out=all_but("parallel_misalignment"), uncertainty=KNOWN, nuisance={})
    work = begin(build_model(rig(heavier=0.3, loads=False)), far_aside, settings)

    def best_of(proposals):
        return max(proposals, key=lambda one: one.log_odds)

    best = best_of(loading_films(work))
    (cause,) = best.causes
    assert cause.where == {"node": 4}
    constant = complex(*(best.values[name] for name in cause.names if "_0X" in name))
    assert constant == pytest.approx(FAR_ASIDE, rel=0.15)
    linear = best_of(additions(work, work.nothing, [work.free_forces[0].fitted]))
    assert linear.causes[0].where != {"node": 4}  # negative control


def test_three_films_share_a_constant_force_as_their_springs_do():
    """A third bearing at the force, which would carry it alone if it was rigid."""
    speeds, harmonics, small, force = TWO, (1, -1), 0.3, 100.0j
    preload = {"kind": "static_preload", "node": 4, "static_preload_N": 100.0, "static_preload_phase_rad": np.pi / 2}
    files, pushed = (rig(*one, heavier=small, loads=False) for one in ([], [preload]))
    files["bearings"] = [{**files["bearings"][0], "node": n, "label": f"{n}"} for n in (1, 4, 7)]
    model = build_model(files)
    loads = [film.load for film in model.structure.films]
    films = [replace(LEFT, node=n, load=load) for n, load in zip((0, 3, 6), loads, strict=True)]
    true = on_true_films(speeds, harmonics, small, force, films=tuple(films))

    def off(one):
        return np.abs(measured_response(one, speeds, harmonics) - true).max() / np.abs(true).max()

    assert off(build_model(pushed | {"bearings": files["bearings"]})) < 0.03  # by springs at one usual speed
    here = model.structure.index(4)
    for one, load in zip(files["bearings"], loads, strict=True):  # negative control: shared as by rigid bearings
        rigid = load + force * model.structure.carried_at(one["node"])[here]
        one |= {"load_N": float(abs(rigid)), "load_angle_rad": float(np.angle(rigid))}
    assert off(build_model(files)) > 0.06


def test_what_linear_films_leave_out_is_within_the_error_that_a_diagnosis_allows():
    speeds, heavier, every = TWO, 20.0, tuple(HARMONICS)
    shown = on_true_films(speeds, every, heavier)
    record, files, growth = seen(shown, 1e-9, None, speeds), rig(heavier=heavier), 0.25
    model, lighter = build_model(files), build_model(rig(heavier=heavier / (1 + growth)))
    linear, before = measured_response(model, speeds, HARMONICS), on_true_films(speeds, every, heavier / (1 + growth))
    assert rms_left(record, linear, 2) > 10  # negative control
    assert 0.1 < rms_left(with_film_error(record, model), linear, 2) < 2
    # of a change of 2X, which linear films do not have
    assert rms_left(record, before, 2) > 10
    assert 0.1 < rms_left(with_film_error(record, lighter, growth=np.full(2, growth)), before, 2) < 2
    spring = {"kind": "linear", "bearing_stiffness_xx_N_per_m": 1e8}
    stiff = files | {"bearings": [spring | {"node": n, "label": f"{n}"} for n in (1, 7)]}
    assert with_film_error(record, build_model(stiff)) is record


@pytest.mark.parametrize("shared", [True, False])
def test_a_sound_machine_whose_films_are_not_linear_has_no_fault(shared, monkeypatch):
    """Negative control: an error of each probe and speed alone is explained by a contact."""
    heavier, every = 10.0, (1, -1, 2, -2, 3, -3)
    shown = on_true_films(tuple(SPEEDS), every, heavier)
    record = seen(shown, 2e-8, harmonics=np.array(every))

    def apart(*given, **more):
        found = with_film_error(*given, **more)
        return replace(found, common_error=None).with_error(np.sum(np.abs(found.common_error) ** 2, axis=0) / 2)

    if not shared:
        monkeypatch.setattr(sought, "with_film_error", apart)
    several = all_but("looseness", "rub", "unbalance", "parallel_misalignment", "angular_misalignment")
    settings = Settings(**STRICT | {"leave_out": several}, hold_out_rad_s=[], uncertainty=KNOWN)
    found = investigate(record, build_model(rig(heavier=heavier)), settings=settings)
    assert found.search.base.p_value > 0.1
    assert (found.verdict.verdict == "nothing") == shared
    assert shared or {cause.effect for cause in found.verdict.causes} == {"rub"}


def test_records_mirrored_on_films_are_told_from_what_linear_films_leave_out():
    """Negative control: by an error of the records as stated alone, the right convention leaves far more than noise."""
    heavier, settings = 20.0, Settings(**STRICT, uncertainty=KNOWN)
    shown = on_true_films(TWO, tuple(HARMONICS), heavier)[:, [1, 0, 3, 2]].conj()  # the sense of rotation is reversed
    record, model = seen(shown, 2e-8, None, TWO), build_model(rig(heavier=heavier))
    work = begin(model, with_film_error(with_model_error(record, settings), model), settings)
    alone = replace(work, spectrum=with_model_error(record, settings))
    told, control = (wrong_convention.tested_convention(one, record) for one in (work, alone))
    assert "other sense" in told.hypothesis.name and told.fit.p_value > 0.01 > control.fit.p_value
    assert told.fit.evidence + told.log_factor > work.base.evidence


def test_a_fault_that_moves_the_films_adds_to_what_they_leave_out():
    """A force at 2X, by whose motion the second term of a film gives 4X."""
    speeds, harmonics, size = TWO[1:], (1, -1, 2, -2, 3, -3, 4, -4), 100.0
    shown = on_true_films(speeds, harmonics, twice=size)
    record = seen(shown, 1e-9, None, speeds, np.array(harmonics))
    force = {"kind": "parallel_misalignment", "node": 4, "harmonics": [2], "misalignment_force_2X_N": size}
    model, faulty = build_model(rig()), build_model(rig(force))
    linear = measured_response(faulty, speeds, harmonics)
    assert 0.1 < rms_left(with_film_error(record, faulty), linear, 4) < 2
    assert rms_left(with_film_error(record, model), linear, 4) > 10  # negative control: by the motion of the rig


def test_the_error_of_form_of_a_force_that_loads_films_acts_where_the_force_does():
    model = build_model(rig())
    record = seen(measured_response(model, SPEEDS, HARMONICS), 1e-9)
    work = begin(model, record, Settings(leave_out=all_but("static_preload")))
    (force,) = (one for one in work.candidates if one.where == {"node": 4})
    forces, _ = work.local_forces.beside([force])
    assert len(forces) == 2 * len(HARMONICS)  # real and imaginary parts of one force at each harmonic
    acted = {int(row) for one in force.term.unknowns for entry in one.entries for row in entry.nonzero[0]}
    assert len(acted) == 3  # negative control: with the films that it loads it acts at both bearings, too
