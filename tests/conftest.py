"""The order of the tests, and what those of all folders share."""

import gc
from pathlib import Path

import pytest
from one_line_errors import run

# files that take longest start first, so that the workers end together
LONGEST = (
    "diagnosis/test_one_cause.py", "workflow/test_workflow.py", "foreign/test_package_against_foreign_verdicts.py",
    "foreign/test_package_against_foreign_films.py", "diagnosis/", "foreign/", "blind/", "docs/", "measured/",
    "physics/", "errors/", "zoo/",
)  # fmt: skip


def pytest_collection_modifyitems(items):
    def rank(item):
        return next((i for i, name in enumerate(LONGEST) if f"tests/{name}" in item.nodeid), len(LONGEST))

    items.sort(key=rank)


def pytest_collection_finish():
    """What is loaded stays to the end: the garbage collector, which takes a tenth of the time, need not look at it."""
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)


@pytest.fixture
def command(capsys):
    """Run a command of rotorstudy, that has to end with a status: what it prints, `out` and `err`."""

    def said(*arguments, status=0):
        run(*arguments, status=status)
        return capsys.readouterr()

    return said


@pytest.fixture
def unrendered(monkeypatch):
    """Pictures are composed, but neither laid out nor drawn: that takes seconds, and only some tests look at them."""

    def save_nothing(figure, place, **options):
        if isinstance(place, Path):  # else a stream in memory, for a picture inside a page
            place.write_bytes(b"")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", save_nothing)
    monkeypatch.setattr("rotorstudy.presentation.plots._lay_out", lambda picture, dpi: None)
    monkeypatch.setattr("rotorstudy.presentation.plots._save_png", save_nothing)


@pytest.fixture
def unhidden(monkeypatch):
    """Sizes of faults that could hide are left out of a command's verdict: they take longer than many a search.

    They are the claims of diagnosis/test_hidden.py; those of a whole command are in test_report.py.
    """
    monkeypatch.setattr("rotorstudy.presentation.diagnosis_files.with_hidden", lambda diagnosis: diagnosis)


@pytest.fixture
def undrawn(monkeypatch):
    """A fit that the data reject does not begin again from draws of the prior, which take as long as all else.

    They are the claims of test_runs.py (parameters that run away) and physics/test_foundation.py.
    """
    monkeypatch.setattr("rotorstudy.inference.fit.DRAWS", 0)


@pytest.fixture
def begun_once(undrawn, monkeypatch):
    """Nor as data gain weight step by step, which may end nearer to the truth: a claim of the same tests."""
    for least in ("DOUBTFUL", "IMPLAUSIBLE"):
        monkeypatch.setattr(f"rotorstudy.inference.fit.{least}", 0)


@pytest.fixture
def usual_form(monkeypatch):
    """A crack is named or identified in the form of the fit: its intervals over all forms take longer than the search.

    They are the claims of diagnosis/test_one_cause.py.
    """
    monkeypatch.setattr("rotorstudy.diagnosis.verdict.investigate.over_its_forms", lambda *_: (None, []))
    monkeypatch.setattr("rotorstudy.diagnosis.one_cause.answer.over_forms", lambda *_: None)


@pytest.fixture
def right_conventions(monkeypatch):
    """Conventions of the records are taken as stated: whether others explain them better takes a seventh of a search.

    They are the claims of diagnosis/test_measuring_chain.py, and tried by every whole command.
    """
    monkeypatch.setattr("rotorstudy.diagnosis.verdict.sought.chain_hypothesis", lambda found, measured: None)


@pytest.fixture
def few_speeds(monkeypatch):
    """Curves over the speed of a rotor's analysis from a fifth of the speeds, for what is no claim about them."""
    monkeypatch.setattr("rotorstudy.studies.rotor_analysis.SPEEDS", 30)
    monkeypatch.setattr("rotorstudy.studies.growth.PERIODIC_SPEEDS", 8)
    monkeypatch.setattr("rotorstudy.response.stability.SEARCHED", 80)


@pytest.fixture
def few_shapes(monkeypatch):
    """A scan along the shaft tries half of its shapes, which makes it harder to find a crack."""
    monkeypatch.setattr("rotorstudy.diagnosis.search.shape_scan.MORE_ALONG_SHAFT", 1)
