"""Whether an explanation cannot be true, however well it fits."""

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.odds import Explanation, total
from rotorstudy.inference.prediction import shown_and_slopes
from rotorstudy.model.registry import registry
from rotorstudy.model.structure import at_supports
from rotorstudy.model.terms import NonlinearForce, Parameter, Term
from rotorstudy.response.stability import growth_of_free_motion

GROWTH = 1e-5  # of the speed: growth rate of a free motion beyond round-off; in a minute it becomes visible
UNCERTAIN = 2.0  # standard deviations of the loss of stiffness of a support, by which it may exceed the stiffness
OF_DISPLACEMENT = (np.ones_like, np.array, np.conj)  # a constant force, and stiffnesses


def is_impossible(work, explanation):
    """Whether an explanation cannot be true.

    A free motion that grows at a measured speed leaves no steady records; where the rig is unstable without causes too,
    that is no fault of the explanation. A contact that never opens or closes in the records is a constant force and a
    stiffness. A support cannot lose more stiffness than it has, and a damping or a stiffness that is built in cannot be
    negative. A cause of which a fit holds every amplitude at zero is none.

    work : Search, which says where the rig is unstable;  explanation : Explanation
    """
    return (
        _is_idle(explanation)
        or is_negative(explanation, work.settings.significance)
        or loses_more_than_all(explanation, work.rig.structure, work.spectrum.speed)
        or is_unseen(work, explanation)
        or bool((grows(explanation.fit, work.spectrum.speed) & ~work.unstable).any())  # the last, as it takes longest
    )


def _is_idle(explanation):
    """Whether a cause has no amplitude but zero."""
    return any(not any(explanation.fit.values[name] for name in cause.names) for cause in explanation.causes)


def is_negative(explanation, significance):
    """Whether an amplitude that cannot be negative is fitted below zero by more than its standard deviation allows.

    If its true value is zero, it is so with the probability of `significance`, as rare as a clean record that is
    called faulty. What the rig has of the same counts with it.
    """
    from scipy.special import ndtri

    totals = [total(cause, name, explanation.fit) for cause in explanation.causes for name in cause.positive]
    return any(mean < ndtri(significance) * std for mean, std in totals)


def loses_more_than_all(explanation, structure, speed):
    """Whether the losses of stiffness at a node exceed that of its bearings, in any direction and at any speed.

    The losses are those of causes at supports that cannot be negative and act as a static stiffness. A rotor without
    bearings has its own supports; how much of its stiffness is theirs is not known, and the answer is False.

    explanation : Explanation;  structure : Structure of the rig;  speed : (speed,) rad/s
    """
    if not structure.bearing_nodes:
        return False
    lost = {}
    for cause in explanation.causes:
        effect = registry().plugins["effect"][cause.effect]
        for p in cause.term.parameters:
            if p.unit == "N/m" and p.entries and effect.places is at_supports and p.positive:
                lost.setdefault(cause.where["node"], []).append(cause.term.full_name(p))
    fitted = explanation.fit
    return any(
        _least_stiffness(fitted, structure.index(node), names, speed) < -UNCERTAIN * _std(fitted, names)
        for node, names in lost.items()
    )


def _least_stiffness(fitted, i, lost, speed):
    """Lowest principal stiffness, over the speeds, of the bearings at a coordinate less the losses, N/m."""
    on_z, on_conj = np.zeros((2, len(speed)), complex)
    model, theta = fitted.model.at(fitted.theta)
    for p, unknown in model.acting:
        if not unknown.carries and unknown.name not in lost:
            continue
        for entry in (e for e in unknown.entries if e.reads_motion and e.order == 0 and e.shift == 0):
            found = on_conj if entry.is_conjugate else on_z
            found += -theta[p] * entry.gain_at(speed, 0) * entry.matrix[i, i]
    return float((on_z.real - np.abs(on_conj)).min())


def _std(fitted, names):
    """Standard deviation of the sum of some amplitudes."""
    chosen = np.isin(fitted.names, names)
    return np.sqrt(chosen @ fitted.covariance @ chosen)


def is_unseen(work: Search, explanation: Explanation) -> bool:
    """Whether the opening and closing of a contact explains no more of the records than chance lets its shape.

    One that stays open or closed is a constant force and a stiffness, and one that hardly opens is nearly that.
    """
    from scipy.special import chdtrc

    effects, significance = registry().plugins["effect"], work.settings.significance
    contacts = [cause for cause in explanation.causes if effects[cause.effect].switches and cause.shape]
    return any(chdtrc(len(c.shape), gain_over_affine(work, explanation, c)) >= significance for c in contacts)


def gain_over_affine(work: Search, explanation: Explanation, contact: Candidate) -> float:
    """By how much the cost would rise with a constant force and a stiffness instead of a contact, to first order."""
    fitted, spectrum, affine = explanation.fit, work.spectrum, _affine(contact)
    model, instead = fitted.model.plus(affine), [unknown.name for unknown in affine.unknowns]
    theta = model.filled(fitted.model.names, fitted.theta)
    _, slopes = shown_and_slopes(model, spectrum, theta, [*contact.names, *instead])
    by_contact = np.tensordot([fitted.values[name] for name in contact.names], slopes[: -len(instead)], 1)
    by_affine = spectrum.whitened(slopes[-len(instead) :]).T
    others = [i for i, name in enumerate(fitted.names) if name not in contact.names]
    known = np.hstack([fitted.prior.whitener[np.ix_(others, others)], np.zeros((len(others), len(instead)))])
    columns = np.vstack([np.hstack([fitted.jacobian[:, others], by_affine]), known])
    target = np.concatenate([spectrum.whitened(by_contact), np.zeros(len(others))])
    scale = np.linalg.norm(columns, axis=0)
    columns = columns / np.where(scale > 0, scale, 1.0)
    left = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    return float(left @ left)


def _affine(contact):
    """Term with a constant force and stiffnesses, all zero, of the coordinate that a contact acts on."""
    matrix, parameters = contact.term.parameters[0].force.matrix, []
    for number, (of, factor) in enumerate((of, factor) for of in OF_DISPLACEMENT for factor in (1, 1j)):
        at = NonlinearForce(matrix, lambda displacement, *_, of=of, factor=factor: factor * of(displacement))
        parameters.append(Parameter(f"affine {number}", "1", (), 1.0, force=at))
    return Term("affine", tuple(parameters), {p.name: 0.0 for p in parameters}, label="affine")


def grows(fitted, speed):
    """Whether a free motion of a fit grows at each speed (speed,), rad/s.

    About a nonlinear steady state that takes too long to find, and is not tested.
    """
    if fitted.model.nonlinear_forces:
        return np.zeros(len(speed), bool)
    return growth_of_free_motion(fitted.model, speed, fitted.theta) > GROWTH * speed
