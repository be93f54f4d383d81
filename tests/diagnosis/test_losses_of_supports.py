"""A support cannot lose more stiffness than it has."""

import numpy as np
import pytest
from machines import disc, shaft, spectrum_of, unbalance

from rotorstudy.diagnosis.search.candidates import candidate
from rotorstudy.diagnosis.search.odds import Explanation
from rotorstudy.diagnosis.search.supports import loses_more_than_all
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prior import Prior
from rotorstudy.model.rig import build_model

SPEEDS, HARMONICS = np.array([60.0, 100.0, 140.0]), np.array([0, 1, -1])
BEARING = {"kind": "linear", "coefficients": "anisotropic", "bearing_damping_xx_N_s_per_m": 300.0}
BEARING |= {"bearing_stiffness_xx_N_per_m": 1e6, "bearing_stiffness_yy_N_per_m": 1.6e6}
BEARING |= {"bearing_damping_yy_N_s_per_m": 300.0}
RIG = {  # three bearings, so that the rotor does not fall where one of them gives way
    "rotor": shaft(0.8, 4, disc(2, 2.0, 4e-3, 2.1e-3), youngs_modulus_Pa=2.1e11, density_kg_per_m3=7800.0),
    "bearings": [{**BEARING, "node": node, "label": str(node)} for node in (1, 3, 5)],
    "effects": [unbalance(2, 2e-5, 0.4)],
    "sensors": [2, 4],
}
MODEL = build_model(RIG)


def explained(lost, node, along):
    """A loss along a direction, fitted to records of the same loss with little noise."""
    cause = candidate(MODEL, "support_loss", {"node": node}, {"direction_rad": along})
    (name,), extended = cause.names, MODEL.plus(cause.term)
    theta = np.append(MODEL.theta, lost)
    assert extended.names[-1] == name
    spectrum = spectrum_of(extended, SPEEDS, HARMONICS, 1e-9, theta=theta)
    prior = Prior.independent({name: cause.prior[name]})
    return Explanation((cause,), fit(extended, spectrum, prior, start=theta), 0.0)


@pytest.mark.parametrize(("along", "all_of_it"), [(0.0, 1e6), (np.pi / 2, 1.6e6)])
@pytest.mark.parametrize(("share", "expected"), [(0.9, False), (1.1, True)])
def test_a_bearing_loses_at_most_its_stiffness_along_a_direction(along, all_of_it, share, expected):
    found = explained(share * all_of_it, 3, along)
    assert found.fit.theta[-1] == pytest.approx(share * all_of_it, rel=1e-2)
    assert loses_more_than_all(found, MODEL.structure, SPEEDS) == expected


def test_where_there_is_no_bearing_there_is_nothing_to_lose():
    assert loses_more_than_all(explained(3e4, 2, 0.3), MODEL.structure, SPEEDS)
