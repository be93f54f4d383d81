"""Run-up of the cracked rotor: its harmonics and the growth of its free motion over speed."""

import numpy as np

from rotorstudy.errors import NoSteadyState
from rotorstudy.response.floquet import periodic_growth_rate
from rotorstudy.response.measured import measured_response
from rotorstudy.response.whirl import critical_speeds, time_invariant
from rotorstudy.store import dataset
from rotorstudy.studies.common import SPEED


def passage(study):
    """A Dataset of harmonics, m, and growth rate, 1/s, of the main rotor, without and with a crack, over speed."""
    settings, main = study.passage, study.main
    speed = np.linspace(settings.lowest_rad_s, settings.highest_rad_s, settings.count)
    depths, orders = np.array([0.0, *settings.depth_ratios]), np.array(settings.orders)
    amplitude = np.full((len(depths), len(speed), len(orders)), np.nan)
    growth = np.full((len(depths), len(speed)), np.nan)
    for i, depth in enumerate(depths):
        place = {**study.reference.model_dump(), "depth_ratio": depth}
        model = main.model(*([study.crack.effect(**place)] if depth else []))
        node = model.sensors.index(settings.node)
        for j, w in enumerate(speed):
            try:
                both = np.abs(measured_response(model, [w], [*orders, *-orders])[0, :, node])
                amplitude[i, j], growth[i, j] = both.reshape(2, -1).sum(axis=0), periodic_growth_rate(model, [w])[0]
            except NoSteadyState:
                continue
    criticals = critical_speeds(time_invariant(main.model()), settings.highest_rad_s)[0]
    coordinates = {
        "depth_ratio": (depths, "1", "depth over diameter"),
        "speed": (speed, *SPEED),
        "order": (orders, "1", "multiple of the spin speed"),
        "critical": (np.arange(1, len(criticals) + 1), "1", "critical speed, by frequency"),
    }
    variables = {
        "amplitude": (("depth_ratio", "speed", "order"), amplitude, "m", f"major semi-axis at node {settings.node}"),
        "growth_rate": (("depth_ratio", "speed"), growth, "1/s", "growth rate of the fastest growing free motion"),
        "critical_speed": (("critical",), np.array(criticals), "rad/s", "critical speed of the sound rotor"),
    }
    return dataset(variables, coordinates, title=f"{study.title}: run-up")
