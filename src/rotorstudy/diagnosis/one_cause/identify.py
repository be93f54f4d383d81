"""One effect of the library where it is known to be the cause: its shape and amplitudes, beside the rig's parameters.

The shape (the position, depth and angle of a crack) is searched in three steps. Many shapes are judged by their columns
at the motion that the records imply; the best are fitted by a few Gauss-Newton steps of all parameters together, the
best of those to convergence. Then shapes elsewhere are judged at the motion that was found, and fitted too: one of them
may be better, or explain the records as well, which is stated. A further cause of the same kind is searched likewise.
"""

from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.one_cause.shape_starts import first_starts, further_starts, starts_of_another
from rotorstudy.diagnosis.search.candidates import Candidate, candidate, shape_ranges, with_vibration
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.search.shape_fit import CLOSELY, Fitted, Work, fitted_from, ranges_of
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import CannotAct, NoConvergenceError, NoSteadyState, RotorstudyError
from rotorstudy.inference.fit import chi_square_p_value, fit
from rotorstudy.inference.levenberg_marquardt import HYPOTHESIS
from rotorstudy.inference.linear import invert
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry

LOOK = replace(HYPOTHESIS, steps=2, first_damping=1e-2)  # the first steps from a start
FAR = replace(HYPOTHESIS, steps=4, first_damping=1e-2)  # from the best of these
PROMISING = (6, 10.0)  # fits that are taken further: at most that many, with less than so many times the least misfit
NEAR = (3, 3.0)  # fits that are taken further still, likewise
FURTHER = replace(HYPOTHESIS, steps=12)  # the steps of these
WITHIN = 20.0  # of the least misfit: fits that are taken to convergence
ROUNDS = 3  # of searches elsewhere, as long as they find something better
EXPLAINED = 0.05  # p-value below which it is searched again, at the values of the rig that fit best without the cause
LIKELY = 0.95  # of the region about the best shape whose misfit another one must have to be stated beside it
SAME = 3.0  # standard deviations of the shape, within which two fits are one
ALIKE = 0.1  # standard deviations of the data: predictions that are closer are the same
SOMEWHERE = (0.5, 0.37, 0.61, 0.13, 0.89)  # fractions of the ranges: at some of them an effect may be unable to act


class Identified(NamedTuple):
    """An effect as identified.

    causes     : (cause,) Candidate with its shape, and the standard deviations of that
    model      : Model with the effect in that shape
    names      : (parameter,) of the free amplitudes of the model, then of the options of the shapes
    theta      : (parameter,) their values, of options as fractions of their ranges
    covariance : (parameter, parameter) of the posterior
    p_value    : probability of a misfit as large by noise alone
    misfits    : alternatives of the effect (as a text) -> misfit and penalty beyond those of the best
    elsewhere  : other shapes (with their standard deviations) that explain the records as well, each (cause,)
    """

    causes: tuple[Candidate, ...]
    model: Model
    names: tuple[str, ...]
    theta: np.ndarray
    covariance: np.ndarray
    p_value: float
    misfits: dict[str, float]
    elsewhere: tuple[tuple[Candidate, ...], ...] = ()

    @property
    def cause(self) -> Candidate:
        """The first one."""
        return self.causes[0]


def identify_cause(
    spectrum: Spectrum, model: Model, effect: str, settings: Settings | None = None, count: int = 1
) -> Identified:
    """The shape and the amplitudes of an effect that is known to be the only cause.

    Parameters
    ----------
    spectrum : Spectrum
    model : Model
        With a value for every amplitude, without the effect.
    effect : str
        Name of a plugin with options that enter nonlinearly, such as `transverse_crack`.
    settings : Settings, optional
    count : int, optional
        How many of them there are.

    Returns
    -------
    Identified

    Raises
    ------
    RotorstudyError
        For an unknown effect, one without such options, or one that cannot act on this rotor.
    """
    settings = settings or Settings()
    spectrum = with_model_error(spectrum, settings)
    model = with_vibration(model, spectrum)
    work = Work(model, *base_model(model, settings), spectrum, settings)
    kinds = _alternatives(work, effect)
    stated = fit(work.whole, spectrum, work.prior, steps=0)
    found = _also_elsewhere(work, kinds, _fitted(work, [s for kind in kinds for s in first_starts(work, stated, kind)]))
    if count == 1 and not _explains(work, found[0]):
        alone = fit(work.whole, spectrum, work.prior)
        found = _sorted([*found, *_fitted(work, [s for kind in kinds for s in first_starts(work, alone, kind)])])
    if count == 1 and not _explains(work, found[0]):
        found = _sorted([*found, *_fitted(work, _starts_everywhere(work, kinds, found))])
    for _ in range(count - 1):
        starts = [s for one in found[:1] for kind in kinds for s in starts_of_another(work, one, kind)]
        found = _also_elsewhere(work, kinds, _fitted(work, starts))
    return identified(work, found[0], found)


def _explains(work, one):
    return chi_square_p_value(one.cost, 2 * work.spectrum.amplitude.size) >= EXPLAINED


def _fitted(work, starts, least=np.inf):
    """Fits from (causes, amplitudes), the best first: all by a few steps, the best to convergence.

    At the stated values of the rig its parameters do not imitate the cause.

    least : misfit of a fit that is known
    """
    looked = _tried(work, starts, LOOK)
    if not looked and not np.isfinite(least):
        raise RotorstudyError("no shape of the cause gives a steady motion of this rotor")
    least = min([least, *(one.cost for one in looked)])
    begun = _tried(work, [_start(one) for one in looked[: PROMISING[0]] if one.cost <= PROMISING[1] * least], FAR)
    least, found = min([least, *(one.cost for one in begun)]), []
    for one in begun[: NEAR[0]]:
        if one.cost <= NEAR[1] * least:
            found += _tried(work, [_start(one)], FURTHER)
            least = min([least, *(known.cost for known in found)])
            if found and found[-1].cost <= least + WITHIN and not found[-1].minimum.converged[0]:
                found += _tried(work, [_start(found[-1])], CLOSELY)
    return _sorted([*found, *begun, *looked])


def _starts_everywhere(work, kinds, found):
    """Starts at all positions, in the alternatives that come near the best fit."""
    (gone,), close = found[0].causes, _close(found, NEAR[1] * found[0].cost)
    return [s for k in kinds if k.variant in close for s in further_starts(work, found[0], gone, k, (), True)]


def _close(found, reach):
    """Alternatives of the fits whose misfit and penalty are within reach."""
    return [one.causes[-1].variant for one in found if one.cost <= reach]


def _start(one):
    return one.causes, one.amplitudes


def _sorted(found):
    return sorted(found, key=lambda one: one.cost)


def _tried(work, starts, convergence):
    """Fits from those starts at which the rotor has a steady state, the best first."""
    found = []
    for causes, amplitudes in starts:
        try:
            found.append(fitted_from(work, causes, amplitudes, convergence))
        except (CannotAct, NoSteadyState, NoConvergenceError):  # in that shape
            continue
    return _sorted(found)


def _also_elsewhere(work, kinds, found):
    """The fits with those of shapes elsewhere, judged at the motion of the best one, the best first."""
    for _ in range(ROUNDS):
        best, known = found[0], [one for one in found if one.minimum.converged[0]]
        close = _close(found, NEAR[1] * best.cost if _explains(work, best) else np.inf)
        starts = [
            start
            for gone in best.causes
            for kind in kinds
            if kind.variant in close
            for start in further_starts(work, best, gone, kind, known)
        ]
        found = _sorted([*found, *_fitted(work, starts, best.cost)])
        if found[0] is best or _is_same(work, found[0], best):
            return found
    return found


def _is_same(work, one, other):
    """Whether two fits have the same alternatives, and their shapes agree within their uncertainty, in any order.

    Where they predict the same, a half turn counts as none: a slot looks the same from both sides.
    """
    if one.variant != other.variant:
        return False
    data = slice(2 * work.spectrum.amplitude.size)
    alike = np.abs(one.minimum.residual[0, data] - other.minimum.residual[0, data]).max() < ALIKE
    pairs = (sorted(shaped(work, fitted), key=lambda cause: tuple(cause.shape.values())) for fitted in (one, other))
    for a, b in zip(*pairs, strict=True):
        for name, ends in ranges_of(work, a).items():
            turn, off = (ends.high - ends.low) / (2 if alike else 1), abs(a.shape[name] - b.shape[name])
            off = min(off % turn, -off % turn) if ends.goes_around else off
            if off > SAME * max(a.shape_std[name], b.shape_std[name]):
                return False
    return True


def _alternatives(work, effect):
    """The effect at every place with every alternative, in the middle of its shapes."""
    plugin, structure = registry().get("effect", effect, "--cause"), work.rig.structure
    if not plugin.shape or plugin.acts_on_output:
        known = sorted(n for n, p in registry().plugins["effect"].items() if p.shape and not p.acts_on_output)
        raise RotorstudyError(f"{effect} has no shape to be searched; known causes with one: {', '.join(known)}")
    chosen = product(*(known() for known in plugin.alternatives.values()))
    variants = [dict(zip(plugin.alternatives, values, strict=True)) for values in chosen]
    found = []
    for where, variant in product(plugin.places(structure, work.rig.sensors), variants):
        ranges = shape_ranges(effect, structure, where.get("node"))
        for x in SOMEWHERE:
            shape = {name: ends.value(x) for name, ends in ranges.items()}
            try:
                found.append(candidate(work.rig, effect, where, shape, "cause", work.settings.prior_width, variant))
            except CannotAct:
                continue
            break
    if not found:
        raise RotorstudyError(f"{effect} cannot act on this rotor at any place")
    return found


def shaped(work: Work, one: Fitted) -> tuple[Candidate, ...]:
    """The causes of a fit, with the standard deviations of their shapes."""
    std = np.sqrt(np.diag(_covariance(one)))[len(one.amplitudes) :]
    found, first = [], 0
    for cause in one.causes:
        ranges, own = ranges_of(work, cause), std[first : first + len(cause.shape)]
        spread = {n: ranges[n].slope(cause.shape[n]) * x for n, x in zip(cause.shape, own, strict=True)}
        found.append(cause._replace(shape_std=spread))
        first += len(own)
    return tuple(found)


def _covariance(one):
    return invert(one.minimum.jacobian[0].T @ one.minimum.jacobian[0])


def identified(work: Work, best: Fitted, tried: list[Fitted]) -> Identified:
    """The Identified of a fit, the best of all that were tried."""
    from scipy.stats import chi2

    names = [*work.prior.names, *(name for cause in best.causes for name in cause.names)]
    names += [name for cause in best.causes for name in cause.shape]
    misfits = {}
    for one in tried:
        misfits[one.variant] = min(misfits.get(one.variant, np.inf), one.cost - best.cost)
    least, elsewhere = best.cost + chi2.isf(1 - LIKELY, sum(len(cause.shape) for cause in best.causes)), [best]
    for one in tried:
        if one.cost <= least and not any(_is_same(work, one, known) for known in elsewhere):
            elsewhere.append(one)
    return Identified(
        shaped(work, best),
        work.whole.plus(*(cause.term for cause in best.causes)),
        tuple(names),
        best.minimum.theta[0],
        _covariance(best),
        chi_square_p_value(best.cost, 2 * work.spectrum.amplitude.size),
        misfits,
        tuple(shaped(work, one) for one in elsewhere[1:]),
    )


def estimates_of(found: Identified) -> list[tuple[str, float, float, str]]:
    """(name, value, standard deviation, unit) of the shapes of the causes, what follows, and their amplitudes.

    Parameters
    ----------
    found : Identified

    Returns
    -------
    list of tuple
    """
    rows, std = [], np.sqrt(np.diag(found.covariance))
    for number, cause in enumerate(found.causes, start=1):
        more = f"[{number}]" if len(found.causes) > 1 else ""
        rows += [(name + more, *one) for name, *one in shape_of(found, cause)]
        place = [found.names.index(name) for name in cause.names]
        units = [unknown.unit for unknown in cause.term.unknowns]
        names = (name.replace(f"[{cause.term.label}]", more) for name in cause.names)
        rows += zip(names, found.theta[place].tolist(), std[place].tolist(), units, strict=True)
    return rows


def shape_of(found: Identified, cause: Candidate) -> list[tuple[str, float, float, str]]:
    """(name, value, standard deviation, unit) of the shape of a cause, and what follows from it."""
    rows = [(name, value, cause.shape_std[name], _unit(name)) for name, value in cause.shape.items()]
    stated = registry().get("effect", cause.effect).stated
    for name, (option, factor) in stated(found.model.structure, **cause.shape).items() if stated else ():
        rows.append((name, factor * cause.shape[option], factor * cause.shape_std[option], _unit(name)))
    return rows


def _unit(name):
    """Unit of an option, by the end of its name."""
    return next((unit for unit in ("rad", "m") if name.endswith(f"_{unit}")), "1")
