"""Evidence for the misprints and sign errors of Chapters 2, 3 and 5: what changes if the printed form is used.

Every function returns numbers by name; the errata page quotes them as {name}.
"""

from dataclasses import replace

import numpy as np
import pandas as pd

from rotorstudy.inference.equation_error import regression
from rotorstudy.inference.linear import solve_linear
from rotorstudy.inference.problem import Problem
from rotorstudy.response.coupling import forced_harmonics
from rotorstudy.response.measured import measured_response
from rotorstudy.store import as_complex
from rotorstudy.studies.common import clean_spectrum
from thesis.replay import printed_values, remove_slow_roll, replay_problem, rounding_draws
from thesis.scoreboard import published

GRAVITY = 9.81  # m/s^2, as in the thesis
HARMONICS = (0, 1, 2, 3, 5, 7, -1, -3, -5)  # in the order in which the thesis writes its equations


def agreeing(model, speeds, printed, theta=None):
    """Number of printed amplitudes and phases that the steady state of a model reproduces to the last digit.

    speeds : case as printed -> rad/s;  printed : rows of `published`
    """
    response = measured_response(model, list(speeds.values()), HARMONICS, theta)[..., 0]
    found = dict(zip(speeds, response, strict=True))
    count = 0
    for row in printed.itertuples():
        value = found[row.case][HARMONICS.index(int(row.item))]
        if row.quantity == "amplitude":
            distance = abs(value) - row.published
        else:
            distance = np.angle(value * np.exp(-1j * row.published))
        count += int(abs(distance) <= row.last_digit * (1 + 1e-6))
    return count


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
    return Problem(model, clean_spectrum(config, model, config.cases[case].speeds), tuple(config.unknowns))


def _negated(config, rig, unit):
    """(parameter,) amplitudes of a rig, those of one unit with reversed sign."""
    model = config.rig(rig)
    return np.where([own == unit for own in model.units], -1, 1) * model.theta


def chapter_2(config, folder):
    """Numbers on the sign of the crack force, the omitted terms of its series, and Eq. (2.32)."""
    printed = published(folder, ["2.2", "2.3", "2.5"])
    spectra = printed[printed.method == "regression"]
    thesis, speeds = config.rig("thesis"), {"88 rad/s": 88.0}
    right = _negated(config, "thesis", "N/m")
    first = np.abs(measured_response(thesis, [88.0], [1], np.stack([thesis.theta, right]))[:, 0, 0, 0])
    physical = measured_response(config.rig("physical"), [88.0], HARMONICS)[0, :, 0]
    cut = measured_response(thesis, [88.0], HARMONICS, right)[0, :, 0]
    forced = forced_harmonics(config.rig("physical"))
    every = np.abs(measured_response(config.rig("physical"), [88.0], forced)[0, :, 0])
    case = "Combined speed from 50 to 199 with increment +1"
    problem = case_problem(config, "physical", case)
    wrong = estimates_with_misprint(problem, swap_imag=True)
    copied = printed[(printed.case == f"{case}, with phase compensation") & (printed.noise_percent == 2)]
    copied = copied.set_index("item").published
    return {
        "crack_sign_values": len(spectra),
        "crack_sign_reversed": agreeing(thesis, speeds, spectra),
        "crack_sign_right": agreeing(thesis, speeds, spectra, right),
        "first_reversed_um": first[0] * 1e6,
        "first_right_um": first[1] * 1e6,
        "eq_2_32_c_H": wrong[problem.names.index("internal_damping")],
        "eq_2_32_c_E": wrong[problem.names.index("external_damping")],
        "printed_digits_percent": np.max(np.abs(cut - physical) / np.abs(physical)) * 100,
        "left_out_um": every[~np.isin(forced, HARMONICS)].max() * 1e6,
        "left_out_harmonic": int(forced[~np.isin(forced, HARMONICS)][every[~np.isin(forced, HARMONICS)].argmax()]),
        "row_2_5_e": copied["e"] * 1e6,
        "row_2_5_dk": copied["dk_xi"] / 1e5,
    }


def chapter_3(replay, folder):
    """Numbers on the mean of the slow roll, and on the mean at 17 Hz in section 3.7; folder : of printed values."""
    data_set = replay.data_sets.index("fft")
    zero = replay.harmonics.index(0)
    remaining = {}
    for corrected in (False, True):
        values = {q: v[data_set] for q, (v, _) in printed_values(replay, folder, corrected=corrected).items()}
        plain = values["amplitude"] * np.exp(1j * values["phase"])
        remaining[corrected] = np.abs(remove_slow_roll(replay, plain)[list(replay.cases).index("17 Hz"), zero])
    drawn = np.abs(remove_slow_roll(replay, rounding_draws(replay, folder, "fft")))[:, 1, zero]
    return {
        "mean_17_printed_um": remaining[False] * 1e6,
        "mean_17_used_um": remaining[True] * 1e6,
        "mean_17_highest_um": drawn.max() * 1e6,
    }


def chapter_5(replay, spectra, identification):
    """Numbers on the mass implied by Table 5.1, and on Eq. (5.1); spectra, identification : of `thesis.replay`."""
    structure = replay.model.structure
    stiffness = 1 / np.linalg.inv(structure.stiffness)[0, 0]
    mass = replay.thesis_deflection_m * stiffness / GRAVITY
    compensated = as_complex(spectra.compensated.sel(version="corrected", data_set="fft", spectrum_method="regression"))
    draws = np.stack([compensated, compensated * (1 + 1e-6)])
    problem = replay_problem(replay, replay.groups[replay.all_speeds], compensated, draws)
    wrong = estimates_with_misprint(problem, real_from=ALL_ROWS, imag_from=ALL_ROWS)
    ours = identification.estimate.sel(estimator="least_squares", data_set="fft", group=replay.all_speeds)
    static = structure.static_deflection.real
    return {
        "deflection_of_1_87_um": static[0] * 1e6,
        "tilt_of_1_87_urad": static[1] * 1e6,
        "mass_of_deflection_kg": mass,
        "moment_ratio": structure.gyroscopic[1, 1] / structure.mass[1, 1],
        "frequency_of_1_87_Hz": np.sqrt(stiffness / structure.mass[0, 0]) / (2 * np.pi),
        "frequency_of_that_mass_Hz": np.sqrt(stiffness / mass) / (2 * np.pi),
        "eq_5_1_c_H": wrong[problem.names.index("internal_damping")],
        "eq_5_1_c_E": wrong[problem.names.index("external_damping")],
        "right_5_c_H": float(ours.sel(parameter="internal_damping")),
        "right_5_c_E": float(ours.sel(parameter="external_damping")),
    }


def filled(entries, numbers):
    """The errata as a DataFrame with every {name} in their texts replaced by its number."""
    table = pd.DataFrame([{key: text.format(**numbers) for key, text in entry.items()} for entry in entries])
    return table.apply(lambda column: column.str.split().str.join(" "))
