"""What is known before the search for causes, and what a search that was stopped leaves."""

import numpy as np

from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.verdict.one_place import linearised_places, most_forces
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
    places = linearised_places(work, work.spectrum) if most_forces(work.spectrum) >= 1 else []
    if not places:
        return said
    (place, number, kind), left = places[0]
    share = percent(min(left / work.base.cost, 1.0) ** 0.5)
    return f"{said}; a {kind} at {place} {number} would leave {share} of it, the least of all nodes"


def stopped_early(found: Search) -> list[Finding]:
    """A note if the search was stopped before its end."""
    text = (
        f"the search was stopped after {len(found.found) - 1} explanations had been fitted; what is stated is the best "
        "of these, and may be wrong. Diagnose again for a verdict"
    )
    return [Finding("note", "search stopped", "diagnosis", text)] if found.stopped else []
