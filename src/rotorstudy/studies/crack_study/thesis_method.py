"""The thesis's method on the same cracks: a stiffness loss at a node that is given, by least squares."""

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.estimate import estimate_by
from rotorstudy.inference.problem import Problem
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.model.registry import registry
from rotorstudy.response.measured import measured_response
from rotorstudy.store import dataset


def thesis_method(study):
    """A Dataset of the loss found without noise by least squares at the thesis's node, for cracks elsewhere."""
    main, settings = study.main, study.thesis
    nodes = list(main.model().structure.nodes)
    model = main.model(cracks=settings.cracks, sensors=nodes)
    speed, estimator = np.array(main.speeds_rad_s), registry().get("estimator", settings.estimator)
    (name,) = (name for name in settings.unknowns if name.startswith("stiffness_loss"))

    def loss(position):
        effect = study.crack.effect(position, settings.depth_ratio, 0.0)  # it faces the mark, as the one of the thesis
        try:
            cracked = main.model(effect, sensors=nodes)
        except RotorstudyError:  # at a disc
            return np.nan
        shown = measured_response(cracked, speed, study.harmonics)
        covariance = independent_covariance(np.ones(shown.shape))
        spectrum = Spectrum(shown, speed, np.array(study.harmonics), tuple(nodes), covariance)
        found = estimate_by(estimator, Problem(model, spectrum, tuple(settings.unknowns)))
        return float(found.theta[found.names.index(name)])

    length = model.structure.length
    position = (np.arange(study.map.positions) + 0.5) / study.map.positions * length
    found = [loss(place) for place in position]
    coordinates = {"position": (position, "m", "position of the true crack on the shaft, from node 1")}
    variables = {"loss": (("position",), found, "N/m", "stiffness loss found at the thesis's node")}
    return dataset(variables, coordinates, title=f"{study.title}: the thesis's method")
