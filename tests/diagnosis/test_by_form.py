"""The search by form: errors that data have in common, and what they leave to be explained."""

import numpy as np
import pytest

from rotorstudy import harmonic_response, make_term
from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.by_form.form import SCALES, SHARES, Change, form_errors, most_probable_form
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.inference.levenberg_marquardt import levenberg_marquardt
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.model.hinge import crack_at
from rotorstudy.model.rig import load_rig

RNG = np.random.default_rng(8)
SPEED, HARMONICS = np.array([50.0, 60.0, 80.0, 110.0]), np.array([0, 1, -1, 2])


def noisy(noise=1e-7):
    """A spectrum of two nodes with independent noise."""
    amplitude = RNG.standard_normal((4, 4, 2)) + 1j * RNG.standard_normal((4, 4, 2))
    covariance = independent_covariance(np.full((4, 4, 2), noise**2))
    return Spectrum(1e-5 * amplitude, SPEED, HARMONICS, (1, 2), covariance)


def test_a_shared_error_whitens_like_the_full_covariance():
    spectrum = noisy()
    columns = RNG.standard_normal((spectrum.data_count, 5))
    found, whole = spectrum.with_shared_error(columns), np.eye(spectrum.data_count) + columns @ columns.T
    white = spectrum.whitened(spectrum.amplitude)
    assert np.sum(found.whitened(spectrum.amplitude) ** 2) == pytest.approx(white @ np.linalg.solve(whole, white))
    assert found.log_shared == pytest.approx(-0.5 * np.linalg.slogdet(whole)[1])
    more = spectrum.with_shared_error(RNG.standard_normal((spectrum.data_count, 2 * spectrum.data_count)))
    assert np.sum(more.whitened(spectrum.amplitude) ** 2) < white @ white
    # negative control: without such errors, and in a part of the spectrum, nothing changes
    assert np.array_equal(spectrum.whitened(spectrum.amplitude), white)
    assert found.at_speeds([0, 1]).shared_error is None


def test_the_error_of_form_is_common_to_the_nodes_and_differs_by_harmonic():
    change = np.ones((4, 4, 2)) * [1, 2j]
    errors = form_errors(SPEED, [Change(change, 0.0)], SHARES[0], 1.0)
    assert np.allclose(errors[..., 1], 2j * errors[..., 0])
    assert (np.count_nonzero(np.abs(errors).max(axis=(1, 3)), axis=1) == 1).all()
    variance = np.sum(np.abs(errors[..., 0]) ** 2, axis=0)  # of each harmonic, beside that of the change itself
    assert np.allclose(variance, 1 + 0.1**2 * 4, rtol=1e-3)


def test_what_a_form_explains_is_not_evidence_against_a_cause():
    spectrum = noisy(1e-9)
    change = spectrum.amplitude
    prior = Prior.independent({"size": (0.0, 10.0)})
    jacobian = spectrum.whitened(change)[:, None]

    def evidence(off, largest):
        left = np.append(spectrum.whitened(off), prior.whitener @ (prior.mean - 1.0))
        return most_probable_form(spectrum, [Change(change, 0.0)], left, jacobian, prior.whitener, largest)

    scattered = 0.02 * np.roll(change, 1, axis=0)
    near = change * np.array([0.03, -0.02, 0.02, -0.03])[:, None]
    exact, any_form = (evidence(near, largest).evidence for largest in (1e-6, 0.05))
    assert any_form > exact + 1e4
    assert 0.005 < evidence(near, 0.05).mean_std < 0.05
    # negative controls: what no form explains stays evidence against it; no residual needs no error
    assert evidence(scattered, 0.05).evidence < any_form - 1e3
    assert evidence(0 * near, 0.05).scale == SCALES[0]


def test_long_steps_are_shortened_in_their_direction():
    def steep(theta):
        return np.arctan(theta), (1 / (1 + theta**2))[..., None]

    prior, start = Prior.independent({"x": (0.0, 100.0)}), np.array([[3.0]])
    found = levenberg_marquardt(steep, np.zeros((1, 1)), start, ("x",), prior=prior, longest=0.5)
    assert abs(found.theta[0, 0]) < 1e-3


def test_the_kink_along_the_front_is_a_part_of_the_kink():
    structure = load_rig("examples/two_discs.yaml").structure
    hinge = crack_at(structure, 0.3, 0.25, 0.4, "strip_integration")
    xi, eta = hinge.open_shares
    scale = xi / (1 - xi) / (eta / (1 - eta))  # of the flexibilities
    motion = 1e-5 * (RNG.standard_normal(len(structure.dofs)) + 1j * RNG.standard_normal(len(structure.dofs)))

    def moment(entries, angle):
        """Of the crack at an angle of the shaft, in its frame."""
        sources = {"z": motion, "conj": motion.conj(), "one": np.ones(1)}
        force = sum(
            np.exp(1j * e.shift * angle)
            * (np.ravel(e.matrix) if e.on == "one" else np.asarray(e.matrix) @ sources[e.on])
            for e in entries
        )
        kink = force / np.where(hinge.row, hinge.row, np.inf)
        return kink[np.argmax(np.abs(hinge.row))] * np.exp(-1j * (angle + 0.4))

    for table in (hinge.open_entries, hinge.entries_by_turning, hinge.entries_by_weight, hinge.entries_by_angle):
        for angle in (0.0, 1.0, 4.0):
            whole, along = moment(table(), angle), moment(table(along=True), angle)
            assert along / scale == pytest.approx(1j * whole.imag, abs=1e-6 * abs(whole))
    force, along = hinge.force(), hinge.force(along=True)
    turned = np.exp(1j * np.array([0.4]))
    both = [one.function(np.array([[1e-4 + 2e-4j]]), 0.0, np.zeros(1), np.array([[0.0]]))[0] for one in (force, along)]
    assert both[1] / turned / scale == pytest.approx(1j * (both[0] / turned).imag)


def test_a_search_by_form_names_a_cause_and_calls_a_clean_record_clean():
    rig = load_rig("examples/jeffcott.yaml")
    harmonics, speed = np.array([0, 1, -1, 2, -2, 3, -3]), np.array([60.0, 90.0, 120.0, 160.0, 210.0, 260.0])
    settings = Settings(search="by_form", leave_out=["rub", "looseness", "cubic_stiffness", "breathing_crack"])
    cause = {"kind": "support_anisotropy", "support_anisotropy_N_per_m": 15000.0, "support_anisotropy_phase_rad": 0.7}
    faulty = rig.plus(make_term("effect", cause | {"node": 1}, rig.structure, rig.sensors))
    verdicts = []
    for machine in (faulty, rig):
        shown = harmonic_response(machine, speed, harmonics)[..., list(machine.measured)]
        noise = 0.003 * np.abs(shown[:, [1]]).mean()
        drawn = RNG.standard_normal((2, *shown.shape))
        variance = np.full(shown.shape, noise**2)
        spectrum = Spectrum(
            shown + noise * (drawn[0] + 1j * drawn[1]), speed, harmonics, rig.sensors, independent_covariance(variance)
        )
        verdicts.append(investigate(spectrum, rig, settings=settings).verdict)
    found, clean = verdicts
    (named,) = found.causes
    assert (found.verdict, named.effect) == ("cause", "support_anisotropy")
    size = named.parameters["support_anisotropy"]
    assert abs(size.value - 15000.0) < 4 * size.std
    assert 0 < found.cause_error <= settings.form_error
    assert clean.verdict == "nothing"  # negative control
