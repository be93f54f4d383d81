"""Estimates of a rig, numbers of its rotor included."""

from dataclasses import replace

import numpy as np

from rotorstudy.inference.estimate import Estimate, estimate_by
from rotorstudy.inference.problem import Problem
from rotorstudy.model.estimated_rig import rig_with_values
from rotorstudy.model.kinds import Estimator
from rotorstudy.model.rig import build_model
from rotorstudy.model.rig_numbers import is_number, with_numbers

SETTLED = 1e-2  # standard deviations by which a number still changes when the rotor is built again
REBUILDS = 10


def estimate_rig(estimator: Estimator, problem: Problem, rig: dict) -> Estimate:
    """The Estimate of some parameters of a rig; with new numbers of its rotor it is built again and that repeated."""
    found = estimate_by(estimator, problem)
    own = np.array([is_number(name) for name in problem.names])
    ratio = np.ones(len(own))
    for _ in range(REBUILDS if own.any() else 0):
        if np.all(np.abs(found.theta[own]) <= SETTLED * found.std[own]):
            break
        ratio = np.where(own, ratio * (1 + found.theta), 1)
        values = {name: value for name, value in zip(found.names, found.theta, strict=True) if np.isfinite(value)}
        rig = {**rig_with_values(rig, problem.model, values), "sensors": list(problem.model.sensors)}
        problem = replace(problem, model=with_numbers(build_model(rig), problem.names))
        found = estimate_by(estimator, problem)
    theta = np.where(own, ratio * (1 + found.theta) - 1, found.theta)
    return replace(found, theta=theta, covariance=found.covariance * np.outer(ratio, ratio))
