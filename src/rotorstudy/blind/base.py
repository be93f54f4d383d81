"""The part of a change that base parameters and probe calibration cannot absorb."""

import numpy as np

from rotorstudy.inference.prior import prior_of, with_usual
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_items import make_term
from rotorstudy.model.rig_numbers import with_numbers
from rotorstudy.response.measured import measured_response_and_jacobian


def absorbed(spectrum, model, stated):
    """What refitted base parameters and calibration change at most, by one standard deviation each (data, parameter).

    In standard deviations of the spectrum, linearised at the stated values.

    spectrum : Spectrum as measured, with the model error in its covariance;  model : Model of the rig file
    stated   : "uncertainty" with its default and that of the rotor, relative; "nuisance" kind -> standard deviation
    """
    calibration = [
        make_term("effect", {"kind": kind, "label": f"{kind} {i}", **place}, model.structure, model.sensors)
        for kind in stated["nuisance"]
        for i, place in enumerate(registry().get("effect", kind).places(model.structure, model.sensors))
    ]
    uncertainty = with_usual(stated["uncertainty"], model)
    model = with_numbers(model, uncertainty)
    prior = prior_of(model, uncertainty)
    std = dict(zip(prior.names, prior.std, strict=True))
    std |= {u.name: stated["nuisance"][term.kind] for term in calibration for u in term.unknowns}
    whole = model.plus(*calibration)
    theta = np.nan_to_num(whole.stated)
    _, columns = measured_response_and_jacobian(whole, spectrum.speed, spectrum.harmonics, theta)
    columns = columns * np.array([std.get(name, 0.0) for name in whole.names])  # 0: known exactly
    return spectrum.whitened(np.moveaxis(columns, -1, 0)).T


def left_by_base(change, spectrum, columns, beside=None):
    """Rms of the part of a change (speed, harmonic, sensor), m, that `absorbed` columns leave, in standard deviations.

    beside : another change, of unknown size, that may absorb it too
    """
    change, ridge = spectrum.whitened(change), np.ones(columns.shape[1])
    if beside is not None:
        columns = np.column_stack([columns, spectrum.whitened(beside)])
        ridge = np.append(ridge, 1e-9 * (columns[:, -1] @ columns[:, -1] + 1e-300))
    moved = np.linalg.solve(np.diag(ridge) + columns.T @ columns, columns.T @ change)
    left = change - columns @ moved
    return float(np.sqrt(max(left @ left + moved @ (ridge * moved), 0.0) / len(left)))
