"""The chapters of the thesis as the workflow has them, and the folder of the printed values."""

from functools import cache
from pathlib import Path

from rotorstudy.studies.config import load_study
from thesis.config import load_replay

WORKFLOW = Path(__file__).parents[2] / "workflow"
REFERENCE = WORKFLOW / "reference"


@cache
def study(number):
    return load_study(WORKFLOW / "config" / f"chapter_{number}.yaml")


@cache
def replay(number):
    return load_replay(WORKFLOW / "config" / f"chapter_{number}.yaml")
