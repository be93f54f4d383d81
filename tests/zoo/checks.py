"""The invariants of each plugin kind, as functions that raise AssertionError: for the zoo, and for wrong plugins."""

from dataclasses import replace

import numpy as np
import pytest

from rotorstudy import Model, Problem, Spectrum, build_model, measured_response
from rotorstudy.errors import RotorstudyError
from rotorstudy.identification import output_error_fit
from rotorstudy.integration import force_in_time
from rotorstudy.plugins import KINDS
from rotorstudy.records import Record, full_spectrum, synthesize
from rotorstudy.rig import make_term
from rotorstudy.spectrum import components, independent_covariance
from rotorstudy.terms import apply_entries

HARMONICS = [0, 1, 2, 3, 5, 7, -1, -3, -5]
SPEEDS = [50.0, 88.0, 120.0, 150.0, 199.0]


def check_stated(plugin):
    """Every plugin says what it is and where its equation comes from."""
    assert plugin.summary and len(plugin.summary) < 120 and plugin.summary.endswith((".", ")"))
    assert plugin.source


def check_crack(plugin, grid=40_000):
    """Periodic, between closed and open, and the same function in time as in its Fourier series."""
    angle = (np.arange(grid) + 0.5) * 2 * np.pi / grid
    opening = plugin.function(angle)
    assert opening.shape == angle.shape
    assert np.all(opening >= -1e-12) and np.all(opening <= 1 + 1e-12)
    assert np.allclose(opening, plugin.function(angle + 2 * np.pi))
    series = plugin.series(15)
    assert max(abs(k) for k in series) <= 15
    for k in range(-15, 16):
        # midpoint sums of a function with jumps are off by the height of the jumps times the step
        numerical = np.mean(opening * np.exp(-1j * k * angle))
        assert abs(numerical - series.get(k, 0)) < 2 / grid, k
        assert abs(series.get(k, 0) - np.conj(series.get(-k, 0))) < 1e-15, k


def check_rotor(structure):
    """Real symmetric matrices, positive mass, no negative stiffness, a load that weighs; cracks take stiffness away."""
    size = len(structure.dofs)
    for matrix in (structure.mass, structure.stiffness, structure.gyroscopic):
        assert matrix.shape == (size, size) and np.isrealobj(matrix) and np.array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(structure.mass).min() > 0
    least, *_, most = [0.0, *np.linalg.eigvalsh(structure.stiffness)]
    assert least >= -1e-9 * most
    assert structure.static_load.shape == (size,) and structure.static_load.sum() > 0
    for node in structure.nodes:
        losses = structure.stiffness_loss_at(node)
        for pattern, unit, typical in losses.values():
            assert pattern.shape == (size, size) and np.linalg.eigvalsh(pattern).min() >= 0 and unit and typical > 0


def typical_term(plugin, structure, sensors=(1,)):
    """An effect or bearing at its default place, every parameter with its typical size."""
    kind = next(name for name, kind in KINDS.items() if isinstance(plugin, kind))
    term = make_term(kind, {"kind": plugin.name, **plugin.example}, structure, sensors)
    values = {p.name: p.typical * (np.exp(0.6j) if p.is_complex else 1) for p in term.parameters}
    return replace(term, values=values)


def check_term(term, dof):
    """Units and sizes are stated, and the table means in frequency what it means in time."""
    generator = np.random.default_rng(1)
    w, harmonics = 88.0, np.arange(-9, 10)
    time = np.arange(128) * 2 * np.pi / w / 128
    amplitude = np.zeros((1, len(harmonics), dof), complex)
    amplitude[:, 7:12] = generator.normal(size=(1, 5, dof)) + 1j * generator.normal(size=(1, 5, dof))
    turning = np.exp(1j * harmonics * w * time[:, None])
    motion = [turning * (1j * harmonics * w) ** order @ amplitude[0] for order in range(3)]
    still = generator.normal(size=dof) + 1j * generator.normal(size=dof)
    motion[0] = motion[0] + still
    for parameter in term.parameters:
        assert parameter.unit and parameter.typical > 0
    for unknown in term.unknowns:
        column = apply_entries(unknown.entries, amplitude, np.array([w]), harmonics, still)[0]
        if any(entry.frequency_only for entry in unknown.entries):
            with pytest.raises(RotorstudyError, match="exists in frequency only"):
                force_in_time(unknown.entries, w, time, *motion)
            continue
        force = force_in_time(unknown.entries, w, time, *motion, deflection=still)
        seen = (np.fft.fft(force, axis=0) / len(time))[harmonics]
        assert np.allclose(column, seen, rtol=1e-10, atol=1e-10 * np.abs(seen).max()), unknown.name


def check_round_trip(term, structure):
    """What is simulated with the term's values is found again, starting 30 % off, everything else known."""
    rest = build_model(
        {
            "rotor": {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5},
            "cracks": [{"kind": "switching", "stiffness_loss_N_per_m": 1e5}],
            "effects": [{"kind": "external_damping", "label": "known", "external_damping_N_s_per_m": 90.0}],
        }
    )
    model = Model(structure, (*rest.terms, term))
    shown = measured_response(model, SPEEDS, HARMONICS)
    std = np.full(shown.shape, 1e-9)
    spectrum = Spectrum(shown, np.array(SPEEDS), np.array(HARMONICS), (1,), independent_covariance(std**2))
    names = tuple(unknown.name for unknown in term.unknowns)
    true = model.theta[model.position(names)]
    found = output_error_fit(Problem(model, spectrum, names), start=1.3 * true)
    assert np.allclose(found.theta, true, rtol=1e-6, atol=1e-6 * np.abs(true).max())


def check_spectrum(plugin, trials=300):
    """Exact on whole turns without noise; the stated covariance is the scatter under white noise."""
    w, generator = 100.0, np.random.default_rng(3)
    time = np.arange(600) * (2 * np.pi / w * 6 / 600)  # six whole turns
    amplitude = generator.normal(size=len(HARMONICS)) + 1j * generator.normal(size=len(HARMONICS))
    signal = synthesize(amplitude, w, HARMONICS, time)

    def spectrum(displacement):
        return full_spectrum([Record(time, displacement[None], w, (1,))], HARMONICS, plugin, "none")

    clean = spectrum(signal)
    assert clean.amplitude.shape == (1, len(HARMONICS), 1)
    assert clean.covariance.shape == (1, 1, 2 * len(HARMONICS), 2 * len(HARMONICS))
    assert np.allclose(clean.amplitude[0, :, 0], amplitude, rtol=1e-9, atol=1e-9)
    found, stated = [], []
    for _ in range(trials):
        x, y = 0.1 * generator.normal(size=(2, len(time)))
        one = spectrum(signal + x + 1j * y)
        found.append(components(one.amplitude[0])[:, 0])
        stated.append(one.covariance[0, 0])
    scatter, stated = np.cov(np.transpose(found)), np.mean(stated, axis=0)
    # the mean variance of 18 components over 300 trials is known to 2 %, the stated noise floor to 5 % a record
    assert abs(np.trace(stated) / np.trace(scatter) - 1) < 0.1
    off = stated - scatter
    assert np.abs(off).max() < 0.45 * np.diag(scatter).mean()


def check_estimator(plugin):
    """Exact on data without noise, for one spectrum and for many trials at once."""
    model = build_model(
        {
            "rotor": {"kind": "jeffcott", "mass_kg": 2.0, "stiffness_N_per_m": 7.6e5},
            "cracks": [{"kind": "switching", "stiffness_loss_N_per_m": 2.5e5}],
            "effects": [
                {"kind": "internal_damping", "internal_damping_N_s_per_m": 20.0},
                {"kind": "external_damping", "external_damping_N_s_per_m": 100.0},
                {"kind": "unbalance", "eccentricity_m": 5e-6, "eccentricity_phase_rad": 0.5},
            ],
        }
    )
    shown = measured_response(model, SPEEDS, HARMONICS)
    std = np.full(shown.shape, 1e-9)
    spectrum = Spectrum(shown, np.array(SPEEDS), np.array(HARMONICS), (1,), independent_covariance(std**2))
    for amplitude in (shown, np.stack([shown, shown])):
        found = plugin.function(Problem(model, spectrum.with_amplitude(amplitude), model.names))
        assert found.theta.shape == (*amplitude.shape[:-3], len(model.names))
        assert np.all(np.isfinite(found.std))
        assert np.allclose(found.theta, model.theta, rtol=1e-8)
