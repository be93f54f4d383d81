"""What the comparison of spectrum methods and estimators tells: advice from a ranking, and no truth for estimators."""

import numpy as np
import pandas as pd

from rotorstudy import load_rig
from rotorstudy.studies.compare import ANY_FAULT, advice, without_values


def ranked(*rows):
    columns = ["fault", "rotor", "noise", "spectrum_method", "estimator", "error over bound", "coverage", "failed"]
    return pd.DataFrame(rows, columns=columns).assign(**{"ms an estimate": 1.0})


def test_advice_takes_honest_equals_first_names_them_and_says_where_the_worst_is():
    told = advice(
        ranked(
            ("spikes", "a", 1.0, "plain", "sure", 2.00, 0.50, 0.0),
            ("spikes", "a", 1.0, "plain", "honest", 2.02, 0.95, 0.0),
            ("spikes", "b", 5.0, "plain", "sure", 1.00, 0.95, 0.0),
            ("spikes", "b", 5.0, "plain", "honest", 1.00, 0.95, 0.0),
            ("spikes", "a", 1.0, "plain", "seldom fails", 1.99, 0.95, 0.01),
            ("spikes", "b", 5.0, "plain", "seldom fails", 1.00, 0.95, 0.0),
            ("spikes", "a", 1.0, "other", "honest", 3.00, 0.95, 0.0),
            ("spikes", "b", 5.0, "other", "honest", 9.00, 0.95, 0.0),
            ("spikes", "a", 1.0, "lucky", "fails", 1.00, 0.95, 0.1),
            ("spikes", "b", 5.0, "lucky", "fails", 1.00, 0.95, 0.0),
        )
    )
    assert list(told.fault) == ["spikes", "spikes", ANY_FAULT, ANY_FAULT]
    first, second = told.iloc[0], told.iloc[1]
    assert (first.spectrum_method, first.estimator, first["estimators as good"]) == (
        "plain",
        "honest",
        "seldom fails, sure",
    )
    assert first["where that is"] == "a, 1 %" and first.intervals == "honest"
    assert (second.spectrum_method, second["where that is"], second["estimators as good"]) == (
        "other",
        "b, 5 %",
        "none",
    )


def test_advice_for_a_fault_not_known_is_by_the_worst_of_all_faults():
    told = advice(
        ranked(
            ("none", "a", 1.0, "quick", "e", 1.0, 0.95, 0.0),
            ("spikes", "a", 1.0, "quick", "e", 90.0, 0.95, 0.0),
            ("none", "a", 1.0, "robust", "e", 1.2, 0.95, 0.0),
            ("spikes", "a", 1.0, "robust", "e", 2.0, 0.95, 0.0),
        )
    ).set_index("fault")
    assert told.loc["none"].spectrum_method.iloc[0] == "quick"
    assert told.loc[ANY_FAULT].spectrum_method.iloc[0] == "robust"


def test_an_estimator_is_not_told_the_value_it_is_to_find(request):
    model = load_rig(request.config.rootpath / "examples" / "jeffcott.yaml")
    sought = ("internal_damping", "eccentricity_real", "eccentricity_imag")
    asked = without_values(model, sought)
    given = dict(zip(asked.names, np.concatenate([term.theta for term in asked.terms]), strict=True))
    assert {name for name, value in given.items() if np.isnan(value)} == set(sought)
    assert given["external_damping"] == 100.0 and asked.names == model.names
