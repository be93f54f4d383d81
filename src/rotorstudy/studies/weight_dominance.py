"""Errors by the assumption of weight dominance."""

import numpy as np

from rotorstudy.inference.problem import Problem
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import build_model
from rotorstudy.response.measured import measured_response
from rotorstudy.store import dataset
from rotorstudy.studies.common import (
    HARMONIC,
    SPEED,
    clean_spectrum,
    is_phase,
    parameter_coordinates,
    relative_error,
    reported,
    true_values,
)


def first_crack(config, rig):
    """The Term of the first crack of a rig."""
    kind = config.rigs[rig]["cracks"][0]["kind"]
    return next(term for term in config.rig(rig).terms if term.kind == kind)


def weight_dominance(config):
    """A Dataset of errors by weight dominance on the main rig, for scaled losses of its crack on the full motion."""
    rig = config.main_rig
    scales, crack = np.array(config.crack_scales), config.rigs[rig]["cracks"][0]
    term = first_crack(config, rig)
    found, errors = [], []
    least_squares = registry().get("estimator", "least_squares").function
    for scale in scales:
        loss = {loss.key: scale * term.values[loss.name] for loss in term.parameters}
        models = []
        for dominance in (True, False):
            scaled = {**config.rigs[rig], "cracks": [{**crack, **loss, "weight_dominance": dominance}]}
            models.append(build_model(scaled, where=f"study {config.name}, weight dominance"))
        shown = (measured_response(m, config.shown_speeds_rad_s, config.harmonics) for m in models)
        found.append([one[..., one.shape[-1] // 2] for one in shown])
        true = true_values(config, models[0])
        for case in config.cases.values():
            problem = Problem(models[0], clean_spectrum(config, models[1], case.speeds), tuple(config.unknowns))
            names, theta, _ = reported(problem, least_squares(problem))
            errors.append(relative_error(is_phase(config, names), theta, true))
    found = np.moveaxis(np.array(found), 0, 1)
    coordinates = {
        "crack": (["weight dominant", "full"], "1", "what the crack's stiffness loss acts on"),
        "crack_scale": (scales, "1", "stiffness loss over that of the rig"),
        "case": (list(config.cases), "1", "speeds used together"),
        "harmonic": (np.array(config.harmonics), *HARMONIC),
        "speed": (np.array(config.shown_speeds_rad_s, float), *SPEED),
        **parameter_coordinates(names),
    }
    errors = np.array(errors).reshape(len(scales), len(config.cases), len(names))
    variables = {
        "displacement": (("crack", "crack_scale", "speed", "harmonic"), found, "m", "full spectrum"),
        "error": (("crack_scale", "case", "parameter"), errors, "1", "relative error; of phases the difference in rad"),
    }
    return dataset(variables, coordinates, title=f"{config.title}: weight dominance against the full crack")
