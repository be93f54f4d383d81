"""Noisy records of a crack, identified one by one: whether the Cramer-Rao bound and the stated intervals hold."""

import numpy as np

from rotorstudy.diagnosis.one_cause.answer import identified
from rotorstudy.diagnosis.search.candidates import shape_ranges
from rotorstudy.diagnosis.search.shape_fit import fitted_from
from rotorstudy.inference.prediction import predicted
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.noise import standard_normal
from rotorstudy.store import dataset
from rotorstudy.studies.crack_study.sensitivity import SHAPE, Machine, bounds


def trials(config):
    """A Dataset of fits of the reference crack to noisy records; rigs are drawn from their prior, fits start true."""
    machine, settings = Machine(config, config.main), config.trials
    errors, stated, bound = [], [], []
    for number, depth in enumerate(settings.depth_ratios):
        crack = machine.crack(**{**config.reference.model_dump(), "depth_ratio": depth})
        model, names = machine.whole.plus(crack.term), (*machine.prior.names, *crack.names)
        prior = machine.prior.plus(Prior.independent(crack.prior))
        spectrum = machine.noisy_spectrum(machine.healthy + _shown(machine, crack), config.usual_noise_percent)
        widths = [ends.high - ends.low for ends in shape_ranges(crack.effect, machine.model.structure).values()]
        columns = machine.columns(crack) / machine.std(config.usual_noise_percent)[:, None]
        bound.append(bounds(columns, prior.whitener, widths))
        size = len(prior.names) + 2 * spectrum.amplitude.size
        for draw in standard_normal(settings.seed, number, settings.count, size):
            true, noise = np.split(draw, [len(prior.names)])
            theta = model.stated.copy()
            theta[model.position(names)] = prior.mean + prior.factor @ true
            work = machine.work(machine.drawn(spectrum, predicted(model, spectrum, theta), noise))
            fitted = fitted_from(work, [crack], np.concatenate([machine.prior.mean, [1.0]]))
            found = identified(work, fitted, [fitted]).cause
            errors.append([found.shape[name] - crack.shape[name] for name in SHAPE])
            stated.append([found.shape_std[name] for name in SHAPE])
    shape = (len(settings.depth_ratios), settings.count, len(SHAPE))
    coordinates = {
        "depth_ratio": (np.array(settings.depth_ratios), "1", "depth over diameter"),
        "trial": (np.arange(settings.count), "1", "record"),
        "shape": (list(SHAPE), "1", "position in m, depth over diameter, angle in rad"),
    }
    dims = ("depth_ratio", "trial", "shape")
    variables = {
        "error": (dims, np.reshape(errors, shape), "SI", "estimate less truth"),
        "stated_std": (dims, np.reshape(stated, shape), "SI", "stated standard deviation"),
        "bound": (("depth_ratio", "shape"), np.array(bound), "SI", "Cramer-Rao bound"),
    }
    return dataset(variables, coordinates, title=f"{config.title}: noisy records", seed=settings.seed)


def _shown(machine, crack):
    """(speed, harmonic, sensor) what a crack changes, m."""
    model = machine.model.plus(crack.term)
    return predicted(model, machine.raw, np.concatenate([machine.model.theta, [1.0]])) - machine.healthy
