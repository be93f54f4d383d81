"""What a crack changes of the measured harmonics, and how that stands out from noise and from an uncertain rig."""

from functools import cached_property

import numpy as np

from rotorstudy.diagnosis.search.candidates import candidate, shape_ranges
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.search.shape_fit import Work, point_of, response_with_shape
from rotorstudy.errors import CannotAct, NoSteadyState
from rotorstudy.inference.linear import invert
from rotorstudy.inference.prediction import whitened_prediction, with_model_error
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.noise import noise_std
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.response.measured import measured_response

SHAPE = ("position_m", "depth_ratio", "angle_rad")


class Machine:
    """A rotor of the study with all its probes: its motion without a crack, and what is known of it beforehand.

    Rows (component,) are real and imaginary parts of the harmonics, m, in the order (speed, sensor, part, harmonic).

    study : CrackStudy;  rotor : CrackedRotor
    """

    def __init__(self, study, rotor):
        self.study, self.rotor = study, rotor
        self.model = rotor.model()
        self.speed, self.harmonics = np.array(rotor.speeds_rad_s), np.array(study.harmonics)
        self.healthy = measured_response(self.model, self.speed, self.harmonics)
        self.whole, self.prior = base_model(self.model, study.diagnosis)

    def spectrum(self, amplitude, variance):
        """A Spectrum (speed, harmonic, sensor) of this machine, m, with independent variances, m^2."""
        variance = np.broadcast_to(variance, amplitude.shape)
        return Spectrum(amplitude, self.speed, self.harmonics, self.model.sensors, independent_covariance(variance))

    def noisy_spectrum(self, amplitude, percent):
        """The Spectrum with the variance of white noise and of the model error."""
        clean = self.spectrum(amplitude, 0.0)
        std = noise_std(clean, percent / 100, "white in time", self.study.samples)
        variance = std**2 + self.study.probe_noise_m**2 / self.study.samples
        return with_model_error(self.spectrum(amplitude, variance), self.study.diagnosis)

    def drawn(self, spectrum, amplitude, normal):
        """The Spectrum with an amplitude (speed, harmonic, sensor), m, and noise by standard normal numbers."""
        variance = np.diagonal(spectrum.covariance, axis1=-2, axis2=-1)[..., : len(self.harmonics)]
        real, imag = normal.reshape(2, *amplitude.shape)
        return spectrum.with_amplitude(amplitude + np.sqrt(np.moveaxis(variance, 1, 2)) * (real + 1j * imag))

    def std(self, percent):
        """(component,) standard deviations of noise and model error, m."""
        spectrum = self.noisy_spectrum(self.healthy, percent)
        return 1 / spectrum.whitened(np.full(self.healthy.shape, 1 + 1j))

    def positions(self, count):
        """(position,) evenly spaced along the shaft, m."""
        return (np.arange(count) + 0.5) / count * self.model.structure.length

    @cached_property
    def raw(self):
        """Spectrum without a crack, of unit variance: its whitened components are m."""
        return self.spectrum(self.healthy, 1.0)

    @cached_property
    def others(self):
        """Name -> Candidate of the effects that may be present in the healthy machine, too."""
        found, width = {}, self.study.diagnosis.prior_width
        for number, (name, item) in enumerate(self.rotor.confounders.items()):
            options = {key: value for key, value in item.items() if key != "kind"}
            found[name] = candidate(self.model, item["kind"], options, None, f"other {number}", width)
        return found

    def healthy_columns(self, *others):
        """(component, parameter) derivatives without a crack by what is uncertain of rig and probes, and by others."""
        work = self.work(self.raw, *others)
        theta = np.concatenate([self.prior.mean, np.zeros(len(work.prior.names) - len(self.prior.names))])
        return whitened_prediction(work.whole, self.raw, work.prior.names, theta)[1]

    def change(self, position_m, depth_ratio, angle_rad):
        """(component,) what a crack changes, m; NaN where none can be, as at a disc."""
        try:
            cracked = self.rotor.model(self.study.crack.effect(position_m, depth_ratio, angle_rad))
            found = measured_response(cracked, self.speed, self.harmonics)
        except (CannotAct, NoSteadyState):
            return np.full(2 * self.healthy.size, np.nan)
        return self.raw.whitened(found - self.healthy)

    def crack(self, position_m, depth_ratio, angle_rad):
        """A crack as a Candidate; CannotAct where none can be."""
        shape = {"position_m": position_m, "depth_ratio": depth_ratio, "angle_rad": angle_rad}
        kind, variant, width = self.study.crack.kind, self.study.crack.variant, self.study.diagnosis.prior_width
        return candidate(self.model, kind, {}, shape, "crack", width, variant)

    def work(self, spectrum, *others):
        """The `Work` of identifying a crack on this machine; others : Candidates that may be present too."""
        prior = self.prior
        for other in others:
            prior = prior.plus(Prior.independent(other.prior))
        whole = self.whole.plus(*(other.term for other in others))
        return Work(self.model, whole, prior, spectrum, self.study.diagnosis)

    def columns(self, crack, *others):
        """(component, parameter) derivatives at a crack by the base, others, its flexibility and its shape.

        The shape is in the units of the options, in the order of `SHAPE`.
        """
        work, ranges = self.work(self.raw, *others), shape_ranges(crack.effect, self.model.structure)
        absent = np.zeros(len(work.prior.names) - len(self.prior.names))
        amplitudes = np.concatenate([self.prior.mean, absent, [1.0]])
        _, slopes = response_with_shape(work, [crack], amplitudes, [point_of(work, crack)])
        found = work.spectrum.whitened(slopes).T
        found[:, -len(SHAPE) :] /= [ranges[name].slope(crack.shape[name]) for name in SHAPE]
        return found

    def bounds(self, columns, percent, crack, chosen=slice(None), *others):
        """(shape,) `bounds` of a crack by its `columns`, of some components, with noise; others : as for these."""
        prior = self.work(self.raw, *others).prior.plus(Prior.independent(crack.prior))
        ranges = shape_ranges(crack.effect, self.model.structure)
        widths = [ranges[name].high - ranges[name].low for name in SHAPE]
        return bounds((columns / self.std(percent)[:, None])[chosen], prior.whitener, widths)

    def chosen(self, nodes=None, speeds=None, harmonics=None):
        """(component,) whether a component is of some nodes, speeds (rad/s) and harmonics; by default all are."""

        def among(values, wanted):
            return np.ones(len(values), bool) if wanted is None else np.isin(values, wanted)

        speed, harmonic = among(self.speed, speeds), among(self.harmonics, harmonics)
        node = among(self.model.sensors, nodes)
        both = speed[:, None, None, None] & node[:, None, None] & np.ones((2, 1), bool) & harmonic
        return both.ravel()


def explained_away(columns, whitener):
    """Orthonormal basis (row, parameter) of what uncertain parameters can change, with the rows of their prior."""
    known = np.vstack([columns, whitener])
    return np.linalg.qr(known / np.linalg.norm(known, axis=0))[0]


def visibility(changes, basis):
    """(...,) size, in standard deviations, of what a basis leaves of changes (..., component)."""
    padded = np.concatenate([changes, np.zeros((*changes.shape[:-1], len(basis) - changes.shape[-1]))], axis=-1)
    left = padded - (padded @ basis) @ basis.T
    return np.linalg.norm(left, axis=-1)


def bounds(columns, whitener, ranges):
    """(shape,) Cramer-Rao bounds of the options of a crack: standard deviations in their units.

    columns : (component, parameter) in standard deviations, the last ones of the shape
    whitener : (parameter, parameter) of the prior of the others;  ranges : (shape,) width of what is possible
    """
    count = len(ranges)
    prior = np.zeros((columns.shape[1], columns.shape[1]))
    prior[:-count, :-count] = whitener.T @ whitener
    prior[-count:, -count:] = np.diag(12 / np.square(ranges))  # the variance of a uniform distribution
    return np.sqrt(np.diag(invert(columns.T @ columns + prior))[-count:])
