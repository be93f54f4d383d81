"""The input of an estimator plugin: a Problem.

Two errors can be minimised: that of the equations of motion (linear in the unknowns and fast, but with noisy columns)
and that of the output (predicted minus measured harmonics; weighted by their covariance, maximum likelihood).
"""

from dataclasses import dataclass, replace

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.equation_error import regression, residual_sensitivity
from rotorstudy.inference.linear import RANK_TOLERANCE, by_speed
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.response.coupling import COUPLED_ORDER
from rotorstudy.response.statics import static_deflection


@dataclass(frozen=True)
class Problem:
    """A model, a spectrum, and the amplitudes to be estimated.

    Parameters
    ----------
    model : Model
        Gives the values of all other amplitudes.
    spectrum : Spectrum
        Of the model's sensors; its amplitude may have many trials.
    names : tuple of str
        The unknowns.
    order : int
        Highest harmonic carried where the model couples harmonics.
    condensation : str
        Of the coordinates that are not measured, in equation-error least squares: "exact", or "without gyroscopic
        moments" as in the thesis.
    deflection : ndarray (..., speed, dof), optional
        Static deflection, m, at which it is held instead of following from the unknowns.

    Raises
    ------
    RotorstudyError
        For no unknowns, one named twice, other sensors, or a spectrum that is not finite.
    """

    model: Model
    spectrum: Spectrum
    names: tuple[str, ...]
    order: int = COUPLED_ORDER
    condensation: str = "exact"
    deflection: np.ndarray | None = None

    def __post_init__(self):
        model, spectrum = self.model, self.spectrum
        if not self.names:
            raise RotorstudyError(f"no unknowns; name at least one of {', '.join(model.names) or 'none'}")
        twice = sorted({name for name in self.names if list(self.names).count(name) > 1})
        if twice:
            raise RotorstudyError(f"{', '.join(twice)}: named twice among the unknowns; name each once")
        if tuple(spectrum.sensors) != tuple(model.sensors):
            raise RotorstudyError(f"the spectrum is of sensors {spectrum.sensors}, the model of {model.sensors}")
        for name in ("amplitude", "covariance"):
            if not np.isfinite(getattr(spectrum, name)).all():
                raise RotorstudyError(f"the {name} of the spectrum has NaN or infinite values; leave those out")

    def equations(self) -> tuple[np.ndarray, np.ndarray]:
        """Real linear system A theta = b of the equation error.

        Returns
        -------
        two arrays
            A (..., row, parameter) in N per unit of each parameter, b (..., row) in N.
        """
        given = {"order": self.order, "deflection": self.deflection, "condensation": self.condensation}
        return regression(self.model, self.spectrum, self.names, **given).real_system()

    def holding(self, theta: np.ndarray) -> "Problem | None":
        """The problem with the static deflection held at that of an estimate.

        Parameters
        ----------
        theta : array (..., parameter)
            Estimate in the units of the parameters.

        Returns
        -------
        Problem or None
            None if no unknown carries the weight.
        """
        model = self.model
        carrying = [u.name for u in model.rotor_unknowns if u.carries and u.name in self.names]
        if self.deflection is not None or model.held_deflection is not None:
            return None
        if not carrying or not model.structure.static_load.any():
            return None
        deflection = static_deflection(model, self.spectrum.speed, self._rotor_amplitudes(theta)).value
        return replace(self, deflection=deflection)

    def _rotor_amplitudes(self, theta):
        return self.model.filled(self.names, theta)[..., : len(self.model.rotor_unknowns)]

    def _moved_residual(self, theta):
        """(row, parameter) derivative of A theta - b by the unknowns through the static deflection alone."""
        model, speed = self.model, self.spectrum.speed
        deflection, changes = static_deflection(model, speed, self._rotor_amplitudes(theta), jacobian=True)

        change = {p: changes.get(int(model.position([name])[0])) for p, name in enumerate(self.names)}
        moving = [p for p, one in change.items() if one is not None]
        # the residual is affine in the deflection, so any step is exact; all steps at once
        tried = np.stack([deflection, *(deflection + theta[p] * change[p] for p in moving)])
        a, b = replace(self, deflection=tried).equations()
        residual = a @ theta - b
        moved = np.zeros((residual.shape[-1], len(self.names)))
        moved[:, moving] = ((residual[1:] - residual[0]) / theta[moving][:, None]).T
        return moved

    def equation_error_covariance(self, theta: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
        """First-order covariance of a linear estimate theta = (W A)^+ W b.

        The derivative of the residual A theta - b by the spectrum is known. It covers the noise in A to first order.

        Parameters
        ----------
        theta : array (..., parameter)
            Estimate in the units of the parameters.
        weights : array (speed, row, row), optional
            W of each speed, of unit 1/N; one if None.

        Returns
        -------
        array (parameter, parameter)
            In the units of the parameters.
        """
        mean, theta = self.mean(theta)
        held = mean.holding(theta)
        a, _ = (held or mean).equations()
        weighted = a if weights is None else by_speed(weights, a)
        gain = np.linalg.pinv(weighted / np.linalg.norm(weighted, axis=0), RANK_TOLERANCE)
        gain = gain / np.linalg.norm(weighted, axis=0)[:, None]
        if weights is not None:
            gain = by_speed(np.swapaxes(weights, -1, -2), gain.T).T
        if held is not None:  # theta = A^+ b where A and b move with theta
            gain = np.linalg.solve(np.eye(len(theta)) + gain @ mean._moved_residual(theta), gain)
        sensitivity = residual_sensitivity(self.model, self.spectrum, self.names, theta, order=self.order)
        gain = gain.reshape(len(self.names), len(self.spectrum.speed), -1)
        through = np.einsum("psr,src->psc", gain, sensitivity)
        variance, vectors = np.linalg.eigh(self.spectrum.full_covariance())
        root = vectors * np.sqrt(np.maximum(variance, 0))[:, None, :]  # so that round-off leaves no negative variance
        spread = np.einsum("psc,scd->psd", through, root)
        return np.einsum("psd,qsd->pq", spread, spread)

    def mean(self, theta: np.ndarray) -> tuple["Problem", np.ndarray]:
        """The problem with the mean spectrum of all trials, and their mean estimate.

        Parameters
        ----------
        theta : array (..., parameter)
            Estimate in the units of the parameters.

        Returns
        -------
        Problem and array (parameter,)
            The mean estimate in the units of the parameters.
        """
        mean = self.spectrum.amplitude.reshape(-1, *self.spectrum.amplitude.shape[-3:]).mean(axis=0)
        theta = np.asarray(theta).reshape(-1, len(self.names)).mean(axis=0)
        return replace(self, spectrum=self.spectrum.with_amplitude(mean)), theta

    def equation_weights(self, theta: np.ndarray) -> np.ndarray:
        """Weights W that whiten the noise of the equations.

        The derivative of the residual by the spectrum is a square matrix S, so W = (whitener of the spectrum) S^-1:
        weighted rows are errors of the harmonics again, in standard deviations.

        Parameters
        ----------
        theta : array (..., parameter)
            Estimate in the units of the parameters.

        Returns
        -------
        array (..., speed, row, row)
            W, 1/N.
        """
        sensitivity = residual_sensitivity(self.model, self.spectrum, self.names, theta, order=self.order)
        of_all_sensors = replace(self.spectrum, covariance=self.spectrum.whitener).full_covariance()
        found = np.linalg.solve(np.swapaxes(sensitivity, -1, -2), np.swapaxes(of_all_sensors, -1, -2))
        return np.swapaxes(found, -1, -2)
