"""Sweeps split into chunks have the numbers of one job, bit by bit."""

import numpy as np
import pytest
import xarray as xr

from rotorstudy import registry
from rotorstudy.store import chunk_of, gathered
from rotorstudy.studies.comparison.config import load_comparison, study_rotor
from rotorstudy.studies.comparison.estimates import estimates
from rotorstudy.studies.comparison.trials import spectra
from rotorstudy.studies.config import file_name, load_study
from rotorstudy.studies.identify import gather_monte_carlo, monte_carlo

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
