"""Two causes at once, each found beside forces of any law at every node, which stand for the other one.

Fitted alone to records of two faults, a cause and the values of the rig bend to explain what is not theirs: a modulus
moves by a hundred standard deviations rather than leave a fault unexplained. Beside unknown forces neither has to. The
forces are complex, free at every harmonic, and as smooth over the speeds as the error of a form; their size at each
harmonic is the most probable one (D. J. C. MacKay, Neural Comput. 4 (1992) 415-447).
"""

from dataclasses import replace

import numpy as np

from rotorstudy.diagnosis.search.contained import is_allowed
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.form import SHARES, over_speeds
from rotorstudy.diagnosis.search.free_forces import free_force_columns
from rotorstudy.diagnosis.search.moves import Judge, Proposal
from rotorstudy.diagnosis.search.odds import faults_of
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.fit import Fit, fit
from rotorstudy.inference.prediction import carried_order
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.response.neighbourhood import Neighbourhood

MOST_NODES = 12  # at which the forces act, evenly along the shaft
UPDATES = 20  # of their size at each harmonic
FIRST = 5  # causes beside which a second one is sought, the most probable ones
STEPS = 6  # of the fit of the first one
NEGLIGIBLE = 1e-6  # of the largest variance of the data by the forces


def pairs(work: Search) -> list[Proposal]:
    """Proposals of two causes, the most probable ones first; none without a steady state."""
    try:
        stated = fit(work.model, work.spectrum, work.prior, steps=0)
        beside = replace(work, spectrum=with_unknown_forces(stated, work))
        fitted = fit(work.model, beside.spectrum, work.prior, start=stated.theta)
    except NoSteadyState:
        return []
    found, first = [], {}
    for one in sorted(_additions(beside, (), fitted, 0.0), key=lambda one: -one.log_odds):
        first.setdefault(frozenset(c.cause for c in one.causes), one)
    for one in list(first.values())[:FIRST]:
        held = beside.held(one.causes, fitted.values | one.values, STEPS)
        if held is not None:
            found += _additions(beside, one.causes, held, one.log_odds)
    best = {}
    for one in sorted(found, key=lambda one: -one.log_odds):
        best.setdefault(frozenset((c.cause, *c.variant.values()) for c in one.causes), one)
    return [one._replace(log_odds=np.inf) for one in best.values()][: work.settings.candidates_per_round]


def _additions(beside, causes, fitted, base):
    """Proposals of one cause more beside the unknown forces, judged at a fit."""
    chosen = [c for c in beside.candidates if is_allowed(beside, (*causes, c))]
    chosen = [c for c in chosen if len(faults_of((*causes, c))) > len(faults_of(causes))]
    projected, usable = beside.project(fitted, chosen)
    judge = Judge(beside, causes, fitted.values, base - beside.prior_odds.log_odds(causes) if causes else base)
    return judge.alone(projected, usable) + judge.together(projected, usable) + judge.scanned(fitted, usable)


def with_unknown_forces(fitted: Fit, work: Search) -> Spectrum:
    """The Spectrum with what forces at the nodes may show, as an error that its components have in common."""
    spectrum, nodes = work.spectrum, work.rig.structure.nodes
    nodes = nodes[:: len(nodes) // MOST_NODES + 1]
    order = carried_order(spectrum, fitted.model)
    near = Neighbourhood(fitted.model, spectrum.speed, spectrum.harmonics, fitted.theta, order=order)
    columns = free_force_columns(near, spectrum, [work.rig.structure.unit(n) for n in nodes])
    columns = columns.reshape(*columns.shape[:3], 2, -1)  # row, speed, component, part, harmonic
    modes = over_speeds(spectrum.speed, SHARES[-1])
    gram = np.einsum("rscph,rtdph,ms,mt->hsctd", columns, columns, modes, modes, optimize=True)
    gram = gram.reshape(len(spectrum.harmonics), spectrum.data_count, -1)
    known = fitted.jacobian @ fitted.prior.factor
    known = np.eye(spectrum.data_count) + known @ known.T
    data = fitted.residual
    variance = np.full(len(gram), data @ data / np.trace(gram.sum(axis=0)))
    for _ in range(UPDATES):
        inverse = np.linalg.inv(known + np.tensordot(variance, gram, 1))
        pull = inverse @ data
        power, count = np.einsum("c,hcd,d->h", pull, gram, pull), np.einsum("cd,hcd->h", inverse, gram)
        variance = variance * power / np.maximum(count, np.finfo(float).tiny)
    size, along = np.linalg.eigh(np.tensordot(variance, gram, 1))
    kept = size > NEGLIGIBLE * size[-1]
    return spectrum.with_shared_error(along[:, kept] * np.sqrt(size[kept]))
