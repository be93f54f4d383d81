"""Facts about a record: what the quality page lists and what a spectrum file keeps beside the spectrum."""

from dataclasses import dataclass, field, fields

import numpy as np


def _fact(unit, long_name):
    return field(default=np.nan, metadata={"unit": unit, "long_name": long_name})


@dataclass
class NodeFacts:
    """Of one node in one record; NaN where a table cannot tell."""

    forward_1x: float = _fact("m", "amplitude of harmonic 1")
    backward_1x: float = _fact("m", "amplitude of harmonic -1")
    noise_std: float = _fact("m", "noise of a sample of x or y")
    variance_shrinkage: float = _fact("1", "weight of equal variances in the covariance")
    correlation_shrinkage: float = _fact("1", "weight of no correlation in the covariance")


@dataclass
class RecordFacts:
    """Of one record or one speed of a table; NaN where it is not known. nodes : {node: NodeFacts}."""

    where: str
    nodes: dict[int, NodeFacts]
    label: float = _fact("rad/s", "speed as labelled")
    measured_speed: float = _fact("rad/s", "mean speed from the phase marks")
    revolutions: float = _fact("1", "whole revolutions used")
    blocks: float = _fact("1", "repeat blocks for the covariance")
    samples_per_revolution: float = _fact("1", "samples a revolution")
    speed_drift: float = _fact("1", "change of speed over the record, relative")
    jitter: float = _fact("rad", "scatter of the phase marks")
    mark_resolution: float = _fact("rad", "resolution of the phase marks by the sampling")
    missing_pulses: float = _fact("1", "keyphasor pulses that did not come")
    doubled_pulses: float = _fact("1", "keyphasor pulses beside the marks")
    missing_samples: float = _fact("1", "part of the samples that is missing")


def facts_of(kind):
    """[(name, unit, long name)] of the facts of RecordFacts or NodeFacts."""
    return [(one.name, *one.metadata.values()) for one in fields(kind) if one.metadata]


def node_facts(amplitude, harmonics, noise_std=np.nan, shrinkage=(np.nan, np.nan)):
    """NodeFacts of harmonics (harmonic,), m."""
    size = dict(zip((int(n) for n in harmonics), np.abs(amplitude), strict=True))
    return NodeFacts(size.get(1, np.nan), size.get(-1, np.nan), noise_std, *shrinkage)
