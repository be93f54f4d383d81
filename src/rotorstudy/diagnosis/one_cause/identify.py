"""One effect of the library where it is known to be the cause: its shape and amplitudes, beside the rig's parameters.

The shape (the position, depth and angle of a crack) is searched in three steps. Many shapes are judged by their columns
at the motion that the records imply; the best are fitted by a few Gauss-Newton steps of all parameters together, the
best of those to convergence. Then shapes elsewhere are judged at the motion that was found, and fitted too: one of them
may be better, or explain the records as well, which is stated. A further cause of the same kind is searched likewise.
"""

from contextlib import suppress
from dataclasses import replace
from itertools import product

import numpy as np

from rotorstudy.diagnosis.one_cause.answer import SAME, Identified, identified, is_same
from rotorstudy.diagnosis.one_cause.over_forms import in_form
from rotorstudy.diagnosis.one_cause.shape_starts import first_starts, further_starts, starts_of_another
from rotorstudy.diagnosis.search.candidates import (
    candidate,
    form_ranges,
    formulas_of,
    freedom_of,
    shape_ranges,
    variants_of,
    with_vibration,
)
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.search.shape_fit import (
    CLOSELY,
    Work,
    fitted_from,
    point_of,
    ranges_of,
    reshaped,
    shaped,
)
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import CannotAct, NoConvergenceError, NoSteadyState, RotorstudyError
from rotorstudy.inference.fit import chi_square_p_value, fit
from rotorstudy.inference.levenberg_marquardt import HYPOTHESIS
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry, using

LOOK = replace(HYPOTHESIS, steps=2, first_damping=1e-2)  # the first steps from a start
FAR = replace(HYPOTHESIS, steps=4, first_damping=1e-2)  # from the best of these
PROMISING = (6, 10.0)  # fits that are taken further: at most that many, with less than so many times the least misfit
NEAR = (3, 3.0)  # fits that are taken further still, likewise
FURTHER = replace(HYPOTHESIS, steps=12)  # the steps of these
WITHIN = 20.0  # of the least misfit: fits that are taken to convergence
ROUNDS = 3  # of searches elsewhere, as long as they find something better
EXPLAINED = 0.05  # p-value below which it is searched again, at the values of the rig that fit best without the cause
SOMEWHERE = (0.5, 0.37, 0.61, 0.13, 0.89)  # fractions of the ranges: at some of them an effect may be unable to act


def identify_cause(
    spectrum: Spectrum, model: Model, effect: str, settings: Settings | None = None, count: int = 1
) -> Identified:
    """The shape and the amplitudes of an effect that is known to be the only cause.

    model  : with a value for every amplitude, without the effect
    effect : name of a plugin with options that enter nonlinearly, such as `transverse_crack`
    count  : how many of them there are
    raises : RotorstudyError for an unknown effect, one without such options, or one that cannot act on this rotor
    """
    with using(registry()):  # which is asked for at every shape
        return _identified(spectrum, model, effect, settings or Settings(), count)


def _identified(spectrum, model, effect, settings, count):
    """The Identified of an effect that is known to be the only cause, or of several."""
    spectrum = with_model_error(spectrum, settings)
    model = with_vibration(model, spectrum)
    work = Work(model, *base_model(model, settings), spectrum, settings)
    form = form_ranges(effect)
    kinds = _alternatives(work, effect, form if count == 1 else {})
    stated = fit(work.whole, spectrum, work.prior, steps=0)
    found = _also_elsewhere(work, kinds, _fitted(work, [s for kind in kinds for s in first_starts(work, stated, kind)]))
    if count == 1 and not _explains(work, found[0]):
        found = _searched_further(work, effect, kinds, stated, found)
    if count == 1:
        found = _sorted([*found, *_tried(work, _across(work, found[0]), CLOSELY)])
    for _ in range(count - 1):
        starts = [s for one in found[:1] for kind in kinds for s in starts_of_another(work, one, kind)]
        found = _also_elsewhere(work, kinds, _fitted(work, starts))
    if count > 1 and form:  # alone, one of some form imitates several
        found = _fitted(work, [_with_form(work, one) for one in found[: PROMISING[0]]])
    return identified(work, found[0], found)


def _across(work, one):
    """Starts on the other side of a node that the cause of a fit is near: a fit ends there, as moments have a kink."""
    (cause,), starts = shaped(work, one), []
    for i, (name, ends) in enumerate(ranges_of(work, cause).items()):
        std = cause.shape_std[name] / ends.slope(cause.shape[name])
        for way, end in zip((-1, 1), ends.between_breaks(point_of(work, cause)[i]), strict=True):
            point = point_of(work, cause)
            away = abs(point[i] - end)
            if 0 < end < 1 and ends.breaks and away < SAME * std:
                point[i] = end + way * max(away, std)
                with suppress(CannotAct):  # such as at another disc
                    starts.append(((reshaped(work, cause, point),), one.amplitudes))
    return starts


def _with_form(work, one):
    """(causes, amplitudes) of a fit, each cause with a form in the middle of its ranges."""
    causes = [in_form(work, cause) for cause in one.causes]
    means = [mean for cause in causes for mean, _ in cause.prior.values()]
    return causes, np.concatenate([one.amplitudes[: len(work.prior.names)], means])


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


def _searched_further(work, effect, kinds, stated, found):
    """The fits with more of them, as the best one does not explain the records: by formulas, then from other starts.

    A formula may explain by chance what a law of the physics explains in another shape, so it has to be far better.
    """
    formulas = _of_variants(work, effect, formulas_of(effect))
    published = _fitted(work, [s for kind in formulas for s in first_starts(work, stated, kind)], found[0].cost)
    if published and _explains(work, published[0]) and found[0].cost > NEAR[1] * published[0].cost:
        return _sorted([*found, *published])
    alone = fit(work.whole, work.spectrum, work.prior)
    found = _sorted([*found, *_fitted(work, [s for kind in kinds for s in first_starts(work, alone, kind)])])
    if not _explains(work, found[0]):
        found = _sorted([*found, *_fitted(work, _starts_everywhere(work, kinds, found))])
    return found if _explains(work, found[0]) else _sorted([*found, *published])


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
        if found[0] is best or is_same(work, found[0], best):
            return found
    return found


def _alternatives(work, effect, form):
    """The effect at every place with every alternative, in the middle of its shapes and of a form."""
    plugin = registry().get("effect", effect, "--cause")
    if not plugin.shape or plugin.acts_on_output:
        known = sorted(n for n, p in registry().plugins["effect"].items() if p.shape and not p.acts_on_output)
        raise RotorstudyError(f"{effect} has no shape to be searched; known causes with one: {', '.join(known)}")
    found = _of_variants(work, effect, variants_of(plugin.alternatives), form)
    if not found:
        raise RotorstudyError(f"{effect} cannot act on this rotor at any place")
    return found


def _of_variants(work, effect, variants, form=None):
    """The effect at every place in each variant, in the middle of its shapes, with a form or the default one."""
    plugin, structure, found = registry().get("effect", effect), work.rig.structure, []
    freedoms = (freedom_of(effect, any_form=False),) if form else ()
    for where, variant in product(plugin.places(structure, work.rig.sensors), variants):
        ranges = shape_ranges(effect, structure, where.get("node")) | (form or {})
        for x in SOMEWHERE:
            shape = {name: ends.value(x) for name, ends in ranges.items()}
            try:
                where_and_how = work.rig, effect, where, shape, "cause", work.settings.prior_width, variant
                found.append(candidate(*where_and_how, freedoms))
            except CannotAct:
                continue
            break
    return found
