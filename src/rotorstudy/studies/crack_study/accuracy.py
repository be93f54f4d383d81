"""How accurately depth, position and angle of a crack can be found: Cramer-Rao bounds, and what they rest on."""

from itertools import product

import numpy as np

from rotorstudy.diagnosis.search.candidates import shape_ranges
from rotorstudy.errors import CannotAct
from rotorstudy.inference.prior import Prior
from rotorstudy.store import dataset
from rotorstudy.studies.common import SPEED
from rotorstudy.studies.crack_study.sensitivity import SHAPE, Machine, bounds

OF_SHAPE = ("position of the crack, m", "depth over diameter, 1", "angle of the crack, rad")


def accuracy(study):
    """A Dataset of Cramer-Rao bounds of a crack of the main rotor, in a record without a baseline."""
    machine, planes = Machine(study, study.main), study.main.planes
    length = machine.model.structure.length
    position = (np.arange(study.accuracy.positions) + 0.5) / study.accuracy.positions * length
    depths, angle = study.accuracy.depth_ratios, study.accuracy.angles_rad[0]
    shape = (len(planes), len(study.noise_percent), len(position), len(depths), len(SHAPE))
    bound = np.full(shape, np.nan)
    for (i, place), (j, depth) in product(enumerate(position), enumerate(depths)):
        try:
            crack = machine.crack(place, depth, angle)
        except CannotAct:
            continue
        columns = machine.columns(crack)
        for (p, nodes), (n, percent) in product(enumerate(planes.values()), enumerate(study.noise_percent)):
            bound[p, n, i, j] = _bounds(machine, columns, percent, machine.chosen(nodes), crack)
    dims = ("planes", "noise", "position", "depth_ratio", "shape")
    variables = {"bound": (dims, bound, "SI", "Cramer-Rao bound"), **_of_the_reference(study, machine)}
    coordinates = {
        "planes": (list(planes), "1", "nodes with probes"),
        "noise": (np.array(study.noise_percent), "percent", "white noise on each sample, of the rms vibration"),
        "position": (position, "m", "position on the shaft, from node 1"),
        "depth_ratio": (np.array(depths), "1", "depth over diameter"),
        "shape": (list(SHAPE), "1", ", ".join(OF_SHAPE)),
        "harmonic_group": (list(groups(study)), "1", "harmonics used"),
        "speed": (machine.speed, *SPEED),
        "confounder": (list(study.main.confounders), "1", "effect that may be present too"),
    }
    return dataset(variables, coordinates, title=f"{study.title}: Cramer-Rao bounds")


def groups(study):
    """Name -> harmonics: all, and the forward and backward ones of each order alone."""
    orders = sorted({abs(n) for n in study.harmonics})
    alone = {f"{n}X": [n, -n] for n in orders}
    return {"all": None, **alone, "without 1X": [n for n in study.harmonics if abs(n) != 1]}


def _of_the_reference(study, machine):
    crack, percent = machine.crack(**study.reference.model_dump()), study.usual_noise_percent
    columns, everything = machine.columns(crack), machine.chosen()

    def bound(chosen):
        return _bounds(machine, columns, percent, chosen, crack)

    by_harmonic = [bound(machine.chosen(harmonics=group)) for group in groups(study).values()]
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
