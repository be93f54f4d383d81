"""A measured full spectrum: harmonics of the displacement with their covariance."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

RELATIVE_FLOOR = 1e-13  # of the largest harmonic: round-off, so that exact data have a finite weight
CORRELATION_FLOOR = 1e-9  # keeps a covariance of fully correlated harmonics (one phase mark for all) invertible


@dataclass(frozen=True)
class Spectrum:
    """Harmonics R_n of the complex displacement at the sensors.

    amplitude  : (..., speed, harmonic, sensor) complex, m
    speed      : (speed,) rad/s
    harmonics  : (harmonic,) int, n > 0 forward, n < 0 backward
    sensors    : (sensor,) nodes
    covariance : (speed, sensor, component, component) m^2; components are the real parts of all harmonics, then the
                 imaginary parts. The noise of different sensors is independent.
    """

    amplitude: np.ndarray
    speed: np.ndarray
    harmonics: np.ndarray
    sensors: tuple
    covariance: np.ndarray

    def full_covariance(self) -> np.ndarray:
        """Covariance of the components of all sensors together.

        Returns
        -------
        array (speed, component * sensor, component * sensor)
            In m^2.
        """
        speeds, sensors, size, _ = self.covariance.shape
        full = np.zeros((speeds, size, sensors, size, sensors))
        for s in range(sensors):
            full[:, :, s, :, s] = self.covariance[:, s]
        return full.reshape(speeds, size * sensors, size * sensors)

    @cached_property
    def whitener(self) -> np.ndarray:
        """W (speed, sensor, component, component) in 1/m with W C W^T = 1.

        The symmetric root of the correlation is taken, so that a whitened component belongs to its harmonic.
        """
        floor = (RELATIVE_FLOOR * np.abs(self.amplitude).max()) ** 2
        size = np.sqrt(np.diagonal(self.covariance, axis1=-2, axis2=-1) + floor)
        correlation = self.covariance / (size[..., :, None] * size[..., None, :])
        correlation = correlation + CORRELATION_FLOOR * np.eye(size.shape[-1])
        variance, vectors = np.linalg.eigh(correlation)
        return (vectors / np.sqrt(variance)[..., None, :]) @ np.swapaxes(vectors, -1, -2) / size[..., None, :]

    def whitened(self, amplitude: ArrayLike) -> np.ndarray:
        """Harmonics as real components in standard deviations.

        Parameters
        ----------
        amplitude : array (..., speed, harmonic, sensor)
            Complex, m.

        Returns
        -------
        array (..., component)
            Of all speeds, in units of their standard deviation.
        """
        found = shared_product(self.whitener, np.swapaxes(components(amplitude), -1, -2))
        return found.reshape(*found.shape[:-3], -1)

    def at_speeds(self, chosen: ArrayLike) -> "Spectrum":
        """The spectrum at some of its speeds.

        Parameters
        ----------
        chosen : array (speed,)
            Positions (int) or mask of speeds.

        Returns
        -------
        Spectrum
        """
        return replace(
            self,
            amplitude=self.amplitude[..., chosen, :, :],
            speed=self.speed[chosen],
            covariance=self.covariance[chosen],
        )

    def at_harmonics(self, wanted: Iterable[int]) -> "Spectrum":
        """The spectrum at some of its harmonics.

        Parameters
        ----------
        wanted : ints (harmonic,)
            Harmonics of the spectrum.

        Returns
        -------
        Spectrum
            In the order wanted.
        """
        place = np.array([list(self.harmonics).index(n) for n in wanted])
        both = np.concatenate([place, place + len(self.harmonics)])
        covariance = self.covariance[..., both, :][..., both]
        return replace(self, amplitude=self.amplitude[..., place, :], harmonics=np.array(wanted), covariance=covariance)

    def with_amplitude(self, amplitude: ArrayLike) -> "Spectrum":
        """The same speeds, harmonics, sensors and covariance with other amplitudes.

        Parameters
        ----------
        amplitude : array (..., speed, harmonic, sensor)
            Complex, m.

        Returns
        -------
        Spectrum
        """
        return replace(self, amplitude=amplitude)


def components(amplitude):
    """(..., harmonic, sensor) complex -> (..., component, sensor) real: real parts, then imaginary parts."""
    return np.concatenate([amplitude.real, amplitude.imag], axis=-2)


def shared_product(matrix, vectors):
    """Matrices (speed, block, row, column), the same for all trials, times vectors (..., speed, block, column)."""
    lead, last = vectors.shape[:-3], vectors.shape[-3:]
    columns = np.moveaxis(vectors.reshape(-1, *last), 0, -1)  # one product for each matrix, all trials as its columns
    return np.moveaxis(matrix @ columns, -1, 0).reshape(*lead, *matrix.shape[:-1])


def independent_covariance(variance):
    """Covariance of circular noise, independent by harmonic.

    variance : (speed, harmonic, sensor) of each of the real and imaginary parts, m^2
    """
    both = np.concatenate([variance, variance], axis=1)  # (speed, component, sensor)
    return np.moveaxis(both, -1, 1)[..., None] * np.eye(both.shape[1])
