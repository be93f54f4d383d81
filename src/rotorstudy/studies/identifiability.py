"""How well the unknowns of a study can be told apart, and which further measurement would help most."""

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.identification import check_identifiable, invert, magnitude_and_phase
from rotorstudy.response import harmonic_response
from rotorstudy.spectrum import components
from rotorstudy.store import dataset
from rotorstudy.studies.config import Measurement, parameter_coordinates

AS_IT_IS = "as it is"
NOISE = 0.01  # white in time, of each sensor's own rms


def output_rows(structure, sensors, extra):
    """(output, dof) what each sensor shows: translations at nodes, then tilts at nodes and translations at stations."""
    rows = [structure.unit(node) for node in sensors]
    rows += [structure.unit(node, "tilt") for node in extra.tilts]
    for position in extra.stations_m:
        if structure.shape_at is None:
            raise RotorstudyError(f"no probe can stand at {position:g} m: this rotor does not tell the shaft's shape")
        rows.append(structure.shape_at(position))
    return np.array(rows)


def information(config, model, speeds, harmonics, rows, samples):
    """Normal matrix J^T C^-1 J (parameter, parameter) of the unknowns, 1 % white noise on every output."""
    if any(name in {u.name for u in model.output_unknowns} for name in config.unknowns):
        raise RotorstudyError("identifiability is computed for amplitudes of the rotor, not of its sensors")
    found, change = harmonic_response(model, speeds, harmonics, jacobian=True)
    shown, change = found @ rows.T, np.einsum("od,shdp->shop", rows, change)
    power = np.sum(np.abs(shown) ** 2 * (np.asarray(harmonics) != 0)[:, None], axis=1, keepdims=True) / 2
    weighted = change[..., model.position(config.unknowns)] / (NOISE * np.sqrt(power / samples))[..., None]
    columns = np.stack([components(weighted[..., p]).ravel() for p in range(weighted.shape[-1])], axis=-1)
    check_identifiable(columns, config.unknowns)
    return columns.T @ columns


def identifiability(config, rig):
    """Cramer-Rao bounds at 1 % white noise, what correlates, and what each further measurement would gain.

    returns : correlation (case, parameter, other_parameter) of the estimates; bound (case, measurement, parameter)
              relative, of phases in rad; inflation (case, parameter), the bound over the one with all others known
    """
    model, options = config.rig(rig), {AS_IT_IS: Measurement(), **config.extra_measurements}
    bounds, correlations, inflations = [], [], []
    for case in config.cases.values():
        for name, extra in options.items():
            speeds = case.speeds if extra.speeds is None else extra.speeds.speeds
            harmonics = config.harmonics if extra.harmonics is None else extra.harmonics
            rows = output_rows(model.structure, model.sensors, extra)
            normal = information(config, model, speeds, harmonics, rows, config.record.samples * extra.times_longer)
            covariance = invert(normal)
            theta = model.theta[model.position(config.unknowns)]
            names, values, turned = magnitude_and_phase(config.unknowns, theta, covariance)
            std = np.sqrt(np.diag(turned))
            is_phase = np.array([n.endswith("_phase") for n in names])
            bounds.append(std / np.where(is_phase, 1, np.abs(values)))
            if name == AS_IT_IS:
                correlations.append(turned / np.outer(std, std))
                inflations.append(np.sqrt(np.diag(np.linalg.inv(correlations[-1]))))
    shape = (len(config.cases), len(options), len(names))
    coordinates = {
        "case": (list(config.cases), "1", "speeds used together"),
        "measurement": (list(options), "1", "what is measured besides"),
        **parameter_coordinates(names),
        "other_parameter": (list(names), "1", "identified parameter"),
    }
    variables = {
        "bound": (
            ("case", "measurement", "parameter"),
            np.array(bounds).reshape(shape),
            "1",
            "Cramer-Rao bound over the value, of phases in rad, 1 % white noise",
        ),
        "correlation": (
            ("case", "parameter", "other_parameter"),
            np.array(correlations),
            "1",
            "correlation of efficient estimates",
        ),
        "inflation": (
            ("case", "parameter"),
            np.array(inflations),
            "1",
            "bound over the bound with all other parameters known",
        ),
    }
    return dataset(variables, coordinates, title=f"{config.title}: identifiability, rig {rig}")
