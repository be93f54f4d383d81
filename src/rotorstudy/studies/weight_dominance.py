"""What weight dominance costs."""

import numpy as np

from rotorstudy.identification import Problem
from rotorstudy.plugins import registry
from rotorstudy.response import measured_response
from rotorstudy.rig import build_model
from rotorstudy.store import dataset
from rotorstudy.studies.config import (
    clean_spectrum,
    parameter_coordinates,
    relative_error,
    reported,
    rig_coordinates,
    true_values,
)


def weight_dominance(config, rig):
    """What weight dominance costs: a crack acting on the static deflection only, against the full time-periodic one.

    returns : displacement (crack, stiffness_loss, speed, harmonic, part) at the shown speeds, first sensor;
              error (stiffness_loss, case, parameter) of least squares with the weight-dominant model on full-crack data
    """
    ratios = np.array(config.stiffness_loss_percent)
    rotor, crack = config.rigs[rig]["rotor"], config.rigs[rig]["cracks"][0]
    key = next(k for k in crack if k.startswith("stiffness_loss"))
    stiffness = rotor["stiffness_N_per_m"]
    found, errors = [], []
    least_squares = registry().get("estimator", "least_squares").function
    for ratio in ratios:
        models = []
        for dominance in (True, False):
            cut = {**crack, key: ratio / 100 * stiffness, "weight_dominance": dominance}
            models.append(
                build_model({**config.rigs[rig], "cracks": [cut]}, where=f"study {config.name}, weight dominance")
            )
        found.append([measured_response(m, config.shown_speeds_rad_s, config.harmonics)[..., 0] for m in models])
        true = true_values(config, models[0])
        for case in config.cases.values():
            problem = Problem(models[0], clean_spectrum(config, models[1], case.speeds), tuple(config.unknowns))
            names, theta, _ = reported(problem, least_squares(problem))
            errors.append(relative_error(names, theta, true))
    found = np.moveaxis(np.array(found), 0, 1)
    coordinates = {
        "crack": (["weight dominant", "full"], "1", "what the crack's stiffness loss acts on"),
        "stiffness_loss": (ratios, "percent", "stiffness lost by the open crack"),
        "case": (list(config.cases), "1", "speeds used together"),
        **rig_coordinates(config, models[0], config.shown_speeds_rad_s),
        **parameter_coordinates(names),
    }
    del coordinates["node"]
    errors = np.array(errors).reshape(len(ratios), len(config.cases), len(names))
    variables = {
        "displacement": (("crack", "stiffness_loss", "speed", "harmonic"), found, "m", "full spectrum"),
        "error": (
            ("stiffness_loss", "case", "parameter"),
            errors,
            "1",
            "relative error; of phases the difference in rad",
        ),
    }
    return dataset(variables, coordinates, title=f"{config.title}: weight dominance against the full crack")
