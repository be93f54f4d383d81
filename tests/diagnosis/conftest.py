"""What tests of the diagnosis share."""

from pathlib import Path

import pytest


@pytest.fixture
def unrendered(monkeypatch):
    """Pictures are composed, but saved as empty files: rendering takes seconds, and only some tests look at it."""

    def save_nothing(figure, place, **options):
        if isinstance(place, Path):  # else a stream in memory, for a picture inside a page
            place.write_bytes(b"")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", save_nothing)
