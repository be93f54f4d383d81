"""The causes of an explanation as data: place, parameters with their standard deviations, and posterior probability."""

from itertools import combinations

import numpy as np

from rotorstudy.diagnosis.search.odds import faults_of
from rotorstudy.diagnosis.verdict.result import Cause, ParameterEstimate
from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.model.registry import registry


def causes_of(explanation, probability):
    """The Cause of every fault of an explanation; the parts of a fault are one cause."""
    faults = faults_of(explanation.causes)
    return [cause_of(parts, explanation.fit, probability[fault]) for fault, parts in faults.items()]


def adjoin(explanation, candidates):
    """Whether two faults of an explanation act at a common node, so that one force there could stand in for both.

    An effect that has no place, as an error of the whole model, adjoins every other fault; a fault of a part of the
    shaft that is found to extend over the whole of it (an asymmetry) adjoins none.
    """
    local = {c.effect for c in candidates if c.where.keys() & {"node", "element"}}
    each = [_nodes(parts, explanation.fit.model, local) for parts in faults_of(explanation.causes).values()]
    return any(one & other for one, other in combinations(each, 2))


def _nodes(parts, model, local):
    """Nodes at which the parts of a fault act, or whose sensors show them; local : effects that have places."""
    found = set()
    for part in parts:
        acts = {part.where["node"]} if "node" in part.where else _acted_on(part, model)
        everywhere = acts >= set(model.sensors if part.term.acts_on_output else model.structure.nodes)
        found |= set() if everywhere and part.effect in local else acts
    return found


def _acted_on(part, model):
    """Nodes of the coordinates in the table of a cause."""
    nodes = model.sensors if part.term.acts_on_output else [node for node, _ in model.structure.dofs]
    found = set()
    for unknown in part.term.unknowns:
        rows = [(np.abs(e.matrix) > 0).reshape(len(nodes), -1).any(axis=1) for e in unknown.entries]
        rows += [(np.abs(unknown.force.matrix) > 0).any(axis=0)] if unknown.force else []
        found |= {node for acts in rows for node, here in zip(nodes, acts, strict=True) if here}
    return found


def cause_of(parts, fitted, probability):
    """The Cause of the parts of a fault, whose options are listed where they differ."""
    where = {}
    for key in dict.fromkeys(key for part in parts for key in part.where):
        values = sorted({part.where[key] for part in parts if key in part.where})
        where[key] = values if len(values) > 1 else values[0]
    parameters = {}
    for part in parts:
        found = _parameters(part, fitted)
        taken = "".join(f"_{key}_{own}" for key, own in part.where.items() if isinstance(where[key], list))
        parameters |= {f"{name}{taken}" if name in parameters else name: one for name, one in found.items()}
    return Cause(
        effect=parts[0].effect,
        where=where,
        label=fitted.model.structure.label_at(where),
        parameters=parameters,
        variant=parts[0].variant,
        posterior_probability=probability,
    )


def _parameters(candidate, fitted):
    """{name: ParameterEstimate} of a candidate as fitted, complex ones by magnitude and phase, then its shape."""
    place = [fitted.names.index(name) for name in candidate.names]
    theta, covariance = fitted.free[place], fitted.covariance[np.ix_(place, place)]
    _, theta, covariance = magnitude_and_phase(candidate.names, theta, covariance)
    estimates = zip(theta, np.sqrt(np.diag(covariance)), strict=True)
    parameters = {}
    for p in candidate.term.parameters:
        parts = {p.name: (p.unit, "magnitude"), f"{p.name}_phase": ("rad", "phase")}
        for name, (unit, part) in parts.items() if p.is_complex else [(p.name, (p.unit, "amplitude"))]:
            value, std = next(estimates)
            parameters[name] = ParameterEstimate(value=value, std=std, unit=unit, part=part)
        size = parameters[p.name]  # an eccentricity is an unbalance too
        for name, (unit, factor) in p.also.items():
            also = {"value": size.value / factor, "std": size.std / factor, "unit": unit}
            parameters[name] = size.model_copy(update=also)
    for name, value in candidate.shape.items():
        unit = "rad" if name.endswith("_rad") else ""
        parameters[name] = ParameterEstimate(value=value, std=candidate.shape_std.get(name), unit=unit, part="shape")
    plugin = registry().get("effect", candidate.effect)
    known = plugin.stated and set(plugin.shape) <= set(candidate.shape)  # not before its whole shape was searched
    for name, (option, factor) in plugin.stated(fitted.model.structure, **candidate.shape).items() if known else ():
        one = parameters[option]
        std = None if one.std is None else factor * one.std
        parameters[name] = ParameterEstimate(value=factor * one.value, std=std, unit="", part="shape")
    return parameters
