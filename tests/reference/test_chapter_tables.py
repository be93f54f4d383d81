"""Tables and figures of the chapters without any computation: what they are made of covers what is printed."""

import numpy as np
import pandas as pd
import pytest
from chapters import REFERENCE, replay, study
from machines import readings

from rotorstudy.measurement.noise import MODELS, noise_std, with_noise
from rotorstudy.studies.analyses import damping_along_x
from thesis.chapter_tables import described, places
from thesis.scoreboard import PLACE, PRINTED, published, scored_tables, table_name


@pytest.mark.parametrize("number", [2, 4, 6])
def test_what_is_printed_has_its_place_here_and_every_place_is_printed(number):
    config, texts = study(number), described(REFERENCE, f"chapter_{number}")
    printed = published(REFERENCE, list(texts["tables"]))
    spectra, estimates = (printed[printed.quantity.eq("estimate") == of] for of in (False, True))
    columns = places(REFERENCE, "full_spectrum", texts["tables"], [*PRINTED, *PLACE])
    assert len(columns) == len(spectra.drop_duplicates(PRINTED))
    assert all({"speed_rad_s", "record", "spectrum_method"} < {*column} for column in columns)
    assert {round(speed, 2) for speed in config.shown_speeds_rad_s} >= {column["speed_rad_s"] for column in columns}
    rows = places(REFERENCE, "rows_of_estimates", texts["tables"])
    assert {*zip(estimates.table, estimates.case, strict=True)} == {(r["table"], r["printed_case"]) for r in rows}
    assert {row["case"] for row in rows} == set(config.cases)
    assert set(estimates.item) <= set(texts["parameters"])
    assert set(texts["parameters"].values()) <= set(config.reported)


def test_phases_and_dampings_are_told_by_unit_and_table():
    config = study(6)
    names = ["eccentricity[1]", "eccentricity[1]_phase", "internal_damping", "bearing_stiffness_xx[1]"]
    assert [config.reported[name] == "rad" for name in names] == [False, True, False, False]
    found = {u.name: damping_along_x(u) for u in config.rig("physical").rotor_unknowns}
    shown = ("bearing_damping_xx[1]", "bearing_damping_yy[1]", "bearing_stiffness_xx[1]", "internal_damping")
    assert [found[name] for name in shown] == [1, 0, 0, 1]


def test_a_noise_model_is_its_attributes():
    amplitude = np.array([[[1.0], [3.0]], [[2.0], [4.0]]]) + 0j  # (speed, harmonic, sensor)
    spectrum = readings(amplitude, [50.0, 60.0], [1, 2], (1,), 0.0)
    numbers = np.random.default_rng(1).standard_normal((1, 2, *amplitude.shape))
    for name, model in MODELS.items():
        std = noise_std(spectrum, 0.01, name, 100)
        assert np.allclose(std[:, 0], std[:, 1]) != model.own_size
        drawn = (with_noise(spectrum, 0.01, name, 100, numbers).amplitude - amplitude)[0] / std
        assert np.allclose(drawn[0], drawn[1]) == model.one_draw


def test_the_stiffness_losses_of_a_replay_are_those_of_its_rig():
    for config in map(replay, (3, 5)):
        assert set(config.losses.values()) == {n for n in config.model.names if "stiffness_loss" in n}
        assert config.thesis_names["dk p_-1"] == (config.losses[-1], 1.0)


def test_scored_tables_are_named_as_their_files():
    row = {"table": "2.10", "case": "a", "item": "1", "unit": "m", "published": 1e-6, "computed": 2e-6, "status": "s"}
    found = scored_tables(pd.DataFrame([row]), {"2.10": ("Title", "Note.", ["item"], ["case"])})
    assert list(found) == [table_name("2.10")] == ["table_2_10"]
    assert found["table_2_10"].title == "Table 2.10: Title"
    assert found["table_2_10"].rows["a (µm): here"].item() == 2.0
