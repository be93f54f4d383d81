"""What could hide: for every fault that operators fear, the size that would have been seen.

The rig with a fault of some size predicts records. The rig without it is fitted to these, as a diagnosis would: other
clearances and oil may look like the fault, and the model error grows with the vibration. What is left, in standard
deviations of the records, is how clearly the fault is seen. It is found with a probability of 95 % where that exceeds
what its odds need by `evidence.POWER`.
"""

import logging
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from functools import cache, partial
from itertools import product

import numpy as np

from rotorstudy.diagnosis.search.candidates import candidate
from rotorstudy.diagnosis.search.explanations import LEAST_LOG_ODDS, Search
from rotorstudy.diagnosis.search.search import is_asked_to_stop
from rotorstudy.diagnosis.search.shape_fit import at_numbers
from rotorstudy.diagnosis.verdict.evidence import POWER
from rotorstudy.diagnosis.verdict.findings import told
from rotorstudy.diagnosis.verdict.next_run import with_term
from rotorstudy.diagnosis.verdict.result import Hidden
from rotorstudy.diagnosis.verdict.words import OF_DIAMETER, summary
from rotorstudy.errors import NoSteadyState, RotorstudyError
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import carried_order, model_error_variance, predicted
from rotorstudy.model.registry import registry, using
from rotorstudy.response.harmonic import harmonic_response

log = logging.getLogger(__name__)

STEPS = 7  # of the size, towards the one that is just seen
CLOSE = 1.2  # of the clearness that is needed: near enough; what a linearised fit leaves is off by less
MOST_PLACES = 20  # of a fault, evenly along the shaft: nearer nodes of a fine mesh are alike
LITTLE = 0.1  # of the cost: less to gain by a further step is known well enough from the step itself
SMALLEST = 1e-3  # of the largest size: a smaller one is stated as that
NARROWED = 30.0  # by which the data narrow the range of a searched shape option: its share in the odds
UNITS = {"depth_ratio": OF_DIAMETER}


def what_could_hide(work: Search) -> Iterator[Hidden]:
    """The size of every feared fault that is seen with 95 % at its places, by a search that is over."""
    tried = {c.effect for c in work.candidates}
    base, spectrum = work.base, work.spectrum
    sound = spectrum.shown(predicted(base.model, spectrum, base.theta))
    cost = fit(base.model, spectrum.with_amplitude(sound), base.prior, start=base.theta).cost
    vibration = _vibration(work)
    for name, plugin in sorted(registry().plugins["effect"].items()):
        if plugin.feared and name in tried and name not in work.failures:
            yield from _of_fault(work, plugin, vibration, partial(_clearness, work, sound, cost))


def _vibration(work):
    """{node: vibration against the casing, m} of the fitted rig, of all harmonics but 0X at the median speed."""
    base, spectrum, structure = work.base, work.spectrum, work.base.model.structure
    moving = spectrum.harmonics[spectrum.harmonics != 0]
    if not len(moving):
        return dict.fromkeys(structure.nodes, 0.0)
    motion = harmonic_response(base.model, spectrum.speed, moving, base.theta, order=carried_order(spectrum))
    size = np.linalg.norm([motion @ structure.against_casing(node) for node in structure.nodes], axis=-1)
    return dict(zip(structure.nodes, np.median(size, axis=-1).tolist(), strict=True))


def with_hidden(diagnosis):
    """A Diagnosis whose verdict says what could hide, also in its summary."""
    if diagnosis.search.stopped:
        return diagnosis
    log.info("how large feared faults must be to be seen")
    rows, findings = [], diagnosis.verdict.findings
    try:
        with using(registry()):
            for row in what_could_hide(diagnosis.search):
                rows.append(row)
    except KeyboardInterrupt as stop:
        if not is_asked_to_stop(stop):
            raise
        findings = (*findings, told("limits stopped", "diagnosis"))
    verdict = diagnosis.verdict.model_copy(update={"hidden": tuple(rows), "findings": findings})
    said = summary(verdict, diagnosis.search.rig.before is not None)
    return replace(diagnosis, verdict=verdict.model_copy(update={"summary": said}))


def _of_fault(work, plugin, vibration, seen):
    """A Hidden for each place of a fault."""
    feared, structure = plugin.feared, work.rig.structure
    places = [(where, where) for where in plugin.places(structure, work.rig.sensors)]
    if feared.places is not None:
        places = feared.places(structure)
    tried = np.linspace(0, len(places) - 1, min(len(places), MOST_PLACES)).astype(int)
    begin = near = feared.largest, 3.0 if feared.size in plugin.shape else 1.0  # a size, and how its clearness grows
    for where, options in (places[i] for i in tried):
        sizes, there = [], {"vibration": vibration[where["node"]]} if "node" in where else {}
        with suppress(RotorstudyError):  # it cannot act there
            shape = {
                name: factor * (there.get(scale) or structure.scales.usual(scale, where.get("node")))
                for name, (factor, scale) in feared.shape.items()
            }
            for worst in (dict(zip(feared.worst, chosen, strict=True)) for chosen in product(*feared.worst.values())):
                one, scale, unit = _just_seen(work, plugin, {**options, **shape, **worst}, seen, near)
                near = one or begin
                sizes.append(one and one[0] * scale)
                if one is None:
                    break
        if sizes:
            size = None if None in sizes else max(sizes)
            row = {"parameter": feared.size, "size": size, "unit": unit}
            yield Hidden.of(plugin.name, where, structure, **row, measure=feared.measure if size is None else "")


def _just_seen(work, plugin, options, seen, near):
    """Size that is seen with 95 % at a place, with its growth, or None; its scale and unit; near : one elsewhere."""
    feared = plugin.feared
    own = {name: value for name, value in options.items() if name != feared.size}
    rig = at_numbers(work, work.base.free).rig
    is_option = feared.size in plugin.shape

    def cause(size):
        return candidate(rig, plugin.name, {**own, feared.size: size} if is_option else own, label="hidden")

    largest = cause(feared.largest)
    (parameter,) = [p for p in largest.term.parameters if is_option or p.name == feared.size][:1]
    unit = UNITS.get(feared.size, "1") if is_option else parameter.unit
    scale = 1.0 if is_option else parameter.typical
    alike = [c for c in work.candidates if c.effect == plugin.name]
    here = next((c for c in alike if c.where.items() <= options.items()), alike[0])
    gain = work.prior_odds.even_odds_gain(here) + 2 * len(plugin.shape) * np.log(NARROWED)
    needed = np.sqrt(2 * LEAST_LOG_ODDS + gain) + POWER

    @cache
    def clearness(size, fitted):
        one = cause(size) if is_option else largest
        values = {p.name: p.default or 0.0 for p in one.term.parameters}
        values[parameter.name] = parameter.typical if is_option else size * scale
        return seen(replace(one.term, values=values), fitted)

    found = _smallest(partial(clearness, fitted=False), needed, near, feared.largest, parameter)
    seen_at = clearness(found[0] if found else feared.largest, fitted=found is not None)
    is_confirmed, is_out_of_reach = needed <= seen_at <= CLOSE**2 * needed, not found and seen_at < needed / CLOSE
    if not (is_confirmed or is_out_of_reach):
        near = found or (feared.largest, near[1])
        found = _smallest(partial(clearness, fitted=True), needed, near, feared.largest, parameter)
    return found, scale, unit


def _smallest(clearness, needed, near, largest, parameter):
    """About the smallest size that is clear enough, and the exponent of its growth; None if the largest is not.

    By secants of the logarithms, as the clearness grows about as a power of the size.
    """
    (size, exponent), seen, before = near, None, None
    for _ in range(STEPS):
        clear = clearness(size)
        if before and 0 < clear < np.inf and 0 < before[1] < np.inf and clear != before[1]:
            exponent = float(np.clip(np.log(clear / before[1]) / np.log(size / before[0]), 0.3, 6.0))
        seen = size if clear >= needed else seen
        if needed <= clear <= CLOSE * needed:
            break
        factor = 2.0 if clear == 0 else 0.5  # of what is not seen at all, or leaves no steady state
        if 0 < clear < np.inf:
            factor = (np.sqrt(CLOSE) * needed / clear) ** (1 / exponent)
        factor = max(factor, 0.5) if parameter.force else factor  # a stiffer contact may be seen less
        other = max(min(size * factor, seen or largest), SMALLEST * largest)
        if other in (size, seen):
            break
        before, size = (size, clear), other
    seen = largest if seen is None and clearness(largest) >= needed else seen
    return seen and (seen, exponent)


def _clearness(work, sound, cost, term, fitted):
    """How clearly a term is seen once the rig is fitted to records that have it, in standard deviations of these.

    It is the root of what no values of the rig explain, more than of `sound` records without the term; infinite where
    there is no steady state with it. The rig is `fitted`, or linearised, which takes a fraction of the time.
    """
    base, spectrum = work.base, work.spectrum
    faulty = with_term(base, term)
    try:
        shown = spectrum.shown(predicted(faulty.model, spectrum, faulty.theta))
    except NoSteadyState:
        return np.inf
    errors = [model_error_variance(one, spectrum.harmonics, work.settings) for one in (shown, sound)]
    records = spectrum.with_amplitude(shown).with_error(np.maximum(errors[0] - errors[1], 0.0))
    found = fit(base.model, records, base.prior, start=base.theta, steps=1 if fitted else 0)
    if fitted and found.gain > LITTLE * found.cost:
        found = fit(base.model, records, base.prior, start=found.theta)
    return float(np.sqrt(max(found.cost - found.gain - cost, 0.0)))
