"""What is known before the search for causes, and what a search that was stopped leaves."""

import numpy as np

from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.inference.fit import chi_square_p_value
from rotorstudy.measurement.findings import Finding
from rotorstudy.units import p_value, percent


def first_answer(work: Search) -> str:
    """Whether the rig explains the records within its uncertainty, and where one force would explain most of the rest.

    work : in which nothing was searched yet
    """
    rows = work.spectrum.data_count
    p_residual = chi_square_p_value(work.base.cost, rows)
    if p_residual >= work.settings.significance:
        return f"first answer: the rig explains the records (residual: {p_value(p_residual)})"
    said = f"first answer: the rig leaves {np.sqrt(work.base.cost / rows):.3g} standard deviations (rms) unexplained"
    testable = [one for one in work.free_forces if one.is_testable]
    if not testable:
        return said
    best = testable[0]
    ((place, number),) = best.where.items()
    share = percent(min(best.left / work.base.cost, 1.0) ** 0.5)
    name = {"force": "a force", "moment": "a moment", "bending": "bending moments"}[best.motion]
    return f"{said}; {name} at {place} {number} would leave {share} of it, the least of all places"


def stopped_early(found: Search) -> list[Finding]:
    """A note if the search was stopped before its end."""
    text = (
        f"the search was stopped after {len(found.found) - 1} explanations had been fitted; what is stated is the best "
        "of these, and may be wrong. Diagnose again for a verdict"
    )
    return [Finding("note", "search stopped", "diagnosis", text)] if found.stopped else []
