"""What the comparison of spectrum methods and estimators tells; sweeps in chunks have the numbers of one job."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from jobs.comparison_page import advice_table, best_by_worst, comparison_figures
from jobs.shown import write_tables
from rotorstudy import load_rig, registry
from rotorstudy.measurement.full_spectra import full_spectrum
from rotorstudy.measurement.records import Record
from rotorstudy.store import chunk_of, gathered
from rotorstudy.studies.comparison.config import Fault, Rotor, load_comparison, study_rotor
from rotorstudy.studies.comparison.estimates import estimates, without_values
from rotorstudy.studies.comparison.ranking import ANY_FAULT, advice, ranking
from rotorstudy.studies.comparison.trials import make_trials, spectra, trial_spectra
from rotorstudy.studies.config import file_name, load_study
from rotorstudy.studies.identify import gather_monte_carlo, monte_carlo


def ranked(*rows):
    columns = ["fault", "rotor", "noise", "spectrum_method", "estimator", "error over bound", "coverage", "failed"]
    return pd.DataFrame(rows, columns=columns).assign(**{"time per estimate (ms)": 1.0, "which parameter": "damping"})


def test_advice_takes_valid_equals_first_names_them_and_says_where_the_worst_is():
    told = advice(ranked(
        ("spikes", "a", 1.0, "plain", "sure", 2.00, 0.50, 0.0), ("spikes", "a", 1.0, "plain", "valid", 2.02, 0.95, 0.0),
        ("spikes", "b", 5.0, "plain", "sure", 1.00, 0.95, 0.0), ("spikes", "b", 5.0, "plain", "valid", 1.00, 0.95, 0.0),
        ("spikes", "a", 1.0, "plain", "seldom fails", 1.99, 0.95, 0.01),
        ("spikes", "b", 5.0, "plain", "seldom fails", 1.00, 0.95, 0.0),
        ("spikes", "a", 1.0, "other", "valid", 3.00, 0.95, 0.0), ("spikes", "b", 5.0, "other", "valid", 9.0, 0.95, 0.0),
        ("spikes", "a", 1.0, "lucky", "fails", 1.00, 0.95, 0.1), ("spikes", "b", 5.0, "lucky", "fails", 1.0, 0.95, 0.0),
    ))  # fmt: skip
    assert list(told.fault) == ["spikes", "spikes", ANY_FAULT, ANY_FAULT]
    first, second = told.iloc[0], told.iloc[1]
    of_first = (first.spectrum_method, first.estimator, first["equally good estimators"])
    assert of_first == ("plain", "valid", "seldom fails, sure")
    assert first["worst rotor and noise"] == "a, 1 %" and first.intervals == "valid"
    of_second = (second.spectrum_method, second["worst rotor and noise"], second["equally good estimators"])
    assert of_second == ("other", "b, 5 %", "none")


def test_advice_for_a_fault_not_known_is_by_the_worst_of_all_faults():
    told = advice(ranked(
        ("none", "a", 1.0, "quick", "e", 1.0, 0.95, 0.0), ("spikes", "a", 1.0, "quick", "e", 90.0, 0.95, 0.0),
        ("none", "a", 1.0, "robust", "e", 1.2, 0.95, 0.0), ("spikes", "a", 1.0, "robust", "e", 2.0, 0.95, 0.0),
    )).set_index("fault")  # fmt: skip
    assert told.loc["none"].spectrum_method.iloc[0] == "quick"
    assert told.loc[ANY_FAULT].spectrum_method.iloc[0] == "robust"


def test_an_estimator_is_not_told_the_value_it_is_to_find(request):
    model = load_rig(request.config.rootpath / "examples" / "jeffcott.yaml")
    sought = ("internal_damping", "eccentricity_real", "eccentricity_imag")
    asked = without_values(model, sought)
    given = dict(zip(asked.names, np.concatenate([term.theta for term in asked.terms]), strict=True))
    assert {name for name, value in given.items() if np.isnan(value)} == set(sought)
    assert given["external_damping"] == 100.0 and asked.names == model.names


HARMONICS, JITTER = [0, 1, -1], {"keyphasor_jitter_rad": 0.02}


def trials_of(root, fault, levels):
    """Three Trials of a Jeffcott rotor with noise of each level and a fault."""
    config = load_comparison(root / "workflow" / "config" / "test" / "compare.yaml")
    config = config.model_copy(update={"faults": {"one": Fault(**fault)}})
    rotor = Rotor(load_rig(root / "examples" / "jeffcott.yaml"), (), HARMONICS, HARMONICS, np.array([100.0]))
    return make_trials(config, 0, rotor, "one", 0, levels, 3)


@pytest.mark.parametrize("method", ["regression", "sine_fit", "order_tracking"])
def test_a_spectrum_of_a_trial_is_the_one_that_its_user_gets(method, request):
    method, trials = registry().get("spectrum", method), trials_of(request.config.rootpath, JITTER, [1.0])
    amplitude, covariance = trial_spectra(method, trials, HARMONICS)
    stated = []
    for t, (signal, keyphasor) in enumerate(zip(trials.signal[0], trials.keyphasor, strict=True)):
        record = Record(trials.time, signal, trials.label, (1,), keyphasor=keyphasor)
        own = full_spectrum([record], HARMONICS, method, "keyphasor")
        assert np.allclose(amplitude[0, t], own.amplitude[0], rtol=1e-9, atol=0)
        stated.append(own.covariance[0])
    assert np.allclose(covariance[0], np.mean(stated, axis=0), rtol=1e-9, atol=1e-9 * covariance.max())


@pytest.mark.parametrize("method", ["regression", "order_tracking"])
@pytest.mark.parametrize("fault", [{}, JITTER])
def test_levels_evaluated_together_are_those_evaluated_alone(method, fault, request):
    """They share their draws: the error of a linear method grows with the level, without a fault in proportion."""
    method = registry().get("spectrum", method)

    def found(levels):
        return trial_spectra(method, trials_of(request.config.rootpath, fault, levels), HARMONICS)

    both, clean = found([1.0, 5.0]), found([0.0])
    for i, level in enumerate((1.0, 5.0)):
        for part, alone in zip(both, found([level]), strict=True):
            assert np.allclose(part[i], alone[0], rtol=1e-12, atol=1e-12 * abs(alone).max())
    off = both[0] - clean[0]
    if not fault:
        assert np.allclose(off[1], 5 * off[0], rtol=1e-6, atol=1e-9 * abs(clean[0]).max())
    assert abs(off[1]).max() > 3 * abs(off[0]).max() > 0


def compared():
    """A tiny comparison as its stages leave it: Dataset over everything, errors of the harmonics, bias."""
    rng = np.random.default_rng(0)
    labels = {"rotor": ["small", "large"], "estimator": ["good", "poor"], "spectrum_method": ["regression", "fft"]}
    labels |= {"fault": ["whole revolutions", "outliers"], "noise": [0.0, 1.0, 5.0]}
    labels |= {"parameter": ["damping", "eccentricity"]}
    dims, shape = tuple(labels), tuple(map(len, labels.values()))
    efficiency = rng.uniform(0.7, 1, shape)
    efficiency[:, 1] /= 100
    poor = (np.arange(2) == 1)[:, None, None, None, None]
    found = {"efficiency": (dims, efficiency)}
    found |= {name: (dims, size * efficiency**-0.5) for name, size in (("rmse", 1.0), ("scatter", 0.9), ("bias", 0.4))}
    found |= {"coverage": (dims, np.full(shape, 0.95) - 0.5 * poor)}
    found |= {name: (dims[:-1], np.full(shape[:-1], value)) for name, value in (("failed", 0.0), ("seconds", 1e-3))}
    whole = xr.Dataset(found, labels)
    error = xr.DataArray(np.full((2, 3), 0.01), {key: labels[key] for key in ("fault", "noise")})
    errors = {(r, m): error * (1 + (m == "fft")) for r in labels["rotor"] for m in labels["spectrum_method"]}
    over = ("case", "estimator", "known", "percent", "parameter"), np.full((1, 1, 1, 3, 2), 0.02)
    relative = xr.Dataset({"relative_error": over}, {"percent": [-1.0, 0.0, 1.0]})
    return whole, errors, [("small", e, relative) for e in labels["estimator"]]


def test_figures_of_a_comparison_carry_their_name_and_say_what_is_in_the_data():
    whole, errors, biased = compared()
    figures = comparison_figures(whole, errors, biased, 200)
    assert list(figures) == ["estimators", "spectra", "faults", "coverage", "bias"]
    said = {name: picture.get_suptitle() for name, picture in figures.items()}
    assert said["estimators"].startswith("Good comes closest to the Cramér-Rao bound")
    assert "with good has the smallest error in its worst fault (1 % noise)" in said["faults"]
    assert said["coverage"].startswith("2 of 4 pairs state valid 95 % intervals")
    assert "by 1 % moves the parameters by 2 to 2 %" in said["bias"]
    assert figures["spectra"].axes[0].get_title().startswith("Regression has the smallest error")


def test_one_that_fails_somewhere_is_none_of_the_best():
    names = {"fault": ["none", "spikes"], "spectrum_method": ["fails", "holds"]}
    values = xr.DataArray([[1.0, 2.0], [np.nan, 3.0]], names)
    assert best_by_worst(values) == ["holds"]


def test_advice_as_a_page(tmp_path):
    ranked = ranking(compared()[0])
    advice = advice_table(ranked, {"outliers": "samples are spikes"})
    write_tables({"advice": advice}, [tmp_path / "advice.csv", tmp_path / "advice.html"])
    told = pd.read_csv(tmp_path / "advice.csv")
    assert set(told.estimator) == {"good"} and set(told.intervals) == {"valid"}
    page = (tmp_path / "advice.html").read_text()
    assert "within 5 % of it" in page and "samples are spikes" in page and "the record has: whole revolutions" in page


TINY = "workflow/config/test"


def test_chunks_are_all_items_in_order():
    for chunks in (1, 3, 7):
        assert [one for i in range(chunks) for one in chunk_of("abcdefg", i, chunks)] == list("abcdefg")


@pytest.mark.parametrize("study", ["chapter_4", "chapter_6"])
def test_trials_in_three_chunks_are_those_of_one_job(study):
    config = load_study(f"{TINY}/{study}.yaml")
    settings = config.monte_carlo.model_copy(update={"trials": 4, "levels_percent": [1, 2, 5]})
    config = config.model_copy(update={"monte_carlo": settings})
    case = file_name(next(iter(config.cases)))
    parts = {f"{case}_{i}": monte_carlo(config, "physical", case, i, 3) for i in range(3)}
    whole = monte_carlo(config, "physical", case)
    xr.testing.assert_identical(gather_monte_carlo(config, case, 3, parts), whole)
    parts[f"{case}_1"] = parts[f"{case}_0"]  # the same level twice is noticed
    assert not np.array_equal(gather_monte_carlo(config, case, 3, parts).noise, whole.noise)


def test_a_comparison_in_two_chunks_is_that_of_one_job():
    config = load_comparison(f"{TINY}/compare.yaml")
    rotor = study_rotor(config.rotors["2-DOF"], load_study(f"{TINY}/chapter_2.yaml"))
    method, estimator = registry().get("spectrum", "regression"), registry().get("estimator", "least_squares")

    def compared(faults):
        seen = spectra(config, "2-DOF", rotor, method, faults)
        return seen.drop_vars("seconds"), estimates(config, "2-DOF", rotor, {"regression": seen}, estimator)

    whole = compared(None)
    parts = zip(*(compared(chunk_of(list(config.faults), i, 2)) for i in range(2)), strict=True)
    for part, one in zip(parts, whole, strict=True):
        xr.testing.assert_identical(gathered(part, "fault").drop_vars("seconds", errors="ignore").transpose(*one.dims),
                                    one.drop_vars("seconds", errors="ignore"))  # fmt: skip
