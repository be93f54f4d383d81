"""Whether an explanation cannot be true, however well it fits."""

import numpy as np

from rotorstudy.diagnosis.search.contact_evidence import is_unseen
from rotorstudy.diagnosis.search.odds import total
from rotorstudy.diagnosis.search.supports import loses_more_than_all
from rotorstudy.inference.prediction import carried_order
from rotorstudy.measurement.findings import Finding
from rotorstudy.model.registry import registry
from rotorstudy.response.alternating import affine_error
from rotorstudy.response.neighbourhood import carried_motion
from rotorstudy.response.stability import growth_of_free_motion
from rotorstudy.units import RAD_PER_S

GROWTH = 1e-5  # of the speed: growth rate of a free motion beyond round-off; in a minute it becomes visible
AFFINE = 1e-3  # of the force of a contact (rms): it opens or closes if more than that is not affine in the motion


def is_impossible(work, explanation):
    """Whether an explanation cannot be true.

    A free motion that grows at a measured speed leaves no steady records; where the rig is unstable without causes too,
    that is no fault of the explanation. A contact that never opens or closes in the records is a constant force and a
    stiffness. A support cannot lose more stiffness than it has, and a damping or a stiffness that is built in cannot be
    negative.

    work : Search, which says where the rig is unstable;  explanation : Explanation
    """
    return (
        is_negative(explanation, work.settings.significance)
        or loses_more_than_all(explanation, work.rig.structure, work.spectrum.speed)
        or _never_switches(work, explanation)
        or is_unseen(work, explanation)
        or bool((grows(explanation.fit, work.spectrum.speed) & ~work.unstable).any())  # the last, as it takes longest
    )


def is_negative(explanation, significance):
    """Whether an amplitude that cannot be negative is fitted below zero by more than its standard deviation allows.

    If its true value is zero, it is so with the probability of `significance`, as rare as a clean record that is
    called faulty. What the rig has of the same counts with it.
    """
    from scipy.special import ndtri

    totals = [total(cause, name, explanation.fit) for cause in explanation.causes for name in cause.positive]
    return any(mean < ndtri(significance) * std for mean, std in totals)


def _never_switches(work, explanation):
    """Whether the force of a contact is an affine function of the displacement throughout the records."""
    effects, fitted, spectrum = registry().plugins["effect"], explanation.fit, work.spectrum
    forces = [p.force for c in explanation.causes if effects[c.effect].switches for p in c.term.parameters]
    if not forces:
        return False
    order = carried_order(spectrum)
    motion = carried_motion(fitted.model, spectrum.speed, spectrum.harmonics, fitted.theta, order=order)
    carried = np.union1d(np.arange(-order, order + 1), spectrum.harmonics)
    return any(affine_error(f, motion.amplitude, spectrum.speed, carried, motion.deflection) < AFFINE for f in forces)


def grows(fitted, speed):
    """Whether a free motion of a fit grows at each speed (speed,), rad/s.

    About a nonlinear steady state that takes too long to find, and is not tested.
    """
    if fitted.model.nonlinear_forces:
        return np.zeros(len(speed), bool)
    return growth_of_free_motion(fitted.model, speed, fitted.theta) > GROWTH * speed


def unstable_rig(unstable, fitted, speed):
    """A list with a warning if the rig is unstable at some measured speeds with the best explanation too, else empty.

    unstable : (speed,) bool, of the rig without causes;  fitted : Fit of the best explanation;  speed : (speed,) rad/s
    """
    if unstable.any():
        unstable = unstable & grows(fitted, speed)
    if not unstable.any():
        return []
    at = speed[unstable] / RAD_PER_S["rpm"]
    text = (
        f"the rig, with its values fitted to the records, is unstable at {len(at)} of {len(speed)} measured speeds "
        f"({at.min():.5g} to {at.max():.5g} rpm), where steady records were taken. Correct its bearings or its damping "
        "in the rig file ('rotorstudy check' prints the threshold), or leave the records of these speeds out"
    )
    return [Finding("warning", "unstable rig", "rig", text)]
