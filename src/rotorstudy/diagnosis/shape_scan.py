"""The shape of a cause from its columns at a known motion: many shapes at once, without a fit.

A force that depends on the motion (a contact, a resonant support) is a known function of time once the motion of its
node is known, whatever causes it, and linear in its amplitude. That motion follows from the records and the receptances
of the rotor with a free force at the node. Each shape is then judged by least squares, as in `screen`; the best one is
refined by sampling about it.
"""

from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.candidates import Candidate, Screened, candidate, screen
from rotorstudy.inference.fit import Fit
from rotorstudy.inference.prediction import carried_order
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry
from rotorstudy.model.terms import Entry, Unknown
from rotorstudy.response.measured import Motion, carried_motion, replies

FIRST_SAMPLES = (0, 16, 32, 64, 64)  # shapes over the whole range, by the number of options
SAMPLES = 24  # shapes per round about the best one
REFINED = 2  # places of each effect at which the best shape is refined
SPREADS = (0.12, 0.05, 0.02, 0.008, 0.003)  # of those rounds, in shares of the range


class Scanned(NamedTuple):
    """A Candidate with the best shape found, and its Screened."""

    cause: Candidate
    screened: Screened


def place_of(value, low, high):
    """Position (0 to 1) of the value of a shape option in its range, logarithmic if that begins above zero."""
    return np.log(value / low) / np.log(high / low) if low > 0 else (value - low) / (high - low)


def value_at(place, low, high):
    """Value of a shape option at a position in its range; see `place_of`."""
    return float(low * (high / low) ** place if low > 0 else low + place * (high - low))


def inside(places, names):
    """Positions (..., option) moved into their ranges: angles go around, other options stop at the ends."""
    around = np.array([name.endswith("_rad") for name in names])
    return np.where(around, np.mod(places, 1), np.clip(places, 0, 1))


def can_be_scanned(cause):
    """Whether a cause acts at a node, with a force whose shape is to be found."""
    return bool(cause.shape) and "node" in cause.where and not cause.term.acts_on_output


def motion_by_a_free_force(fitted, spectrum, node):
    """The Motion of a fitted model with the force at one node, free at every harmonic and speed, that explains most.

    Parameters
    ----------
    fitted : Fit
    spectrum : Spectrum
    node : int

    Returns
    -------
    Motion
    """
    model, speed, order = fitted.model, spectrum.speed, carried_order(spectrum)
    unit = model.structure.unit(node)
    pushes = [
        Unknown(f"{factor} {n}X", "N", (Entry(factor * unit, on="one", shift=int(n)),), 1.0)
        for factor in (1, 1j)
        for n in spectrum.harmonics
    ]
    moved = replies(model, speed, spectrum.harmonics, pushes, fitted.theta, order=order)
    carried = np.union1d(np.arange(-order, order + 1), spectrum.harmonics)
    seen = moved[:, np.searchsorted(carried, spectrum.harmonics)][:, :, model.measured]
    columns = spectrum.whitened(np.moveaxis(seen, -1, 0)).T.reshape(len(speed), -1, len(pushes))
    residual = fitted.residual.reshape(len(speed), -1)
    found = carried_motion(model, speed, spectrum.harmonics, fitted.theta, order=order)
    forces = np.array([np.linalg.lstsq(a, b, rcond=1e-9)[0] for a, b in zip(columns, residual, strict=True)])
    return Motion(found.amplitude + np.einsum("whdp,wp->whd", moved, forces), found.deflection)


def scan(fitted, spectrum, model, chosen, prior_width):
    """The shapes of causes at which their columns explain most, at the best places of each effect.

    Parameters
    ----------
    fitted : Fit
        Without the causes.
    spectrum : Spectrum
    model : Model
    chosen : list of Candidate
        One for each effect and place; those at a node whose effect has shape options are considered.
    prior_width : float
        Standard deviation of an amplitude, in typical sizes.

    Returns
    -------
    list of Scanned
    """
    motions, looked = {}, {}
    for cause in chosen:
        if not can_be_scanned(cause):
            continue
        node = cause.where["node"]
        if node not in motions:
            motions[node] = motion_by_a_free_force(fitted, spectrum, node)
        one = _Scan(fitted, spectrum, model, cause, motions[node], prior_width)
        looked.setdefault(cause.effect, []).append((one, one.first()))
    found = []
    for places in looked.values():
        places.sort(key=lambda place: -place[1].screened.evidence)
        found += [one.refined(best) for one, best in places[:REFINED]]
    return found


class _Judged(NamedTuple):
    """A shape at a position (option,) in its ranges, judged."""

    place: np.ndarray
    cause: Candidate
    screened: Screened


class _Scan(NamedTuple):
    """The scan of one cause at one motion."""

    fitted: Fit
    spectrum: Spectrum
    model: Model
    cause: Candidate
    motion: Motion
    prior_width: float

    @property
    def ranges(self):
        return registry().get("effect", self.cause.effect).shape

    def best(self, places):
        """The best of some positions (shape, option)."""
        ranges, (effect, where, term) = self.ranges, self.cause[:3]
        shapes = [{name: value_at(x, *ranges[name]) for name, x in zip(ranges, place, strict=True)} for place in places]
        labels = [f"{term.label} {i}" for i in range(len(shapes))]
        chosen = [
            candidate(self.model, effect, where, shape, label, self.prior_width)
            for shape, label in zip(shapes, labels, strict=True)
        ]
        judged = screen(self.fitted, self.spectrum, chosen, self.motion)
        i = max(range(len(judged)), key=lambda i: judged[i].evidence)
        same = candidate(self.model, effect, where, shapes[i], term.label, self.prior_width)
        return _Judged(places[i], same, judged[i])

    def first(self):
        """The best of shapes over the whole range."""
        from scipy.stats import qmc

        options = len(self.ranges)
        return self.best(qmc.Sobol(options, scramble=False).random(FIRST_SAMPLES[options]))

    def refined(self, best):
        """Scanned, from the best of rounds of ever closer shapes."""
        random = np.random.default_rng(0)  # the same numbers for the same records
        for spread in SPREADS:
            about = inside(best.place + spread * random.standard_normal((SAMPLES, len(self.ranges))), self.ranges)
            best = max(best, self.best(about), key=lambda one: one.screened.evidence)
        return Scanned(best.cause, best.screened)
