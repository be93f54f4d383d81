"""How accurately depth, position and angle of a crack can be found: Cramer-Rao bounds, and what they rest on."""

from functools import cache

import numpy as np

from rotorstudy.diagnosis.search.candidates import shape_ranges
from rotorstudy.errors import CannotAct
from rotorstudy.inference.prior import Prior
from rotorstudy.studies.common import SPEED, sweep
from rotorstudy.studies.crack_study.sensitivity import SHAPE, Machine, bounds

OF_SHAPE = ("position of the crack, m", "depth over diameter, 1", "angle of the crack, rad")


def accuracy(config):
    """A Dataset of Cramer-Rao bounds of a crack of the main rotor, in a record without a baseline."""
    machine, planes = Machine(config, config.main), config.main.planes
    position, depths = machine.positions(config.accuracy.positions), config.accuracy.depth_ratios

    @cache
    def columns(place, depth):
        crack = machine.crack(place, depth, config.accuracy.angles_rad[0])
        return crack, machine.columns(crack)

    def bound(names, percent, place, depth):
        try:
            crack, changes = columns(place, depth)
        except CannotAct:
            return {}
        return {"bound": _bounds(machine, changes, percent, machine.chosen(planes[names]), crack)}

    told, along = {"bound": (("shape",), "SI", "Cramer-Rao bound")}, ("planes", "noise", "position", "depth_ratio")
    coordinates = {
        "planes": (list(planes), "1", "nodes with probes"),
        "noise": (np.array(config.noise_percent), "percent", "white noise on each sample, of the rms vibration"),
        "position": (position, "m", "position on the shaft, from node 1"),
        "depth_ratio": (np.array(depths), "1", "depth over diameter"),
        "shape": (list(SHAPE), "1", ", ".join(OF_SHAPE)),
        "harmonic_group": (list(groups(config)), "1", "harmonics used"),
        "speed": (machine.speed, *SPEED),
        "confounder": (list(config.main.confounders), "1", "effect that may be present too"),
    }
    others = _of_the_reference(config, machine)
    return sweep(coordinates, along, bound, told, others, title=f"{config.title}: Cramer-Rao bounds")


def groups(config):
    """Name -> harmonics: all, and the forward and backward ones of each order alone."""
    orders = sorted({abs(n) for n in config.harmonics})
    alone = {f"{n}X": [n, -n] for n in orders}
    return {"all": None, **alone, "without 1X": [n for n in config.harmonics if abs(n) != 1]}


def _of_the_reference(config, machine):
    crack, percent = machine.crack(**config.reference.model_dump()), config.usual_noise_percent
    columns, everything = machine.columns(crack), machine.chosen()

    def bound(chosen):
        return _bounds(machine, columns, percent, chosen, crack)

    by_harmonic = [bound(machine.chosen(harmonics=group)) for group in groups(config).values()]
    by_speed = [bound(machine.chosen(speeds=[w])) for w in machine.speed]
    by_speeds = [bound(machine.chosen(speeds=machine.speed[: i + 1])) for i in range(len(machine.speed))]
    with_others = []
    for other in machine.others.values():
        with_others.append(_bounds(machine, machine.columns(crack, other), percent, everything, crack, other))
    told = "Cramer-Rao bound of the reference crack"
    found = {
        "bound_by_harmonic": ("harmonic_group", by_harmonic, ", some harmonics alone"),
        "bound_by_speed": ("speed", by_speed, ", one speed alone"),
        "bound_by_speeds": ("speed", by_speeds, ", all speeds up to that one"),
        "bound_with": ("confounder", with_others, " if another effect is free, too"),
    }
    return {"bound_of_reference": (("shape",), bound(everything), "SI", told)} | {
        name: ((dim, "shape"), np.array(values), "SI", f"{told}{what}") for name, (dim, values, what) in found.items()
    }


def _bounds(machine, columns, percent, chosen, crack, *others):
    prior = machine.work(machine.raw, *others).prior.plus(Prior.independent(crack.prior))
    ranges = shape_ranges(crack.effect, machine.model.structure)
    widths = [ranges[name].high - ranges[name].low for name in SHAPE]
    return bounds((columns / machine.std(percent)[:, None])[chosen], prior.whitener, widths)
