"""Noise for Monte Carlo studies: seeded by trial, so that chunks and cores cannot change a result."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class NoiseModel:
    """in_time : white on each sample, else drawn a harmonic;  one_draw : used at every speed."""

    in_time: bool = False
    one_draw: bool = False


MODELS = {
    "per harmonic": NoiseModel(),
    "per harmonic, same at all speeds": NoiseModel(one_draw=True),
    "white in time": NoiseModel(in_time=True),
}


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
    if not MODELS[model].in_time:
        return level * size / np.sqrt(2)
    fluctuating = (spectrum.harmonics != 0)[:, None]
    rms = np.sqrt(np.sum(size**2 * fluctuating, axis=1, keepdims=True) / 2)
    return np.broadcast_to(level * rms / np.sqrt(samples), size.shape)


def noisy(amplitude, std, numbers, model):
    """(trial, speed, harmonic, sensor) harmonics with noise; numbers (trial, 2, speed, harmonic, sensor)."""
    if MODELS[model].one_draw:
        numbers = numbers[:, :, :1]
    return amplitude + std * (numbers[:, 0] + 1j * numbers[:, 1])
