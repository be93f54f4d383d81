"""Evidence for the misprints and sign errors of the thesis: what changes if the printed form is used.

Every function returns numbers by name; the errata page quotes them as {name}, estimates as {name[parameter]}.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from rotorstudy.inference.equation_error import regression
from rotorstudy.inference.linear import solve_linear
from rotorstudy.inference.output_error import cramer_rao_bound
from rotorstudy.measurement.noise import with_noise
from rotorstudy.model.model import Model
from rotorstudy.model.rig import build_model
from rotorstudy.response.coupling import forced_harmonics
from rotorstudy.response.measured import measured_response
from rotorstudy.response.stability import eigenvalues
from rotorstudy.response.whirl import critical_speeds, time_invariant
from rotorstudy.store import as_complex
from rotorstudy.studies.config import load_study
from thesis.config import load_replay
from thesis.replay import DAMPINGS, printed_values, remove_slow_roll, replay_problem, rounding_draws
from thesis.scoreboard import agreeing, published
from thesis.texts import page

GRAVITY = 9.81  # m/s^2, as in the thesis
HARMONICS = (0, 1, 2, 3, 5, 7, -1, -3, -5)  # in the order in which the thesis writes its equations


def reproduced(model, speeds, printed, theta=None):
    """Number of printed amplitudes and phases that a model reproduces to the last digit; speeds : case -> rad/s."""
    response = measured_response(model, list(speeds.values()), HARMONICS, theta)[..., 0]
    found = dict(zip(speeds, response, strict=True))
    values = [found[row.case][HARMONICS.index(int(row.item))] for row in printed.itertuples()]
    return int(agreeing(printed, _as_printed(printed, values)).sum())


def _as_printed(printed, values):
    """(row,) amplitudes or phases, as the rows have them, of complex values."""
    return np.where(printed.quantity == "amplitude", np.abs(values), np.angle(values))


def estimates_with_misprint(problem, real_from=None, imag_from=None, swap_imag=False):
    """(parameter,) least-squares estimates with the column of internal damping as the thesis prints it.

    real_from, imag_from : harmonic of a real (imaginary) row -> harmonic whose R is printed there instead
    swap_imag            : R_Im printed in the imaginary rows where R_Re is meant
    """
    equations, spectrum = regression(problem.model, problem.spectrum, problem.names), problem.spectrum
    displacement = {int(n): spectrum.amplitude[:, h, 0] for h, n in enumerate(spectrum.harmonics)}
    resting = problem.model.structure.static_deflection[problem.model.measured[0]].real
    columns, position = equations.columns.copy(), problem.names.index("internal_damping")
    for row, n in enumerate(sorted(displacement)):  # equations come by harmonic
        real, imag = (displacement.get(f.get(n, n), 0 * spectrum.speed) for f in (real_from or {}, imag_from or {}))
        static = resting if n == 0 else 0.0
        shown = (imag.imag if swap_imag else imag.real) + static
        columns[:, row, position] = (n - 1) * spectrum.speed * (real.imag - 1j * shown)
    return solve_linear(*replace(equations, columns=columns).real_system(), problem.names)


ROW_ABOVE = {2: 1, 3: 2, 5: 3, 7: 5}  # Eq. (4.36), real rows
ALL_ROWS = {**ROW_ABOVE, -1: -3, -3: -5, -5: -7}  # Eq. (5.1), real and imaginary rows


def case_problem(config, rig, case):
    """The Problem of the unknowns of a study at the speeds of a case, from the exact spectrum of a rig."""
    model = config.rig(rig)
    return config.problem(model, config.clean_spectrum(model, config.cases[case].speeds))


def by_misprint(problem, **misprint):
    """name of a parameter -> its estimate with a misprint, as for `estimates_with_misprint`."""
    return dict(zip(problem.names, estimates_with_misprint(problem, **misprint), strict=True))


def with_right_sign(rig):
    """The options of a rig with the right sign of the gyroscopic moment."""
    return {**rig, "rotor": {**rig["rotor"], "gyroscopic_sign": 1}}


def numbers_2(config, folder):
    """Numbers on the sign of the crack force, the omitted terms of its series, and Eq. (2.32)."""
    printed = published(folder, ["2.2", "2.3", "2.5"])
    spectra, speeds = printed[printed.method == "regression"], {"88 rad/s": 88.0}
    thesis, physical = config.rig("thesis"), config.rig("physical")
    right = np.where([unit == "N/m" for unit in thesis.units], -1, 1) * thesis.theta  # the crack force reversed
    reversed_, cut = measured_response(thesis, [88.0], HARMONICS, np.stack([thesis.theta, right]))[:, 0, :, 0]
    forced = forced_harmonics(physical)
    every = measured_response(physical, [88.0], forced)[0, :, 0]
    exact = every[[list(forced).index(n) for n in HARMONICS]]
    left_out = np.where(np.isin(forced, HARMONICS), 0, np.abs(every))
    case = "Combined speed from 50 to 199 with increment +1"
    copied = printed[(printed.case == f"{case}, with phase compensation") & (printed.noise_percent == 2)]
    copied = copied.set_index("item").published
    first = HARMONICS.index(1)
    return {
        "crack_sign_values": len(spectra),
        "crack_sign_reversed": reproduced(thesis, speeds, spectra),
        "crack_sign_right": reproduced(thesis, speeds, spectra, right),
        "first_reversed_um": np.abs(reversed_[first]) * 1e6,
        "first_right_um": np.abs(cut[first]) * 1e6,
        "eq_2_32": by_misprint(case_problem(config, "physical", case), swap_imag=True),
        "printed_digits_percent": np.max(np.abs(cut - exact) / np.abs(exact)) * 100,
        "left_out_um": left_out.max() * 1e6,
        "left_out_harmonic": int(forced[left_out.argmax()]),
        "row_2_5_e": copied["e"] * 1e6,
        "row_2_5_dk": copied["dk_xi"] / 1e5,
    }


def numbers_3(replay, folder):
    """Numbers on the mean of the slow roll, and on the mean at 17 Hz in section 3.7; folder : of printed values."""
    place = list(replay.cases).index("17 Hz"), replay.harmonics.index(0)

    def mean(amplitude):
        return np.abs(remove_slow_roll(replay, amplitude))[..., *place] * 1e6

    def stated(corrected):
        values = {
            key: v[replay.data_sets.index("fft")]
            for key, (v, _) in printed_values(replay, folder, corrected=corrected).items()
        }
        return mean(values["amplitude"] * np.exp(1j * values["phase"]))

    highest = mean(rounding_draws(replay, folder, "fft")).max()
    return {"mean_17_printed_um": stated(False), "mean_17_used_um": stated(True), "mean_17_highest_um": highest}


def numbers_4(config, folder, spectra, dominance, noisy):
    """Numbers on the gyroscopic sign, Eq. (4.36), the natural frequency, Table 4.7 and the condensation."""
    printed = published(folder, ["4.2", "4.3", "4.4", "4.5", "4.7"])
    numbers = _gyroscopic_sign(config, printed) | _headings(config, printed, spectra)
    return numbers | _equations(config) | _stiffness_losses(config, noisy) | _weight_dominance(dominance)


def _gyroscopic_sign(config, printed):
    """Spectra, critical speeds and natural frequency with the printed and with the right sign."""
    speeds = dict(zip(("20 Hz, complete cycles", "50 Hz, complete cycles"), config.shown_speeds_rad_s, strict=True))
    whole = printed[(printed.method == "regression") & printed.case.isin(speeds)]
    whole = whole[whole.quantity != "reference phase"]
    thesis = config.rig("thesis")
    right = build_model(with_right_sign(config.rigs["thesis"]), "the thesis's rig with the right gyroscopic sign")
    responses = [np.abs(measured_response(m, list(speeds.values()), HARMONICS)[..., 0]) for m in (thesis, right)]
    still = (time_invariant(one).without(DAMPINGS) for one in (thesis, right))
    critical = [critical_speeds(one, 2 * np.pi * 500)[0] / (2 * np.pi) for one in still]
    structure = right.structure
    return {
        "gyroscopic_values": len(whole),
        "gyroscopic_reversed": reproduced(thesis, speeds, whole),
        "gyroscopic_right": reproduced(right, speeds, whole),
        "gyroscopic_change_percent": np.max(np.abs(responses[0] / responses[1] - 1)) * 100,
        "critical_reversed_Hz": ", ".join(f"{f:.1f}" for f in critical[0]),
        "critical_right_Hz": ", ".join(f"{f:.1f}" for f in critical[1]),
        "uncoupled_Hz": np.sqrt(structure.stiffness[0, 0] / structure.mass[0, 0]) / (2 * np.pi),
        "coupled_Hz": np.abs(eigenvalues(Model(structure), [1e-3]).imag).min() / (2 * np.pi),
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
        at = [{"spectrum_method": columns[row.method], "harmonic": int(row.item)} for row in headings.itertuples()]
        return int(agreeing(headings, np.array([float(marks.sel(one)) for one in at])).sum())

    printed_as = {"regression": "regression", "fft": "fft_multiples"}
    swapped = dict(zip(printed_as, reversed(printed_as.values()), strict=True))
    return {"headings_values": len(headings), "headings_printed": met(printed_as), "headings_swapped": met(swapped)}


def _equations(config):
    """Estimates by Eq. (4.36) as printed, and the error of the right equations."""
    problem = case_problem(config, "physical", next(iter(config.cases)))
    exact = solve_linear(*problem.equations(), problem.names)
    true = problem.model.theta[problem.model.position(problem.names)]
    wrong = by_misprint(problem, real_from=ROW_ABOVE)
    return {"eq_4_36": wrong, "condensation_error": np.max(np.abs(exact / true - 1))}


def _stiffness_losses(config, noisy):
    """How well both stiffness losses are separated, by the Cramer-Rao bound and by the trials under noise."""
    problem = case_problem(config, "thesis", next(iter(config.cases)))
    weighted = with_noise(problem.spectrum, 0.01, "white in time", config.record.samples)
    theta = problem.model.theta[problem.model.position(problem.names)]
    covariance = cramer_rao_bound(replace(problem, spectrum=weighted), theta)
    i, j = (problem.names.index(f"stiffness_loss_{k}") for k in ("22", "44"))
    tilt = float(noisy.true.sel(parameter="stiffness_loss_44"))
    where = {"record": "complete cycles", "noise_model": "white in time", "noise": 1, "estimator": "least_squares"}
    scatter = noisy.estimate.sel(**where, parameter="stiffness_loss_44")
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


def numbers_5(replay, spectra, identification):
    """Numbers on the mass implied by Table 5.1, and on Eq. (5.1); spectra, identification : of `thesis.replay`."""
    structure = replay.model.structure
    stiffness = 1 / np.linalg.inv(structure.stiffness)[0, 0]
    mass = replay.thesis_deflection_m * stiffness / GRAVITY
    compensated = as_complex(spectra.compensated.sel(version="corrected", data_set="fft", spectrum_method="regression"))
    draws = np.stack([compensated, compensated * (1 + 1e-6)])
    problem = replay_problem(replay, replay.groups[replay.all_speeds], compensated, draws)
    ours = identification.estimate.sel(estimator="least_squares", data_set="fft", group=replay.all_speeds)
    static = structure.static_deflection.real
    return {
        "deflection_of_1_87_um": static[0] * 1e6,
        "tilt_of_1_87_urad": static[1] * 1e6,
        "mass_of_deflection_kg": mass,
        "moment_ratio": structure.gyroscopic[1, 1] / structure.mass[1, 1],
        "frequency_of_1_87_Hz": np.sqrt(stiffness / structure.mass[0, 0]) / (2 * np.pi),
        "frequency_of_that_mass_Hz": np.sqrt(stiffness / mass) / (2 * np.pi),
        "eq_5_1": by_misprint(problem, real_from=ALL_ROWS, imag_from=ALL_ROWS),
        "right_5": ours.to_series(),
    }


LEAST = 1e-7  # m, amplitude of the smallest harmonic compared
SENSORS = {f"100 rad/s, node {n}": n - 1 for n in (1, 2, 3)}  # case as printed -> sensor
UNBALANCES = {  # of Table 6.8 -> parameter here, factor to the printed unit
    **{f"e_{n}": (f"eccentricity[{n}]", 1.0) for n in (1, 2)},
    **{f"phi_{n}": (f"eccentricity[{n}]_phase", 180 / np.pi) for n in (1, 2)},
}


def deviations(model, printed):
    """Deviations (amplitudes relative, phases in rad) of Tables 6.2 to 6.7 above 0.1 µm from a model at 100 rad/s."""
    harmonics = sorted({int(n) for n in printed.item})
    response = measured_response(model, [100.0], harmonics)[0]
    values = [response[harmonics.index(int(row.item)), SENSORS[row.case]] for row in printed.itertuples()]
    found = printed.assign(computed=_as_printed(printed, values))[np.abs(values) >= LEAST]
    turned = np.angle(np.exp(1j * (found.computed - found.published)))
    off = np.where(found.quantity == "amplitude", found.computed / found.published - 1, turned)
    return found.assign(deviation=np.abs(off))


def numbers_6(config, folder, variants):
    """Numbers on gyroscopic sign, mass matrix and unbalance phases of the spectra, and on Tables 6.8 and 6.9."""
    printed = published(folder, [f"6.{n}" for n in range(2, 8)])
    printed = printed[printed.method == "regression"]
    rig = config.rigs["thesis"]
    phases = [item["eccentricity_phase_rad"] for item in rig["effects"] if "eccentricity_phase_rad" in item]
    exchanged = dict(zip(phases, reversed(phases), strict=True))
    effects = [
        {key: exchanged[value] if key == "eccentricity_phase_rad" else value for key, value in item.items()}
        for item in rig["effects"]
    ]
    read = {
        "thesis": rig,
        "right_sign": with_right_sign(rig),
        "right_mass": {**rig, "effects": rig["effects"][:-1]},
        "printed_phases": {**rig, "effects": effects},
    }
    found = {name: deviations(build_model(own, f"Chapter 6, {name}"), printed) for name, own in read.items()}
    misprint = "table == '6.4' and item == '-2'"
    worst = {name: rows.query(f"not ({misprint})").deviation.max() * 100 for name, rows in found.items()}
    one = published(folder, ["6.8"])
    one = one[one.noise_percent == 0].set_index("item").published

    def off(variant):
        """Largest deviation of our eccentricities and phases from the printed ones, per cent."""
        here = variants.estimate.sel(variant=variant, case="100 rad/s")
        found = {name: float(here.sel(parameter=ours)) * factor for name, (ours, factor) in UNBALANCES.items()}
        return max(abs(value / one[name] - 1) for name, value in found.items()) * 100

    true = variants.true.to_series()
    return {
        **{f"reading_{name}_percent": value for name, value in worst.items()},
        "minus_2X_um": float(found["thesis"].query(misprint).computed.iloc[0]) * 1e6,
        "phi_1_deg": one["phi_1"],
        "e_1_off_percent": (one["e_1"] / true["eccentricity[1]"] - 1) * 100,
        "e_2_off_percent": (one["e_2"] / true["eccentricity[2]"] - 1) * 100,
        "opposite_signs_percent": off("the thesis: opposite gyroscopic sign"),
        "consistent_signs_percent": off("the thesis with consistent signs"),
    }


def filled(entries, numbers):
    """The errata as a DataFrame with every {name} in their texts replaced by its number."""
    table = pd.DataFrame([{key: text.format(**numbers) for key, text in entry.items()} for entry in entries])
    return table.apply(lambda column: column.str.split().str.join(" "))


def errata_table(errata, chapter_2, chapter_3, chapter_4, chapter_5, chapter_6, **results):
    """The Table of errata with the numbers of all chapters; errata : path;  chapter_n : its configuration file."""
    reference = Path(errata).parent
    of_4 = (results[name] for name in ("thesis_spectra", "weight_dominance", "monte_carlo"))
    numbers = numbers_2(load_study(chapter_2), reference) | numbers_3(load_replay(chapter_3), reference)
    numbers |= numbers_4(load_study(chapter_4), reference, *of_4)
    numbers |= numbers_5(load_replay(chapter_5), results["spectra"], results["identification"])
    numbers |= numbers_6(load_study(chapter_6), reference, results["variants"])
    table = filled(yaml.safe_load(Path(errata).read_text(encoding="utf-8")), numbers)
    return {"errata": page("errata", table)}
