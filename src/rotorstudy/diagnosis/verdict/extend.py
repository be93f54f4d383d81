"""The extended rig: fitted base parameters, the causes as effects, and the covariance of both."""

from dataclasses import replace

import numpy as np

from rotorstudy.inference.fit import fit
from rotorstudy.inference.prior import Prior
from rotorstudy.model.estimated_rig import rig_with_estimate, rig_with_values
from rotorstudy.model.rig import build_model
from rotorstudy.model.rig_numbers import is_number, with_numbers


def extended_rig(given, diagnosis):
    """The rig `given`, as read, with its fitted parameters and every cause of the best explanation as an effect.

    Its section `prior` has the covariance of the fit. The calibration of the measuring chain is left out.
    """
    best, causes, rig = diagnosis.best, diagnosis.search.best.causes, dict(given)
    own = build_model(given).names
    shared = best.model.names if best.model.before is None else best.model.before
    renamed = {name: name for name in best.names if (name in own or is_number(name)) and name in shared}
    if causes:
        labels = {item.get("label") for item in rig.get("effects") or []}
        free = (f"found {n}" for n in range(1, len(labels) + len(causes) + 1) if f"found {n}" not in labels)
        items = [
            {"kind": c.effect, "label": next(free), **c.options, **c.where, **c.variant, **c.shape} for c in causes
        ]
        rig["effects"] = [*(rig.get("effects") or []), *items]
        for cause, item in zip(causes, items, strict=True):
            mark = f"[{cause.term.label}]"
            renamed |= {name: name.replace(mark, f"[{item['label']}]") for name in cause.names}
    rig, fitted = _with_rotor_built_again(rig, diagnosis, renamed)
    place = [best.names.index(name) for name in renamed]
    covariance = fitted.covariance[np.ix_(place, place)]
    return rig_with_estimate(rig, build_model(rig), list(renamed.values()), fitted.free[place], covariance)


def _with_rotor_built_again(rig, diagnosis, renamed):
    """The rig with the fitted numbers of its rotor, and a Fit of it, whose free parameters are those of the best one.

    In the best fit most effects that depend on the matrices of the rotor did not follow its numbers.
    """
    best = diagnosis.best
    names = tuple(renamed.get(name, name) for name in best.names)
    own = np.array([is_number(name) and name in renamed for name in names])
    if not own.any():
        return rig, best
    here = {name: value for name, value in zip(names, best.free, strict=True) if name in renamed.values()}
    rig = rig_with_values(rig, build_model(rig), here)
    model = build_model({**rig, "sensors": list(diagnosis.spectrum.sensors)})
    known = {*renamed, *model.names}
    calibration = [
        term
        for term in best.model.terms
        if not (term.variation or term.is_bearing_number)
        and all(u.name in best.names and u.name not in known for u in term.unknowns)
    ]
    model = replace(with_numbers(model, names).plus(*calibration), before=best.model.before)
    ratio = np.where(own, 1 + best.free, 1)
    mean = np.where(own, (1 + best.prior.mean) / ratio - 1, best.prior.mean)
    prior = Prior(names, mean, best.prior.covariance / np.outer(ratio, ratio))
    return rig, fit(model, diagnosis.spectrum, prior, start=model.filled(names, np.where(own, 0, best.free)))
