"""Noise for Monte Carlo studies, seeded by trial: results do not depend on chunks and cores."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotorstudy.measurement.spectrum import independent_covariance


class NoiseModel(NamedTuple):
    """own_size : proportional to each harmonic, else white in time;  one_draw : the same at every speed."""

    own_size: bool
    one_draw: bool = False


MODELS = {
    "per harmonic": NoiseModel(own_size=True),
    "per harmonic, same at all speeds": NoiseModel(own_size=True, one_draw=True),
    "white in time": NoiseModel(own_size=False),
}


def standard_normal(seed, study, trials, shape):
    """(trial, *shape) standard normal numbers; trial t has its own stream (seed, study, t)."""
    streams = (np.random.SeedSequence(seed, spawn_key=(study, t)) for t in range(trials))
    return np.array([np.random.default_rng(stream).standard_normal(shape) for stream in streams])


def noise_std(spectrum, level, model, samples):
    """(speed, harmonic, sensor) standard deviation, m, of the real and of the imaginary part of each harmonic.

    spectrum : Spectrum without noise;  level : 0.01 for 1 %, of the size of each harmonic, or of the rms of the
    fluctuating part (mean of x and y) as white noise on each of the `samples` samples of whole revolutions
    """
    size = np.abs(spectrum.amplitude)
    if MODELS[model].own_size:
        return level * size / np.sqrt(2)
    fluctuating = (spectrum.harmonics != 0)[:, None]
    rms = np.sqrt(np.sum(size**2 * fluctuating, axis=1, keepdims=True) / 2)
    return np.broadcast_to(level * rms / np.sqrt(samples), size.shape)


def with_noise(spectrum, level, model, samples, numbers=None):
    """A Spectrum without noise with the covariance of noise, see `noise_std`, and noisy trials of it by some numbers.

    numbers : (trial, 2, speed, harmonic, sensor) standard normal
    """
    std = noise_std(spectrum, level, model, samples)
    known = replace(spectrum, covariance=independent_covariance(std**2))
    if numbers is None:
        return known
    numbers = numbers[:, :, :1] if MODELS[model].one_draw else numbers
    return known.with_amplitude(spectrum.amplitude + std * (numbers[:, 0] + 1j * numbers[:, 1]))
