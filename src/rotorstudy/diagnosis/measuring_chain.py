"""Errors of the stated measuring conventions as hypotheses: units, signs, directions, phases, order and zero.

A hypothesis changes the data, not the model. Its likelihood is that of the changed data times the determinant of the
change, so that a hypothesis that only shrinks the data and their errors gains nothing.
"""

from dataclasses import dataclass, replace

import numpy as np

from rotorstudy.inference.fit import Fit, fit
from rotorstudy.inference.linear import invert
from rotorstudy.inference.prediction import carried_order, with_model_error
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.conventions import Conventions
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.terms import Entry, Parameter, Term, apply_entries
from rotorstudy.response.measured import measured_response_and_jacobian
from rotorstudy.response.statics import static_deflection

PRIOR_ODDS = 0.02  # that some convention is stated wrongly, divided among the hypotheses
LEAST_LOG_ODDS = 5.0  # beyond the stated conventions and beyond the best causes under them
SMALLEST = 1e-6  # of the static deflection: an error without any other reason
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
    is_uncertain : whether the shift has the errors of the static deflection; else it is exact
    """

    name: str
    remedy: str
    direct: np.ndarray
    mirrored: np.ndarray
    conjugate: np.ndarray
    shift: np.ndarray
    order: np.ndarray
    is_uncertain: bool = False

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
    """A hypothesis fitted.

    fit        : to the corrected spectrum with the model error
    log_factor : logarithm of what its likelihood is multiplied by: its prior odds, and the determinant of the change
    """

    hypothesis: Hypothesis
    fit: Fit
    log_factor: float


@dataclass(frozen=True)
class Sag:
    """Static deflection as the probes show it.

    value  : (speed, sensor) m, by the stated values
    change : (speed, sensor, error) complex, m, by one standard deviation of independent errors: those of the probes,
             which act on the deflection too, and of the numbers of the rotor and its bearings
    """

    value: np.ndarray
    change: np.ndarray

    def spread(self, harmonics) -> np.ndarray:
        """(speed, sensor, component, component) covariance of the harmonics by the errors, m^2; zero but at 0X."""
        count = len(harmonics)
        parts = np.zeros((*self.change.shape[:2], 2 * count, self.change.shape[-1]))
        for mean in np.flatnonzero(np.equal(harmonics, 0)):
            parts[..., mean, :], parts[..., mean + count, :] = self.change.real, self.change.imag
        return parts @ np.swapaxes(parts, -1, -2)

    def constant(self) -> tuple[Term, Prior]:
        """The errors as a constant reading at each sensor, the same at all speeds, and its Prior."""
        mean = self.change.mean(axis=0)
        parameters = tuple(
            Parameter(f"static_deflection_error_{s}", "m", (Entry(unit, on="one", shift=0),), 1.0, is_complex=True)
            for s, unit in enumerate(np.eye(len(mean)))
        )
        term = Term("measuring chain", parameters, {p.name: 0.0 for p in parameters}, acts_on="output")
        parts = np.stack([mean.real, mean.imag], axis=1).reshape(2 * len(mean), -1)
        covariance = parts @ parts.T
        floor = (SMALLEST * np.abs(self.value).max()) ** 2 * np.eye(len(covariance))
        names = tuple(unknown.name for unknown in term.unknowns)
        return term, Prior(names, np.zeros(len(names)), covariance + floor)


def shown_sag(model, prior, spectrum) -> Sag:
    """The Sag of a model at the speeds of a spectrum.

    Parameters
    ----------
    model : Model
        With the nuisance terms.
    prior : Prior
        Of its free parameters.
    spectrum : Spectrum
    """
    theta = np.concatenate([term.theta for term in model.terms])
    theta[model.position(prior.names)] = prior.mean
    found = static_deflection(model, spectrum.speed, theta[: len(model.rotor_unknowns)], jacobian=True)
    grid = (len(spectrum.speed), len(spectrum.sensors))
    value = np.broadcast_to(found.value[..., model.measured], grid)
    slopes = np.zeros((*grid, len(theta)), complex)
    for position, change in found.changes.items():
        slopes[..., position] = np.broadcast_to(change[..., model.measured], grid)
    for position, unknown in enumerate(model.output_unknowns, start=len(model.rotor_unknowns)):
        reading = tuple(entry for entry in unknown.entries if entry.reads_motion)
        if reading:
            slopes[..., position] = apply_entries(reading, value[:, None], spectrum.speed, [0])[:, 0]
    return Sag(value, slopes[..., model.position(prior.names)] @ prior.factor)


def probes_of(conventions: Conventions | None, node: int) -> list[tuple[str, complex, complex]]:
    """Each probe of a node: its name, its direction, and the motion z that one unit of its reading alone gives.

    conventions : of the records; None for probes along x and y
    """
    stated = [one for one in conventions.probes if one.node in (None, node)] if conventions else []
    names = [f"of channel '{one.channel}'" for one in stated] or ["along x", "along y"]
    angles = conventions.direction_rad([one.angle_deg for one in stated]) if stated else np.array([0, np.pi / 2])
    along = np.exp(1j * np.asarray(angles))
    x, y = np.linalg.pinv(np.column_stack([along.real, along.imag]))
    return list(zip(names, along, x + 1j * y, strict=True))


def hypotheses(spectrum, sag, conventions=None) -> list[Hypothesis]:
    """Every hypothesis that a spectrum allows.

    Parameters
    ----------
    spectrum : Spectrum
    sag : Sag
    conventions : Conventions, optional
        Stated for the records.

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

    def suppose(name, remedy, direct=whole, mirrored=none, conjugate=none, shift=still, order=every, **options):
        found.append(Hypothesis(name, remedy, direct, mirrored, conjugate, shift, order, **options))

    def only(column, value):
        return np.where(every == column, value, 1.0) * whole

    for factor, remedy in FACTORS.items():
        suppose(f"all readings are {1 / factor:.4g} times the true ones", remedy, factor * whole)
        for s, node in enumerate(sensors if len(sensors) > 1 else ()):
            text = f"the readings at node {node} are {1 / factor:.4g} times the true ones"
            suppose(text, remedy, only(s, factor))
        for s, node in enumerate(sensors if symmetric else ()):
            for probe, along, alone in probes_of(conventions, node):
                # the reading (z e^-ja + conj(z) e^ja) / 2 of the probe, the missing part of it added to z
                text = f"the readings {probe} at node {node} are {1 / factor:.4g} times the true ones"
                direct, mirrored = ((factor - 1) * alone * turned / 2 for turned in (along.conj(), along))
                suppose(text, remedy, only(s, 1 + direct), (every == s) * mirrored * whole)
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
    if 0 in n and sag.value.any():
        for sign, zero in ((-1, "unloaded_line"), (1, "at_rest")):
            shift = still.copy()
            shift[:, list(n).index(0)] = sign * sag.value
            said = "unloaded line" if sign < 0 else "position of the shaft at rest"
            suppose(
                f"displacements count from the {said}",
                f"state 'displacement_zero: {zero}'",
                shift=shift,
                is_uncertain=sign < 0,  # what the reading subtracted is known
            )
    return found


def best_hypothesis(spectrum, model, prior, about, settings, conventions=None) -> Tested:
    """The Tested hypothesis with the highest odds.

    Parameters
    ----------
    spectrum : Spectrum
        Without the model error.
    model : Model
        With the nuisance terms, and with causes, if any.
    prior : Prior
        Of its free parameters.
    about : ndarray (parameter,)
        Values of all parameters, about which the model is linearised to choose the hypotheses that are fitted.
    settings : Settings
    conventions : Conventions, optional
        Stated for the records.
    """
    sag = shown_sag(model, prior, spectrum)
    every = hypotheses(spectrum, sag, conventions)
    term, errors = sag.constant()
    models = {
        False: (model, prior, about),
        True: (model.plus(term), prior.plus(errors), np.concatenate([about, errors.mean])),
    }
    linearised = {uncertain: _linearised(*one, spectrum) for uncertain, one in models.items()}
    stated, screened = _volume(with_model_error(spectrum, settings)), []
    for hypothesis in every:
        corrected, log_volume = hypothesis.corrected(spectrum)
        corrected = with_model_error(corrected, settings)
        log_factor = log_volume + _volume(corrected) - stated + np.log(PRIOR_ODDS / len(every))
        evidence = _linear_evidence(corrected, *linearised[hypothesis.is_uncertain])
        screened.append((evidence + log_factor, log_factor, hypothesis))
    screened.sort(key=lambda one: -one[0])
    tested = []
    for _, log_factor, hypothesis in screened[:FITTED]:
        corrected = with_model_error(hypothesis.corrected(spectrum)[0], settings)
        extended, known, start = models[hypothesis.is_uncertain]
        tested.append(Tested(hypothesis, fit(extended, corrected, known, start=start), float(log_factor)))
    return max(tested, key=lambda one: one.fit.evidence + one.log_factor)


def _linearised(model, prior, about, spectrum):
    """Harmonics of a model at the mean of a prior, linearised about other values; their derivatives; the prior."""
    shown, change = measured_response_and_jacobian(
        model, spectrum.speed, spectrum.harmonics, about, order=carried_order(spectrum)
    )
    free = model.position(prior.names)
    shown = shown + change[..., free] @ (prior.mean - about[free])
    return shown, np.moveaxis(change[..., free], -1, 0), prior


def _volume(spectrum):
    """Logarithm of the determinant of the whitener."""
    return float(np.linalg.slogdet(spectrum.whitener)[1].sum())


def _linear_evidence(spectrum, shown, change, prior):
    """Log evidence of a spectrum less a constant; shown : by the linearised model at the prior mean."""
    off, columns = spectrum.whitened(spectrum.amplitude - shown), spectrum.whitened(change).T @ prior.factor
    normal = np.eye(columns.shape[1]) + columns.T @ columns
    along = columns.T @ off
    return float(-0.5 * (off @ off - along @ invert(normal) @ along + np.linalg.slogdet(normal)[1]))
