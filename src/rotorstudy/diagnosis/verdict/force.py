"""Equivalent residual force: the force at the measured nodes that would cause the residual displacement."""

import numpy as np

from rotorstudy.inference.prediction import BEYOND
from rotorstudy.model.entries import Entry
from rotorstudy.model.terms import Unknown
from rotorstudy.response.neighbourhood import Neighbourhood


def equivalent_residual_force(model, theta, speed, harmonics, residual):
    """Residual displacement times the inverse receptance at the measured nodes.

    Coupled harmonics are solved together. The force acts at the measured nodes, wherever the true one acts; an effect
    of the measuring chain appears as a force too. The receptance of nonlinear forces is neglected.

    theta    : (parameter,) of the model
    residual : (speed, harmonic, sensor) complex, measured minus simulated, m
    returns  : (speed, harmonic, sensor) complex, N
    """
    harmonics = np.asarray(harmonics)
    units = [model.structure.unit(node) for node in model.sensors]
    pushes = [
        Unknown(f"{part} {n}X at {node}", "N", (Entry(factor * unit, on="one", shift=int(n)),), 1.0)
        for part, factor in (("real", 1), ("imag", 1j))
        for n in harmonics
        for node, unit in zip(model.sensors, units, strict=True)
    ]
    order = int(np.abs(harmonics).max()) + BEYOND
    reply = Neighbourhood(model, speed, harmonics, theta, order=order).changes_by_forces([(pushes, None)])
    reply = reply.reshape(len(speed), -1, len(pushes))
    right = residual.reshape(len(speed), -1)
    found = np.linalg.solve(
        np.concatenate([reply.real, reply.imag], axis=1), np.concatenate([right.real, right.imag], axis=1)[..., None]
    )[..., 0]
    real, imag = np.split(found, 2, axis=1)
    return (real + 1j * imag).reshape(residual.shape)
