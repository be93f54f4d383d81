"""Printed values of the thesis, at full resolution of the records, without running the workflow."""

import numpy as np
import pytest
from chapters import REFERENCE, WORKFLOW, replay, study
from one_line_errors import refused
from scipy.optimize import least_squares

from rotorstudy import Problem, Spectrum, load_rig, magnitude_and_phase, measured_response
from rotorstudy.inference.linear import solve_linear
from rotorstudy.measurement.spectrum import independent_covariance
from rotorstudy.response.series import synthesize
from rotorstudy.store import as_complex
from thesis.replay import printed_values, records, rounding_draws, spectra
from thesis.scoreboard import published, score

CHAPTER_2 = study(2)
CHAPTER_3 = replay(3)


def test_deflection_and_natural_frequency_are_those_printed():
    structure = CHAPTER_2.rig("physical").structure
    assert abs(structure.static_deflection[0].real - 2.58e-5) < 0.01e-5  # Table 2.1, last digit
    # 616.44 rad/s in section 2.4.1, last digit
    assert abs(np.sqrt(structure.stiffness[0, 0] / structure.mass[0, 0]) - 616.44) < 0.01


def test_replayed_tables_3_4_to_3_8_come_back_to_the_digit():
    found = spectra(CHAPTER_3, records(CHAPTER_3, REFERENCE))
    table = published(REFERENCE, ["3.4", "3.5", "3.6", "3.7", "3.8"])
    quantities = {"amplitude": "displacement", "phase": "displacement", "reference phase": "reference_phase"}
    checked = 0
    for row in table.itertuples():
        version = "corrected" if row.table == "3.8" else "as printed"
        here = found.sel(version=version, data_set=row.method, spectrum_method=row.method, case=row.case)
        value = here[quantities.get(row.quantity, "compensated")].sel(harmonic=int(row.item))
        if row.quantity != "reference phase":
            value = as_complex(value)
        if row.quantity == "amplitude":
            distance = abs(abs(value) - row.published)
        else:
            angle = value if row.quantity == "reference phase" else np.angle(value)
            distance = abs(np.angle(np.exp(1j * (float(angle) - row.published))))
        assert distance <= row.last_digit * (1 + 1e-6), row
        checked += 1
    assert checked == 252
    # without the correction the mean of the slow roll contradicts Table 3.8
    printed = printed_values(CHAPTER_3, REFERENCE, corrected=False)["phase"][0]
    assert abs(printed[0, 0, 0] - 0.77) > 0.7


def test_rounding_draws_stay_within_half_a_digit_and_spread_over_it():
    draws = rounding_draws(CHAPTER_3, REFERENCE, "fft")
    size, digit = (part[1] for part in printed_values(CHAPTER_3, REFERENCE, corrected=True)["amplitude"])
    distance = (np.abs(draws) - size) / digit
    assert np.abs(distance).max() <= 0.5 + 1e-9
    # uniform within the digit: standard deviation 1/sqrt(12); 1000 draws of 36 values leave under 1 %
    assert distance.std() == pytest.approx(1 / np.sqrt(12), rel=0.02)


@pytest.mark.parametrize(
    ("table", "change", "status"),
    [
        ("2.2", lambda value: 1.01 * value, "explained"),
        ("2.2", lambda value: value, "reproduced"),
        ("3.8", lambda value: value + 2 * np.pi, "reproduced"),  # phases
    ],
)
def test_a_value_that_differs_needs_a_reason_and_another_one_does_not(table, change, status):
    printed = published(REFERENCE, [table])
    computed = printed.drop(columns=["published", "last_digit", "unit"]).assign(computed=change(printed.published))
    reasons = [{"table": table, "status": "explained", "reason": "a test"}]
    assert set(score(printed, computed, reasons).status) == {status}
    if status == "explained":
        refused(lambda: score(printed, computed, []), "no reason given")


def test_the_example_rig_is_the_rotor_of_table_2_1():
    example, study = load_rig(WORKFLOW.parent / "examples" / "jeffcott.yaml"), CHAPTER_2.rig("physical")
    assert dict(zip(example.names, example.theta, strict=True)) == dict(zip(study.names, study.theta, strict=True))


def both_end_points(config, speed, samples):
    """Full spectrum by FFT of a closed-form record over 2 pi s whose time grid holds both end points."""
    exact = measured_response(config.rig("thesis"), [speed], config.harmonics)[0, :, 0]
    time = np.linspace(0, 2 * np.pi, samples)
    record = synthesize(exact, speed, config.harmonics, time)
    bins = np.array(config.harmonics) * int(speed)
    return exact, np.fft.fft(record)[bins] / samples


def test_a_time_grid_with_both_end_points_gives_the_printed_percentages_of_table_2_2():
    printed = {0: -0.0047, 1: -0.0032, 2: 0.0012, 3: 0.0128, -1: -0.0051, -3: 0.0163}
    exact, leaky = both_end_points(CHAPTER_2, 88.0, 65536)
    for n, expected in printed.items():
        i = CHAPTER_2.harmonics.index(n)
        found = (1 - abs(leaky[i]) / abs(exact[i])) * 100
        assert found == pytest.approx(expected, abs=0.002)  # what is left is the thesis's integration error


def estimates(config, case, amplitude):
    model, speeds = config.rig("thesis"), config.cases[case].speeds
    zero = independent_covariance(np.zeros((len(speeds), len(config.harmonics), 1)))
    spectrum = Spectrum(amplitude, speeds, np.array(config.harmonics), (1,), zero)
    names = tuple(config.unknowns)
    theta = solve_linear(*Problem(model, spectrum, names).equations(), names)
    return magnitude_and_phase(names, theta, np.eye(len(names)))[1] * [1, 1, 1, 180 / np.pi, 1]


def test_with_half_the_samples_it_comes_near_the_uncompensated_estimate_at_308():
    _, leaky = both_end_points(CHAPTER_2, 308.0, 32768)
    found = estimates(CHAPTER_2, "Single speed 308", leaky[None, :, None])
    # printed 20.0297, 99.4815, 4.8185e-6, 28.68; a plain delay of one sample gives 19.955 for the first
    assert found[0] == pytest.approx(20.0297, abs=0.005)
    assert found[3] == pytest.approx(28.68, abs=0.02)


def test_nine_real_factors_on_the_amplitudes_explain_all_noise_rows_of_table_2_5():
    """One draw for all speeds and levels, no noise in the phases; the single speeds foretell the combined ones."""
    table = published(REFERENCE, ["2.5"])
    table = table[table.case.str.endswith("with phase compensation")].set_index(["case", "noise_percent", "item"])
    items, model, cases = ["c_H", "c_E", "e", "phi", "dk_xi"], CHAPTER_2.rig("thesis"), list(CHAPTER_2.cases)
    exact = {case: measured_response(model, CHAPTER_2.cases[case].speeds, CHAPTER_2.harmonics) for case in cases}
    clean = {case: estimates(CHAPTER_2, case, amplitude) for case, amplitude in exact.items()}
    rows = {case: table.loc[f"{case}, with phase compensation"].published for case in cases}
    printed = {(c, level): np.array([rows[c][level, item] for item in items]) for c in cases for level in (0, 1, 2, 5)}

    def missed(factors, case, level):
        """Relative error of the predicted change (..., item) by factors (..., harmonic), without the misprint."""
        change = estimates(CHAPTER_2, case, exact[case] * (1 + level / 100 * factors[..., None, :, None])) - clean[case]
        count = 4 if case == cases[2] and level == 2 else 5
        return ((change - printed[case, level] + printed[case, 0]) / np.abs(clean[case]))[..., :count]

    def fitted(chosen):
        def all_missed(factors):
            return np.concatenate([missed(factors, c, level) for c in chosen for level in (1, 2, 5)], axis=-1)

        def slopes(factors):
            step = 1e-4 * np.eye(9)  # all at once
            return (all_missed(factors + step) - all_missed(factors - step)).T / 2e-4

        return least_squares(all_missed, np.zeros(9), slopes).x

    everywhere = fitted(cases)
    assert np.abs(everywhere).max() < 0.55  # a uniform draw between -1/2 and 1/2
    worst = max(np.abs(missed(everywhere, case, 5)).max() for case in cases)
    assert worst < 2e-3  # of changes up to 0.6: a few units of the printed digits
    assert max(np.abs(missed(-everywhere, case, 5)).max() for case in cases) > 0.1  # negative control: another draw
    from_single = fitted(cases[:2])
    # 5X and -5X hardly show at these two speeds
    assert max(np.abs(missed(from_single, case, 5)).max() for case in cases[2:]) < 2e-2
