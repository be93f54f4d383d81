"""Random cases and their files."""

import numpy as np
import pytest
import xarray as xr
import yaml

from rotorstudy.blind.machines.cases import CHAIN_FAULTS, draw_case
from rotorstudy.blind.machines.draw import draw_rotor, first_frequency
from rotorstudy.blind.machines.faults import FAMILIES
from rotorstudy.blind.machines.files import write_case
from rotorstudy.blind.machines.forms import FORMS


def test_rotors_of_all_sizes():
    rng = np.random.default_rng(0)
    rotors = [draw_rotor(rng) for _ in range(16)]
    masses = [rotor.mass for rotor in rotors]
    assert min(masses) < 0.1 and max(masses) > 500.0
    counts = [len(rotor.elements) for rotor in rotors]
    assert min(counts) < 6 and max(counts) > 16
    assert any(rotor.bearings[-1].node < len(rotor.elements) for rotor in rotors)
    assert draw_rotor(rng, mass=3.0, count=7).mass == pytest.approx(3.0)
    assert all(0.1 < first_frequency(rotor) < 1e6 for rotor in rotors[:5])


OF_FORMS = dict.fromkeys(FORMS, (11, "between_bearings"))
OF_FORMS |= {"crack_form": (11, "jeffcott"), "coupling_form": (11, "overhung")}


@pytest.mark.parametrize("family", ["crack", "rub", "misalignment", "pedestal", *FORMS])
def test_cases_are_steady_and_show_their_effect(family):
    seed, machine = OF_FORMS.get(family, (5, "any"))
    case = draw_case(seed, family, speeds=2, steps=64, modes=4, visible=1e-3, machine=machine)
    assert case.effects[0]["family"] == family and case.machine == machine
    assert np.max(case.steady.change) < 1e-6
    assert max(case.steady.multipliers) < 1.0
    assert max(case.changed.values()) >= 1e-3


def test_a_healthy_case_changes_nothing_and_is_that_of_its_seed():
    case, again = (draw_case(6, "healthy", speeds=2, steps=32, modes=4) for _ in range(2))
    assert max(case.changed.values()) < 1e-9
    assert len(FAMILIES) == 19
    np.testing.assert_array_equal(case.records["displacement"], again.records["displacement"])
    assert (case.effects, case.probes, case.chain) == (again.effects, again.probes, again.chain)


@pytest.fixture(scope="module")
def sound():
    return draw_case(8, "healthy", 2, 32, 4, count=3)


@pytest.mark.parametrize("fault", CHAIN_FAULTS)
def test_faults_of_the_chain_reach_the_record(fault, sound):
    faulty = draw_case(8, "healthy", 2, 32, 4, chain_fault=fault, count=3)
    assert faulty.fault == fault
    changed = ~np.isclose(sound.records["displacement"], faulty.records["displacement"]).all(axis=(0, 2, 3))
    keyed = ~np.isclose(sound.records["keyphasor"], faulty.records["keyphasor"]).all()
    assert changed.any() or keyed


def test_files_hold_the_nominal_machine_and_the_record_and_no_truth(tmp_path):
    case = draw_case(9, "added_mass", speeds=2, steps=64, modes=6)
    folder = write_case(case, tmp_path / "case")
    assert sorted(path.name for path in folder.iterdir()) == ["record.nc", "rig.yaml"]
    text = (folder / "rig.yaml").read_text(encoding="utf-8")
    rig, rotor = yaml.safe_load(text), case.rotor
    assert rig["rotor"]["kind"] == "finite_element" and "added" not in text
    assert sum(part["count"] for part in rig["rotor"]["elements"]) == len(rotor.elements)
    assert sum(part["length_m"] for part in rig["rotor"]["elements"]) == pytest.approx(rotor.length)
    assert 0 < abs(rig["rotor"]["youngs_modulus_Pa"] / rotor.youngs_modulus - 1) < 0.03
    stiff = [bearing["bearing_stiffness_xx_N_per_m"] for bearing in rig["bearings"]]
    np.testing.assert_allclose(stiff, [bearing.stiffness[0, 0] for bearing in rotor.bearings], rtol=0.1)
    assert [effect["kind"] for effect in rig["effects"]].count("unbalance") == len(rotor.discs)
    with xr.open_dataset(folder / "record.nc") as data:
        assert data.displacement.dims == ("speed", "node", "direction", "time")
        assert data.displacement.attrs["units"] == "m"
        assert data.keyphasor.dims == ("speed", "time")
        assert list(data.node.values) == rig["sensors"]
        assert [probe["channel"] for probe in rig["measurement"]["probes"]] == list(data.direction.values)
        assert list(data.attrs) == ["title"]
