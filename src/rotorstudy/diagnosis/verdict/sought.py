"""What was sought in the speeds measured, and what the speeds held out say of it."""

import logging
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.explanations import LIKELY_OUTSIDE, Search
from rotorstudy.diagnosis.search.film_error import with_film_error
from rotorstudy.diagnosis.search.form_by_law import with_other_laws
from rotorstudy.diagnosis.search.search import begin, is_asked_to_stop, search
from rotorstudy.diagnosis.verdict.cause_words import force_in_words
from rotorstudy.diagnosis.verdict.held_out import HeldOutMisfit, expected_of, held_out_misfit, with_held_out
from rotorstudy.diagnosis.verdict.result import ChainHypothesis
from rotorstudy.diagnosis.verdict.wrong_convention import chain_hypothesis
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.units import p_value, percent

log = logging.getLogger(__name__)


class Sought(NamedTuple):
    """A search and what the held-out speeds say of it; fields of these are None where no speed is held out."""

    found: Search  # by the speeds fitted
    measured: Spectrum  # fitted, without the model error
    held: Spectrum | None  # of the speeds held out, with the model error
    judged: Search  # with the held-out speeds in its odds
    chain: ChainHypothesis | None  # what explains the records better, or None
    expected: Spectrum | None  # the same with the error of the causes, too
    surprise: HeldOutMisfit | None  # misfit of the held-out speeds, with no larger an error of form than the fit has
    # Spectrum of the speeds that were held out at first, and surprised the fit; None if there are none
    surprised: Spectrum | None = None

    def is_surprised(self, significance):
        """Whether the speeds held out show something of what is missing that the others do not."""
        known = self.judged.stopped or self.chain or self.judged.outside_probability > LIKELY_OUTSIDE
        return self.surprise is not None and self.surprise.p_value < significance and not known


def seek(measured, held, model, settings, failed):
    """The Sought of two Spectra, measured and held out."""
    kept = settings.model_copy(update={"leave_out": [*settings.leave_out, *failed]})
    begun, moving = _begun(model, with_model_error(measured, kept), kept)
    held = None if held is None else with_film_error(with_model_error(held, settings), *moving)
    found = search(begun)
    found.failures.update(failed)
    return _judged(Sought(found, measured, held, found, None, None, None))


def without_the_best(one: Sought) -> Sought:
    """The same without its best explanation, with which the machine could not run as it was measured."""
    del one.found.found[one.judged.best.kind]
    return _judged(one)


def _judged(one):
    """The same with the held-out speeds in its odds."""
    found, held, chain = one.found, one.held, None
    try:
        if found.rig.before is None and not found.stopped:  # conventions are shared by both states
            log.info("testing whether conventions of the records are wrongly stated")
            chain = chain_hypothesis(found, one.measured)
    except KeyboardInterrupt as stop:
        if not is_asked_to_stop(stop):
            raise
        found = replace(found, stopped=True)
    if chain:  # values fitted to records read wrongly say nothing of the rig
        judged = replace(found, upheld=False, unstable=np.zeros_like(found.unstable))
    else:
        judged = with_other_laws(with_held_out(found, held))
    if held is None:
        return one._replace(judged=judged, chain=chain)
    best = judged.best
    expected, usual = (expected_of(best, judged, held, largest=is_largest) for is_largest in (True, False))
    surprise = held_out_misfit(judged, best, usual)
    return one._replace(judged=judged, chain=chain, expected=expected, surprise=surprise)


def _begun(model, spectrum, settings):
    """The Search in which nothing was searched yet, and the model and values whose motion gives the error of films."""
    begun = begin(model, with_film_error(spectrum, model), settings)
    log.info("%s", first_answer(begun))
    force = next((one.fitted for one in begun.free_forces if one.fitted is not None), None)
    if force is None or not begun.base.is_rejected(settings.significance):
        return begun, (model,)
    moving = force.model, force.theta
    wider = with_film_error(spectrum, *moving)
    return (begun if wider is spectrum else begin(model, wider, settings)), moving


def first_answer(work: Search) -> str:
    """Whether the rig explains the records, and where one force would explain most of the rest, before the search."""
    if not work.base.is_rejected(work.settings.significance):
        return f"first answer: the rig explains the records (residual: {p_value(work.base.p_value)})"
    left = np.sqrt(work.base.cost / work.spectrum.data_count)
    said = f"first answer: the rig leaves {left:.3g} standard deviations (rms) unexplained"
    if not work.free_forces:
        return said
    best = work.free_forces[0]
    share = percent(min(best.left / work.base.cost, 1.0) ** 0.5)
    return f"{said}; {force_in_words(best)} would leave {share} of it, the most probable place"
