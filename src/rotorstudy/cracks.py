"""A crack as a term: the opening function of a plugin acting on the stiffness the rotor says a crack takes away.

The shaft loses dK sigma(wt) in the direction xi that turns with it, so the force on z is
sigma dK (z + conj(z) e^{2jwt}) / 2. Under weight dominance z is the static deflection (thesis Eqs. 2.16 to 2.20).
"""

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.terms import Entry, Parameter

SERIES_ORDER = 15  # of a sudden opening: doubling it changes the response to the first harmonics by 0.3 % at most


def participation_factors(crack, harmonics, order=None):
    """p_n = (s_n + s_{n-2}) / 2, the share of harmonic n in the weight-dominant crack force (thesis Eq. 2.20)."""
    order = max(abs(int(n)) for n in harmonics) + 2 if order is None else order
    series = crack.series(order)
    return np.array([(series.get(int(n), 0) + series.get(int(n) - 2, 0)) / 2 for n in harmonics])


def weight_deflection(structure):
    """(dof,) static deflection that a weight-dominant crack acts on, or an error if the rotor alone has none."""
    if structure.static_load.any() and not structure.is_supported:
        raise RotorstudyError(
            "weight dominance needs the static deflection, which this shaft has not without its bearings; "
            "say 'weight_dominance: false' (the crack then acts on all of the motion), or support the shaft rigidly"
        )
    return structure.static_deflection


def crack_parameters(crack, structure, weight_dominance=True, order=SERIES_ORDER, node=None, element=None):
    """The table of a crack plugin on a rotor; one parameter for each stiffness the crack can take away."""
    parameters = []
    deflection = weight_deflection(structure) if weight_dominance else None
    for name, (pattern, unit, typical) in structure.stiffness_loss_at(node, element).items():
        entries = []
        for k, s in crack.series(order).items():
            if weight_dominance:
                static = pattern @ deflection * s / 2
                entries += [Entry(static, on="one", shift=k), Entry(static, on="one", shift=k + 2)]
            else:
                entries += [Entry(pattern * s / 2, shift=k), Entry(pattern * s / 2, on="conj", shift=k + 2)]
        parameters.append(Parameter(name, unit, tuple(entries), typical))
    return parameters
