"""Where one force explains the records of machines that share nothing with the package, and what follows from it."""

import pytest

from foreign.small_cases import small
from rotorstudy.blind.machines.files import write_case
from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.search.search import begin
from rotorstudy.diagnosis.settings import read_settings
from rotorstudy.diagnosis.verdict.one_place import explaining_places
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import read_rig

pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")

HARMONICS = [0, 1, -1, 2, -2, 3, -3]
SIZE = {"count": 4, "speeds": 5, "steps": 128, "visible": 0.05}


def read(case, folder, library=()):
    """Spectrum, model and settings of a case, with a rig file as wrong as good ones are and some effects alone."""
    write_case(case, folder, 0.005, 0.02, 0.05, harmonics=HARMONICS)
    rig = read_rig(folder / "rig.yaml")
    spectrum, model, _ = measured_spectrum([folder / "record.nc"], rig)
    others = sorted(set(registry().plugins["effect"]) - set(library))
    return spectrum, model, read_settings(rig.given, "rig.yaml").model_copy(update={"leave_out": others})


def places(case, folder):
    spectrum, model, settings = read(case, folder)
    spectrum = with_model_error(spectrum, settings)
    return explaining_places(begin(model, spectrum, settings), spectrum)


@pytest.mark.parametrize(("family", "motion"), [("looseness", "force"), ("couple_unbalance", "moment")])
def test_a_fault_is_found_where_it_acts_whatever_it_is(family, motion, tmp_path):
    """No effect of the library is used. A force at another node explains the records too where modes are alike."""
    case = small(4, family, **SIZE)
    first, *_ = places(case, tmp_path)
    assert (first.where, first.motion) == ({"node": case.effects[0]["node"]}, motion)


def test_of_two_faults_no_place_explains_both(tmp_path):
    case = small(4, "external_damping+cubic_bearing", **SIZE)
    assert len({one["node"] for one in case.effects}) == 2
    assert not places(case, tmp_path)


def test_two_causes_that_look_like_one_force_are_not_named(tmp_path):
    """A library that lacks resonant supports imitates one by two springs at other nodes."""
    case = small(4, "pedestal", **SIZE)
    spectrum, model, settings = read(case, tmp_path, ["external_damping", "support_stiffness"])
    found = investigate(spectrum, model, settings=settings).verdict
    assert len(found.causes) == 2
    assert found.residual_p_value.after > 0.05
    assert found.verdict == "unknown"
    node = case.effects[0]["node"]
    assert [one.where for one in found.one_place] == [{"node": node}]
    assert f"a force at node {node} alone" in found.summary


def test_two_faults_at_their_places_are_named(tmp_path):
    case = small(4, "preload+unbalance", **SIZE)
    spectrum, model, settings = read(case, tmp_path, ["static_preload", "unbalance"])
    found = investigate(spectrum, model, settings=settings).verdict
    assert (found.verdict, found.one_place) == ("cause", ())
    assert {c.where["node"] for c in found.causes} == {one["node"] for one in case.effects}
