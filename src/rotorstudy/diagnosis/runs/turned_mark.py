"""A phase mark that was moved between two states: every harmonic n is turned by n times the same angle."""

from dataclasses import replace

import numpy as np

from rotorstudy.inference.fit import chi_square_p_value
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.measurement.findings import Finding
from rotorstudy.units import quantity

LEAST_TURN = 5.0  # times the repeatability: a smaller one is scatter of the mark
SCATTER = np.sqrt(3)  # each harmonic, the angle of the mark and the motion differ from run to run


def without_turn(before, after, settings):
    """The later state turned back if it is the earlier one turned, and a list of Finding that says so.

    That is more than a change of the rotor can do: runout and vibration are turned alike, at every speed and probe.

    before, after : Spectrum at the same speeds
    """
    shares = {"model_error": SCATTER * settings.repeatability, "covariance_error": 0.0}
    allowed = settings.model_copy(update=shares)
    covariance = sum(with_model_error(one, allowed).covariance for one in (before, after))
    difference = replace(before, covariance=covariance)

    def misfit(turn):
        return float(np.sum(np.abs(difference.whitened(turned(after, -turn) - before.amplitude)) ** 2))

    turn = _best_turn(before, after, misfit)
    if abs(turn) < LEAST_TURN * max(settings.repeatability, 1e-3):
        return after, []
    unturned, left = (chi_square_p_value(misfit(angle), difference.data_count) for angle in (0.0, turn))
    if unturned >= settings.significance or left < settings.significance:
        return after, []
    text = (
        f"harmonic n of the later state is that of the earlier one turned by n times {quantity(turn, 'rad')}, with the "
        "runout, and nothing else changed: the phase mark or its sensor was moved, its other edge was taken, or all "
        "that is unbalanced was turned on the shaft. The later state is turned back; correct 'mark_angle_deg' for it"
    )
    finding = Finding("warning", "phase mark moved", "both states", text)
    return replace(after, amplitude=turned(after, -turn)), [finding]


def turned(spectrum, turn):
    """Harmonics (speed, harmonic, sensor) of a spectrum, each turned by n times an angle, rad."""
    return spectrum.amplitude * np.exp(1j * turn * spectrum.harmonics)[:, None]


def _best_turn(before, after, misfit):
    """The angle, rad, by which the harmonics +-1 are turned on average, then that of the least misfit."""
    from scipy.optimize import minimize_scalar

    product = (after.amplitude * before.amplitude.conj())[:, np.abs(before.harmonics) == 1]
    signs = before.harmonics[np.abs(before.harmonics) == 1]
    start = float(np.angle(np.sum(np.where(signs[:, None] > 0, product, product.conj()))))
    return float(minimize_scalar(misfit, bounds=(start - 0.1, start + 0.1), method="bounded").x)
