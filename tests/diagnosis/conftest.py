"""What tests of the diagnosis share."""

from pathlib import Path

import pytest


@pytest.fixture
def unrendered(monkeypatch):
    """Pictures are composed, but saved as empty files: rendering takes seconds, and only some tests look at it."""

    def save_nothing(figure, path, **options):
        Path(path).write_bytes(b"")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", save_nothing)
