"""What the study of cracks computes: five of its stages, each a Dataset of its configuration."""

from functools import cache
from itertools import product

import numpy as np

from rotorstudy.diagnosis.one_cause.answer import identified
from rotorstudy.diagnosis.search.shape_fit import fitted_from
from rotorstudy.errors import CannotAct, NoSteadyState, RotorstudyError
from rotorstudy.inference.estimate import estimate_by
from rotorstudy.inference.prediction import predicted
from rotorstudy.inference.prior import Prior
from rotorstudy.inference.problem import Problem
from rotorstudy.measurement.noise import standard_normal
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.model.registry import registry
from rotorstudy.response.floquet import periodic_growth_rate
from rotorstudy.response.measured import measured_response
from rotorstudy.response.whirl import critical_speeds, time_invariant
from rotorstudy.studies.common import results
from rotorstudy.studies.crack_study.sensitivity import SHAPE, Machine, explained_away, visibility

FREEDOM = 3  # position, depth and angle
BASELINES = ("none", "healthy record")
DETECTED = 1e-4  # accuracy of the size that is needed


def needed_visibility(false_alarm, power):
    """Size of a change in standard deviations at which a chi-square test with three degrees of freedom has a power."""
    from scipy.optimize import brentq
    from scipy.stats import chi2, ncx2

    least = chi2.isf(false_alarm, FREEDOM)
    return float(np.sqrt(brentq(lambda square: ncx2.sf(least, FREEDOM, square) - power, 1e-3, 1e3, xtol=DETECTED)))


def detection_probability(seen, false_alarm):
    """(...,) power of that test for changes of some sizes (...) in standard deviations."""
    from scipy.stats import chi2, ncx2

    return ncx2.sf(chi2.isf(false_alarm, FREEDOM), FREEDOM, np.maximum(seen, 1e-6) ** 2)


def smallest(depths, seen, needed):
    """(...,) depth at which the visibility (..., depth), a power between depths, reaches what is needed, or NaN."""
    logs, found = np.log(np.maximum(seen, 1e-300)), np.full(seen.shape[:-1], np.nan)
    for place in np.ndindex(found.shape):
        rising = np.maximum.accumulate(logs[place])
        if np.isnan(rising).any() or rising[-1] < np.log(needed):
            continue
        i = min(max(int(np.searchsorted(rising, np.log(needed))) - 1, 0), len(depths) - 2)
        slope = (rising[i + 1] - rising[i]) / np.log(depths[i + 1] / depths[i])
        if slope > 0:
            found[place] = depths[i] * np.exp((np.log(needed) - rising[i]) / slope)
    return found


def limits(config):
    """A Dataset of the visibility of cracks at their worst angle, and of the smallest one detected, over shafts."""
    import xarray as xr

    depths, needed = config.map.depth_ratios, needed_visibility(config.false_alarm, config.power)
    common = {"noise": config.noise_percent, "baseline": list(BASELINES), "depth_ratio": depths}
    title, found = f"{config.title}: smallest crack detected", []
    for name, rotor in config.rotors.items():
        machine = Machine(config, rotor)
        position = machine.positions(config.map.positions)
        seen = _visibilities(config, machine, position)
        own = {"planes": list(rotor.planes), "position": position, "visibility": seen}
        own["smallest_depth"] = smallest(depths, seen, needed)
        own["diameter"] = [machine.model.structure.section_at(s).outer_diameter_m for s in position]
        of_rotor = results("limits", title, **common, **own, needed_visibility=needed)
        found.append(of_rotor.rename({key: f"{key}_{name}" for key in own}))
    return xr.merge(found)


def _visibilities(config, machine, position):
    """(planes, noise, baseline, position, depth) visibility of cracks on a machine, of the least visible angle."""
    grid = list(product(position, config.map.depth_ratios, config.map.angles_rad))
    changes = np.array([machine.change(*one) for one in grid])
    found = np.empty((len(machine.rotor.planes), len(config.noise_percent), len(BASELINES), len(grid)))
    others = machine.others.values()
    base, known = machine.healthy_columns(*others), machine.work(machine.raw, *others).prior.whitener
    for (p, nodes), (n, percent) in product(enumerate(machine.rotor.planes.values()), enumerate(config.noise_percent)):
        chosen, std = machine.chosen(nodes), machine.std(percent)
        columns = (base / std[:, None])[chosen]
        healthy = np.vstack([columns, known])  # what a record before the crack says, and the rig file
        for b, before in enumerate((known, healthy)):
            found[p, n, b] = visibility((changes / std)[:, chosen], explained_away(columns, before))
    shape = (len(position), len(config.map.depth_ratios), len(config.map.angles_rad))
    return found.reshape(*found.shape[:-1], *shape).min(axis=-1)


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
        return {"bound": machine.bounds(changes, percent, crack, machine.chosen(planes[names]))}

    along = {"planes": list(planes), "noise": np.array(config.noise_percent)}
    along |= {"position": position, "depth_ratio": np.array(depths)}
    given = {"shape": list(SHAPE), "harmonic_group": list(groups(config)), "speed": machine.speed}
    given |= {"confounder": list(config.main.confounders), **_of_the_reference(config, machine)}
    return results("accuracy", f"{config.title}: Cramer-Rao bounds", tuple(along), bound, **along, **given)


def groups(config):
    """Name -> harmonics: all, and the forward and backward ones of each order alone."""
    orders = sorted({abs(n) for n in config.harmonics})
    alone = {f"{n}X": [n, -n] for n in orders}
    return {"all": None, **alone, "without 1X": [n for n in config.harmonics if abs(n) != 1]}


def _of_the_reference(config, machine):
    crack, percent = machine.crack(**config.reference.model_dump()), config.usual_noise_percent
    columns = machine.columns(crack)

    def bound(chosen):
        return machine.bounds(columns, percent, crack, chosen)

    every, speed = machine.chosen(), machine.speed
    others = ((machine.columns(crack, one), percent, crack, every, one) for one in machine.others.values())
    return {
        "bound_of_reference": bound(every),
        "bound_by_harmonic": [bound(machine.chosen(harmonics=group)) for group in groups(config).values()],
        "bound_by_speed": [bound(machine.chosen(speeds=[w])) for w in speed],
        "bound_by_speeds": [bound(machine.chosen(speeds=speed[: i + 1])) for i in range(len(speed))],
        "bound_with": [machine.bounds(*one) for one in others],
    }


def trials(config):
    """A Dataset of fits of the reference crack to noisy records; rigs are drawn from their prior, fits start true."""
    machine, settings = Machine(config, config.main), config.trials
    percent, depths = config.usual_noise_percent, settings.depth_ratios

    def at(depth):
        errors, stated = [], []
        crack = machine.crack(**{**config.reference.model_dump(), "depth_ratio": depth})
        model, names = machine.whole.plus(crack.term), (*machine.prior.names, *crack.names)
        prior = machine.prior.plus(Prior.independent(crack.prior))
        cracked, theta = machine.model.plus(crack.term), np.concatenate([machine.model.theta, [1.0]])
        changed = machine.healthy + (predicted(cracked, machine.raw, theta) - machine.healthy)
        spectrum = machine.noisy_spectrum(changed, percent)
        size = len(prior.names) + 2 * spectrum.amplitude.size
        for draw in standard_normal(settings.seed, depths.index(depth), settings.count, size):
            true, noise = np.split(draw, [len(prior.names)])
            theta = model.filled(names, prior.mean + prior.factor @ true)
            work = machine.work(machine.drawn(spectrum, predicted(model, spectrum, theta), noise))
            fitted = fitted_from(work, [crack], np.concatenate([machine.prior.mean, [1.0]]))
            found = identified(work, fitted, [fitted]).cause
            errors.append([found.shape[name] - crack.shape[name] for name in SHAPE])
            stated.append([found.shape_std[name] for name in SHAPE])
        bound = machine.bounds(machine.columns(crack), percent, crack)
        return {"error": errors, "stated_std": stated, "bound": bound}

    given = {"depth_ratio": depths, "trial": np.arange(settings.count), "shape": list(SHAPE), "seed": settings.seed}
    return results("noisy_records", f"{config.title}: noisy records", ("depth_ratio",), at, **given)


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
    given = {"depth_ratio": depths, "speed": speed, "order": orders}
    given |= {"critical": np.arange(1, len(criticals) + 1), "critical_speed": criticals, "shown_node": settings.node}
    return results("passage", f"{config.title}: run-up", ("depth_ratio", "speed"), at, **given)


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
    return results("thesis_method", f"{config.title}: the thesis's method", ("position",), loss, position=position)
