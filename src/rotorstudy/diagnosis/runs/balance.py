"""Correction masses that balance a rotor: what the readings say of its vibration, and least squares.

The reading y at 1X is x(p) + J(p) u + f + errors of the probes + noise: the vibration x of the rig with the parameters
p, the influence J of unbalances u in the correction planes, of which nothing is known, and what other forces f cause:
unbalances elsewhere and a bow, which no rig file states. All of them are fitted to the readings together, within the
priors. How large the forces f are, the readings say: their standard deviations are averaged over a grid, by their
evidence. The corrections w are the least squares of the vibration fitted,

    x + J (u + w) + f,

weighted by the noise of y. Its posterior, to first order in p and second in p and u together, is the vibration left of
the machine as it was measured. The next reading is that of another run: with the errors of the probes, the parameters
that differ from run to run drawn anew, and noise.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.runs.balance_holes import Choice, Holes, chosen
from rotorstudy.diagnosis.runs.joint import GRAM, unbalance_term
from rotorstudy.diagnosis.runs.other_forces import FIRST, PAIRS, by_sizes, other_forces
from rotorstudy.diagnosis.runs.run_file import AddedUnbalance
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings, read_settings
from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.fit import fit
from rotorstudy.inference.linear import check_identifiable, invert
from rotorstudy.inference.prediction import carried_order, shown_and_slopes, with_model_error
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.conventions import Conventions, read_conventions
from rotorstudy.measurement.findings import Finding
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.rig import RigFile, read_rig

DRAWS, SEED = 1000, 1  # of the vibration left, for its interval
INTERVAL = (2.5, 50.0, 97.5)  # percent
WIDE = 1e2  # standard deviation of an unbalance in a plane: what it causes, over the vibration measured
NEGLIGIBLE = 1e-3  # probability of their sizes, over the largest


class Balancing(NamedTuple):
    """Corrections, and the vibration before and after."""

    corrections: np.ndarray  # (plane, part), real and imaginary part from the shaft's reference line, kg m
    covariance: np.ndarray  # (plane * part, plane * part), of the best ones, kg^2 m^2
    choices: list[Choice] | None  # (plane,) what is put into given holes; None if any correction can be made
    spectrum: Spectrum  # balanced, at 1X and -1X, without the runout that the rig states
    before: np.ndarray  # (speed, sensor), semi-major axis of the orbit, m
    after: np.ndarray  # (percentile, speed, sensor), its 2.5, 50 and 97.5 % points for the vibration left, m
    # (percentile, speed, sensor), those of the next run, without the runout that the rig states, m
    next_reading: np.ndarray


def balance_files(
    paths: Sequence[str | Path], rig: str | Path | RigFile, planes: Sequence[int | str], holes: Holes | None = None
) -> tuple[Balancing, list[Finding]]:
    """`balance` by records, tables of harmonics or one imported spectrum; with findings on them.

    rig : best as updated by `rotorstudy identify`
    """
    rig = read_rig(rig)
    settings, conventions = read_settings(rig.given, str(rig.path)), read_conventions(rig.given, str(rig.path))
    spectrum, model, findings = measured_spectrum(paths, rig)
    return balance(spectrum, model, planes, settings, conventions, holes), findings


def balance(
    spectrum: Spectrum,
    model: Model,
    planes: Sequence[int | str],
    settings: Settings,
    conventions: Conventions,
    holes: Holes | None = None,
) -> Balancing:
    """Unbalances to be added in some planes, so that the least 1X vibration is left.

    planes : nodes, or labels of nodes, where a correction mass can be put
    holes  : to which, with their weights, the corrections are restricted
    raises : RotorstudyError for records without 1X, and planes that the probes cannot tell apart
    """
    wanted = [n for n in (1, -1) if n in spectrum.harmonics]
    if 1 not in wanted:
        raise RotorstudyError("the records have no harmonic 1, which balancing needs; add it to 'harmonics:'")
    noise = spectrum.at_harmonics(wanted)
    spectrum = with_model_error(noise, settings)
    whole, prior = base_model(model, settings)
    whole, in_planes, others = _with_unbalances(whole, planes, conventions)
    known = _fitted(whole, spectrum, prior, in_planes, others)
    no_errors = {u.name: 0.0 for u in whole.output_unknowns}  # of the probes
    motion, influence = _shown(whole, spectrum, known.values | no_errors, in_planes)
    columns = spectrum.whitened(influence).T
    check_identifiable(columns, in_planes)
    normal = columns.T @ columns
    gain = invert(normal) @ columns.T
    corrections, choices = -gain @ spectrum.whitened(motion), None
    if holes:
        choices = chosen(holes, GRAM * corrections, normal / GRAM**2)
        corrections = np.concatenate([choice.total for choice in choices]) / GRAM
    unbalances = [known.values[name] for name in in_planes]
    balanced = known.values | dict(zip(in_planes, corrections + unbalances, strict=True))
    of_motion = np.array([name not in no_errors for name in known.names])
    slopes = _shown(whole, spectrum, balanced | no_errors, known.names)[1] * of_motion[:, None, None, None]
    spread = gain @ spectrum.whitened(slopes).T
    runout = _runout(model, whole, spectrum, known.values)
    draws = np.random.default_rng(SEED)
    moved = known.drawn(draws)
    vibration = _moved(whole, spectrum, known, balanced | no_errors, moved * of_motion)
    of_run = [name for one in settings.run_to_run for name in model.amplitudes_of(one) if name in prior.names]
    place, part = [known.names.index(name) for name in of_run], prior.part(of_run)
    moved[:, place] = part.mean - known.free[place] + draws.normal(size=(DRAWS, len(of_run))) @ part.factor.T
    reading = _moved(whole, spectrum, known, balanced, moved) - runout + _noise(noise, draws)
    measured = replace(spectrum, amplitude=spectrum.amplitude - runout)
    covariance = GRAM**2 * spread @ known.covariance @ spread.T
    after = (np.percentile(_axis(one), INTERVAL, axis=0) for one in (vibration, reading))
    return Balancing(
        GRAM * corrections.reshape(-1, 2), covariance, choices, measured, _axis(measured.amplitude), *after
    )


class Known(NamedTuple):
    """What the readings say of all parameters, in a model linearised about a fit, for each size of the other forces."""

    names: tuple[str, ...]  # (parameter,) that are free
    values: dict[str, float]  # of every amplitude of the model at the fit
    weights: np.ndarray  # (size,) posterior probability
    means: np.ndarray  # (size, parameter) from the fit
    roots: np.ndarray  # (size, parameter, parameter) R of the covariance R R^T

    @property
    def free(self):
        """(parameter,) values at the fit."""
        return np.array([self.values[name] for name in self.names])

    @property
    def covariance(self):
        """(parameter, parameter) of the mixture of all sizes."""
        off = self.means - self.weights @ self.means
        each = zip(self.weights, off, self.roots, strict=True)
        return sum(weight * (np.outer(one, one) + root @ root.T) for weight, one, root in each)

    def drawn(self, draws):
        """(draw, parameter) of the posterior, from the fit."""
        each = zip(draws.multinomial(DRAWS, self.weights), self.means, self.roots, strict=True)
        return np.concatenate([m + draws.normal(size=(n, len(m))) @ r.T for n, m, r in each])


def _with_unbalances(whole, planes, conventions):
    """The model with unbalances in each plane and other forces, all zero, and names: of the planes', of both others."""
    zero = [AddedUnbalance(node=node, unbalance_g_mm=0.0) for node in planes]
    if len(set(planes)) < len(planes):
        raise RotorstudyError(f"planes {', '.join(map(str, planes))}: give each once")
    terms = [
        unbalance_term(one, whole, conventions, f"correction {i}", f"plane {one.node}") for i, one in enumerate(zero, 1)
    ]
    terms += other_forces(whole.structure)
    names = [[unknown.name for unknown in term.unknowns] for term in terms]
    return whole.plus(*terms), [name for part in names[:-2] for name in part], names[-2:]


def _fitted(whole, spectrum, prior, names, others):
    """What is Known by a Spectrum, by a fit that is repeated with the most probable sizes of the other forces."""
    values = dict(zip(whole.names, whole.stated, strict=True)) | dict(zip(prior.names, prior.mean, strict=True))
    measured, units = np.sqrt(np.mean(np.abs(spectrum.amplitude) ** 2)), {}
    for part, share in (*(([name], WIDE) for name in names), *((part, 1.0) for part in others)):
        caused = np.linalg.norm(_shown(whole, spectrum, values, part)[1]) / np.sqrt(spectrum.amplitude.size)
        units |= dict.fromkeys(part, share * measured / (caused or 1.0))
    best, start = FIRST, None
    for _ in range(2):
        sizes = {name: size for part, size in zip(others, best, strict=True) for name in part}
        own = {name: (0.0, unit * sizes.get(name, 1.0)) for name, unit in units.items()}
        known = prior.plus(Prior.independent(own))
        found = fit(whole, spectrum, known, start)
        odds, scales, seen, right = by_sizes(found, others, best)
        best, start = PAIRS[np.argmax(odds)], found.theta
    weights = np.exp(odds - odds.max())
    likely = np.flatnonzero(weights > NEGLIGIBLE)
    each = [_posterior(seen * scale, right) for scale in scales[likely]]
    factors = [scale[:, None] * known.factor for scale in scales[likely]]
    means = np.array([f @ at for f, (at, _) in zip(factors, each, strict=True)]) + known.mean - found.free
    roots = np.array([f @ root for f, (_, root) in zip(factors, each, strict=True)])
    return Known(known.names, found.values, weights[likely] / weights[likely].sum(), means, roots)


def _posterior(seen, right):
    """Mean, and root R of the covariance R R^T, of these parameters."""
    root = np.linalg.inv(np.linalg.cholesky(np.eye(seen.shape[1]) + seen.T @ seen)).T
    return root @ (root.T @ (seen.T @ right)), root


def _moved(whole, spectrum, known, values, moved):
    """What the probes show (draw, speed, harmonic, sensor) where the parameters move (draw, parameter) from values."""
    forces = {u.name for u in whole.rotor_unknowns if all(entry.is_constant for entry in u.entries)}
    force = np.array([name in forces for name in known.names])
    shown, slopes = _shown(whole, spectrum, values, known.names)
    found = shown + np.tensordot(moved, slopes, 1)
    for i in np.flatnonzero(~force & moved.any(axis=0)):
        step = np.std(moved[:, i])
        there = _shown(whole, spectrum, values | {known.names[i]: values[known.names[i]] + step}, known.names)[1]
        turned = np.tensordot(moved[:, force], there[force] - slopes[force], 1)
        found += (moved[:, i] / step)[:, None, None, None] * turned
    return found


def _runout(model, whole, spectrum, values):
    """What probes of these values show without a motion of the shaft, of stated size: (speed, harmonic, sensor), m."""
    output = [u for term in model.terms if term.acts_on_output for u in term.unknowns]
    names = [u.name for u in output if not any(entry.reads_motion for entry in u.entries)]
    stated = dict(zip(model.names, model.stated, strict=True))
    return np.tensordot([stated[name] for name in names], _shown(whole, spectrum, values, names)[1], 1)


def _shown(model, spectrum, values, names):
    """What the probes show (speed, harmonic, sensor) at values of all amplitudes, and its derivatives by some."""
    theta = np.array([values[name] for name in model.names])
    shown, slopes = shown_and_slopes(model, spectrum, theta, names, carried_order(spectrum))
    return spectrum.shown(shown), spectrum.shown(slopes)


def _noise(spectrum, draws):
    """Draws (draw, speed, harmonic, sensor) of the noise of a spectrum, as its probes show it."""
    values, vectors = np.linalg.eigh(spectrum.covariance)  # which of a single probe has half the rank
    root = vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]
    parts = root @ draws.normal(size=(DRAWS, *root.shape[:-1], 1))
    real, imaginary = np.split(np.moveaxis(parts[..., 0], -1, -2), 2, axis=-2)
    return spectrum.shown(real + 1j * imaginary)


def _axis(amplitude):
    """Semi-major axis (..., speed, sensor) of the orbit of harmonics 1 and -1, m."""
    return np.abs(amplitude).sum(axis=-2)
