"""A phase mark that was moved between two states beside a change of what is most often at the discs, the unbalance.

Runout and vibration are turned alike by n times the angle, and the rotor moves differently as well. Neither alone
explains the records: a change of the rotor turns no runout, and a moved mark changes no amplitude.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rotorstudy.diagnosis.runs.turned_mark import LEAST_TURN, turned
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.inference.fit import Fit, fit
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.findings import Finding
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.rig_items import make_term
from rotorstudy.units import quantity

ANGLES = 120  # of a full turn, tried linearised
REFINED = 3  # of them are refined, by steps
NEAR = 3.0  # times the cost of noise: a linearised cost above it is not that of a turn
STEPS, REACH, SETTLED = 3, 0.1, 1e-4  # of a refinement, how far each goes, and when it ends, rad
DECISIVE = 40.0  # decrease of the cost: odds of e^20


def without_turn_beside_a_change(
    after: Spectrum, prepared: Callable, settings: Settings
) -> tuple[Spectrum, list[Finding]]:
    """The later state turned back if a moved phase mark and a change at the discs explain it together.

    after    : Spectrum of the later state
    prepared : function of such a Spectrum -> Spectrum of the difference, Model of it, Settings
    settings : of the comparison
    returns  : the state, and a list of Finding that says so. Unchanged where a change at the discs alone explains the
               records, or both together do not
    """
    straight = _fitted(after, prepared)
    if straight is None or not straight.is_rejected(settings.significance):
        return after, []
    costs = _linearised(straight, after, prepared)
    angles = 2 * np.pi * np.arange(ANGLES) / ANGLES - np.pi
    values = costs(angles)
    least = [i for i in np.argsort(values) if values[i] <= min(values[i - 1], values[(i + 1) % ANGLES])]
    tried = [one for i in least[:REFINED] if (one := _refined(angles[i], after, prepared))]
    if not tried:
        return after, []
    angle, explained = min(tried, key=lambda one: one[1].cost)
    if (
        abs(angle) < LEAST_TURN * max(settings.repeatability, 1e-3)
        or explained.is_rejected(settings.significance)
        or straight.cost - explained.cost < DECISIVE
    ):
        return after, []
    text = (
        f"harmonic n of the later state is turned by n times {quantity(angle, 'rad')}, with the runout, beside a "
        "change of the rotor: the phase mark or its sensor was moved, or its other edge was taken. The later state is "
        "turned back, and what else changed follows from that; correct 'mark_angle_deg' for it"
    )
    back = replace(after, amplitude=turned(after, -angle))
    return back, [Finding("warning", "phase mark moved", "both states", text)]


def _fitted(after, prepared) -> Fit | None:
    """The Fit of the difference by a change at the discs; None of a rotor without such a change."""
    difference, model, settings = prepared(after)
    whole, prior = base_model(model, settings)
    terms = [
        make_term("effect", {"kind": kind, "node": node, "label": f"changed {node}"}, model.structure, model.sensors)
        for kind in settings.at_discs
        for node in sorted({disc.node for disc in model.structure.discs} or model.structure.nodes[:1])
    ]
    if not terms:
        return None
    wide = {u.name: (0.0, settings.prior_width * u.typical) for term in terms for u in term.unknowns}
    return fit(whole.plus(*terms), with_model_error(difference, settings), prior.plus(Prior.independent(wide)))


def _linearised(found, after, prepared):
    """Function of angles (angle,), rad -> (angle,) costs with the model linearised about a fit."""
    difference, _, settings = prepared(after)
    known = np.vstack([found.jacobian, found.prior.whitener])
    basis, _ = np.linalg.qr(known / np.linalg.norm(known, axis=0))
    still = np.concatenate([found.residual, found.prior.whitener @ (found.prior.mean - found.free)])
    noise = with_model_error(difference, settings)

    def costs(angles):
        change = np.array([turned(after, -angle) for angle in angles]) - after.amplitude
        moved = noise.whitened(change)
        right = still + np.pad(moved, [(0, 0), (0, len(still) - moved.shape[-1])])
        left = right - (right @ basis) @ basis.T
        return np.sum(left**2, axis=-1)

    return costs


def _refined(angle, after, prepared):
    """The angle, rad, of least cost near another one, and the Fit with the state turned back; None far from noise."""
    from scipy.optimize import minimize_scalar

    for _ in range(STEPS):
        back = replace(after, amplitude=turned(after, -angle))
        costs = _linearised(_fitted(back, prepared), back, prepared)
        found = minimize_scalar(lambda a, at=costs: at(np.array([a]))[0], bounds=(-REACH, REACH), method="bounded")
        if found.fun > NEAR * back.data_count:
            return None
        angle += float(found.x)
        if abs(found.x) < SETTLED:
            break
    angle = float(np.angle(np.exp(1j * angle)))
    return angle, _fitted(replace(after, amplitude=turned(after, -angle)), prepared)
