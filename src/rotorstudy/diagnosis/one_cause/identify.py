"""One effect of the library where it is known to be the cause: its shape and amplitudes, beside the rig's parameters.

Its shapes are scanned as in a diagnosis: at the motion that the records imply, then at the motion that was found, as
one elsewhere may be better, or explain the records as well, which is stated. The best of a scan are fitted by a few
Gauss-Newton steps of all parameters together, the best of those to convergence. A further cause of the same kind is
searched likewise.
"""

from contextlib import suppress
from dataclasses import replace
from itertools import chain, product, zip_longest

import numpy as np

from rotorstudy.diagnosis.one_cause.answer import Identified, identified, is_same
from rotorstudy.diagnosis.one_cause.over_forms import in_form
from rotorstudy.diagnosis.search import candidates
from rotorstudy.diagnosis.search.free_force import FREE_FORCE
from rotorstudy.diagnosis.search.moves import in_best_shapes
from rotorstudy.diagnosis.search.search import begin
from rotorstudy.diagnosis.search.shape_fit import (
    CLOSELY,
    check_together,
    fitted_from,
    point_of,
    reshaped,
)
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import CannotAct, NoConvergenceError, NoSteadyState, RotorstudyError
from rotorstudy.inference.levenberg_marquardt import HYPOTHESIS
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry, using
from rotorstudy.threads import on_one_thread

MOST_SPEEDS = 40  # of the first scans, as time and memory of free forces grow with their number
STARTS = 3  # shapes of a scan of each law and place that are fitted
LOOK = replace(HYPOTHESIS, steps=4, first_damping=1e-2)  # the first steps from a start
FURTHER = (4, 3.0)  # fits that are taken to convergence: at most that many, with less than so many times the least
ROUNDS = 3  # of searches elsewhere, as long as they find something better
EXPLAINED = 0.05  # p-value below which it is searched by formulas, and at another motion
SOMEWHERE = (0.5, 0.37, 0.61, 0.13, 0.89)  # fractions of the ranges: at some of them an effect may be unable to act


@on_one_thread
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
        plugin, effects = registry().get("effect", effect, "--cause"), registry().plugins["effect"]
        if not plugin.shape or plugin.acts_on_output:
            known = sorted(name for name, p in effects.items() if p.shape and not p.acts_on_output)
            raise RotorstudyError(f"{effect} has no shape to be searched; known causes with one: {', '.join(known)}")
        settings = (settings or Settings()).model_copy(update={"leave_out": [*effects]})
        spectrum = with_model_error(spectrum, settings)
        few = np.unique(np.linspace(0, len(spectrum.speed) - 1, MOST_SPEEDS).round().astype(int))
        return _identified(begin(model, spectrum.at_speeds(few), settings), spectrum, plugin, count)


def _identified(begun, spectrum, plugin, count):
    """The Identified of a cause, or of several; begun : Search of some speeds, at which shapes are first scanned."""
    work = replace(begun, spectrum=spectrum)
    laws = _alternatives(work, plugin, candidates.variants_of(plugin.alternatives))
    if not laws:
        raise RotorstudyError(f"{plugin.name} cannot act on this rotor at any place")
    laws = [in_form(work, one) for one in laws] if count == 1 else laws
    found = _fitted(work, _first_starts(begun, laws))
    if count == 1 and not _explains(found[0]):
        found = _searched_further(work, begun, plugin, laws, found)
    else:
        found = _also_elsewhere(work, laws, found)
    for number in range(2, count + 1):
        more, known = _labelled(work, laws, f"cause {number}"), _by_turns(found)[: FURTHER[0]]
        beside = [start for one in known for start in _starts(work, one.fit, more, one.causes)]
        found = _also_elsewhere(work, laws, _fitted(work, beside))
    if count > 1 and candidates.form_ranges(plugin.name):  # alone, one of some form imitates several
        found = _fitted(work, [_with_form(work, one) for one in found[: FURTHER[0]]])
    return identified(work, found[0], found)


def _searched_further(work, begun, plugin, laws, found):
    """The fits with more of them, as the best one does not explain the records: by formulas, then at another motion.

    A formula may explain by chance what a law of the physics explains in another shape, and has to be far better.
    """
    formulas = _alternatives(work, plugin, candidates.formulas_of(plugin.name))
    published = _fitted(work, _first_starts(begun, formulas), found)
    if _explains(published[0]) and found[0].fit.cost > FURTHER[1] * published[0].fit.cost:
        return published
    found = _also_elsewhere(work, laws, _fitted(work, _starts(begun, begun.base, laws), found))
    return found if _explains(found[0]) else _sorted([*found, *published])


def _first_starts(work, laws):
    """Starts at the motion with the most likely free force, at which a cause of any size is exact."""
    force = next((one.fitted for one in work.free_forces if one.fitted is not None), None)
    return _starts(work, force, laws, without=(FREE_FORCE,)) if force else _starts(work, work.base, laws)


def _starts(work, fitted, laws, others=(), without=()):
    """(causes, amplitudes) of the best shapes of a cause beside others, by its columns at a fit but some amplitudes."""
    kept, found, by_law = [name not in without for name in fitted.names], [], {}
    for cause in laws:
        by_law.setdefault(tuple(cause.variant.values()), []).append(cause)
    scans = [in_best_shapes(work, fitted, alike, without=without, most=STARTS) for alike in by_law.values()]
    for cause, one in chain.from_iterable(scans):
        with suppress(CannotAct):
            check_together(work, (*others, cause))
            found.append(((*others, cause), np.concatenate([fitted.free[kept], one.start])))
    return found


def _as_known(work, causes, amplitudes):
    """A start with all amplitudes that are known, those of the rig and of causes of known size, at what is known."""
    names = [*work.prior.names, *(name for cause in causes for name in cause.names)]
    known = dict(zip(work.prior.names, work.prior.mean, strict=True))
    known |= {name: mean for cause in causes if cause.fixed for name, (mean, _) in cause.prior.items()}
    return causes, np.array([known.get(name, value) for name, value in zip(names, amplitudes, strict=True)])


def _labelled(work, laws, label):
    return [reshaped(work, cause, point_of(work, cause), label) for cause in laws]


def _with_form(work, one):
    """(causes, amplitudes) of a fit, each cause with a form in the middle of its ranges."""
    causes = [in_form(work, cause) for cause in one.causes]
    means = [mean for cause in causes for mean, _ in cause.prior.values()]
    return causes, np.concatenate([one.fit.free[: len(work.prior.names)], means])


def _explains(one):
    return one.fit.p_value >= EXPLAINED


def _fitted(work, starts, known=()):
    """Fits from (causes, amplitudes), and those known, the best first: all by a few steps, the best to convergence."""
    found = _tried(work, starts, LOOK)
    if not found and not known:
        raise RotorstudyError(next(iter(work.broken), "no shape of the cause gives a steady motion of this rotor"))
    least, close = min(one.fit.cost for one in [*found, *known]), []
    for one in _by_turns(found):
        near = one.fit.cost <= FURTHER[1] * least and len(close) < FURTHER[0]
        if near and not any(is_same(work, one, other) for other in [*close, *known]):
            close += _tried(work, [(one.causes, one.fit.free)], CLOSELY)
            least = min([least, *(other.fit.cost for other in close)])
    return _sorted([*close, *known, *found])


def _by_turns(found):
    """The best fit by each set of laws, then the second best of each, and so on, so that none crowds out another."""
    by_laws = {}
    for one in found:
        by_laws.setdefault(one.variant, []).append(one)
    return [one for some in zip_longest(*by_laws.values()) for one in some if one]


def _sorted(found):
    return sorted(found, key=lambda one: one.fit.cost)


def _tried(work, starts, convergence):
    """Fits from those starts at which the rotor has a steady state, the best first."""
    found = []
    for causes, amplitudes in starts:
        with suppress(CannotAct, NoSteadyState, NoConvergenceError):  # in that shape
            found.append(fitted_from(work, causes, amplitudes, convergence))
    return _sorted(found)


def _also_elsewhere(work, laws, found):
    """The fits with those of shapes elsewhere, judged at the motion of the best one, the best first."""
    for _ in range(ROUNDS):
        best, starts = found[0], []
        reach = FURTHER[1] * best.fit.cost if _explains(best) else np.inf
        close = [one.causes[-1].variant for one in found if one.fit.cost <= reach]
        near = [cause for cause in laws if cause.variant in close]
        for gone in best.causes:
            others = tuple(one for one in best.causes if one is not gone)
            starts += _starts(work, best.fit, _labelled(work, near, gone.term.label), others, gone.names)
        if len(best.causes) > 1 and not _explains(best):  # what the rig took up of one may hold the others there
            starts += [_as_known(work, *start) for start in starts]
        found = _fitted(work, starts, found)
        if found[0] is best or is_same(work, found[0], best):
            return found
    return found


def _alternatives(work, plugin, variants):
    """The effect at every place in each variant, in the middle of its shapes."""
    structure, found, width = work.rig.structure, [], work.settings.prior_width
    for where, variant in product(plugin.places(structure, work.rig.sensors), variants):
        ranges = candidates.shape_ranges(plugin.name, structure, where.get("node"))
        for x in SOMEWHERE:
            shape = {name: ends.value(x) for name, ends in ranges.items()}
            with suppress(CannotAct):
                found.append(candidates.candidate(work.rig, plugin.name, where, shape, "cause", width, variant))
                break
    return found
