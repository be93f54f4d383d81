"""A crack as a term: the opening function of a plugin acting on the stiffness the rotor says a crack takes away.

The shaft loses dK sigma(wt) in the direction xi that turns with it, so the force on z is
sigma dK (z + conj(z) e^{2jwt}) / 2. Under weight dominance z is the static deflection (thesis Eqs. 2.16 to 2.20).
"""

import numpy as np

from rotorstudy.terms import Entry, Parameter

SERIES_ORDER = 15  # of a sudden opening: doubling it changes the response to the first harmonics by 0.3 % at most


def participation_factors(crack, harmonics, order=None):
    """p_n = (s_n + s_{n-2}) / 2, the share of harmonic n in the weight-dominant crack force (thesis Eq. 2.20)."""
    order = max(abs(int(n)) for n in harmonics) + 2 if order is None else order
    series = crack.series(order)
    return np.array([(series.get(int(n), 0) + series.get(int(n) - 2, 0)) / 2 for n in harmonics])


def crack_parameters(crack, structure, weight_dominance=True, order=SERIES_ORDER, node=None, element=None):
    """The table of a crack plugin on a rotor; one parameter for each stiffness the crack can take away."""
    parameters, on = [], ("static", "static conj") if weight_dominance else ("z", "conj")
    for name, (pattern, unit, typical) in structure.stiffness_loss_at(node, element).items():
        entries = []
        for k, s in crack.series(order).items():
            entries += [Entry(pattern * s / 2, on=on[0], shift=k), Entry(pattern * s / 2, on=on[1], shift=k + 2)]
        parameters.append(Parameter(name, unit, tuple(entries), typical))
    return parameters
