"""The extended rig: fitted base parameters, the causes as effects, and the covariance of both."""

import numpy as np

from rotorstudy.model.estimated_rig import rig_with_estimate
from rotorstudy.model.rig import build_model
from rotorstudy.model.rotor_numbers import is_rotor_number


def extended_rig(given, diagnosis):
    """The rig with its fitted parameters and every cause of the best explanation as an effect.

    Its section `prior` has the covariance of the fit. The calibration of the measuring chain is left out.

    Parameters
    ----------
    given : dict
        The rig as read from its file.
    diagnosis : Diagnosis

    Returns
    -------
    dict
    """
    best, causes, rig = diagnosis.best, diagnosis.search.best.causes, dict(given)
    own = build_model(given).names
    renamed = {name: name for name in best.names if name in own or is_rotor_number(name)}
    if causes:
        labels = {item.get("label") for item in rig.get("effects") or []}
        free = (f"found {n}" for n in range(1, len(labels) + len(causes) + 1) if f"found {n}" not in labels)
        items = [{"kind": c.effect, "label": next(free), **c.options, **c.where, **c.shape} for c in causes]
        rig["effects"] = [*(rig.get("effects") or []), *items]
        for cause, item in zip(causes, items, strict=True):
            mark = f"[{cause.term.label}]"
            renamed |= {name: name.replace(mark, f"[{item['label']}]") for name in cause.names}
    place = [best.names.index(name) for name in renamed]
    covariance = best.covariance[np.ix_(place, place)]
    return rig_with_estimate(rig, build_model(rig), list(renamed.values()), best.free[place], covariance)
