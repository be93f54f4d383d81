"""Vectors of the rig, such as an unbalance, that the records show to be others, within their stated uncertainty."""

import numpy as np

from rotorstudy.measurement.findings import Finding
from rotorstudy.units import quantity

CERTAIN = 3.0  # standard deviations of the fitted value, by which it differs from the stated one
OTHER = 1.0  # of the stated size, by which it differs


def within_uncertainty(found):
    """A list with a note if nothing is missing because a vector of the rig took over what changed, else empty.

    Its uncertainty allows that, but a fault of the same kind at the same place would look alike.

    found : Search whose best explanation has no cause
    """
    fitted, prior, said = found.base, found.prior, []
    vectors = [(term.full_name(p), p) for term in found.rig.terms for p in term.parameters if p.is_complex]
    for name, p in vectors if found.rig.before is None else ():
        parts = [f"{name}_real", f"{name}_imag"]
        if not set(parts) <= set(prior.names):
            continue
        place, where = ([names.index(part) for part in parts] for names in (prior.names, fitted.names))
        stated, value = complex(*prior.mean[place]), complex(*fitted.free[where])
        std = float(np.sqrt(np.trace(fitted.covariance[np.ix_(where, where)]) / 2))
        off = abs(value - stated)
        if stated and off > max(OTHER * abs(stated), CERTAIN * std):
            called, (unit, factor) = next(iter(p.also.items()), (p.name, (p.unit, 1.0)))
            both = [f"{quantity(abs(v) / factor, unit)} at {quantity(np.angle(v), 'rad')}" for v in (value, stated)]
            said.append(f"{name.replace(p.name, called)} is {' instead of '.join(both)}")
    if not said:
        return []
    text = (
        f"{'; '.join(said)}, within the uncertainty that the rig states. A fault of that kind and place would look the "
        "same: state a smaller uncertainty of a value that is known, or compare with records of the sound machine "
        "('rotorstudy compare')"
    )
    return [Finding("note", "explained by the rig", "records and rig", text)]
