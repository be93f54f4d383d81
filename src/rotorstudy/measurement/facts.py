"""Facts about a record, for the quality page and the spectrum file."""

from dataclasses import dataclass, field, fields

import numpy as np


def _fact(unit, long_name):
    return field(default=np.nan, metadata={"unit": unit, "long_name": long_name})


@dataclass
class NodeFacts:
    """Facts about one node in one record; NaN for what a table does not contain."""

    forward_1x: float = _fact("m", "amplitude of harmonic 1")
    backward_1x: float = _fact("m", "amplitude of harmonic -1")
    noise_std: float = _fact("m", "standard deviation of the noise of a sample of x or y")
    variance_shrinkage: float = _fact("1", "weight of the common variance in the covariance")
    correlation_shrinkage: float = _fact("1", "weight of zero correlation in the covariance")
    lines: tuple = ()


@dataclass
class RecordFacts:
    """Facts about one record or one speed of a table; NaN where unknown. nodes : {node: NodeFacts}."""

    where: str
    nodes: dict[int, NodeFacts]
    label: float = _fact("rad/s", "stated speed")
    measured_speed: float = _fact("rad/s", "mean speed from the phase marks")
    revolutions: float = _fact("1", "whole revolutions used")
    blocks: float = _fact("1", "repeat blocks used for the covariance")
    samples_per_revolution: float = _fact("1", "samples per revolution")
    speed_drift: float = _fact("1", "relative change of speed over the record")
    jitter: float = _fact("rad", "standard deviation of the phase marks")
    mark_resolution: float = _fact("rad", "resolution of the phase marks, limited by the sampling")
    missing_pulses: float = _fact("1", "missing keyphasor pulses")
    doubled_pulses: float = _fact("1", "extra keyphasor pulses")
    missing_samples: float = _fact("1", "fraction of missing samples")


def facts_of(kind):
    """[(name, unit, long name)] of the facts of RecordFacts or NodeFacts."""
    return [(one.name, *one.metadata.values()) for one in fields(kind) if one.metadata]


def node_facts(amplitude, harmonics, noise_std=np.nan, shrinkage=(np.nan, np.nan), lines=()):
    """NodeFacts of the amplitudes (harmonic,) of a node, m."""
    size = dict(zip((int(n) for n in harmonics), np.abs(amplitude), strict=True))
    return NodeFacts(size.get(1, np.nan), size.get(-1, np.nan), noise_std, *shrinkage, lines)
