"""What is hidden is what the truth says, it is as large as asked for, and nothing of it is shown."""

import json

import numpy as np
import pytest
from one_line_errors import refused

from rotorstudy import RotorstudyError, measured_response, measured_spectrum, read_rig, registry
from rotorstudy.blind.config import KINDS, load_blind
from rotorstudy.blind.injection import KINDS_OF_CASES, Order, absorbed, draw, left_by_base, order_of
from rotorstudy.blind.machines.cases import CHAIN_FAULTS
from rotorstudy.blind.machines.faults import FAMILIES
from rotorstudy.blind.machines.forms import FORMS
from rotorstudy.blind.meanings import MEANS, compared, in_library, left_out

from .conftest import SEED, cause


def test_every_fault_of_the_simulator_has_a_meaning():
    zoo = registry().plugins["effect"]
    assert set(MEANS) >= {*FAMILIES, *FORMS, *CHAIN_FAULTS} - {"healthy"}
    names = {name for one in MEANS.values() for name in (*one.names, *one.beside, *one.alike)}
    assert names <= set(zoo), "no effects of the library"
    assert in_library("crack_form") and not in_library("dry_friction_form")
    assert set(KINDS) <= set(KINDS_OF_CASES)
    assert left_out([{"family": "preload"}]) == ["parallel_misalignment", "static_preload"]


def test_what_the_library_lacks_it_lacks_in_other_words_too(drawn):
    """Dry friction is a damping; without that, too, it is outside the library."""
    assert left_out([{"family": "dry_friction_form"}]) == ["bearing_coefficients", "external_damping"]
    assert all(bool(truth["leave_out"]) != truth["known"] for truth, _ in drawn)


def test_the_truth_is_recognised_at_its_place_and_not_elsewhere(truths):
    for truth in truths:
        for one in truth["true"]:
            if not in_library(one["family"]) or MEANS[one["family"]].convention:
                continue
            named = cause(one)
            assert compared(one, named)[:2] == (True, True), one
            assert compared(one, named | {"effect": "base_motion"})[0] is False
            if "node" in one and MEANS[one["family"]].place == "node":
                assert compared(one, named | {"where": {"node": one["node"] + 1}})[:2] == (True, False)
            if "softened_m" in one:
                off = one["softened_m"] / 2 + 0.06 * one["length_m"]
                elsewhere = {"position_m": {"value": one["position_m"] + off}}
                assert compared(one, named | {"parameters": elsewhere})[:2] == (True, False)


def test_a_case_depends_on_its_order_alone(config, drawn, tmp_path):
    number, (truth, folder) = next((i, one) for i, one in enumerate(drawn) if one[0]["true"])
    again = draw(order_of(config, SEED, number), tmp_path / "again")
    assert again == truth
    assert (tmp_path / "again" / "rig.yaml").read_text() == (folder / "rig.yaml").read_text()
    assert order_of(config, SEED + 1, number) != order_of(config, SEED, number)


def test_sizes_are_those_asked_for(config, drawn, tmp_path, monkeypatch):
    sizes = [truth["size"] for truth, _ in drawn if truth["true"] and truth["size"] is not None]
    low, high = config.size
    assert len(sizes) > 3 and all(low <= size <= high for size in sizes)
    impossible = Order(7, 3, "unbalance", elements=(2, 2), speeds=(3, 3), harmonics=(1,), sizes=(1e9, 2e9))
    monkeypatch.setattr("rotorstudy.blind.injection.TRIES", 3)
    refused(lambda: draw(impossible, tmp_path), "case 7, unbalance: 3 draws failed: the last had size")


def test_the_folder_does_not_tell_what_is_hidden(drawn):
    for truth, folder in drawn:
        assert sorted(path.name for path in folder.iterdir()) == ["record.nc", "rig.yaml"]
        text = (folder / "rig.yaml").read_text()
        assert all(one["family"] not in text for one in truth["true"] if one["family"] not in ("unbalance", "runout"))


def test_the_record_shows_what_the_truth_says_without_noise(drawn):
    """Whatever the angles of probes, gravity and phase mark; to the scatter from run to run, 0.5 %, and the noise."""
    off = []
    for truth, folder in drawn:
        if "without_noise" in truth:
            spectrum, *_ = measured_spectrum([folder / "record.nc"], read_rig(folder / "rig.yaml"))
            real, imag = np.array(truth["without_noise"])
            size = np.abs(spectrum.amplitude[:, spectrum.harmonics == 1]).max()
            off.append(np.abs(spectrum.amplitude - (real + 1j * imag)).max() / size)
    assert max(off) < 0.05 and np.median(off) < 0.02


def test_the_base_absorbs_what_it_can_change_and_nothing_else(drawn):
    """A stated unbalance moved by its error is next to nothing; a 3X that changes sign from speed to speed is not."""
    folder = next(folder for truth, folder in drawn if not truth["true"] and truth["elements"])
    rig = read_rig(folder / "rig.yaml")
    spectrum, model, _ = measured_spectrum([folder / "record.nc"], rig)
    columns = absorbed(spectrum, model, rig.given["diagnosis"])
    theta = np.nan_to_num(model.stated)
    base = measured_response(model, spectrum.speed, spectrum.harmonics, theta)
    at = next(i for i, name in enumerate(model.names) if "eccentricity" in name)
    moved = theta.copy()
    moved[at] *= 1.05
    change = measured_response(model, spectrum.speed, spectrum.harmonics, moved) - base
    whole = np.sqrt(np.mean(spectrum.whitened(change) ** 2))
    assert whole > 3 and left_by_base(change, spectrum, columns) < 0.2 * whole
    other = np.zeros_like(base)
    other[:, spectrum.harmonics == -3] = np.abs(base).max() * 1e-2
    other[1::2] *= -1
    whole = np.sqrt(np.mean(spectrum.whitened(other) ** 2))
    assert left_by_base(other, spectrum, columns) > 0.8 * whole
    # beside itself of unknown size nothing is left
    assert left_by_base(other, spectrum, columns, beside=2 * other) < 1e-3 * whole


def test_configuration_errors_say_what_is_wrong(tmp_path, config):
    with pytest.raises(RotorstudyError, match="rigz"):
        (tmp_path / "a.yaml").write_text("rigz: {}\n")
        load_blind(tmp_path / "a.yaml")
    given = json.loads(config.model_dump_json())
    for change, said in (
        ({"shares": {"clean": 1.0}}, "shares must name clean"),
        ({"machines": {"turbine": 1.0}}, "machines must be of any"),
        ({"size": [3.0, 1.0]}, "size = 3 to 1"),
    ):
        (tmp_path / "b.yaml").write_text(json.dumps(given | change))
        refused(lambda: load_blind(tmp_path / "b.yaml"), said)
