"""A phase mark that was moved between two states: every harmonic n is turned by n times the same angle.

Runout and vibration are turned alike, which no change of the rotor does. Beside a change of what is most often at the
discs, the unbalance, neither alone explains the records: a moved mark changes no amplitude.
"""

from dataclasses import replace

import numpy as np

from rotorstudy.diagnosis.search.screening import Projection
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.diagnosis.verdict.findings import told
from rotorstudy.diagnosis.verdict.resultant import with_effects
from rotorstudy.inference.fit import Fit, chi_square_p_value, fit
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.measurement.findings import Finding
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.units import quantity

LEAST_TURN = 5.0  # times the repeatability: a smaller one is scatter of the mark
SCATTER = np.sqrt(3)  # each harmonic, the angle of the mark and the motion differ from run to run
ANGLES = 120  # of a full turn, tried linearised
REFINED = 3  # of them are refined, by steps
NEAR = 3.0  # times the cost of noise: a linearised cost above it is not that of a turn
STEPS, REACH, SETTLED = 3, 0.1, 1e-4  # of a refinement, how far each goes, and when it ends, rad
DECISIVE = 40.0  # decrease of the cost: odds of e^20


def without_turn(before: Spectrum, after: Spectrum, settings: Settings) -> tuple[Spectrum, list[Finding]]:
    """The later state turned back if it is the earlier one turned, at every speed and probe, and a Finding of that."""
    allowed = settings.model_copy(update={"model_error": SCATTER * settings.repeatability, "covariance_error": 0.0})
    covariance = sum(with_model_error(one, allowed).covariance for one in (before, after))
    difference = replace(before, covariance=covariance)

    def misfit(turn):
        return float(np.sum(np.abs(difference.whitened(_turned_back(after, turn).amplitude - before.amplitude)) ** 2))

    turn = _best_turn(before, after, misfit)
    unturned, left = (chi_square_p_value(misfit(angle), difference.data_count) for angle in (0.0, turn))
    if _is_scatter(turn, settings) or unturned >= settings.significance or left < settings.significance:
        return after, []
    return _turned_back(after, turn), [told("phase mark moved", "both states", angle=quantity(turn, "rad"))]


def without_turn_beside_a_change(after, prepared, settings):
    """A later state turned back if a moved phase mark and a change at the discs explain it, and neither does alone."""
    straight = _fitted(after, prepared)
    if straight is None or not straight.is_rejected(settings.significance):
        return after, []
    costs = _linearised(straight, after, prepared)
    angles = 2 * np.pi * np.arange(ANGLES) / ANGLES - np.pi
    values = costs(angles)
    least = [i for i in np.argsort(values) if values[i] <= min(values[i - 1], values[(i + 1) % ANGLES])]
    tried = [one for i in least[:REFINED] if (one := _refined(angles[i], straight, after, prepared, settings))]
    angle, explained = min(tried, key=lambda one: one[1].cost, default=(0.0, straight))
    if explained.is_rejected(settings.significance) or straight.cost - explained.cost < DECISIVE:
        return after, []
    finding = told("phase mark moved (and the rotor)", "both states", angle=quantity(angle, "rad"))
    return _turned_back(after, angle), [finding]


def _is_scatter(turn, settings):
    return abs(turn) < LEAST_TURN * max(settings.repeatability, 1e-3)


def _turned_back(spectrum, turn):
    """A spectrum with each harmonic turned back by n times an angle, rad."""
    return spectrum.with_amplitude(spectrum.amplitude * np.exp(-1j * turn * spectrum.harmonics)[:, None])


def _best_turn(before, after, misfit):
    """The angle, rad, by which the harmonics +-1 are turned on average, then that of the least misfit."""
    from scipy.optimize import minimize_scalar

    product = (after.amplitude * before.amplitude.conj())[:, np.abs(before.harmonics) == 1]
    signs = before.harmonics[np.abs(before.harmonics) == 1]
    start = float(np.angle(np.sum(np.where(signs[:, None] > 0, product, product.conj()))))
    return float(minimize_scalar(misfit, bounds=(start - 0.1, start + 0.1), method="bounded").x)


def _fitted(after, prepared, start=None, needed=np.inf) -> Fit | None:
    """The Fit of the difference by a change at the discs, from another Fit; None of a rotor without such a change."""
    difference, model, settings = prepared(after)
    whole, prior = base_model(model, settings)
    nodes = sorted({disc.node for disc in model.structure.discs} or model.structure.nodes[:1])
    changed, wide, terms = with_effects(whole, prior, settings.at_discs, nodes, settings.prior_width)
    noise = with_model_error(difference, settings)
    return fit(changed, noise, wide, start and start.theta, needed=needed) if terms else None


def _linearised(found, after, prepared):
    """Function of angles (angle,), rad -> (angle,) costs with the model linearised about a fit."""
    difference, _, settings = prepared(after)
    noise = with_model_error(difference, settings)
    known = Projection(found, noise)

    def costs(angles):
        change = np.array([_turned_back(after, angle).amplitude for angle in angles]) - after.amplitude
        return np.sum((known.residual[:, None] + known.left(noise.whitened(change).T)) ** 2, axis=0)

    return costs


def _refined(angle, straight, after, prepared, settings):
    """The angle, rad, of least cost near another one, and the Fit with it; None far from noise, or near no turn."""
    from scipy.optimize import minimize_scalar

    found = straight if abs(angle) < SETTLED else None
    for _ in range(STEPS):
        back = _turned_back(after, angle)
        found = found or _fitted(back, prepared, needed=NEAR * back.data_count)
        costs = _linearised(found, back, prepared)
        step = minimize_scalar(lambda a, at=costs: at(np.array([a]))[0], bounds=(-REACH, REACH), method="bounded")
        angle = float(np.angle(np.exp(1j * (angle + step.x))))
        if step.fun > NEAR * back.data_count or _is_scatter(angle, settings):
            return None
        found = _fitted(_turned_back(after, angle), prepared, found)
        if abs(step.x) < SETTLED:
            break
    return angle, found
