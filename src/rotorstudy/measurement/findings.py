"""Findings: what is wrong with a record, where, and what to do. Every repair is reported as one."""

from dataclasses import dataclass, field, fields

import numpy as np

SEVERITIES = ("error", "warning", "note")


@dataclass(frozen=True)
class Finding:
    """One thing worth knowing about a record.

    severity : "error" (the record cannot be used), "warning" (used, but to be checked) or "note"
    name     : short name of the kind of finding
    where    : file, speed, node or channel
    text     : what was found, with the value and what is allowed, and what to do
    """

    severity: str
    name: str
    where: str
    text: str

    def __str__(self):
        return " ".join(
            f"{self.severity}: {self.where}: {self.name}: {self.text}".split()
        )  # a name of a file may break


def errors_among(findings):
    """The findings that are errors."""
    return [finding for finding in findings if finding.severity == "error"]


def worst_first(findings):
    """Findings in the order error, warning, note; otherwise as found."""
    return sorted(findings, key=lambda finding: SEVERITIES.index(finding.severity))


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
