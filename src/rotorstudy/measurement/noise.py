"""Noise for Monte Carlo studies: seeded by trial, so that chunks and cores cannot change a result."""

from typing import NamedTuple

import numpy as np

from rotorstudy.errors import unknown_name


class NoiseModel(NamedTuple):
    """What a noise model does.

    own_size : each harmonic has noise in proportion to its own size; else all have that of white noise in time
    one_draw : one draw is used at every speed, so that the noise at different speeds is not independent
    """

    own_size: bool
    one_draw: bool = False


MODELS = {
    "per harmonic": NoiseModel(own_size=True),
    "per harmonic, same at all speeds": NoiseModel(own_size=True, one_draw=True),
    "white in time": NoiseModel(own_size=False),
}


def noise_model(name):
    """The NoiseModel of a name; an unknown one is a RotorstudyError."""
    if name not in MODELS:
        raise unknown_name("noise model", name, MODELS)
    return MODELS[name]


def standard_normal(seed, study, trials, shape, first=0):
    """(trial, *shape) standard normal numbers; trial t has its own stream (seed, study, t).

    study : int, keeps the streams of different studies apart
    """
    streams = (np.random.SeedSequence(seed, spawn_key=(study, first + t)) for t in range(trials))
    return np.array([np.random.default_rng(stream).standard_normal(shape) for stream in streams])


def noise_std(spectrum, level, model, samples):
    """Standard deviation of the real and of the imaginary part of each harmonic.

    spectrum : Spectrum without noise;  level : 0.01 for 1 %
    model    : "per harmonic": `level` times the size of that harmonic, circular; "per harmonic, same at all speeds":
               the same, but with one draw used at every speed;
               "white in time": white noise on each sample of x and of y, its std `level` times the rms of the
               fluctuating part of the signal (mean of x and y), seen through whole revolutions of `samples` samples
    returns  : (speed, harmonic, sensor) m
    """
    size = np.abs(spectrum.amplitude)
    if noise_model(model).own_size:
        return level * size / np.sqrt(2)
    fluctuating = (spectrum.harmonics != 0)[:, None]
    rms = np.sqrt(np.sum(size**2 * fluctuating, axis=1, keepdims=True) / 2)
    return np.broadcast_to(level * rms / np.sqrt(samples), size.shape)


def noisy(amplitude, std, numbers, model):
    """(trial, speed, harmonic, sensor) harmonics with noise; numbers (trial, 2, speed, harmonic, sensor)."""
    if noise_model(model).one_draw:
        numbers = numbers[:, :, :1]
    return amplitude + std * (numbers[:, 0] + 1j * numbers[:, 1])
