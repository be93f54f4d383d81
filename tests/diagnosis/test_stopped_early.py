"""The first answer of a diagnosis, and what is left of one that is stopped by Ctrl-C."""

import signal
from dataclasses import replace

import numpy as np
import pytest
from machines import faulty, spectrum_of
from one_line_errors import run
from test_places_of_forces import FAULTY, MODEL, begun
from test_search import HARMONICS, JEFFCOTT, ONE, SPEEDS, fault

from rotorstudy import build_model
from rotorstudy.commands.line import Terminated, main
from rotorstudy.commands.shared import conclude
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.search import begin
from rotorstudy.diagnosis.verdict.held_out import HeldOutMisfit
from rotorstudy.diagnosis.verdict.hidden import with_hidden
from rotorstudy.diagnosis.verdict.investigate import _best_sought, investigate
from rotorstudy.diagnosis.verdict.result import Hidden
from rotorstudy.diagnosis.verdict.sought import Sought, first_answer

LIMIT = Hidden(effect="rub", where={"node": 1}, label="", parameter="rub_stiffness", size=1e6, unit="N/m", measure="")


def records(model):
    return spectrum_of(model, SPEEDS, HARMONICS, 1e-8, 3)


def test_the_first_answer_says_where_most_of_the_missing_force_acts():
    said = first_answer(begun())
    assert f"a force at node {FAULTY} would leave" in said and FAULTY in MODEL.structure.nodes
    clean = build_model(JEFFCOTT)
    assert "the rig explains the records" in first_answer(begin(clean, records(clean), ONE))


@pytest.mark.parametrize("fits", [0, 1])
def test_a_search_that_is_stopped_keeps_what_it_found_and_says_so(monkeypatch, fits):
    """By Ctrl-C in the first or a later fit; a termination ends it at once."""
    clean = build_model(JEFFCOTT)
    data = records(faulty(clean, fault("support_anisotropy", support_anisotropy_N_per_m=2e4)))
    carried_out, error, done = Search.explain, KeyboardInterrupt, []

    def interrupted(*given, **more):
        done.append(1)
        if len(done) == fits + 1:
            raise error
        return carried_out(*given, **more)

    monkeypatch.setattr(Search, "explain", interrupted)
    verdict = investigate(data, clean, settings=ONE).verdict
    assert verdict.verdict == "unknown" and "stopped before its end" in verdict.summary
    assert [finding.name for finding in verdict.findings] == ["search stopped"]
    assert bool(verdict.causes) == bool(fits)
    done.clear()
    error = Terminated
    with pytest.raises(Terminated):
        investigate(data, clean, settings=ONE)


@pytest.mark.parametrize("stopped", [True, False])
def test_a_second_search_that_is_stopped_is_said(monkeypatch, stopped):
    """Of the two searches, with different speeds held out, the first one is kept, but it is not the last word."""
    work = begun()
    first = Sought(work, None, None, work, None, None, HeldOutMisfit(2.0, 1e-9, 0.0))
    again = first._replace(judged=replace(work, stopped=stopped), surprise=HeldOutMisfit(3.0, 1e-9, 0.0))
    both = iter([first, again])
    monkeypatch.setattr("rotorstudy.diagnosis.verdict.investigate.seek", lambda *given, **more: next(both))
    monkeypatch.setattr("rotorstudy.diagnosis.verdict.investigate.split", lambda *given, **more: (None, None))
    monkeypatch.setattr(Sought, "is_surprised", lambda *given: True)
    assert _best_sought(None, None, MODEL, ONE, {}).judged.stopped == stopped


@pytest.mark.usefixtures("unrendered", "unhidden")
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
@pytest.mark.parametrize("step", ["search.explanations.Search.explain", "verdict.sought.chain_hypothesis"])
def test_a_diagnosis_that_is_interrupted_ends_in_a_verdict_and_a_terminated_one_in_none(
    spectrum, tmp_path, monkeypatch, capsys, step, number, status
):
    data, rig = spectrum
    monkeypatch.setattr(f"rotorstudy.diagnosis.{step}", lambda *given, **more: signal.raise_signal(number))
    run("diagnose", data, "--rig", rig, "--out", tmp_path / "out", "--quiet", status=status)
    is_interrupted = number == signal.SIGINT
    assert ("stopped before its end" in capsys.readouterr().out) == is_interrupted
    assert (tmp_path / "out" / "verdict.json").exists() == is_interrupted


@pytest.mark.parametrize("error", [KeyboardInterrupt, Terminated])
def test_limits_that_are_stopped_leave_the_verdict_and_those_found(monkeypatch, error):
    def interrupted(search):
        yield LIMIT
        raise error

    clean = build_model(JEFFCOTT)
    diagnosis = investigate(records(clean), clean, settings=ONE)
    monkeypatch.setattr("rotorstudy.diagnosis.verdict.hidden.what_could_hide", interrupted)
    if error is Terminated:
        with pytest.raises(Terminated):
            with_hidden(diagnosis)
        return
    verdict = with_hidden(diagnosis).verdict
    assert verdict.verdict == "nothing" and verdict.hidden == (LIMIT,) and "Rub is seen with 95 %" in verdict.summary
    assert [finding.name for finding in verdict.findings] == ["limits stopped"]
    assert conclude(verdict, "folder")[0] == 130


def unsearched(begun):
    """A Search that is over before any cause was fitted."""
    stable = np.zeros(len(begun.spectrum.speed), bool)
    return replace(begun, screened=begun.screen(begun.base, begun.candidates), unstable=stable)


@pytest.mark.usefixtures("unrendered", "unhidden")
def test_a_diagnosis_tells_its_progress_also_to_a_file(spectrum, tmp_path, capsys, command):
    """Unless it is asked to be quiet."""
    data, rig = spectrum
    arguments = ["diagnose", str(data), "--rig", str(rig), "--out", str(tmp_path / "out")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rotorstudy.diagnosis.verdict.sought.search", unsearched)
        capsys.readouterr()
        told = command(*arguments).err
        assert main([*arguments, "--quiet"]) == 0
    assert " s  first answer: " in told and " s  testing whether" in told
    assert "first answer" not in capsys.readouterr().err
