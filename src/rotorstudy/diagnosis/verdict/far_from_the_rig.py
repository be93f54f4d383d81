"""Whether the records may not be of the rig: another machine of its kind, other units, other speeds."""

from rotorstudy.inference.fit import residual_share
from rotorstudy.inference.prediction import misfit
from rotorstudy.measurement.findings import Finding
from rotorstudy.units import percent, quantity

CONTRADICTED = 5.0  # stated standard deviations, by which a parameter that moves further contradicts the rig
FURTHEST = 3  # values of the rig that a summary names
MOST = 0.1  # of the excess error (rms), which the rig with other values may leave


def far_from_the_rig(found, moved, labels):
    """A list with a warning if the records look like those of a rig with other values, else an empty list.

    They do if the best explanation needs unusual values of the rig or sizes of causes, and the rig without causes, but
    with other values, explains most of the excess error. A fault that no values explain casts no doubt on the records.

    found : Search;  moved : list of MovedParameter;  labels : {name: readable name} of the parameters
    """
    best, settings = found.best, found.settings
    theta = best.fit.values
    said = [
        f"{labels[row.name]} moved by {abs(row.moved_sigma):.0f} stated standard deviations"
        for row in moved
        if abs(row.moved_sigma) > CONTRADICTED
    ]
    said += [
        f"{labels[unknown.name]} would be {quantity(theta[unknown.name], unknown.unit)}"
        for cause in best.causes
        for unknown in cause.term.unknowns
        if not cause.fixed and abs(theta[unknown.name]) > settings.prior_width * unknown.typical
    ]
    base = found.base
    before, after = (misfit(base.model, found.spectrum, one) for one in (base.stated_theta, base.theta))
    left = residual_share(before, after, len(base.residual))
    if not said or left > MOST:
        return []
    text = (
        f"{'; '.join(said)}. The rig without causes but with other values leaves {percent(left)} of the excess error "
        "(rms). Are these records of this rig, at these speeds, in these units? If so, check the sizes of the causes "
        "before relying on them, and the values and the 'uncertainty' in the rig file"
    )
    return [Finding("warning", "far from the rig", "records and rig", text)]


def moved_far(moved):
    """'gain mismatch of disc 1 (by 30 stated standard deviations)' of the values of the rig that moved furthest.

    moved : list of MovedParameter
    """
    furthest = {}
    for row in moved:
        name = row.name.removesuffix("_real").removesuffix("_imag")
        furthest[name] = max(furthest.get(name, 0.0), abs(row.moved_sigma))
    far = sorted(((size, name) for name, size in furthest.items() if size > CONTRADICTED), reverse=True)
    said = [(name.replace("_", " ").replace("[", " of ").removesuffix("]"), size) for size, name in far[:FURTHEST]]
    return [f"{name} (by {size:.0f} stated standard deviations)" for name, size in said]
