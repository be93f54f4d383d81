"""Blind cases through the real diagnosis: what must hold of a few fixed ones, and of any one at all."""

import json
import secrets

import numpy as np
from one_line_errors import refused

from rotorstudy import registry
from rotorstudy.blind.run import check_seal, diagnosed, run_blind
from rotorstudy.diagnosis.verdict.result import Cause

from .conftest import only

FIXED_SEED, CLEAN, LARGE = 4, 2, 2
KINDS = {"verdict": str, "residual_share": float, "candidates": int, "gain": (dict, type(None))}
KINDS |= dict.fromkeys(("residual_p_value", "identifiability", "settings"), dict)
KINDS |= dict.fromkeys(("causes", "ambiguous_with", "separating_measurement", "unexplained"), list)
KINDS |= dict.fromkeys(("detection_limit", "base_parameters"), list)
ALWAYS = ("case", "kind", "group", "machine", "size", "families", "verdict", "answer", "known", "in_set", "seconds")


def quick(config, **changes):
    """The configuration on rotors that are diagnosed in a second or two."""
    few = {"machines": {"any": 0.5, "jeffcott": 0.5}, "elements": [2, 2], "records": 0}
    return config.model_copy(update=few | changes)


def run(config, out, cases, seed, **changed):
    """Rows, verdicts, truths with salt, and seals; the diagnosis must find every truth sealed before it starts."""

    def answer(spectrum, model, settings, findings):
        assert len(json.loads((out / "seals.json").read_text())["sha256"]) == cases
        assert not (out / "truths.json").exists()
        return diagnosed(spectrum, model, settings.model_copy(update=changed), findings)

    _, _, rows = run_blind(config, out, cases=cases, seed=seed, answer=answer)
    verdicts, truths, seals = (json.loads((out / f"{n}.json").read_text()) for n in ("verdicts", "truths", "seals"))
    return rows, verdicts, truths, seals["sha256"]


def check_always(rows, verdicts, truths, seals, where):
    """What holds of every case: a complete verdict, the truth that was sealed, a complete row of the result."""
    for row, verdict, opened, sealed in zip(rows.to_dict("records"), verdicts, truths, seals, strict=True):
        check_seal(opened["truth"], opened["salt"], sealed, where)
        if verdict["verdict"] == "refused":
            assert "swapped" in verdict["error"] and opened["truth"]["fault"], where
            continue
        assert verdict["verdict"] in ("nothing", "cause", "ambiguous", "unknown"), (where, verdict)
        assert {key: isinstance(verdict[key], kind) for key, kind in KINDS.items()} == dict.fromkeys(KINDS, True), where
        for cause in [*verdict["causes"], *verdict["ambiguous_with"]]:
            assert set(cause) == set(Cause.model_fields), where
            assert cause["effect"] in registry().plugins["effect"], where
            assert 0 <= cause["probability"] <= cause["posterior_probability"] <= 1 + 1e-9, where
            assert all(np.isfinite(value["value"]) for value in cause["parameters"].values()), where
        assert (verdict["verdict"] == "nothing") <= (not verdict["causes"]), where
        assert (verdict["verdict"] in ("cause", "ambiguous")) <= bool(verdict["causes"]), where
        assert all(0 <= share <= 1 for share in verdict["residual_p_value"].values()), where
        assert verdict["gain"] is None or verdict["gain"]["before_m"] > 0 < verdict["gain"]["after_m"], where
        refused(lambda: check_seal({**opened["truth"], "kind": "another"}, opened["salt"], sealed, where), "altered")
        assert all(row[key] == row[key] and row[key] is not None for key in ALWAYS), (where, row)
        assert row["families"] == "+".join(one["family"] for one in opened["truth"]["true"]), where
        assert np.isnan(row["probability"]) == (not row["causes"]), where


def test_clean_records_are_not_accused(config, tmp_path):
    found = run(quick(config, shares=only("clean")), tmp_path, CLEAN, FIXED_SEED)
    check_always(*found, f"seed {FIXED_SEED}")
    rows = found[0]
    assert (rows.group == "clean").all()
    assert ((rows.verdict == "nothing") | ~(rows.probability > 0.91)).all(), rows[["machine", "answer", "probability"]]


def test_most_large_effects_are_found_or_not_ruled_out(config, tmp_path):
    """Of most, not of all, as even a good diagnosis errs now and then; large is what the base cannot take over."""
    large = quick(config, shares=only("single"), size=[8.0, 100.0])
    # one effect each, few fits of each round: pairs and unlikely candidates would take most of the time
    found = run(large, tmp_path, LARGE, FIXED_SEED, most_causes=1, candidates_per_round=2)
    check_always(*found, f"seed {FIXED_SEED}")
    rows = found[0]
    assert (rows["size"].isna() | (rows["size"] >= 8)).all()
    assert rows.in_set.mean() > 0.5, rows[["families", "verdict", "answer", "size"]]
    assert (rows.verdict != "nothing").mean() > 0.5


def test_one_case_of_any_seed(config, tmp_path):
    """Only what holds whatever is hidden: whether it is found is a matter of shares, see the criteria."""
    seed = secrets.randbelow(2**31)
    quickest = quick(config, machines={"jeffcott": 1.0}, shares=only("form"))
    where = f"random seed {seed}: pytest cannot choose it again; put it into test_one_case_of_any_seed"
    try:
        check_always(*run(quickest, tmp_path, 1, seed, most_causes=1, candidates_per_round=2), where)
    except AssertionError:
        raise
    except Exception as error:
        raise AssertionError(f"{where}: {type(error).__name__}: {error}") from error
