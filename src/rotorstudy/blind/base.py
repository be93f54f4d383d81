"""The part of a change that base parameters and probe calibration cannot absorb."""

import numpy as np

from rotorstudy.inference.prior import prior_of, with_usual
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_items import make_term
from rotorstudy.model.rig_numbers import with_numbers
from rotorstudy.response.measured import measured_response_and_jacobian


def left_by_base(change, spectrum, model, stated):
    """Rms of the part of a change that the base model cannot absorb, in standard deviations of the spectrum.

    Base parameters (numbers of the rotor among them) and calibration are refitted under their stated standard
    deviations, linearised.

    change   : (speed, sensor, harmonic) complex, m
    spectrum : Spectrum as measured, for its noise;  model : Model of the rig file
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
    columns = columns * np.array([std[name] for name in whole.names])
    change = spectrum.whitened(np.swapaxes(change, 1, 2))
    columns = spectrum.whitened(np.moveaxis(columns, -1, 0)).T
    moved = np.linalg.solve(np.eye(columns.shape[1]) + columns.T @ columns, columns.T @ change)
    left = change - columns @ moved
    return float(np.sqrt(np.mean(left**2)))
