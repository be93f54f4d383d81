"""Checks of the harmonics of all speeds against what a shaft can do, and against what the rig predicts."""

from difflib import get_close_matches

import numpy as np

from rotorstudy.errors import NotHeld, RotorstudyError
from rotorstudy.measurement.findings import told
from rotorstudy.measurement.quality import DEAD, SIGNIFICANT
from rotorstudy.measurement.spectrum import along_probes
from rotorstudy.response.measured import measured_response
from rotorstudy.response.whirl import check_held
from rotorstudy.units import METRES, spin, um

BACKWARD = 2.0  # ratio of backward to forward 1X
HUGE_M, TINY_M = 5e-3, 1e-9  # more than a shaft can vibrate, less than a probe resolves
SCALE = 20.0  # ratio to the predicted vibration, either way; mil taken as µm gives 25
NEAR = 5.0  # ratio to the predicted vibration at which a confusion of units is named
CLOSE_DEG = 10.0  # between the probes of a node, which are mounted further apart; 90 taken as radians gives 1.6
SENSITIVITY = (300.0, 1e6)  # V/m: of displacement probes; numbers per mil, mm or in mV are smaller or larger
SLOW = 0.005  # times the lowest natural frequency: turning gears are slower; ms taken as s gives 0.001 at it
FAST = 8.0  # times the lowest natural frequency, beyond which few machines run; rpm taken as rad/s gives 9.5
REMEDY = (
    "If the shaft does whirl backward here (between the two critical speeds of anisotropic bearings), give the rig the "
    "values of its bearings, so that it predicts this"
)
ABOVE_1X = 20.0  # ratio of another harmonic at every speed; at half a critical speed alone 2X of a crack may be larger
ONE_SIGNAL = 1e-6  # relative difference of +1X and -1X that noise does not leave
APART = 3.0  # times the sag plus the rms vibration: a mean further from the predicted one is a probe gap


def check_together(spectrum, rig, where):
    """Findings that need all speeds: units, mean, probes and sense of rotation, against the prediction of the rig."""
    harmonics, nodes = list(spectrum.harmonics), spectrum.sensors
    moving = spectrum.harmonics != 0
    fluctuating = np.abs(spectrum.amplitude[:, moving])
    std = np.sqrt(spectrum.variance)[:, moving]
    rms = np.sqrt(np.sum(fluctuating**2, axis=1))
    largest, expected, mean = _expected(rig, spectrum)
    yield from _check_units(rms, largest, where)
    yield from check_order(fluctuating, spectrum.harmonics[moving], where)
    silent, expected_rms = (fluctuating <= SIGNIFICANT * std).all(axis=(0, 1)), expected.max(axis=0)
    for i in np.flatnonzero(silent & (expected_rms > DEAD * SIGNIFICANT * std.max(axis=(0, 1)))):
        yield told("dead probe (predicted)", f"{where}, node {nodes[i]}", expected=um(expected_rms[i]))
    if 0 in harmonics:  # most proximity probes include their gap in the mean
        off, most = np.median(np.abs(spectrum.amplitude[:, harmonics.index(0)] - mean), axis=0), rms.max(axis=0)
        for i in np.flatnonzero(off > APART * (np.abs(np.atleast_2d(mean)).max(axis=0) + most)):
            yield told("probe gap", f"{where}, node {nodes[i]}", off=um(off[i]), rms=um(most[i]))
    if -1 in harmonics:
        orbits = np.isnan(spectrum.directions)
        forward, turned = (np.abs(spectrum.amplitude[:, harmonics.index(n), orbits]) for n in (1, -1))
        backward = (expected[1] > expected[0])[orbits]
        nodes = [node for node, whole in zip(nodes, orbits, strict=True) if whole]
        yield from check_sense(forward, turned, backward, nodes, where)
        same = (np.abs(forward - turned) <= ONE_SIGNAL * forward).all(axis=0) & (forward > 0).all(axis=0)
        yield from (told("one signal", f"{where}, node {node}") for node in np.array(nodes)[same])
    if spectrum.single_probes:
        yield told("single probe", where, nodes=", ".join(map(str, sorted(spectrum.single_probes))))


def _expected(rig, spectrum):
    """Prediction by the rig, m: largest amplitude or None (by its weight alone without values); rms +1X, -1X; 0X."""
    sag = float(np.abs(rig.structure.static_deflection).max()) or None
    try:
        check_held(rig, spectrum.speed.max())
        shown = measured_response(rig, spectrum.speed, [1, -1, 0])
        shown = along_probes(shown, [1, -1, 0], spectrum.directions)
    except NotHeld:
        raise
    except RotorstudyError:
        return sag, np.zeros((2, len(rig.sensors))), rig.structure.static_deflection[list(rig.measured)]
    size = np.abs(shown[:, :2])
    return float(size.max()) or sag, np.sqrt(np.mean(size**2, axis=0)), shown[:, 2]


def _check_units(fluctuating, expected, where):
    """Whether rms amplitudes (speed, node), m, without the mean are plausible for a shaft; expected : m, or None."""
    if not (largest := float(np.max(fluctuating))):
        yield told("units (still)", where)
        return
    said = {"size": um(largest, 3), "confused": _fitting(largest, expected)}
    if largest > HUGE_M or largest < TINY_M:
        what = "more than a shaft can move" if largest > HUGE_M else "less than a probe can resolve"
        yield told("units (impossible)", where, what=what, **said)
    elif expected and not expected / SCALE < largest < expected * SCALE:
        yield told("units", where, expected=um(expected), **said)


def _fitting(size, expected):
    """The confusions of units that would bring an amplitude (m) near the expected one, the nearest first."""
    pairs = {(a, b): METRES[a] / METRES[b] for a in METRES for b in METRES if a != b}
    off = {pair: abs(np.log(size * factor / (expected or 5e-5))) for pair, factor in pairs.items()}
    near = sorted((one, pair) for pair, one in off.items() if one < max(min(off.values()) + 1e-6, np.log(NEAR)))
    return " ".join(f"{a} taken as {b}?" for _, (a, b) in near[:3])


def check_order(amplitude, harmonics, where):
    """Whether another harmonic of amplitudes (speed, harmonic, node), m, is far above 1X at every speed and node."""
    once = np.abs(harmonics) == 1
    above = (amplitude > ABOVE_1X * amplitude[:, once].max(axis=1, keepdims=True)).all(axis=(0, 2))
    n = next(iter(np.abs(harmonics)[above].tolist()), None)
    return [] if n is None else [told("phase mark", where, n=n, times=ABOVE_1X, turns=n)]


def check_speeds(speed, rig, where):
    """Whether the fastest of speeds (speed,) rad/s is far above or below the lowest natural frequency of the rig."""
    fastest, lowest = float(np.max(speed)), rig.structure.scales.frequency
    if not SLOW * lowest <= fastest <= FAST * lowest:
        yield told("unusual speed", where, fastest=spin(fastest), times=fastest / lowest, lowest=spin(lowest))


def check_labels(paths, conventions, where):
    """Whether a file without a stated speed may be one that is named otherwise in the rig file."""
    every, given = {name: key for name, key, _ in conventions.stated_speeds}, [path.name for path in paths]
    unnamed = [name for name in given if name not in every]
    for name in (name for name in every if name not in given):
        for record in get_close_matches(name, unnamed, n=1):
            yield told("speed not used", where, name=name, record=record, section=every[name])


def check_sense(forward, backward, expected_backward, nodes, where):
    """Whether backward 1X exceeds forward, (speed, node), m, at nodes (node,) where the rig does not predict it."""
    size, back = (np.sqrt(np.sum(one**2, axis=0)) for one in (forward, backward))
    turned, ratio = (back > BACKWARD * size) & ~expected_backward, back / np.maximum(size, 1e-300)
    if len(nodes) and turned.all():
        return [told("sense of rotation", where, ratio=ratio.min(), remedy=REMEDY)]
    swapped = np.flatnonzero(turned)
    return [told("swapped probes", f"{where}, node {nodes[i]}", ratio=ratio[i], remedy=REMEDY) for i in swapped]


def check_probes(probes, where):
    """Whether the probes of a node are too close to one line to be meant so, or sensitivities are in other units."""
    for node in dict.fromkeys(probe.node for probe in probes):  # None: at every node of a NetCDF file
        angles = np.array([probe.angle_deg for probe in probes if probe.node == node])
        widest = np.abs((angles[:, None] - angles + 90) % 180 - 90).max()
        if len(angles) > 1 and widest < CLOSE_DEG:
            yield told("probe angles", where if node is None else f"{where}, node {node}", apart=widest)
    for probe in probes:
        given, (low, high) = probe.sensitivity_V_per_m, SENSITIVITY
        if given is not None and not low <= given <= high:
            yield told("sensitivity", where, channel=probe.channel, given=given, low=low, high=high)
