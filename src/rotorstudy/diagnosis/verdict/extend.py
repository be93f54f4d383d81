"""The extended rig: fitted base parameters, the causes as effects, and the covariance of both."""

from rotorstudy.inference.fit import fit
from rotorstudy.model.estimated_rig import rig_with_estimate, with_effects_at
from rotorstudy.model.rig import build_model
from rotorstudy.model.rig_numbers import is_number


def extended_rig(given, diagnosis):
    """The rig `given`, as read, with its fitted parameters and every cause of the best explanation as an effect.

    Its section `prior` has the covariance of the fit. The calibration of the measuring chain is left out.
    """
    best, causes, rig = diagnosis.best, diagnosis.search.best.causes, dict(given)
    (whole,) = with_effects_at([best.model], given, best.values)
    if whole is not best.model:  # in the best fit most effects of the rig did not follow the numbers of its rotor
        best = fit(whole, diagnosis.search.spectrum, best.prior, start=best.theta)
    own = build_model(given).names
    shared = best.model.names if best.model.before is None else best.model.before
    renamed = {name: name for name in best.names if (name in own or is_number(name)) and name in shared}
    if causes:
        labels = {item.get("label") for item in rig.get("effects") or []}
        free = (f"found {n}" for n in range(1, len(labels) + len(causes) + 1) if f"found {n}" not in labels)
        items = [{"kind": c.effect, "label": next(free)} | c.options | c.where | c.variant | c.shape for c in causes]
        rig["effects"] = [*(rig.get("effects") or []), *items]
        for cause, item in zip(causes, items, strict=True):
            renamed |= {name: name.replace(f"[{cause.term.label}]", f"[{item['label']}]") for name in cause.names}
    theta, covariance = best.of(list(renamed))
    return rig_with_estimate(rig, build_model(rig), list(renamed.values()), theta, covariance)
