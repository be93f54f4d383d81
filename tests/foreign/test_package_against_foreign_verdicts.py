"""The package's verdicts on records of machines that share nothing with it."""

import numpy as np
import pytest
from machines import all_but

from foreign.small_cases import read, small, special
from rotorstudy.blind.machines.contacts import add_clearance, add_one_sided_loss, add_rub, add_stiffening
from rotorstudy.blind.machines.effects import add_added_mass
from rotorstudy.blind.machines.faults import add_crack
from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.search.search import begin
from rotorstudy.inference.prediction import with_model_error

pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")


# these take most of the time of a search; left out where a test is not about them
CRACKS = ["breathing_crack", "transverse_crack"]
OF_SHAPE = ["rub", "looseness", "cubic_stiffness", "pedestal_resonance"]


def verdict_on(case, folder, rig_error=1.0, change=None, hold_out=None, **changed):
    """rig_error : 0 for an exact rig;  changed : settings beside those of a quick search."""
    spectrum, model, settings, findings = read(case, folder, rig_error, change)
    settings = settings.model_copy(update={"candidates_per_round": 3, "most_causes": 1} | changed)
    return investigate(spectrum, model, hold_out=hold_out, settings=settings, findings=findings).verdict


def names(verdict):
    return {(cause.effect, *cause.where.values()) for cause in verdict.causes}


def test_the_clean_case_is_called_nothing(tmp_path):
    assert verdict_on(small(1, "healthy"), tmp_path).verdict == "nothing"


@pytest.mark.parametrize(
    ("seed", "family", "effect", "leave_out", "most_causes"),
    [(1, "unbalance", "unbalance", [], 2), (2, "support_loss", "support_loss", [*CRACKS, *OF_SHAPE], 1)],
)
def test_what_the_library_has_is_named(seed, family, effect, leave_out, most_causes, tmp_path):
    case = small(seed, family, count=4, visible=0.05)
    verdict = verdict_on(case, tmp_path, leave_out=leave_out, most_causes=most_causes)
    assert verdict.verdict == "cause"
    assert names(verdict) == {(effect, case.effects[0]["node"])}


@pytest.mark.usefixtures("usual_form", "few_shapes", "right_conventions")
@pytest.mark.parametrize("kind", ["switching", "gradual"])
def test_a_crack_at_sixty_degrees_is_named_whatever_its_law(tmp_path, kind):
    def add(draw):
        add_crack(draw.machine, 0, 0.8, 0.8, np.deg2rad(60.0), kind)
        return {"element": 1}

    case = special(1, add)
    verdict = verdict_on(case, tmp_path, rig_error=0.0, leave_out=OF_SHAPE)
    assert verdict.verdict == "cause"
    (cause,) = verdict.causes
    assert cause.effect == "transverse_crack"
    found = {name: one.value for name, one in cause.parameters.items()}
    # beside a bearing, where the moment grows in proportion to the distance, place and depth trade off
    place, depth = (cause.parameters[name] for name in ("position_m", "depth_ratio"))
    near = max(3 * place.std, 0.05 * case.rotor.positions[-1])
    assert place.value == pytest.approx(0.8 * case.rotor.elements[0].length, abs=near)
    assert near < 0.5 * case.rotor.positions[-1]
    assert depth.value == pytest.approx(0.4, abs=max(3 * depth.std, 0.06))
    assert found["angle_rad"] == pytest.approx(np.deg2rad(60.0), abs=np.deg2rad(10.0))


def mass_at_a_node(draw):
    radius = draw.rotor.elements[0].outer_diameter / 2
    add_added_mass(draw.machine, 1, 0.05 * draw.rotor.mass, radius, radius)
    return {"node": 2}


def stiff_bearing(draw):
    """It moves far less than the shaft: its cubic force is usual in units of its own motion."""
    add_stiffening(draw.machine, 0, 0.0, usual_cube(draw))
    return {"node": 1}


def bearing_stiff_along_x(draw):
    """It stiffens along x nearly twice as much as along y, by another law than the library's."""
    add_stiffening(draw.machine, 0, 0.0, 2 * usual_cube(draw), 0.55)
    return {"node": 1}


STIFFENED = 0.3  # of its stiffness, at the largest motion


def usual_cube(draw):
    moved = draw.healthy.displacement[:, :, :2]
    return STIFFENED * draw.rotor.bearings[0].stiffness[0, 0] / np.max(np.sum(moved**2, axis=2))


SIDE = np.deg2rad(200.0)


def rub_on_one_side(draw):
    """The gap is a share of the vibration, which is below the static deflection."""
    swing, towards = draw.swing(1), np.array([np.cos(SIDE), np.sin(SIDE)])
    assert swing < 0.2 * draw.rest(1)[0]
    radius = draw.rotor.elements[0].outer_diameter / 2
    add_rub(draw.machine, 1, 0.2 * draw.stiffness, 2 * swing, 0.1, radius, draw.rest(1) - 1.4 * swing * towards)
    return {"node": 2}


@pytest.mark.usefixtures("right_conventions")
@pytest.mark.parametrize(
    ("add", "effect"),
    [
        (mass_at_a_node, "added_mass"),
        (stiff_bearing, "cubic_stiffness"),
        (bearing_stiff_along_x, "cubic_stiffness"),
        (rub_on_one_side, "rub"),
    ],
)
def test_an_effect_added_by_hand_is_named_at_its_node(add, effect, tmp_path):
    case = special(1, add)
    verdict = verdict_on(case, tmp_path, rig_error=0.0, leave_out=CRACKS)
    assert verdict.verdict == "cause"
    assert names(verdict) == {(effect, case.effects[0]["node"])}
    if effect == "rub":
        off = verdict.causes[0].parameters["contact_angle_rad"].value - SIDE
        assert abs(np.angle(np.exp(1j * off))) < np.deg2rad(10)


def test_a_zero_on_the_unloaded_line_is_no_preload(tmp_path):
    case = small(1, "healthy", speeds=5, count=2, chain_fault="unloaded_zero")
    verdict = verdict_on(case, tmp_path, rig_error=0.0, leave_out=[*CRACKS, *OF_SHAPE])
    assert verdict.measuring_chain.remedy == "state 'displacement_zero: unloaded_line'"
    assert not verdict.causes

    def change(given):
        given["measurement"]["displacement_zero"] = "unloaded_line"

    stated = verdict_on(case, tmp_path, 0.0, change, leave_out=[*CRACKS, *OF_SHAPE])
    assert stated.verdict == "nothing"


def soft_foot(draw):
    """A foot that lifts over as much as half its swing, as on a seat of balls."""
    node, stiffness = draw.support()
    swing, along = draw.swing(node), np.array([np.cos(0.7), np.sin(0.7)])
    start = float(draw.rest(node) @ along) + 0.1 * swing
    gradual = {"start": start, "width": 0.15 * swing, "opening": "ball"}
    add_one_sided_loss(draw.machine, node, 0.5 * stiffness, 0.7, 3 * swing, **gradual)
    return {"node": node + 1}


def oval_clearance(draw):
    """A support with a clearance that is wider to two sides."""
    node, stiffness = draw.support()
    swing = draw.swing(node)
    centre = draw.rest(node) - 0.5 * swing * np.array([np.cos(0.7), np.sin(0.7)])
    add_clearance(draw.machine, node, 0.5 * stiffness, 0.8 * swing, 0.05 * swing, centre, (0.1, 0.3), "even")
    return {"node": node + 1}


CONTACTS = {"looseness": soft_foot, "support_clearance": oval_clearance}


@pytest.mark.usefixtures("right_conventions")
@pytest.mark.parametrize("effect", CONTACTS)
def test_a_contact_that_opens_gradually_by_another_law_is_named_alone(effect, tmp_path):
    """Negative control: without the effect no other contact explains the records."""
    case = special(3, CONTACTS[effect], speeds=6)
    others = all_but("cubic_stiffness", "looseness", "rub", "support_clearance", "support_loss")
    found = verdict_on(case, tmp_path, leave_out=others, most_causes=2)
    assert names(found) == {(effect, case.effects[0]["node"])}
    assert verdict_on(case, tmp_path, leave_out=[*others, effect]).verdict == "unknown"


@pytest.mark.usefixtures("right_conventions")
@pytest.mark.parametrize(("share", "further"), [(0.4, set()), (2.0, {("external_damping", 1)})])
def test_a_small_second_cause_at_the_same_bearing_is_an_error_of_form(share, further, tmp_path):
    """A damping by its force over the cubic one; negative control: one that is larger than laws are uncertain."""

    def add(draw):
        damping = share * STIFFENED * draw.rotor.bearings[0].stiffness[0, 0] / draw.frequency
        draw.machine.at_node(0, damping * np.eye(2), "damping")
        return stiff_bearing(draw)

    case, library = special(1, add), ("cubic_stiffness", "external_damping", "unbalance")
    verdict = verdict_on(case, tmp_path, rig_error=0.0, leave_out=all_but(*library), most_causes=2)
    assert verdict.verdict == "cause" and names(verdict) == {("cubic_stiffness", 1)} | further
    told = [finding.text for finding in verdict.findings if finding.name == "model-form error"]
    assert [("external_damping, node 1" in text) for text in told] == [True] * (not further)


FOUR = {"count": 4, "speeds": 5, "steps": 128, "visible": 0.05}


@pytest.mark.usefixtures("right_conventions")
def test_a_fault_is_found_where_it_acts_whatever_it_is(tmp_path):
    """No effect of the library is used. A force at another node explains the records too where modes are alike."""
    case = small(4, "looseness", **FOUR)
    spectrum, model, settings, _ = read(case, tmp_path)
    settings = settings.model_copy(update={"leave_out": all_but()})
    first, *_ = begin(model, with_model_error(spectrum, settings), settings).free_forces
    assert (first.where, first.motion) == ({"node": case.effects[0]["node"]}, "force")


@pytest.mark.usefixtures("right_conventions")
def test_two_faults_at_their_places_are_named(tmp_path):
    case = small(4, "preload+unbalance", **FOUR)
    library = all_but("static_preload", "unbalance")
    found = verdict_on(case, tmp_path, leave_out=library, most_causes=2, candidates_per_round=10)
    assert (found.verdict, found.one_place) == ("cause", ())
    assert {c.where["node"] for c in found.causes} == {one["node"] for one in case.effects}


@pytest.mark.usefixtures("right_conventions")
@pytest.mark.parametrize("has_mass", [True, False])
def test_a_mass_beside_a_bow_is_found(has_mass, tmp_path):
    """A misalignment explains more than either; negative control: a library without the mass names another cause."""
    case = small(2, "added_mass+thermal_bow", speeds=4)
    library = [*["added_mass"] * has_mass, "unbalance", "bow", "parallel_misalignment"]
    found = verdict_on(case, tmp_path, hold_out=[], leave_out=all_but(*library), most_causes=2)
    assert (found.verdict == "cause" and {c.effect for c in found.causes} == {"bow", "added_mass"}) == has_mass
