"""What no rig file states: unbalances elsewhere and a bent shaft, as forces at the nodes.

The readings say how large they are, by the evidence of a grid of standard deviations.
"""

from itertools import product

import numpy as np

from rotorstudy.inference.linear import marginal
from rotorstudy.model.entries import Entry
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import Parameter, Term

UNSTATED = ("unbalance elsewhere", "bent shaft")  # how the names of their amplitudes begin
# standard deviations of what they cause, over the vibration measured; none is more likely than another
SIZES = np.array([1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0])
PAIRS = np.array(list(product(SIZES, SIZES)))  # of unbalances elsewhere, and of a bent shaft
FIRST = np.array([0.1, 0.1])  # of the first fit
MOST_NODES = 16  # at which they are taken to act, beside the discs


def other_forces(structure: Structure) -> tuple[Term, Term]:
    """Unbalances elsewhere and a bent shaft, zero."""
    nodes = structure.nodes[:: len(structure.nodes) // MOST_NODES + 1]
    nodes = sorted({*nodes, *(disc.node for disc in structure.discs if disc.node in structure.nodes)})
    terms = []
    sizes, gains = (structure.mass_share, lambda node: 1.0), (lambda speed: speed**2, None)
    for name, size, gain in zip(UNSTATED, sizes, gains, strict=True):
        entries = {f"{name} at node {n}": Entry(size(n) * structure.unit(n), "one", shift=1, gain=gain) for n in nodes}
        parameters = (Parameter(own, "1", (entry,), 1.0, is_complex=True) for own, entry in entries.items())
        terms.append(Term(name, tuple(parameters), dict.fromkeys(entries, 0j)))
    return tuple(terms)


def by_sizes(found, others, sizes) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The log evidence (pair,) of each pair of sizes, and factors (pair, parameter) of the standard deviations.

    By a Fit or Posterior with some sizes (2,). Then its whitened derivatives (component, parameter) by unit parameters,
    and what these have to explain (component,); others : names of both forces
    """
    prior = found.prior
    scales = np.ones((len(PAIRS), len(prior.names)))
    for part, column in zip(others, (PAIRS / sizes).T, strict=True):
        scales[:, [prior.names.index(name) for name in part]] = column[:, None]
    right = found.residual + found.jacobian @ (found.free - prior.mean)
    seen = found.jacobian @ prior.factor
    return np.array([-0.5 * sum(marginal(seen * scale, right)) for scale in scales]), scales, seen, right
