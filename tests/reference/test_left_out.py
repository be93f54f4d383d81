"""What is said of the thesis's estimates follows from what they are, not from how they are called."""

from types import SimpleNamespace

from thesis.replays_page import changed_estimates, impossible_values, in_short


def compared(name, thesis, base, extended, kind=""):
    fits = {"base": base[0], "base ±": base[1], "extended": extended[0], "extended ±": extended[1]}
    return {"rig": "chapter 3", "parameter": name, "kind": kind, "unit": "N s/m", "thesis": thesis, **fits}


DAMPING = compared("damping", 824.0, (-9.0, 2.0), (-1.0, 2.0), "positive")
FORCES = [
    compared("dk p_1", 50.0, (50.0, 1.0), (1.0, 3.0), "force"),
    compared("dk p_2", -50.0, (0.0, 1.0), (-49.0, 3.0), "force"),
]
PHASE = compared("eccentricity phase", 3.0, (0.0, 0.1), (-3.0, 0.1), "phase")


def test_only_what_cannot_be_negative_is_called_impossible():
    (said,) = impossible_values([DAMPING, *FORCES, PHASE])
    assert "the base model needs damping -9 ± 2 N s/m" in said


def test_changed_estimates_count_forces_and_name_the_others():
    (said,) = changed_estimates([DAMPING, *FORCES, PHASE])
    assert "change: damping from 824 to -1 ± 2 N s/m;" in said
    assert "1 of 2 crack forces" in said and "1 are zero" in said
    same = compared("damping", -2.0, (0.0, 1.0), (-1.0, 2.0))
    assert "none of damping and unbalance; 0 of 0" in changed_estimates([same])[0]


def test_a_cause_is_established_if_it_is_named_whichever_speed_is_left_out():
    verdicts = {"chapter_5": SimpleNamespace(verdict="cause", causes=["a cause"])}
    harmonics = [{"rig": "chapter 5", "harmonic": "-1X", "base (σ)": 9.0, "base, residual (µm)": 40.0}]

    def said(*causes):
        return in_short(verdicts, harmonics, {"chapter_5": [{"causes": list(named)} for named in causes]})

    assert said(["bow", "rub"], ["bow"]).endswith("chapter 5: cause.")
    assert said(["bow"], ["rub"]).endswith("chapter 5: cause, not established.")
