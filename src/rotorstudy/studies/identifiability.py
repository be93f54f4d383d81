"""Identifiability of the unknowns of a study, and the gain by further measurements."""

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.inference.linear import check_identifiable, invert
from rotorstudy.measurement.spectrum import components
from rotorstudy.response.harmonic import harmonic_response_and_jacobian
from rotorstudy.response.measured import measured_response
from rotorstudy.store import dataset
from rotorstudy.studies.common import is_phase, parameter_coordinates
from rotorstudy.studies.config import ExtraMeasurement

AS_IT_IS = "as it is"
NOISE = 0.01  # white in time, relative to the rms vibration at the study's speeds; the same for all probes and speeds


def probe_noise(config, model, speeds):
    """Standard deviation of a sample of any probe, m; speeds (speed,) rad/s."""
    shown = measured_response(model, speeds, config.harmonics)[:, np.array(config.harmonics) != 0]
    return NOISE * np.sqrt(np.mean(np.sum(np.abs(shown) ** 2, axis=1)) / 2)


def information(config, model, speeds, harmonics, rows, std):
    """Fisher information J^T C^-1 J (parameter, parameter) of rows (output, dof) with noise std (output,), m."""
    if any(name in {u.name for u in model.output_unknowns} for name in config.unknowns):
        raise RotorstudyError("identifiability is computed for amplitudes of the rotor, not of its sensors")
    _, change = harmonic_response_and_jacobian(model, speeds, harmonics)
    weighted = np.einsum("od,shdp->shop", rows / std[:, None], change)[..., model.position(config.unknowns)]
    columns = np.stack([components(weighted[..., p]).ravel() for p in range(weighted.shape[-1])], axis=-1)
    check_identifiable(columns, config.unknowns)
    return columns.T @ columns


def identifiability(config):
    """A Dataset of bounds of the main rig with white noise on all probes, of correlations and further measurements."""
    model, options = config.rig(config.main_rig), {AS_IT_IS: ExtraMeasurement(), **config.extra_measurements}
    bounds, correlations, inflations = [], [], []
    noise = [probe_noise(config, model, case.speeds) for case in config.cases.values()]
    for case, level in zip(config.cases.values(), noise, strict=True):
        for name, extra in options.items():
            speeds = case.speeds if extra.speeds is None else extra.speeds.speeds
            harmonics = config.harmonics if extra.harmonics is None else extra.harmonics
            rows, relative = extra.output_rows(model.structure, model.sensors)
            std = level * relative / np.sqrt(config.record.samples * extra.times_longer)
            covariance = invert(information(config, model, speeds, harmonics, rows, std))
            theta = model.theta[model.position(config.unknowns)]
            names, values, turned = magnitude_and_phase(config.unknowns, theta, covariance)
            std = np.sqrt(np.diag(turned))
            bounds.append(std / np.where(is_phase(config, names), 1, np.abs(values)))
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
    bound, of_all = np.array(bounds).reshape(shape), ("case", "measurement", "parameter")
    pair, one = ("case", "parameter", "other_parameter"), ("case", "parameter")
    variables = {
        "noise": (("case",), np.array(noise), "m", "standard deviation of white noise on each sample of a probe"),
        "bound": (of_all, bound, "1", "Cramer-Rao bound over the value, of phases in rad"),
        "correlation": (pair, np.array(correlations), "1", "correlation of efficient estimates"),
        "inflation": (one, np.array(inflations), "1", "bound over the bound with all other parameters known"),
    }
    return dataset(variables, coordinates, title=f"{config.title}: identifiability, rig {config.main_rig}")
