"""The verdict of a comparison in sentences: those of a diagnosis, said of what changed."""

from rotorstudy.diagnosis.verdict.result import Verdict

# openings of the sentences of a diagnosis, and what they are of a difference between two states
OPENINGS = {
    "Nothing is missing: noise and the stated model error explain the residual": (
        "Nothing changed beyond the noise and the repeatability of the records"
    ),
    "Something is missing": "Something changed",
    "Smallest sizes detected": "Smallest changes detected",
    " of what is missing;": " of what changed;",
}


def summary_of_change(verdict: Verdict) -> str:
    """The summary of the verdict on a difference between two states."""
    text = verdict.summary
    for missing, changed in OPENINGS.items():
        text = text.replace(missing, changed)
    return text
