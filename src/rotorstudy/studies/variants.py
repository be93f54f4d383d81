"""Least squares of the equations from exact spectra, correct and with known mistakes."""

from dataclasses import replace

import numpy as np

from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.inference.linear import solve_equations, solve_linear
from rotorstudy.inference.problem import Problem
from rotorstudy.response.statics import static_deflection
from rotorstudy.store import dataset
from rotorstudy.studies.common import (
    clean_spectrum,
    is_phase,
    parameter_coordinates,
    relative_error,
    reported_names,
    true_values,
)


def held_model(model, speeds, percent):
    """The model with the static deflection held at that of bearings too stiff by `percent`; speeds (speed,) rad/s."""
    theta = model.theta[: len(model.rotor_unknowns)].copy()
    stiff = [u.carries and u.unit == "N/m" for u in model.rotor_unknowns]
    theta[stiff] *= 1 + percent / 100
    return replace(model, held_deflection=static_deflection(model, speeds, theta).value)


def variants(config):
    """A Dataset of the estimates of every variant and case, without noise, and their errors."""
    estimates, errors, names = [], [], reported_names(config)
    phase = is_phase(config, names)
    for variant in config.variants.values():
        source, model = config.rig(variant.simulated), config.rig(variant.identified)
        true = true_values(config, source)
        for case in config.cases.values():
            held = variant.held_with_percent
            used = model if held is None else held_model(model, case.speeds, held)
            spectrum = clean_spectrum(config, source, case.speeds)
            problem = Problem(used, spectrum, tuple(config.unknowns), condensation=variant.condensation)
            exact = variant.condensation == "exact"
            theta = solve_equations(problem) if exact else solve_linear(*problem.equations(), problem.names)
            _, theta, _ = magnitude_and_phase(config.unknowns, theta, np.eye(len(theta)))
            estimates.append(theta)
            errors.append(relative_error(phase, theta, true))
    coordinates = {
        "variant": (list(config.variants), "1", "how the equations are solved"),
        "case": (list(config.cases), "1", "speeds used together"),
        **parameter_coordinates(names),
    }
    dims, shape = tuple(coordinates), [len(values) for values, *_ in coordinates.values()]
    errors = np.array(errors).reshape(shape)
    true = true_values(config, config.rig(config.main_rig))
    variables = {
        "estimate": (dims, np.array(estimates).reshape(shape), "SI", "estimated parameter"),
        "relative_error": (dims, errors, "1", "relative error; of phases the difference in rad"),
        "true": (("parameter",), true, "SI", "value assumed"),
    }
    return dataset(variables, coordinates, title=f"{config.title}: variants of least squares")
