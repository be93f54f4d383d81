"""Evidence for the misprints and sign errors of Chapter 4; see `errata`."""

from dataclasses import replace

import numpy as np

from rotorstudy.inference.bounds import cramer_rao_bound
from rotorstudy.inference.linear import solve_linear
from rotorstudy.measurement.noise import noise_std
from rotorstudy.measurement.spectrum import independent_covariance
from rotorstudy.model.model import Model
from rotorstudy.model.rig import build_model
from rotorstudy.response.measured import measured_response
from rotorstudy.response.stability import eigenvalues
from rotorstudy.response.whirl import critical_speeds, time_invariant
from rotorstudy.store import as_complex
from thesis.chapter_4 import METHODS, SWAPPED
from thesis.errata import HARMONICS, ROW_ABOVE, agreeing, case_problem, estimates_with_misprint
from thesis.scoreboard import published

DAMPINGS = ("internal_damping", "external_damping")


def chapter_4(config, folder, spectra, dominance, noisy):
    """Numbers on the gyroscopic sign, Eq. (4.36), the natural frequency, Table 4.7 and the condensation.

    config : StudyConfig;  folder : of the printed values
    spectra, noisy : spectra and Monte Carlo of the thesis's rig;  dominance : of `studies.weight_dominance`
    """
    printed = published(folder, ["4.2", "4.3", "4.4", "4.5", "4.7"])
    return {
        **_gyroscopic_sign(config, printed),
        **_headings(config, printed, spectra),
        **_equations(config),
        **_stiffness_losses(config, noisy),
        **_weight_dominance(dominance),
    }


def _gyroscopic_sign(config, printed):
    """Spectra, critical speeds and natural frequency with the printed and with the right sign."""
    speeds = dict(zip(("20 Hz, complete cycles", "50 Hz, complete cycles"), config.shown_speeds_rad_s, strict=True))
    whole = printed[(printed.method == "regression") & printed.case.isin(speeds)]
    whole = whole[whole.quantity != "reference phase"]
    thesis = config.rig("thesis")
    corrected = {**config.rigs["thesis"], "rotor": {**config.rigs["thesis"]["rotor"], "gyroscopic_sign": 1}}
    right = build_model(corrected, "the thesis's rig with the right gyroscopic sign")
    responses = [np.abs(measured_response(m, list(speeds.values()), HARMONICS)[..., 0]) for m in (thesis, right)]
    critical = [
        critical_speeds(time_invariant(m).without(DAMPINGS), 2 * np.pi * 500)[0] / (2 * np.pi) for m in (thesis, right)
    ]
    structure = right.structure
    coupled = np.abs(eigenvalues(Model(structure), [1e-3]).imag).min()
    return {
        "gyroscopic_values": len(whole),
        "gyroscopic_reversed": agreeing(thesis, speeds, whole),
        "gyroscopic_right": agreeing(right, speeds, whole),
        "gyroscopic_change_percent": np.max(np.abs(responses[0] / responses[1] - 1)) * 100,
        "critical_reversed_Hz": ", ".join(f"{f:.1f}" for f in critical[0]),
        "critical_right_Hz": ", ".join(f"{f:.1f}" for f in critical[1]),
        "uncoupled_Hz": np.sqrt(structure.stiffness[0, 0] / structure.mass[0, 0]) / (2 * np.pi),
        "coupled_Hz": coupled / (2 * np.pi),
        "vibration_least_um": np.abs(responses[1]).max(axis=1).min() * 1e6,
        "vibration_most_um": np.abs(responses[1]).max() * 1e6,
        "deflection_um": structure.static_deflection[0].real * 1e6,
    }


def _headings(config, printed, spectra):
    """How many values of Table 4.7 are met with its headings as printed, and exchanged."""
    headings = printed[(printed.case == "50 Hz, incomplete cycles") & (printed.quantity == "reference phase")]
    incomplete = spectra.reference_phase.sel(record="incomplete cycles")
    marks = incomplete.sel(speed=config.shown_speeds_rad_s[1], method="nearest")

    def met(columns):
        found = 0
        for row in headings.itertuples():
            value = float(marks.sel(spectrum_method=columns[row.method], harmonic=int(row.item)))
            found += abs(np.angle(np.exp(1j * (value - row.published)))) <= row.last_digit * (1 + 1e-6)
        return found

    return {"headings_values": len(headings), "headings_printed": met(METHODS), "headings_swapped": met(SWAPPED)}


def _equations(config):
    """Estimates by Eq. (4.36) as printed, and the error of the right equations."""
    problem = case_problem(config, "physical", next(iter(config.cases)))
    exact = solve_linear(*problem.equations(), problem.names)
    true = problem.model.theta[problem.model.position(problem.names)]
    wrong = estimates_with_misprint(problem, real_from=ROW_ABOVE)
    return {
        "eq_4_36_c_H": wrong[problem.names.index("internal_damping")],
        "eq_4_36_c_E": wrong[problem.names.index("external_damping")],
        "condensation_error": np.max(np.abs(exact / true - 1)),
    }


def _stiffness_losses(config, noisy):
    """How well both stiffness losses are separated, by the Cramer-Rao bound and by the trials under noise."""
    problem = case_problem(config, "thesis", next(iter(config.cases)))
    std = noise_std(problem.spectrum, 0.01, "white in time", config.record.samples)
    weighted = replace(problem.spectrum, covariance=independent_covariance(std**2))
    theta = problem.model.theta[problem.model.position(problem.names)]
    covariance = cramer_rao_bound(replace(problem, spectrum=weighted), theta)
    i, j = (problem.names.index(f"stiffness_loss_{k}") for k in ("22", "44"))
    tilt = float(noisy.true.sel(parameter="stiffness_loss_44"))
    scatter = noisy.estimate.sel(
        record="complete cycles", noise_model="white in time", noise=1, estimator="least_squares"
    ).sel(parameter="stiffness_loss_44")
    return {
        "dk_correlation": covariance[i, j] / np.sqrt(covariance[i, i] * covariance[j, j]),
        "dk_44_bound_percent": np.sqrt(covariance[j, j]) / tilt * 100,
        "dk_44_scatter_percent": float(scatter.std()) / tilt * 100,
        "samples": config.record.samples,
    }


def _weight_dominance(dominance):
    """What the weight-dominant force of the crack leaves out; harmonics above 1 µm are compared."""
    errors = dominance.error.isel(case=0).sel(parameter="stiffness_loss_22")
    dominant, full = np.abs(as_complex(dominance.displacement.sel(crack_scale=1.0).isel(speed=0)))
    growth = (full / dominant - 1)[dominant > 1e-6] * 100
    return {
        "small_crack_percent": float(dominance.crack_scale[0]) * 30,
        "small_crack_error_percent": float(errors[0]) * 100,
        "full_crack_least_percent": growth.min(),
        "full_crack_most_percent": growth.max(),
    }
