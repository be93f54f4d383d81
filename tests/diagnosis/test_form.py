"""The error of form: errors that data have in common, and what they leave to be explained."""

from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from machines import readings

from rotorstudy import load_rig
from rotorstudy.diagnosis.search import form as form_module
from rotorstudy.diagnosis.search import form_fit
from rotorstudy.diagnosis.search.candidates import ShapeRange
from rotorstudy.diagnosis.search.form import (
    SCALES,
    SHARES,
    Change,
    form_errors,
    largest_error,
    log_predictive,
    most_probable_form,
    over_speeds,
)
from rotorstudy.inference.levenberg_marquardt import levenberg_marquardt
from rotorstudy.inference.prediction import LEAK
from rotorstudy.inference.prior import Prior
from rotorstudy.model.hinge import crack_at

RNG = np.random.default_rng(8)
SPEED, HARMONICS = np.array([50.0, 60.0, 80.0, 110.0]), np.array([0, 1, -1, 2])


MOTIONS = ("across", "along", "coupled", "skewed", "lagging")


def noisy(noise=1e-7):
    """A spectrum of two nodes with independent noise."""
    amplitude = RNG.standard_normal((4, 4, 2)) + 1j * RNG.standard_normal((4, 4, 2))
    return readings(1e-5 * amplitude, SPEED, HARMONICS, (1, 2), noise)


SIZE_STD = 1e-4  # of the size of a cause, so that it takes none of the error


def of_form(spectrum, off, largest=0.05, by_harmonic=True, changes=None):
    """The most probable form of the error of a cause that changes all of a spectrum, and the log evidence with it."""
    jacobian = spectrum.whitened(spectrum.amplitude)[:, None]
    known = np.append(spectrum.whitened(off), 0.0), jacobian, np.eye(1) / SIZE_STD
    form = most_probable_form(spectrum, changes or [Change(spectrum.amplitude)], *known, largest, by_harmonic)
    return form, form.evidence(*known)


def test_a_shared_error_whitens_like_the_full_covariance():
    spectrum = noisy()
    columns = RNG.standard_normal((spectrum.data_count, 5))
    found, whole = spectrum.with_shared_error(columns), np.eye(spectrum.data_count) + columns @ columns.T
    white = spectrum.whitened(spectrum.amplitude)
    assert np.sum(found.whitened(spectrum.amplitude) ** 2) == pytest.approx(white @ np.linalg.solve(whole, white))
    more = spectrum.with_shared_error(RNG.standard_normal((spectrum.data_count, 2 * spectrum.data_count)))
    assert np.sum(more.whitened(spectrum.amplitude) ** 2) < white @ white
    # negative control: without such errors, and in a part of the spectrum, nothing changes
    assert np.array_equal(spectrum.whitened(spectrum.amplitude), white)
    assert found.at_speeds([0, 1]).shared_error is None


def test_a_common_error_whitens_like_the_full_covariance_and_stays_with_a_part_of_the_spectrum():
    errors = 1e-7 * (RNG.standard_normal((5, 4, 4, 2)) + 1j * RNG.standard_normal((5, 4, 4, 2)))
    apart = noisy()
    found, columns = replace(apart, common_error=errors), apart.whitened(errors).T
    whole, white = np.eye(apart.data_count) + columns @ columns.T, apart.whitened(apart.amplitude)
    assert np.sum(found.whitened(apart.amplitude) ** 2) == pytest.approx(white @ np.linalg.solve(whole, white))
    assert found.log_common_volume == pytest.approx(np.linalg.slogdet(whole)[1])
    assert found.log_volume == pytest.approx(apart.log_volume - found.log_common_volume / 2)
    assert found.whitened_by_common(white) == pytest.approx(found.whitened(apart.amplitude))
    more = RNG.standard_normal((apart.data_count, 3))  # beside it, of data whitened by both
    both = np.sum(found.with_shared_error(found.whitened_by_common(more.T).T).whitened(apart.amplitude) ** 2)
    assert both == pytest.approx(white @ np.linalg.solve(whole + more @ more.T, white))
    assert apart.whitened(found.covariance_times(apart.amplitude)) / 1e-7**2 == pytest.approx(whole @ white)
    few = found.at_speeds([0, 2]).at_harmonics([1, 0])
    assert np.array_equal(few.common_error, errors[:, [0, 2]][:, :, [1, 0]])
    # negative control: without them
    assert np.array_equal(found.without_common_error().whitened(apart.amplitude), white)


def test_an_error_of_form_has_the_covariance_that_is_written_out():
    speed, (constant, slow, free) = np.linspace(50.0, 400.0, 60), SHARES[-1]
    modes = over_speeds(speed, SHARES[-1])
    slowly = np.exp(-0.5 * (np.subtract.outer(np.log(speed), np.log(speed)) / 0.2) ** 2)
    assert np.allclose(2 * modes.T @ modes, constant + slow * slowly + free * np.eye(60), atol=1e-9)


def test_the_error_of_form_is_common_to_the_nodes_and_differs_by_harmonic():
    change = np.ones((4, 4, 2)) * [1, 2j]
    errors, harmonic = form_errors(SPEED, [Change(change)], SHARES[0])
    assert np.allclose(errors[..., 1], 2j * errors[..., 0])
    shown = np.abs(errors).max(axis=(1, 3))
    assert (np.count_nonzero(shown, axis=1) == 1).all() and np.array_equal(shown.argmax(axis=1), harmonic)
    variance = np.sum(np.abs(errors[..., 0]) ** 2, axis=0)  # of each harmonic, beside that of the change itself
    assert np.allclose(variance, 1 + LEAK**2 * 4, rtol=1e-3)


def test_several_forces_at_a_place_share_the_error_of_form_in_any_unit():
    """Such as a shear force and a bending moment in an element."""
    change, size = np.ones((4, 4, 2)) * [1, 2j], []
    for rows, unit in ((1, 1.0), (2, 1.0), (2, 1e3)):
        forces = np.zeros((2 * rows * 4, 4, 4, 2), complex)
        for i in range(len(forces)):
            forces[i, :, i % 4] = np.array([1, 0.5] if i < 4 else [1j, -0.5]) * (unit if i >= 8 else 1.0)
        errors, _ = form_errors(SPEED, [Change(change, 1.0, False, forces, np.arange(len(forces)) % 4)], SHARES[0])
        size.append(np.sum(np.abs(errors) ** 2, axis=(0, 3)))
    assert np.allclose(size[0], size[1:])


def test_a_force_that_shows_by_round_off_alone_has_no_error_of_form():
    """At 0X, of a foundation with the probes on it."""
    change, forces = np.ones((4, 4, 2)) * [1, 2j], np.zeros((8, 4, 4, 2), complex)
    for i in range(8):
        forces[i, :, i % 4] = [1, 0.5] if i % 4 else [1e-20, 0]
    errors, at = form_errors(SPEED, [Change(change, 1.0, False, forces, np.arange(8) % 4)], SHARES[0])
    assert np.abs(errors[at == 0]).max() < 1e-15 and np.abs(errors[at == 1]).max() > 0.1
    assert np.abs(errors).max() < 10 * np.abs(change).max()


def test_what_a_form_explains_is_not_evidence_against_a_cause():
    spectrum = noisy(1e-9)
    change = spectrum.amplitude
    near = change * np.array([0.03, -0.02, 0.02, -0.03])[:, None]
    (_, exact), (form, any_form) = (of_form(spectrum, near, largest) for largest in (1e-6, 0.05))
    # as of normal data of which size and errors are a part, but for the scales that the errors may have too
    white, of_size = spectrum.whitened(near), SIZE_STD * spectrum.whitened(change)
    whole = np.eye(len(white)) + form.columns @ form.columns.T + np.outer(of_size, of_size)
    exactly = -0.5 * (white @ np.linalg.solve(whole, white) + np.linalg.slogdet(whole)[1])
    assert any_form - form.more == pytest.approx(exactly, rel=1e-6)
    assert any_form > exact + 1e4
    assert 0.005 < form.mean_std < 0.05
    # negative controls: what no form explains stays evidence against it; no residual needs no error
    assert of_form(spectrum, 0.02 * np.roll(change, 1, axis=0))[1] < any_form - 1e3
    assert of_form(spectrum, 0 * near)[0].mean_std < 0.1 * form.mean_std


def test_a_harmonic_that_is_far_off_does_not_widen_the_others():
    """Negative controls: one size for all; all that are off."""
    spectrum = noisy(1e-9)

    def std(harmonics, by_harmonic=True):
        off = 0.04 * spectrum.amplitude * np.isin(HARMONICS, harmonics)[:, None]
        form, evidence = of_form(spectrum, off, by_harmonic=by_harmonic)
        return form.std, evidence

    (own, separate), (alike, together) = std(2), std(2, by_harmonic=False)
    assert own[HARMONICS == 2] > 0.02 and (own[HARMONICS != 2] < 0.002).all()
    assert separate > together + 50 and (alike > 0).all()
    backward, _ = std(-1)
    assert backward[HARMONICS == -1] > 0.02 and backward[HARMONICS == 1] < 0.002
    everywhere, _ = std(HARMONICS)
    assert (everywhere > 0.01).all()


def test_an_error_that_is_the_same_at_all_speeds_is_more_probable_with_the_steadiest_share(monkeypatch):
    """As of a crack that the weight opens. The negative control, an error that varies, gains nothing by that share."""
    spectrum, wrong = noisy(1e-9), np.array([0.03, -0.02, 0.02j, -0.04])

    def evidence(*over_speeds):
        form, found = of_form(spectrum, spectrum.amplitude * np.outer(over_speeds, wrong)[..., None], 0.1)
        return form.shares, found

    (constant, with_it), (varied, as_before) = evidence(1, 1, 1, 1), evidence(1, 0.5, 1.2, 0.4)
    monkeypatch.setattr(form_module, "SHARES", SHARES[1:])
    (_, without), (_, before) = evidence(1, 1, 1, 1), evidence(1, 0.5, 1.2, 0.4)
    assert constant == SHARES[0] != varied
    assert with_it > without + 5 and 0 < before - as_before < 0.3  # a share more, of equal prior


@pytest.mark.parametrize(("harmonics", "error"), [([1], 1e-6), ([1, 2], 0.1)])
def test_other_speeds_are_as_probable_as_over_all_sizes_and_shares_of_the_error(harmonics, error):
    """The sum over every scale of a harmonic is exact; that of two harmonics nearly, as they share a parameter."""
    spectrum = noisy(1e-9)
    off = spectrum.amplitude * (0.02 * (HARMONICS == 1) + 0.01 * (HARMONICS == 2))[:, None]
    seen = [Change(spectrum.amplitude * np.isin(HARMONICS, harmonics)[:, None])]
    form, _ = of_form(spectrum, off, changes=seen)
    white, slopes = spectrum.whitened(1.5 * off), SIZE_STD * spectrum.whitened(spectrum.amplitude)[:, None]
    log_sum = -np.inf
    for shares, *chosen in product(range(len(SHARES)), *[range(len(SCALES))] * len(harmonics)):
        errors, at = form_errors(spectrum.speed, seen, SHARES[shares])
        scale, weight = np.zeros(len(HARMONICS)), np.exp(form.log_shares[shares])
        for n, i in zip(harmonics, chosen, strict=True):
            scale[n == HARMONICS], weight = SCALES[i], weight * form.weights[n == HARMONICS][0, i]
        scaled = 0.05 * spectrum.whitened(errors).T * scale[at]
        whole = np.eye(len(white)) + slopes @ slopes.T + scaled @ scaled.T
        each = -0.5 * (white @ np.linalg.solve(whole, white) + np.linalg.slogdet(whole)[1])
        log_sum = np.logaddexp(log_sum, each + np.log(weight)) if weight > 0 else log_sum
    assert log_predictive(spectrum, seen, form, white, slopes, 0.05) == pytest.approx(log_sum, abs=error)


def test_a_law_known_less_exactly_has_a_larger_error():
    change = np.ones((4, 4, 2)) * [1, 2j]
    (usual, _), (wide, _) = (form_errors(SPEED, [Change(change, x)], SHARES[0]) for x in (1.0, 4.0))
    assert np.allclose(wide, 4 * usual)
    assert largest_error("looseness", "support_loss", 0.05) > 0.05 == largest_error("unbalance", "eccentricity", 0.05)
    assert largest_error("parallel_misalignment", "misalignment_force_2X", 0.05) > 0.05
    assert largest_error("parallel_misalignment", "coupling_stiffness", 0.05) == 0.05


def test_long_steps_are_shortened_in_their_direction():
    def steep(theta):
        return np.arctan(theta), (1 / (1 + theta**2))[..., None]

    prior, start = Prior.independent({"x": (0.0, 100.0)}), np.array([[3.0]])
    found = levenberg_marquardt(steep, np.zeros((1, 1)), start, ("x",), prior=prior, longest=0.5)
    assert abs(found.theta[0, 0]) < 1e-3


SLANTED = ([[1.0, 0.0], [1.0, 2.0]], [3.0, 1.0])  # residuals x - 3 and x + 2 y - 1
NEARLY_OPPOSITE = ([[1.0, -0.99], [0.0, 0.141]], [-0.98, 0.2837])


@pytest.mark.parametrize(
    ("problem", "start", "high", "expected"),
    [
        (SLANTED, 1.0, np.inf, (3.0, -1.0)),
        (SLANTED, 1.0, (2.0, np.inf), (2.0, -0.5)),  # the free fit cut off would be (2, -1)
        (NEARLY_OPPOSITE, 0.0, 0.0, (-0.98, 0.0)),  # the free fit is beyond both bounds, but the data draw x inwards
    ],
)
def test_a_parameter_that_would_leave_its_bounds_is_held_there_and_the_others_follow(problem, start, high, expected):
    jacobian, data = map(np.array, problem)

    def linear(theta):
        return theta @ jacobian.T - data, np.broadcast_to(jacobian, (len(theta), 2, 2))

    prior, bounds = Prior.independent({"x": (0.0, 1e4), "y": (0.0, 1e4)}), (-np.inf, np.broadcast_to(high, 2))
    found = levenberg_marquardt(
        linear, np.zeros((1, 2)), np.full((1, 2), start), ("x", "y"), prior=prior, bounds=bounds
    )
    assert found.theta[0] == pytest.approx(expected, abs=1e-3)


def test_a_fit_stays_between_the_nodes_about_it_and_goes_on_beyond_the_one_where_it_ends():
    along = ShapeRange(0.0, 2.0, breaks=(0.0, 0.5, 2.0))
    low, high = along.between_breaks(0.5)
    assert 0.25 < low < 0.251 and high == 1.0
    assert along.value(along.beyond(low)) < 0.5 < along.value(low)
    assert along.beyond(0.5) is None and along.beyond(high) is None and along.between_breaks(1.0) == (low, 1.0)
    around = ShapeRange(-np.pi, np.pi, goes_around=True)
    assert around.between_breaks(0.9) == (-np.inf, np.inf) and around.beyond(0.9) is None


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("node", [0.03332834098333333, 0.06665668196666667, 0.13331336393333335])
def test_a_derivative_beside_a_node_does_not_step_on_it(node, side):
    """Where a disc may be, in which a crack cannot act. Negative control: the other way it would."""
    along = ShapeRange(0.0, 0.19997004590000003, breaks=(0.0, node, 0.19997004590000003))
    beside = along.beyond(along.between_breaks(along.fraction(node) - side * 0.01)[1 if side > 0 else 0])
    step = along.step(beside)
    off = [abs(along.value(beside + way * step) - node) / along.high for way in (1, -1)]
    assert off[0] > 1.5e-4 and off[1] < 1e-6


def test_parts_of_a_law_of_breathing_sum_to_another_law():
    """The first multiple beside an open crack is a half that is always open, less a half that turns."""
    structure = load_rig("examples/two_discs.yaml").structure
    hinge = crack_at(structure, 0.3, 0.25, 0.4, "elasticity")
    share, half = hinge.open_shares[0], hinge.section.stiffness * np.outer(hinge.row, hinge.row) / 2

    def across(*part):
        """{shift: matrix} of what acts on z, and on its conjugate."""
        (entries,) = hinge.entries_of_forms((part,), "none")
        return {(e.on, e.shift): np.asarray(e.matrix) for e in entries if e.on != "one"}

    first, left = across("across", 1), share * (1 - share)
    assert np.allclose(first["z", 0], left / 2 * half)
    assert np.allclose(first["conj", 2].real, (left / 2 * half * np.exp(0.8j)).real)
    # where the crack is open, at the angle zero, only the part that is open at all angles yields
    for motion, open_too in [*((one, False) for one in MOTIONS), ("along", True)]:
        found = across(motion, 0 if open_too else 2)
        turned = sum(np.exp(-1j * shift * 0.4) * matrix for (on, shift), matrix in found.items() if on == "z")
        largest = share / (1 - share) * (1 - hinge.open_shares[1]) ** 2 * np.abs(half).max()
        assert np.abs(turned).max() == pytest.approx(largest if open_too else 0.0, abs=1e-9 * largest)


def test_an_open_crack_that_is_skewed_yields_most_beside_the_middle_of_its_edge():
    structure, skew = load_rig("examples/two_discs.yaml").structure, 0.02

    def table(angle, *parts):
        """{shift and what it acts on: matrix} of an open crack and further parts of its law, (part, amplitude)."""
        hinge, found = crack_at(structure, 0.3, 0.25, angle, "elasticity"), {}
        tables = hinge.entries_of_forms(tuple(part for part, _ in parts), "none")
        for entries, size in [(hinge.entries("none"), 1.0), *zip(tables, (size for _, size in parts), strict=True)]:
            for e in entries:
                found[e.on, e.shift] = found.get((e.on, e.shift), 0.0) + size * np.asarray(e.matrix)
        return found, hinge.open_shares / (1 - hinge.open_shares)

    straight, (xi, eta) = table(0.4)
    turned, _ = table(0.4 + skew)
    skewed, _ = table(0.4, (("skewed", 0), skew * (xi - eta) / xi))
    change = np.abs(turned["conj", 2] - straight["conj", 2]).max()
    assert change > 0 and np.abs(skewed["conj", 2] - turned["conj", 2]).max() < 2 * skew * change


def test_by_the_moment_the_parts_are_those_by_the_weight_where_that_alone_acts():
    """To 2e-3: one law is a series of the direction of the rotation, the other leaves out coefficients below 1e-3."""
    structure = load_rig("examples/two_discs.yaml").structure
    hinge = crack_at(structure, 0.3, 0.25, 0.0, "elasticity")
    tables = hinge.entries_of_forms(tuple((motion, 1) for motion in MOTIONS), "weight")
    pattern = hinge.section.stiffness * np.outer(hinge.row, hinge.row)
    place, by_moment, by_weight = np.unravel_index(np.argmax(np.abs(pattern)), pattern.shape), [], []
    for motion, entries in zip(MOTIONS, tables, strict=True):
        force = hinge.force_of_form(motion, 1)
        for angle in np.linspace(0, 2 * np.pi, 30):
            # the rotation that the static moment imposes, in the direction in which the crack then opens
            strain = 1e-3 * hinge.side
            turn = np.exp(1j * angle)
            kink = hinge._kink_by_rotation
            imposed = fixed_point(lambda x, turn=turn: strain / turn + kink(x), np.array([[strain / turn]]))
            rotation = -imposed * turn - hinge.section.own_moment / hinge.section.stiffness
            by_moment.append(np.ravel(force.function(rotation, 0.0, np.zeros(1), np.array([[angle]])))[0])
            on_z, on_conj = (
                sum(np.exp(1j * e.shift * angle) * e.matrix[place] for e in entries if e.on == on)
                for on in ("z", "conj")
            )
            seen = np.ravel(-imposed * turn)[0]
            by_weight.append((on_z * seen + on_conj * seen.conjugate()) / pattern[place] * hinge.section.stiffness)
    assert np.abs(np.subtract(by_moment, by_weight)).max() < 2e-3 * np.abs(by_weight).max()


def fixed_point(function, value):
    """By repetition, of a function that contracts."""
    for _ in range(200):
        value = function(value)
    return value


@pytest.mark.parametrize(("beyond", "crossed", "left_at_it"), [
    (lambda x: 0.51 if x < 0.5 else 0.49, [0.49, 0.51], [0.51]),  # the same node from both sides
    (lambda x: round(x + 0.1, 2), [0.49, 0.59, 0.69, 0.79, 0.89, 0.99], []),  # negative control: one after another
])  # fmt: skip
def test_a_fit_does_not_go_back_over_a_node(monkeypatch, beyond, crossed, left_at_it):
    """Both sides may gain by more steps each time, for as long as one likes. Only what ends at a node is fitted on."""
    fitted, to_their_end = [], []

    def within(work, causes, values, least, to_end=False):
        assert to_end or not fitted or least == len(fitted)  # the odds of the fit before, which it must surpass
        (to_their_end if to_end else fitted).extend(causes)
        return SimpleNamespace(causes=causes, log_posterior_odds=len(fitted), fit=SimpleNamespace(values={}))

    monkeypatch.setattr(form_fit, "_fitted_within", within)
    monkeypatch.setattr(form_fit, "_moved", lambda work, causes, n, name, fraction: (fraction,))
    monkeypatch.setattr(form_fit, "_at_a_node", lambda work, causes: (
        (0, "position_m", x, beyond(x)) for x in causes if x < 0.9
    ))  # fmt: skip
    work = SimpleNamespace(explanations=[SimpleNamespace(log_posterior_odds=0.0)])
    form_fit.fitted_with_form(work, (0.49,), {})
    assert fitted == crossed and to_their_end == left_at_it


def test_parameters_that_the_data_do_not_tell_apart_leave_the_error_of_form_as_it_is():
    """Their prior is lost beside the data in the last digit, so that round-off decides whether a matrix is definite."""
    spectrum = noisy(1e-11)
    change = spectrum.amplitude
    column, off = spectrum.whitened(change)[:, None], 0.02 * spectrum.whitened(change)

    def std(jacobian):
        known = 1e-3 * np.eye(jacobian.shape[1])
        left = np.append(off, np.zeros(len(known)))
        return most_probable_form(spectrum, [Change(change)], left, jacobian, known, 0.05).std

    assert std(np.hstack([column, column])) == pytest.approx(std(column), rel=1e-6)
