"""Numbers that follow from the shape and the amplitudes of a cause, such as the depth of a crack in metres."""

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.inference.fit import Fit
from rotorstudy.model.options import option_names
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_numbers import rotor_at
from rotorstudy.model.structure import Structure

SMALL = 1e-6  # relative step of an option or an amplitude, for a slope


def sizes_of(fitted: Fit, cause: Candidate) -> dict[str, tuple[float, float | None]]:
    """Name -> value and standard deviation, if known, of the shape of a cause in a Fit, and of its `stated_numbers`."""
    structure = rotor_at(fitted.model.structure, fitted.values)
    shape = {name: (value, cause.shape_std.get(name)) for name, value in cause.shape.items()}
    return shape | stated_numbers(structure, cause, *fitted.of(cause.names))


def stated_numbers(
    structure: Structure, cause: Candidate, amplitudes: np.ndarray, covariance: np.ndarray
) -> dict[str, tuple[float, float]]:
    """Name -> value and standard deviation of what the effect of a cause states (`Effect.stated`).

    amplitudes : (unknown,) of the cause
    covariance : (number, number) of its shape and then of these, or of these alone, beside `Candidate.shape_std`
    returns    : nothing before its whole shape was searched
    """
    from scipy.linalg import block_diag

    effect = registry().get("effect", cause.effect)
    if effect.stated is None or not effect.shape.keys() <= cause.shape.keys():
        return {}
    if len(covariance) == len(amplitudes):
        covariance = block_diag(np.diag([cause.shape_std.get(name) or 0.0 for name in cause.shape]) ** 2, covariance)
    names = [*cause.shape, *(name.partition("[")[0] for name in cause.names)]
    values, std = np.array([*cause.shape.values(), *amplitudes]), np.sqrt(np.diag(covariance))
    taken = [i for i, name in enumerate(names) if name in option_names(effect.stated)]
    chosen = {name: one for name, one in cause.variant.items() if name in option_names(effect.stated)}

    def logarithms(at):
        stated = effect.stated(structure, **chosen, **{names[i]: float(at[i]) for i in taken})
        return stated, np.log([*stated.values()])

    stated, here = logarithms(values)
    slopes = np.zeros((len(values), len(stated)))
    for i in (i for i in taken if std[i] > 0):
        step = np.zeros(len(values))
        step[i] = -SMALL * (abs(values[i]) or std[i])
        slopes[i] = (logarithms(values + step)[1] - here) / step[i]
    variance = np.einsum("in,ij,jn->n", slopes, covariance, slopes)
    return {name: (one, float(one * np.sqrt(v))) for (name, one), v in zip(stated.items(), variance, strict=True)}
