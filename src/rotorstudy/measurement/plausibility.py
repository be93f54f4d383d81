"""Checks of the harmonics of all speeds against what a shaft can do, and against what the rig predicts."""

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.findings import Finding
from rotorstudy.measurement.quality import DEAD, SIGNIFICANT
from rotorstudy.measurement.single_probe import along_probes
from rotorstudy.response.measured import measured_response
from rotorstudy.units import METRES, RAD_PER_S, number, um

BACKWARD = 2.0  # ratio of backward to forward 1X
HUGE_M, TINY_M = 5e-3, 1e-9  # more than a shaft can vibrate, less than a probe resolves
SCALE = 20.0  # ratio to the predicted vibration, either way; mil taken as µm gives 25
NEAR = 5.0  # ratio to the predicted vibration at which a confusion of units is named
CLOSE_DEG = 10.0  # between the probes of a node, which are mounted further apart; 90 taken as radians gives 1.6
FAST = 8.0  # times the lowest natural frequency, beyond which few machines run; rpm taken as rad/s gives 9.5
APART = 3.0  # times the sag plus the rms vibration: a mean further from the predicted one is a probe gap


def check_together(spectrum, rig, where):
    """Findings that need all speeds: units, mean, probes and sense of rotation, against the prediction of the rig."""
    harmonics, nodes = list(spectrum.harmonics), spectrum.sensors
    moving = spectrum.harmonics != 0
    fluctuating = np.abs(spectrum.amplitude[:, moving])
    variance = np.diagonal(spectrum.covariance, axis1=-2, axis2=-1)
    std = np.sqrt(sum(np.swapaxes(part, 1, 2) for part in np.split(variance, 2, axis=-1)))[:, moving]
    rms = np.sqrt(np.sum(fluctuating**2, axis=1))
    largest, expected, mean = _expected(rig, spectrum)
    findings = check_units(rms, largest, where)
    findings += check_detected(fluctuating, std, expected.max(axis=0), nodes, where)
    if 0 in harmonics:
        findings += check_mean(spectrum.amplitude[:, harmonics.index(0)], mean, rms, nodes, where)
    if -1 in harmonics:
        orbits = np.isnan(spectrum.directions)
        forward, turned = (np.abs(spectrum.amplitude[:, harmonics.index(n), orbits]) for n in (1, -1))
        backward = (expected[1] > expected[0])[orbits]
        nodes = [node for node, whole in zip(nodes, orbits, strict=True) if whole]
        findings += check_sense(forward, turned, backward, nodes, where)
    directions = dict(zip(spectrum.sensors, spectrum.directions.tolist(), strict=True))
    return findings + check_directions({n: a for n, a in directions.items() if np.isfinite(a)}, where)


def _expected(rig, spectrum):
    """Prediction by the rig's own values, m: largest amplitude or None; rms +1X and -1X (2, sensor); 0X there.

    Without values for all parameters the largest amplitude is the static deflection, and no whirl is predicted.
    """
    try:
        shown = measured_response(rig, spectrum.speed, [1, -1, 0])
        shown = along_probes(shown, [1, -1, 0], spectrum.directions)
    except RotorstudyError:
        deflection = rig.structure.static_deflection
        return float(np.abs(deflection).max()) or None, np.zeros((2, len(rig.sensors))), deflection[list(rig.measured)]
    size = np.abs(shown[:, :2])
    return float(size.max()) or None, np.sqrt(np.mean(size**2, axis=0)), shown[:, 2]


def check_units(fluctuating, expected, where):
    """Whether rms amplitudes (speed, node), m, without the mean are plausible for a shaft; expected : m, or None."""
    largest = float(np.max(fluctuating))
    if largest == 0:
        return [Finding("error", "units", where, "no vibration in any harmonic; check the probes and their columns")]
    if largest > HUGE_M or largest < TINY_M:
        what = "more than a shaft can move" if largest > HUGE_M else "less than a probe can resolve"
        text = f"vibration of {um(largest, 3)} rms is {what}; check the units ({_fitting(largest, expected)})"
        return [Finding("error", "units", where, text)]
    if expected and not expected / SCALE < largest < expected * SCALE:
        text = (
            f"vibration of {um(largest, 3)} rms where the rig predicts {um(expected)}; check the units "
            f"({_fitting(largest, expected)}), and the unbalance that the rig states"
        )
        return [Finding("warning", "units", where, text)]
    return []


def _fitting(size, expected):
    """The confusions of units that would bring an amplitude (m) near the expected one, the nearest first."""
    pairs = {(a, b): METRES[a] / METRES[b] for a in METRES for b in METRES if a != b}
    off = {pair: abs(np.log(size * factor / (expected or 5e-5))) for pair, factor in pairs.items()}
    near = sorted((one, pair) for pair, one in off.items() if one < max(min(off.values()) + 1e-6, np.log(NEAR)))
    return " ".join(f"{a} taken as {b}?" for _, (a, b) in near[:3])


def check_detected(amplitude, std, expected, nodes, where):
    """Whether amplitudes (speed, harmonic, node), m, show a vibration where the rig expects one, (node,) m rms."""
    silent = (amplitude <= SIGNIFICANT * std).all(axis=(0, 1))
    told = silent & (expected > DEAD * SIGNIFICANT * std.max(axis=(0, 1)))
    return [
        Finding(
            "error",
            "dead probe",
            f"{where}, node {node}",
            f"no harmonic exceeds the noise at any speed, where the rig predicts {um(expected[i])}: its probes do not "
            "detect the shaft, or the shaft does not vibrate",
        )
        for i, node in enumerate(nodes)
        if told[i]
    ]


def check_stated_speeds(speed, rig, where):
    """Whether the speeds (speed,) rad/s of a table are far above the lowest natural frequency of the rig."""
    fastest, lowest = float(np.max(speed)), rig.structure.scales.frequency
    if fastest <= FAST * lowest:
        return []
    in_rpm = [number(speed / RAD_PER_S["rpm"], 4) for speed in (fastest, lowest)]
    text = (
        f"up to {fastest:.4g} rad/s ({in_rpm[0]} rpm), {fastest / lowest:.3g} times the lowest natural frequency of "
        f"the rig ({in_rpm[1]} rpm); are the speeds in another unit, such as rpm taken as rad/s?"
    )
    return [Finding("warning", "unusual speed", where, text)]


def check_mean(mean, expected, fluctuating, nodes, where):
    """Whether 0X is near the predicted static position: the reading of most proximity probes includes their gap.

    mean, expected : (speed, node) complex, m, measured and predicted;  fluctuating : (speed, node) rms of the rest, m
    """
    off = np.median(np.abs(mean - expected), axis=0)
    allowed = APART * (np.abs(np.atleast_2d(expected)).max(axis=0) + fluctuating.max(axis=0))
    return [
        Finding(
            "warning",
            "probe gap",
            f"{where}, node {node}",
            f"the mean is {um(off[i])} from the static position that the rig predicts, while the shaft vibrates by "
            f"{um(fluctuating[:, i].max())} rms. Does it include the gap of the probes? It would be taken for a "
            "preload. Zero the probes with the shaft at rest, leave 0 out of 'measurement: harmonics:', or give the "
            "rig the effect sensor_gap",
        )
        for i, node in enumerate(nodes)
        if off[i] > allowed[i]
    ]


def check_sense(forward, backward, expected_backward, nodes, where):
    """Whether backward 1X exceeds forward, (speed, node), m, at nodes (node,) where the rig does not predict it."""
    size = np.sqrt(np.sum(forward**2, axis=0)), np.sqrt(np.sum(backward**2, axis=0))
    reversed_nodes = (size[1] > BACKWARD * size[0]) & ~expected_backward
    ratio = size[1] / np.maximum(size[0], 1e-300)
    remedy = (
        "If the shaft does whirl backward here (between the two critical speeds of anisotropic bearings), give the rig "
        "the values of its bearings, so that it predicts this"
    )
    if len(nodes) and reversed_nodes.all():
        text = (
            f"backward 1X is {ratio.min():.3g} times forward or more at every node: reversed rotation, the probes of "
            "all nodes swapped or of the wrong sign, or phases of a table that are leads instead of lags, or the other "
            f"way round. Correct 'rotation:', the probes or 'table_phase:'. {remedy}"
        )
        return [Finding("error", "sense of rotation", where, text)]
    return [
        Finding(
            "error",
            "swapped probes",
            f"{where}, node {node}",
            f"backward 1X is {ratio[i]:.3g} times forward, but not at the other nodes: the two probes of this node are "
            f"swapped, or one has the wrong sign. {remedy}",
        )
        for i, node in enumerate(nodes)
        if reversed_nodes[i]
    ]


def check_probe_angles(probes, where):
    """Whether several probes of a node are too close to each other to be meant so. probes : list of Probe."""
    found = []
    for node in sorted({probe.node for probe in probes if probe.node is not None}):
        angles = np.array([probe.angle_deg for probe in probes if probe.node == node])
        widest = np.abs((angles[:, None] - angles + 180) % 360 - 180).max()
        if len(angles) > 1 and widest < CLOSE_DEG:
            text = (
                f"its probes are only {widest:.2g} degrees apart by 'measurement: probes:', and show one direction "
                "together. Correct the angles; they must be in degrees"
            )
            found.append(Finding("warning", "probe angles", f"{where}, node {node}", text))
    return found


def check_directions(directions, where):
    """A note on the nodes that one direction is measured of. directions : {node: rad}."""
    if not directions:
        return []
    listed = ", ".join(map(str, sorted(directions)))
    text = (
        f"node {listed} has a single probe: only its motion along the probe is measured, and "
        "only the model separates forward from backward. A second probe there would measure the orbit"
    )
    return [Finding("note", "single probe", where, text)]
