"""The thesis's method on the same cracks: a stiffness loss at a node that is given, by least squares."""

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.estimate import estimate_by
from rotorstudy.inference.problem import Problem
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.model.registry import registry
from rotorstudy.response.measured import measured_response
from rotorstudy.studies.common import sweep


def thesis_method(config):
    """A Dataset of the loss found without noise by least squares at the thesis's node, for cracks elsewhere."""
    main, settings = config.main, config.thesis
    nodes = list(main.model().structure.nodes)
    model = main.model(cracks=settings.cracks, sensors=nodes)
    speed, estimator = np.array(main.speeds_rad_s), registry().get("estimator", settings.estimator)
    (name,) = (name for name in settings.unknowns if name.startswith("stiffness_loss"))

    def loss(position):
        effect = config.crack.effect(position, settings.depth_ratio, 0.0)  # it faces the mark, as the one of the thesis
        try:
            cracked = main.model(effect, sensors=nodes)
        except RotorstudyError:  # at a disc
            return {}
        shown = measured_response(cracked, speed, config.harmonics)
        covariance = independent_covariance(np.ones(shown.shape))
        spectrum = Spectrum(shown, speed, np.array(config.harmonics), tuple(nodes), covariance)
        found = estimate_by(estimator, Problem(model, spectrum, tuple(settings.unknowns)))
        return {"loss": float(found.theta[found.names.index(name)])}

    count, length = config.map.positions, model.structure.length
    position = (np.arange(count) + 0.5) / count * length
    coordinates = {"position": (position, "m", "position of the true crack on the shaft, from node 1")}
    told = {"loss": ((), "N/m", "stiffness loss found at the thesis's node")}
    return sweep(coordinates, ("position",), loss, told, title=f"{config.title}: the thesis's method")
