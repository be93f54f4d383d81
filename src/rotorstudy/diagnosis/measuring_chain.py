"""Errors of the stated measuring conventions as hypotheses: units, signs, directions, phases, order and zero.

A hypothesis changes the data, not the model. Its likelihood is that of the changed data times the determinant of the
change, so that a hypothesis that only shrinks the data and their errors gains nothing.
"""

from dataclasses import dataclass, replace

import numpy as np

from rotorstudy.inference.fit import Fit, fit
from rotorstudy.inference.linear import invert
from rotorstudy.inference.prediction import carried_order, with_model_error
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.response.measured import measured_response_and_jacobian
from rotorstudy.response.statics import static_deflection

PRIOR_ODDS = 0.02  # that some convention is stated wrongly, divided among the hypotheses
LEAST_LOG_ODDS = 5.0  # beyond the stated conventions and beyond the best causes under them
FITTED = 3  # hypotheses that are fitted, the best linearised ones

FACTORS = {  # true over read
    25.4: "the file is in mil and read as um; state 'unit: mil'",
    1 / 25.4: "the file is in um and read as mil; state 'unit: um'",
    1e3: "the file is in mm and read as um, or in m and read as mm; state the unit of the file",
    1e-3: "the file is in um and read as mm, or in mm and read as m; state the unit of the file",
    25.4e-3: "the file is in mil and read as mm; state 'unit: mil'",
    1 / 25.4e-3: "the file is in mm and read as mil; state 'unit: mm'",
    2.0: "a sensitivity stated twice too large; correct 'sensitivity_V_per_m:' or the values",
    0.5: "peak-to-peak values read as amplitudes, or a sensitivity stated half too large; correct the values or "
    "'sensitivity_V_per_m:'",
    np.sqrt(2): "rms values read as amplitudes; convert them",
    np.sqrt(0.5): "amplitudes divided by the root of two twice; convert them",
}
ANGLES_DEG = (90, 180, -90, 45, -45)


@dataclass(frozen=True)
class Hypothesis:
    """A convention that may be stated wrongly, and the change of the data that corrects it.

    The corrected harmonics are direct R_n + mirrored conj(R_-n) + conjugate conj(R_n) + shift, of the nodes in `order`.

    name, remedy : what the records look like, and what to state
    direct, mirrored, conjugate : (harmonic, sensor) complex
    shift : (speed, harmonic, sensor) complex, m
    order : (sensor,) position of the sensor that each node's data are read from
    """

    name: str
    remedy: str
    direct: np.ndarray
    mirrored: np.ndarray
    conjugate: np.ndarray
    shift: np.ndarray
    order: np.ndarray

    def corrected(self, spectrum: Spectrum) -> tuple[Spectrum, float]:
        """The corrected Spectrum, and the logarithm of the determinant of the change."""
        amplitude, covariance = spectrum.amplitude[..., self.order], spectrum.covariance[:, self.order]
        matrix = self._matrix(spectrum.harmonics)
        parts = np.concatenate([amplitude.real, amplitude.imag], axis=1)  # (speed, component, sensor)
        moved = np.einsum("sij,wjs->wis", matrix, parts)
        real, imag = np.split(moved, 2, axis=1)
        covariance = matrix @ covariance @ np.swapaxes(matrix, -1, -2)
        log_volume = len(spectrum.speed) * np.linalg.slogdet(matrix)[1].sum()
        changed = replace(spectrum, amplitude=real + 1j * imag + self.shift, covariance=covariance)
        return changed, float(log_volume)

    def _matrix(self, harmonics):
        """(sensor, component, component) of the change of real and imaginary parts."""
        identity = np.eye(len(harmonics))
        mirror = (harmonics[:, None] == -harmonics).astype(float)

        def rows(factor, chosen):
            return np.swapaxes(factor, 0, 1)[..., None] * chosen

        plain = rows(self.direct, identity)
        turned = rows(self.mirrored, mirror) + rows(self.conjugate, identity)
        upper = np.concatenate([(plain + turned).real, (turned - plain).imag], axis=-1)
        lower = np.concatenate([(plain + turned).imag, (plain - turned).real], axis=-1)
        return np.concatenate([upper, lower], axis=-2)


@dataclass(frozen=True)
class Tested:
    """A hypothesis fitted: its Spectrum with the model error, Fit, and log odds against the stated conventions."""

    hypothesis: Hypothesis
    spectrum: Spectrum
    fit: Fit
    log_odds: float


def hypotheses(model, spectrum, deflection) -> list[Hypothesis]:
    """Every hypothesis that a spectrum allows.

    Parameters
    ----------
    model : Model
    spectrum : Spectrum
    deflection : array (speed, sensor)
        Static deflection, m.

    Returns
    -------
    list of Hypothesis
    """
    n, sensors = spectrum.harmonics, spectrum.sensors
    shape, every = (len(n), len(sensors)), np.arange(len(sensors))
    none, whole = np.zeros(shape, complex), np.ones(shape, complex)
    still = np.zeros((len(spectrum.speed), *shape), complex)
    symmetric = set(n.tolist()) == set((-n).tolist())
    found = []

    def suppose(name, remedy, direct=whole, mirrored=none, conjugate=none, shift=still, order=every):
        found.append(Hypothesis(name, remedy, direct, mirrored, conjugate, shift, order))

    def only(column, value):
        return np.where(every == column, value, 1.0) * whole

    for factor, remedy in FACTORS.items():
        suppose(f"all readings are {1 / factor:.4g} times the true ones", remedy, factor * whole)
        for s, node in enumerate(sensors if len(sensors) > 1 else ()):
            text = f"the readings at node {node} are {1 / factor:.4g} times the true ones"
            suppose(text, remedy, only(s, factor))
        for s, node in enumerate(sensors if symmetric else ()):
            for sign, axis in ((1, "x"), (-1, "y")):
                text = f"the readings along {axis} at node {node} are {1 / factor:.4g} times the true ones"
                suppose(text, remedy, only(s, (1 + factor) / 2), (every == s) * sign * (factor - 1) / 2 * whole)
    turn = np.outer(n, np.ones(len(sensors)))
    for angle in ANGLES_DEG:
        by = np.deg2rad(angle)
        suppose(
            f"the probes are turned by {angle} degrees against the rig file",
            "correct 'angle_deg:' or the sign of the probes",
            np.exp(1j * by) * whole,
        )
        suppose(
            f"the phase mark is {angle} degrees from where the rig file says",
            "correct 'keyphasor: sensor_angle_deg, mark_angle_deg, edge'",
            np.exp(-1j * turn * by),
        )
        suppose(
            f"gravity points {angle} degrees from where the rig file says",
            "correct 'gravity_angle_deg:'",
            np.exp(1j * (turn - 1) * by),
        )
    moving = (n != 0)[:, None] * whole
    suppose(
        "phases are lags where leads are meant",
        "state 'table_phase: lag'",
        whole - moving,
        conjugate=moving,
    )
    if symmetric:
        suppose("the shaft turns in the other sense", "correct 'rotation:'", none, whole)
        suppose("x and y are swapped at all nodes", "exchange the channels of the probes", none, 1j * whole)
    if len(sensors) > 1:
        suppose("the nodes are in the reverse order", "correct the 'node:' of the probes", order=every[::-1])
    if 0 in n and deflection.any():
        for sign, zero in ((-1, "unloaded_line"), (1, "at_rest")):
            shift = still.copy()
            shift[:, list(n).index(0)] = sign * deflection
            said = "unloaded line" if sign < 0 else "position of the shaft at rest"
            suppose(f"displacements count from the {said}", f"state 'displacement_zero: {zero}'", shift=shift)
    return found


def best_hypothesis(model, spectrum, base, settings):
    """The Tested hypothesis with the highest odds against the stated conventions, or None.

    Parameters
    ----------
    model : Model
        With the nuisance terms.
    spectrum : Spectrum
        Without the model error.
    base : Fit
        Under the stated conventions, without causes.
    settings : Settings
    """
    theta = np.concatenate([term.theta for term in model.terms])
    theta[model.position(base.names)] = base.prior.mean
    rotor = theta[: len(model.rotor_unknowns)]
    deflection = static_deflection(model, spectrum.speed, rotor).value[..., model.measured]
    deflection = np.broadcast_to(deflection, (len(spectrum.speed), len(spectrum.sensors)))
    every = hypotheses(model, spectrum, deflection)
    shown, change = measured_response_and_jacobian(
        model, spectrum.speed, spectrum.harmonics, theta, order=carried_order(spectrum)
    )
    change = np.moveaxis(change[..., model.position(base.names)], -1, 0)
    stated = _volume(with_model_error(spectrum, settings))
    screened = []
    for hypothesis in every:
        corrected, log_volume = _corrected(hypothesis, spectrum, settings)
        log_volume += _volume(corrected) - stated
        screened.append((_linear_evidence(corrected, shown, change, base.prior) + log_volume, hypothesis))
    screened.sort(key=lambda one: -one[0])
    return max(
        (_tested(one, model, spectrum, base, settings, len(every)) for _, one in screened[:FITTED]),
        key=lambda one: one.log_odds,
        default=None,
    )


def _corrected(hypothesis, spectrum, settings):
    corrected, log_volume = hypothesis.corrected(spectrum)
    return with_model_error(corrected, settings), log_volume


def _volume(spectrum):
    """Logarithm of the determinant of the whitener."""
    return float(np.linalg.slogdet(spectrum.whitener)[1].sum())


def _linear_evidence(spectrum, shown, change, prior):
    """Log evidence of a spectrum less a constant, of the model linearised at the prior mean."""
    off, columns = spectrum.whitened(spectrum.amplitude - shown), spectrum.whitened(change).T @ prior.factor
    normal = np.eye(columns.shape[1]) + columns.T @ columns
    along = columns.T @ off
    return float(-0.5 * (off @ off - along @ invert(normal) @ along + np.linalg.slogdet(normal)[1]))


def _tested(hypothesis, model, spectrum, base, settings, count):
    corrected, log_volume = _corrected(hypothesis, spectrum, settings)
    log_volume += _volume(corrected) - _volume(with_model_error(spectrum, settings))
    found = fit(model, corrected, base.prior)
    odds = found.evidence - base.evidence + log_volume + np.log(PRIOR_ODDS / count)
    return Tested(hypothesis, corrected, found, float(odds))
