"""Unbalances of several discs that look alike: what they are together, and that their split is not known.

Below the first critical speed of bending the unbalances of two discs move the probes nearly alike. Any split of the sum
between them then fits, and the simplest explanation, one disc alone, is no better founded than another. All discs are
therefore given an unbalance of their own. Of their joint covariance C (complex), the eigenvector of the least
eigenvalue gives the combination sum of w_d u_d that the records determine best, the modal or static resultant.
"""

from itertools import product

import numpy as np

from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation
from rotorstudy.diagnosis.verdict.result import ParameterEstimate, Place, Resultant
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prior import Prior
from rotorstudy.model.rig_items import make_term

WORSE = 2.0  # standard deviations of a disc over that of the resultant, from which on the split counts as not known
NEGLIGIBLE = 0.1  # of the resultant: a split known as well as that is known


def resultant_of(found: Search, best: Explanation) -> Resultant | None:
    """What the unbalances of all discs are together; None where their split is known, or the causes are others."""
    structure = found.rig.structure
    nodes = sorted({disc.node for disc in structure.discs})
    if len(nodes) < 2 or not best.causes or any(cause.effect != "unbalance" for cause in best.causes):
        return None
    vector, covariance = _of_all_discs(found, best, nodes)
    if vector is None:
        return None
    weights = _best_determined(covariance)
    sums = np.kron(weights, np.eye(2))
    together, spread = sums @ vector, sums @ covariance @ sums.T
    each = np.sqrt(np.diag(covariance).reshape(-1, 2).mean(axis=1))
    if each.max() < WORSE * np.sqrt(np.trace(spread) / 2) or each.max() < NEGLIGIBLE * np.hypot(*together):
        return None
    _, (size, angle), spread = magnitude_and_phase(["sum_real", "sum_imag"], together, spread)
    std = np.sqrt(np.diag(spread))
    return Resultant(
        discs=[Place.of("unbalance", {"node": n}, structure) for n in nodes],
        weights=tuple(weights.tolist()),
        size=ParameterEstimate(value=float(size), std=float(std[0]), unit="kg m", part="magnitude"),
        angle=ParameterEstimate(value=float(angle), std=float(std[1]), unit="rad", part="phase"),
        std_of_each=tuple(each.tolist()),
    )


def with_effects(model, prior, kinds, nodes, width):
    """A Model and its Prior with effects of some kinds at every node, of a width in typical sizes, and their terms."""
    places = [{"kind": kind, "node": node, "label": f"free at {node}"} for kind, node in product(kinds, nodes)]
    terms = [make_term("effect", place, model.structure, model.sensors) for place in places]
    known = {unknown.name: (0.0, width * unknown.typical) for term in terms for unknown in term.unknowns}
    return model.plus(*terms), prior.plus(Prior.independent(known)), terms


def _of_all_discs(found, best, nodes):
    """Unbalance (disc * part,) of every disc fitted together, kg m, and its covariance; None if they do not explain."""
    model, prior, terms = with_effects(found.model, found.prior, ["unbalance"], nodes, found.settings.prior_width)
    values, names = found.base.values, [unknown.name for term in terms for unknown in term.unknowns]
    try:
        fitted = fit(model, found.spectrum, prior, np.array([values.get(name, 0.0) for name in model.names]))
    except NoSteadyState:
        return None, None
    if fitted.cost > best.fit.cost + len(names):  # at other places than the discs
        return None, None
    values, covariance = fitted.of(names)
    unit = np.repeat([term.parameters[0].also["unbalance"][1] for term in terms], 2)  # m of 1 kg m
    return values / unit, covariance / np.outer(unit, unit)


def _best_determined(covariance):
    """Real weights (disc,), the largest one 1, of the combination of complex unbalances that is known best."""
    parts = covariance.reshape(len(covariance) // 2, 2, -1, 2)
    hermitian = parts[:, 0, :, 0] + parts[:, 1, :, 1] + 1j * (parts[:, 1, :, 0] - parts[:, 0, :, 1])
    vector = np.linalg.eigh(hermitian)[1][:, 0]
    return np.real(vector.conj() / vector[np.argmax(np.abs(vector))].conj())
