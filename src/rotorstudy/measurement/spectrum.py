"""A measured full spectrum: harmonics of the displacement with their covariance, and its data as fits take them.

A probe alone at a node, in the direction a, reads r(t) = Re(e^{-ja} z(t)), so that its harmonic n is
r_n = (e^{-ja} R_n + e^{ja} conj(R_-n)) / 2, and r_-n = conj(r_n). The motion across it is not measured. Such a node is
kept as the motion along the probe, z = e^{ja} r, and only the components of r_n for n >= 0 count as data.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.entries import on_real_parts

RELATIVE_FLOOR = 1e-13  # of the largest harmonic: round-off, so that exact data have a finite weight
WHITENERS_KEPT = 16  # of single sensors
SHARED_FLOOR = 1e-6  # variance of a shared error beside that of the noise, below which it changes nothing
CORRELATION_FLOOR = 1e-9  # keeps a covariance of fully correlated harmonics (one phase mark for all) invertible


@lru_cache(maxsize=WHITENERS_KEPT)  # of many hypotheses on the records each changes what one sensor shows
def _whitener(covariance, shape, floor):
    """Root of the inverse of a covariance (speed, component, component), m^2, of which `floor` is round-off."""
    covariance = np.frombuffer(covariance).reshape(shape)
    size = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1) + floor)
    correlation = covariance / (size[..., :, None] * size[..., None, :])
    correlation = correlation + CORRELATION_FLOOR * np.eye(size.shape[-1])
    variance, vectors = np.linalg.eigh(correlation)
    return (vectors / np.sqrt(variance)[..., None, :]) @ np.swapaxes(vectors, -1, -2) / size[..., None, :]


class Whitened:
    """The data of a Spectrum: the components of its harmonics that probes show, with their covariance."""

    @cached_property
    def _seen(self):
        """(sensor, component) whether a component is a datum, and (sensor, component, component) rows of the data."""
        rows = np.array([seen_rows(self.harmonics, a) for a in self.directions])
        return rows.any(axis=-1), rows

    @property
    def data_count(self) -> int:
        """Number of real data."""
        return len(self.speed) * int(self._seen[0].sum())

    def with_amplitude(self, amplitude: np.ndarray):
        """The same speeds, harmonics, sensors and covariance with amplitudes (..., speed, harmonic, sensor), m."""
        return replace(self, amplitude=amplitude)

    def with_error(self, variance: np.ndarray):
        """The spectrum with independent errors of a variance (speed, harmonic, sensor), m^2, of each part of harmonics.

        Harmonics n and -n of a single probe are one datum: they share their error, which does not average out.
        """
        variance = variance * np.where(np.isnan(self.directions), 1.0, 2.0)
        return replace(self, covariance=self.covariance + independent_covariance(variance))

    def with_shared_error(self, columns: np.ndarray):
        """The spectrum with errors of unit variance that sensors share, as whitened data (component, unknown)."""
        return replace(self, shared_error=np.asarray(columns))

    def without_common_error(self):
        """The spectrum with the noise of its sensors alone, so that speeds are independent."""
        return replace(self, common_error=None, shared_error=None)

    @cached_property
    def _common(self):
        """Directions (component, error) of the common errors, of data whitened by noise, and variances (error,)."""
        return principal(self._with_own_noise(self.common_error).T)

    @cached_property
    def _shared(self):
        """Directions (component, error) of the shared errors, and their variances (error,)."""
        return principal(self.shared_error)

    def full_covariance(self) -> np.ndarray:
        """Covariance (speed, component * sensor, component * sensor) of the components of all sensors together, m^2."""
        speeds, sensors, size, _ = self.covariance.shape
        full = np.einsum("vsij,st->visjt", self.covariance, np.eye(sensors))
        return full.reshape(speeds, size * sensors, size * sensors)

    def covariance_times(self, amplitude: np.ndarray) -> np.ndarray:
        """Covariance, without shared errors, times harmonics (speed, harmonic, sensor), m: the same in m^3."""
        real, imaginary = np.split(np.einsum("wscd,wds->wcs", self.covariance, components(amplitude)), 2, axis=1)
        found = real + 1j * imaginary
        if self.common_error is None:
            return found
        along = np.sum((self.common_error.conj() * amplitude).real, axis=(1, 2, 3))
        return found + np.tensordot(along, self.common_error, 1)

    @cached_property
    def whitener(self) -> np.ndarray:
        """W (speed, sensor, component, component) in 1/m with W C W^T = 1, zero in rows that are not data.

        The symmetric root of the correlation is taken, so that a whitened component belongs to its harmonic.
        """
        floor = (RELATIVE_FLOOR * np.abs(self.amplitude).max()) ** 2
        _, rows = self._seen  # an orbit's are the identity
        apart = np.moveaxis(rows @ np.asarray(self.covariance, float) @ np.swapaxes(rows, -1, -2), -3, 0)
        return np.stack([_whitener(one.tobytes(), one.shape, floor) for one in apart], axis=-3) @ rows

    @property
    def log_volume(self) -> float:
        """Logarithm of the determinant of the whitener, of the data."""
        parts = zip(np.moveaxis(self.whitener, 1, 0), *self._seen, strict=True)
        found = [np.linalg.slogdet(w[:, data] @ rows[data].T)[1] for w, data, rows in parts]
        return float(np.stack(found, axis=1).sum() - self.log_common_volume / 2)

    @property
    def log_common_volume(self) -> float:
        """Logarithm of the determinant of the covariance that common errors give data whitened by the noise alone."""
        return 0.0 if self.common_error is None else float(np.log1p(self._common[1]).sum())

    @property
    def log_shared_volume(self) -> float:
        """Logarithm of the determinant of the covariance of whitened data, which is that of the errors they share."""
        return 0.0 if self.shared_error is None else float(np.log1p(self._shared[1]).sum())

    def log_change(self, matrix: np.ndarray) -> float:
        """Logarithm of the determinant of a linear change (sensor, component, component) of the data of all speeds."""
        parts = zip(matrix, *self._seen, strict=True)
        found = [np.linalg.slogdet(rows[data] @ m @ rows[data].T)[1] for m, data, rows in parts]
        return float(len(self.speed) * np.sum(found))

    def whitened(self, amplitude: np.ndarray) -> np.ndarray:
        """Harmonics (..., speed, harmonic, sensor), m, as the data (..., component) in their standard deviations."""
        found = self.whitened_by_common(self._with_own_noise(amplitude))
        return found if self.shared_error is None else _whitened(found, *self._shared)

    def whitened_by_common(self, data: np.ndarray) -> np.ndarray:
        """Data (..., component) in standard deviations of the noise of each sensor, whitened by common errors too."""
        return data if self.common_error is None else _whitened(data, *self._common)

    def _with_own_noise(self, amplitude):
        """The same by the noise of each sensor alone."""
        found = shared_product(self.whitener, np.swapaxes(components(amplitude), -1, -2))
        seen = self._seen[0]
        if not seen.all():
            found = found[..., seen]
        lead = found.shape[: np.ndim(amplitude) - 3]  # may be of no columns at all
        return found.reshape(*lead, int(np.prod(found.shape[len(lead) :])))

    def by_harmonic(self, whitened: np.ndarray) -> np.ndarray:
        """Rms (speed, harmonic, sensor) of whitened data (component,) by harmonic; of a probe the same at n and -n."""
        seen, order = self._seen[0], list(self.harmonics)
        parts = np.zeros((len(self.speed), *seen.shape))
        parts[:, seen] = np.reshape(whitened, (len(self.speed), -1))
        parts, count = parts.reshape(len(self.speed), len(self.sensors), 2, -1), seen.reshape(len(seen), 2, -1)
        found = np.sqrt(np.sum(parts**2, axis=2) / np.maximum(count.sum(axis=1), 1)).transpose(0, 2, 1)
        for s in np.flatnonzero(~np.isnan(self.directions)):
            found[..., s] = found[:, [order.index(abs(n)) if abs(n) in order else i for i, n in enumerate(order)], s]
        return found


def principal(columns, least=SHARED_FLOOR, share=0.0):
    """Orthonormal directions (component, error) of errors (component, error), and their variances (error,).

    Of those above the least variance, and above a share of the largest one.
    """
    wide = columns.shape[1] > len(columns)
    variance, vectors = np.linalg.eigh(columns @ columns.T if wide else columns.T @ columns)
    kept = variance > max(least, share * variance.max(initial=0.0))
    along = vectors[:, kept] if wide else columns @ (vectors[:, kept] / np.sqrt(variance[kept]))
    return along, variance[kept]


def _whitened(data, along, variance):
    """Data with errors along some directions; by the symmetric root, so that a component belongs to its harmonic."""
    return data - (data @ along) * (1 - 1 / np.sqrt(1 + variance)) @ along.T


@dataclass(frozen=True)
class Spectrum(Whitened):
    """Harmonics R_n of the complex displacement at the sensors.

    amplitude  : (..., speed, harmonic, sensor) complex, m
    speed      : (speed,) rad/s
    harmonics  : (harmonic,) int, n > 0 forward, n < 0 backward
    sensors    : (sensor,) nodes
    covariance : (speed, sensor, component, component) m^2; components are the real parts of all harmonics, then the
                 imaginary parts. The noise of different sensors is independent.
    directions : (sensor,) rad from x in the sense of rotation, of the only probe of a node, whose amplitude is that of
                 the motion along it; NaN where the orbit is measured, as by default at all nodes
    common_error : (error, speed, harmonic, sensor) m, what each of some independent errors of unit variance, that
                 sensors and speeds have in common, changes beside the noise of each; None by default
    shared_error : (component, error) what each of some independent errors of unit variance, that sensors or speeds have
                 in common, changes the whitened data by; None by default. A part of the spectrum has none
    """

    amplitude: np.ndarray
    speed: np.ndarray
    harmonics: np.ndarray
    sensors: tuple
    covariance: np.ndarray
    directions: np.ndarray | None = None
    common_error: np.ndarray | None = None
    shared_error: np.ndarray | None = None

    def __post_init__(self):
        if self.directions is None:
            object.__setattr__(self, "directions", np.full(len(self.sensors), np.nan))
        sizes = (len(self.speed), len(self.harmonics), len(self.sensors))
        both = (sizes[0], sizes[2], 2 * sizes[1], 2 * sizes[1])
        if np.shape(self.amplitude)[-3:] != sizes or np.shape(self.covariance) != both:
            raise RotorstudyError(
                f"a spectrum has amplitude of shape {np.shape(self.amplitude)} and covariance of shape "
                f"{np.shape(self.covariance)}; needed are (..., speed, harmonic, sensor), {sizes}, and {both}"
            )
        if self.single_probes and not any(n > 0 and -n in self.harmonics for n in self.harmonics):
            raise RotorstudyError(
                f"node {self.single_probes[0]} has a single probe, which shows harmonics n and -n together; of "
                f"{list(map(int, self.harmonics))} none has its opposite: take both ('measurement: harmonics:' or "
                "--harmonics)"
            )

    @property
    def single_probes(self) -> list[int]:
        """Nodes with a single probe."""
        return [node for node, whole in zip(self.sensors, np.isnan(self.directions), strict=True) if not whole]

    @property
    def variance(self) -> np.ndarray:
        """(speed, harmonic, sensor) m^2, of the real and the imaginary part of each harmonic together."""
        real, imag = np.split(np.diagonal(self.covariance, axis1=-2, axis2=-1), 2, axis=-1)
        common = 0.0 if self.common_error is None else np.sum(np.abs(self.common_error) ** 2, axis=0)
        return np.swapaxes(real + imag, 1, 2) + common

    def shown(self, amplitude: ArrayLike) -> np.ndarray:
        """What the probes show of harmonics: at a node with a single probe the motion along it.

        Parameters
        ----------
        amplitude : array (..., speed, harmonic, sensor)
            Complex, m.

        Returns
        -------
        array (..., speed, harmonic, sensor)
            Complex, m.
        """
        return along_probes(amplitude, self.harmonics, self.directions)

    def along(self, directions: ArrayLike) -> "Spectrum":
        """The spectrum as single probes would show it at the nodes where this one has an orbit.

        Parameters
        ----------
        directions : array (sensor,)
            In rad, NaN where nothing changes.

        Returns
        -------
        Spectrum
        """
        single = np.where(np.isnan(self.directions), directions, np.nan)
        covariance = np.array(self.covariance)
        for sensor in np.flatnonzero(~np.isnan(single)):
            covariance[:, sensor] = along_probe(covariance[:, sensor], self.harmonics, single[sensor])
        both = np.where(np.isnan(single), self.directions, single)
        shown = partial(along_probes, harmonics=self.harmonics, directions=single)
        return self._changed(shown, covariance=covariance, directions=both)

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
        own = {"speed": self.speed[chosen], "covariance": self.covariance[chosen]}
        return self._changed(lambda amplitude: amplitude[..., chosen, :, :], **own)

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
        own = {"harmonics": np.array(wanted), "covariance": self.covariance[..., both, :][..., both]}
        return self._changed(lambda amplitude: amplitude[..., place, :], **own)

    def _changed(self, change, **own):
        """The spectrum with its amplitude and common errors changed alike, and other parts; without shared errors."""
        common = None if self.common_error is None else change(self.common_error)
        return replace(self, amplitude=change(self.amplitude), common_error=common, shared_error=None, **own)


def components(amplitude):
    """(..., harmonic, sensor) complex -> (..., component, sensor) real: real parts, then imaginary parts."""
    return np.concatenate([amplitude.real, amplitude.imag], axis=-2)


def shared_product(matrix, vectors):
    """Matrices (speed, block, row, column), the same for all trials, times vectors (..., speed, block, column)."""
    lead, last = vectors.shape[:-3], vectors.shape[-3:]
    columns = np.moveaxis(vectors.reshape(-1, *last), 0, -1)  # one product for each matrix, all trials as its columns
    return np.moveaxis(matrix @ columns, -1, 0).reshape(*lead, *matrix.shape[:-1])


def independent_covariance(variance):
    """Covariance of circular noise, independent by harmonic, of the variance (speed, harmonic, sensor) of each part."""
    both = np.concatenate([variance, variance], axis=1)  # (speed, component, sensor)
    return np.moveaxis(both, -1, 1)[..., None] * np.eye(both.shape[1])


def along_probes(amplitude, harmonics, directions):
    """The part (..., harmonic, sensor) that probes show: (R_n + e^{2ja} conj(R_-n)) / 2; of orbits (NaN) all."""
    single = np.flatnonzero(~np.isnan(directions))
    if not len(single):
        return amplitude
    order = list(harmonics)
    paired = [i for i, n in enumerate(order) if -n in order]
    shown = np.array(amplitude)
    there, opposite = shown[..., paired, :][..., single], [order.index(-order[i]) for i in paired]
    mirrored = np.exp(2j * directions[single]) * shown[..., opposite, :][..., single].conj()
    shown[..., np.array(paired)[:, None], single] = (there + mirrored) / 2
    return shown


def seen_rows(harmonics, direction):
    """(component, component) from the harmonics of an orbit to the data: sqrt(2) r_n for n > 0, and r_0.

    Components are the real parts of all harmonics, then the imaginary parts. With these factors the rows are
    orthonormal, and white noise of the probe has the same variance in all; the rows of components that are not data
    are zero: of n < 0, of n without -n, and the imaginary part of the mean. Of an orbit it is the identity.
    """
    count = len(harmonics)
    if np.isnan(direction):
        return np.eye(2 * count)
    harmonics, turn = np.asarray(harmonics), np.exp(-1j * direction)
    factor = np.where(harmonics > 0, np.sqrt(0.5), 0.5 * (harmonics == 0))[:, None]
    factor = factor * np.isin(-harmonics, harmonics)[:, None]
    return on_real_parts(factor * turn * np.eye(count), factor * turn.conj() * (harmonics[:, None] == -harmonics))


def along_probe(covariance, harmonics, direction):
    """The part (..., component, component) of a covariance that is of the motion along a probe."""
    rows = seen_rows(harmonics, direction)
    return rows.T @ (rows @ covariance @ rows.T) @ rows
