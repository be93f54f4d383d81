"""Whether records show that a contact opens or closes.

A contact that stays open or closed is a constant force and a stiffness, and one that hardly opens is nearly that. So
its force is compared with a constant force and a stiffness at the same place, both in any direction: where these
explain the records as well, it is not a contact that they show.
"""

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation
from rotorstudy.inference.prediction import carried_order
from rotorstudy.model.registry import registry
from rotorstudy.model.terms import NonlinearForce, Parameter, Term
from rotorstudy.response.measured import measured_response_and_jacobian

AFFINE = (np.ones_like, np.array, np.conj)  # of the displacement: a constant force, and stiffnesses


def is_unseen(work: Search, explanation: Explanation) -> bool:
    """Whether the opening and closing of a contact explains no more of the records than chance lets its shape."""
    from scipy.special import chdtrc

    effects, significance = registry().plugins["effect"], work.settings.significance
    contacts = [cause for cause in explanation.causes if effects[cause.effect].switches and cause.shape]
    return any(chdtrc(len(c.shape), gain_over_affine(work, explanation, c)) >= significance for c in contacts)


def gain_over_affine(work: Search, explanation: Explanation, contact: Candidate) -> float:
    """By how much the cost would rise with a constant force and a stiffness instead of a contact, to first order."""
    fitted, spectrum = explanation.fit, work.spectrum
    affine = _affine(contact)
    model = work.model.plus(*(cause.term for cause in explanation.causes), affine)
    theta = np.array([fitted.values.get(name, 0.0) for name in model.names])
    order = carried_order(spectrum, model)
    change = measured_response_and_jacobian(model, spectrum.speed, spectrum.harmonics, theta, order=order).jacobian
    instead = model.position([unknown.name for unknown in affine.unknowns])
    own = change[..., model.position(contact.names)] @ np.array([fitted.values[name] for name in contact.names])
    others = [i for i, name in enumerate(fitted.names) if name not in contact.names]
    affine_columns = spectrum.whitened(np.moveaxis(change[..., instead], -1, 0)).T
    known = np.hstack([fitted.prior.whitener[np.ix_(others, others)], np.zeros((len(others), len(instead)))])
    columns = np.vstack([np.hstack([fitted.jacobian[:, others], affine_columns]), known])
    target = np.concatenate([spectrum.whitened(own), np.zeros(len(others))])
    scale = np.linalg.norm(columns, axis=0)
    columns = columns / np.where(scale > 0, scale, 1.0)
    left = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    return float(left @ left)


def _affine(contact):
    """Term with the amplitudes of a constant force and of the stiffnesses of the coordinate that a contact acts on."""
    matrix, parameters = contact.term.parameters[0].force.matrix, []
    for number, (of, factor) in enumerate((of, factor) for of in AFFINE for factor in (1, 1j)):
        at = NonlinearForce(matrix, lambda displacement, *_, of=of, factor=factor: factor * of(displacement))
        parameters.append(Parameter(f"affine {number}", "1", (), 1.0, force=at))
    return Term("affine", tuple(parameters), label="affine")
