"""Where one force explains the records of machines that share nothing with the package, and what follows from it."""

import pytest
from machines import all_but

from foreign.small_cases import read, small
from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.search.search import begin
from rotorstudy.inference.prediction import with_model_error

pytestmark = [pytest.mark.filterwarnings("ignore::RuntimeWarning"), pytest.mark.usefixtures("right_conventions")]

SIZE = {"count": 4, "speeds": 5, "steps": 128, "visible": 0.05}


def places(case, folder):
    spectrum, model, settings, _ = read(case, folder)
    settings = settings.model_copy(update={"leave_out": all_but()})
    return begin(model, with_model_error(spectrum, settings), settings).free_forces


def verdict_on(case, folder, library, hold_out=None, **quick):
    """The verdict by some effects alone."""
    spectrum, model, settings, _ = read(case, folder)
    settings = settings.model_copy(update={"leave_out": all_but(*library), **quick})
    return investigate(spectrum, model, hold_out=hold_out, settings=settings).verdict


def test_a_fault_is_found_where_it_acts_whatever_it_is(tmp_path):
    """No effect of the library is used. A force at another node explains the records too where modes are alike."""
    case = small(4, "looseness", **SIZE)
    first, *_ = places(case, tmp_path)
    assert (first.where, first.motion) == ({"node": case.effects[0]["node"]}, "force")


def test_two_faults_at_their_places_are_named(tmp_path):
    case = small(4, "preload+unbalance", **SIZE)
    found = verdict_on(case, tmp_path, ["static_preload", "unbalance"])
    assert (found.verdict, found.one_place) == ("cause", ())
    assert {c.where["node"] for c in found.causes} == {one["node"] for one in case.effects}


@pytest.mark.parametrize("has_mass", [True, False])
def test_a_mass_beside_a_bow_is_found(has_mass, tmp_path):
    """A misalignment explains more than either; negative control: a library without the mass names another cause."""
    case = small(2, "added_mass+thermal_bow", speeds=4)
    library = [*["added_mass"] * has_mass, "unbalance", "bow", "parallel_misalignment"]
    found = verdict_on(case, tmp_path, library, hold_out=[], candidates_per_round=3)
    assert (found.verdict == "cause" and {c.effect for c in found.causes} == {"bow", "added_mass"}) == has_mass
