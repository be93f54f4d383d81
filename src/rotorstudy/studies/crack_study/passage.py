"""Run-up of the cracked rotor: its harmonics and the growth of its free motion over speed."""

from functools import cache

import numpy as np

from rotorstudy.errors import NoSteadyState
from rotorstudy.response.floquet import periodic_growth_rate
from rotorstudy.response.measured import measured_response
from rotorstudy.response.whirl import critical_speeds, time_invariant
from rotorstudy.studies.common import SPEED, sweep


def passage(config):
    """A Dataset of harmonics, m, and growth rate, 1/s, of the main rotor, without and with a crack, over speed."""
    settings, main = config.passage, config.main
    speed = np.linspace(settings.lowest_rad_s, settings.highest_rad_s, settings.count)
    depths, orders = np.array([0.0, *settings.depth_ratios]), np.array(settings.orders)

    @cache
    def cracked(depth):
        place = {**config.reference.model_dump(), "depth_ratio": depth}
        return main.model(*([config.crack.effect(**place)] if depth else []))

    def at(depth, w):
        model = cracked(depth)
        try:
            both = np.abs(measured_response(model, [w], [*orders, *-orders])[0, :, model.sensors.index(settings.node)])
            return {"amplitude": both.reshape(2, -1).sum(axis=0), "growth_rate": periodic_growth_rate(model, [w])[0]}
        except NoSteadyState:
            return {}

    criticals = critical_speeds(time_invariant(main.model()), settings.highest_rad_s)[0]
    coordinates = {
        "depth_ratio": (depths, "1", "depth over diameter"),
        "speed": (speed, *SPEED),
        "order": (orders, "1", "multiple of the spin speed"),
        "critical": (np.arange(1, len(criticals) + 1), "1", "critical speed, by frequency"),
    }
    told = {
        "amplitude": (("order",), "m", f"major semi-axis at node {settings.node}"),
        "growth_rate": ((), "1/s", "growth rate of the fastest growing free motion"),
    }
    sound = {"critical_speed": (("critical",), np.array(criticals), "rad/s", "critical speed of the sound rotor")}
    return sweep(coordinates, ("depth_ratio", "speed"), at, told, sound, title=f"{config.title}: run-up")
