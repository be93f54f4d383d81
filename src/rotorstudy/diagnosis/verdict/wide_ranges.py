"""Which part of a rig would explain records that it does not: bearings, foundation, runout, by a fit with each free."""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.fit import Fit, fit, residual_share
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.entries import Entry
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_numbers import bearings_of
from rotorstudy.model.terms import Parameter, Term
from rotorstudy.units import percent

WIDE = {"the bearings": 0.3, "the foundation": 1.0}  # relative standard deviations that hold for nearly every machine
STIFFER = (0.5, 2.0)  # of a foundation: its resonances lie elsewhere then, and no step of a fit leads across them
LEAST_OFFSET = 1e-3  # of the largest harmonic
EXPLAINS = 0.5  # of the excess error (rms), which a part that explains it leaves at most
MOVED = 3  # numbers that are said


def wide_ranges(model: Model, spectrum: Spectrum, settings: Settings, stated: Fit | None = None) -> str:
    """What a rig leaves unexplained with wide ranges of its bearings or foundation, or any runout, as a sentence.

    Empty for a rig without uncertain bearings or foundation. The spectrum has the model error.
    """
    parts, rows = _parts(model), spectrum.data_count
    stated = stated if stated or not parts else _fitted(*base_model(model, settings), spectrum, {})
    if not parts or stated is None:
        return ""
    free = {}
    for part, numbers in parts.items():
        wider = settings.model_copy(update={"uncertainty": settings.uncertainty | numbers})
        free[part] = _fitted(*base_model(replace(model, uncertainty=None), wider), spectrum, stated.values, numbers)
    whole, prior = base_model(model, settings)
    offset, known = any_offset(spectrum)
    free["a runout"] = _fitted(whole.plus(offset), prior.plus(known), spectrum, stated.values)
    costs = {part: found.cost for part, found in free.items() if found}
    each = ", ".join(f"with {part} free {np.sqrt(costs[part] / rows):.3g}" for part in sorted(costs, key=costs.get))
    said = f"As stated the rig leaves {np.sqrt(stated.cost / rows):.3g} standard deviations (rms), {each}"
    best = min(costs, key=costs.get)
    if residual_share(stated.cost, costs[best], rows) > EXPLAINS:
        return f"{said}: none of these alone explains it"
    return f"{said}: check {best} first{_furthest(free[best], parts.get(best, {}))}, and state how well it is known"


def any_offset(spectrum: Spectrum) -> tuple[Term, Prior]:
    """The Term of a constant offset of each harmonic at each sensor, and the Prior of its amplitudes."""
    size = np.sqrt(np.mean(np.abs(spectrum.amplitude) ** 2, axis=0))  # (harmonic, sensor)
    parameters, each = [], np.eye(len(spectrum.sensors))
    for h, n in enumerate(spectrum.harmonics.tolist()):
        for s, node in enumerate(spectrum.sensors):
            name, std = f"offset of {n}X at node {node}", max(float(size[h, s]), float(size.max()) * LEAST_OFFSET)
            parameters.append(Parameter(name, "m", (Entry(each[s], on="one", shift=n),), std, is_complex=True))
    term = Term("offset", tuple(parameters), acts_on="output")
    return term, Prior.independent({unknown.name: (0.0, unknown.typical) for unknown in term.unknowns})


def _parts(model):
    """Part of a rig -> {name of a number or parameter of it: relative standard deviation}."""
    numbers = {
        holder.name(path)
        for term, holder in bearings_of(model.structure.bearings)
        for path in {*registry().get("bearing", term.kind).changeable, *holder.uncertain} & {*holder.paths}
    }
    supports = {term.full_name(p) for term in model.terms if term.is_foundation for p in term.parameters}
    parts = {"the bearings": sorted(numbers), "the foundation": sorted(supports)}
    return {part: dict.fromkeys(names, WIDE[part]) for part, names in parts.items() if names}


def _fitted(whole, prior, spectrum, values, numbers=()):
    """The best Fit from some values {name: value}, and from stiffnesses beside those stated; None without a motion."""
    units, found = dict(zip(whole.names, whole.units, strict=True)), []
    stiff = [name for name in numbers if units[name] == "N/m"]
    for factor in (1.0, *STIFFER) if stiff else (1.0,):
        first = [values.get(n, mean) * (factor if n in stiff else 1.0) for n, (mean, _) in prior.by_name.items()]
        with suppress(NoSteadyState):
            found.append(fit(whole, spectrum, prior, whole.filled(prior.names, first), from_afar=True))
    return min(found, key=lambda one: one.cost, default=None)


def _furthest(found, numbers):
    """' (bearings[DE].radial_clearance_m by 38 %)': the numbers of a part that a fit moved furthest."""
    prior = found.prior.by_name
    changes = {n: found.values[n] / prior[n][0] - 1 if prior[n][0] else found.values[n] for n in numbers}
    said = [f"{n} by {percent(changes[n], 2)}" for n in sorted(changes, key=lambda n: -abs(changes[n]))[:MOVED]]
    return f" ({', '.join(said)})" * bool(said)
