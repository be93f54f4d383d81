"""Invariants of cracks: a breathing function that only reduces stiffness, equal in time and frequency; and depths."""

import numpy as np

from rotorstudy.authoring.invariants.base import HARMONICS, ROUND_OFF, BrokenInvariant, claimed, require
from rotorstudy.authoring.invariants.bench import SERIES_ORDER, bench_structure, check_round_trip
from rotorstudy.errors import RotorstudyError
from rotorstudy.model import cracks
from rotorstudy.model.entries import apply_entries
from rotorstudy.model.options import check_options, option_names
from rotorstudy.model.terms import Term
from rotorstudy.response.integration import force_in_time

GRID = 4_000  # angles
FOURIER_GRID = 40_000  # the error of the Fourier sums of a jump is its height divided by this number
DIRECTIONS = ("xi", "eta", "xi-eta")
SHAFT = {"stiffness": 7.6e5, "span_m": 0.45}


def _angles(count=GRID):
    return (np.arange(count) + 0.5) * 2 * np.pi / count


def crack_is_bounded(plugin):
    """has a breathing function between 0 (closed) and 1 (open), along xi and eta"""
    check_options(plugin.function, plugin.example, f"example of '{plugin.name}'", option_names(plugin.function)[:1])
    values = cracks.breathing_function(plugin, _angles(), plugin.example)
    for name, value in zip(DIRECTIONS[:2], values, strict=False):
        low, high = value.min(), value.max()
        bounded = low >= -1e-12 and high <= 1 + 1e-12
        require(bounded, f"the breathing function along {name} goes from {low:.3g} to {high:.3g}")


def crack_never_stiffens(plugin):
    """reduces the stiffness in every direction at every angle, by at most the whole loss"""
    xi, eta, both = cracks.breathing_function(plugin, _angles(), plugin.example)
    middle, radius = (xi + eta) / 2, np.hypot((xi - eta) / 2, both)
    low, high = (middle - radius).min(), (middle + radius).max()
    require(low >= -1e-12, f"in some direction it adds {-low:.3g} of the loss, whose matrix has a negative eigenvalue")
    require(high <= 1 + 1e-12, f"in some direction it removes {high:.3g} times the loss")


def crack_is_periodic(plugin):
    """is periodic with the revolution"""
    angle = _angles()
    one, other = (cracks.breathing_function(plugin, a, plugin.example) for a in (angle, angle + 2 * np.pi))
    off = np.abs(one - other).max()
    require(off < ROUND_OFF, f"a revolution later the breathing function differs by up to {off:.3g}")


@claimed("symmetric")
def crack_is_symmetric(plugin):
    """opens as it closes: xi and eta even in the angle, xi-eta odd"""
    angle = _angles()
    mirrored = cracks.breathing_function(plugin, -angle, plugin.example) * np.array([1, 1, -1])[:, None]
    off = np.abs(cracks.breathing_function(plugin, angle, plugin.example) - mirrored).max()
    require(off < ROUND_OFF, f"opening and closing differ by up to {off:.3g}")


def crack_series_is_the_function(plugin):
    """has a Fourier series that agrees with its breathing function, mean included"""
    angle, series = _angles(FOURIER_GRID), cracks.crack_series(plugin, SERIES_ORDER, plugin.example)
    values = cracks.breathing_function(plugin, angle, plugin.example)
    highest = max(abs(k) for k in series)
    require(highest <= SERIES_ORDER, f"series({SERIES_ORDER}) gives coefficient {highest}")
    for k in range(-SERIES_ORDER, SERIES_ORDER + 1):
        numerical = np.mean(values * np.exp(-1j * k * angle), axis=-1)
        told, mirrored = series.get(k, np.zeros(3)), np.conj(series.get(-k, np.zeros(3)))
        for name, one, other, back in zip(DIRECTIONS, told, numerical, mirrored, strict=True):
            require(
                abs(one - other) < (2 / FOURIER_GRID if plugin.series else 2 / cracks.SAMPLES),
                f"coefficient {k} of the series along {name} is {one:.4g}, of the function {other:.4g}",
            )
            told = f"coefficients {k} and {-k} along {name} are not conjugate: no real function has them"
            require(abs(one - back) < 1e-13, told)


def crack_force_is_its_table(plugin):
    """has the force of the stiffness lost at each shaft angle, for any angular position"""
    structure, position, w = bench_structure(), 0.8, 88.0
    time = np.arange(256) * 2 * np.pi / w / 256
    (loss,) = cracks.crack_parameters(plugin, structure, False, SERIES_ORDER, angle_rad=position, **plugin.example)
    motion = np.exp(1j * np.outer(w * time, [0, 1, -1])) @ np.array([1.0, 0.5j, 0.3])
    angle = w * time + position
    rotating = motion * np.exp(-1j * angle)
    series = cracks.crack_series(plugin, SERIES_ORDER, plugin.example)
    xi, eta, both = sum(np.outer(s, np.exp(1j * k * angle)) for k, s in series.items()).real
    expected = (xi * rotating.real + both * rotating.imag) + 1j * (both * rotating.real + eta * rotating.imag)
    force = force_in_time(loss.entries, w, time, motion[:, None])[:, 0]
    off = np.abs(force - expected * np.exp(1j * angle)).max()
    require(off < ROUND_OFF, f"the force of one unit of loss differs by {off:.3g} N from the stiffness lost")
    (at_rest,) = cracks.crack_parameters(plugin, structure, True, SERIES_ORDER, **plugin.example)
    still = apply_entries(at_rest.entries, np.zeros((1, len(HARMONICS), 1), complex), [w], HARMONICS, np.ones(1))
    off = np.abs(still[0, :, 0] - cracks.participation_factors(plugin, HARMONICS, SERIES_ORDER, plugin.example)).max()
    require(off < ROUND_OFF, f"the participation factors differ by {off:.3g} from the weight-dominant force")


def crack_is_found_again(plugin):
    """is identified from its own response, with and without weight dominance, from a start 30 % off"""
    structure = bench_structure()
    for dominance in (True, False):
        parameters = tuple(cracks.crack_parameters(plugin, structure, dominance, **plugin.example))
        check_round_trip(Term(plugin.name, parameters, {p.name: p.typical for p in parameters}), structure)


def _depths(plugin):
    return np.linspace(*plugin.valid, 26)


def depth_is_monotone(plugin):
    """has a compliance that is zero at zero depth and increases with it, larger along xi than along eta"""
    check_options(plugin.function, plugin.example, f"example of '{plugin.name}'", option_names(plugin.function)[:1])
    found = np.array([cracks.compliance(plugin, depth, **plugin.example) for depth in _depths(plugin)])
    if plugin.valid[0] == 0:
        require(np.abs(found[0]).max() == 0, f"at zero depth the compliance is {found[0].max():.3g} rad/(N m)")
    require((np.diff(found, axis=0) > 0).all(), "the compliance does not increase with the depth")
    require((found[1:, 0] >= found[1:, 1]).all(), "the compliance is larger along eta than along the weak direction xi")


def depth_keeps_to_its_range(plugin):
    """rejects a depth outside its stated range"""
    low, high = plugin.valid
    require(0 <= low < high <= 1, f"{low:g} to {high:g} is not a valid range of the depth ratio")
    for outside in (low - 0.01, high + 0.01, float("nan")):
        try:
            cracks.compliance(plugin, outside, **plugin.example)
        except RotorstudyError:
            continue
        raise BrokenInvariant(f"it accepts the depth ratio {outside:g}")


def depth_comes_back(plugin):
    """follows from its stiffness loss, which grows with it and is less than the whole stiffness"""
    last, stiffness = 0.0, SHAFT["stiffness"]
    for depth in _depths(plugin)[1:-1:4]:
        loss = cracks.stiffness_loss(plugin, depth, **SHAFT, **plugin.example)
        told = f"depth {depth:.3g} takes {loss.xi:.6g} N/m along xi and {loss.eta:.6g} N/m along eta"
        less = 0 < loss.eta <= loss.xi < stiffness
        require(less, f"{told} of {stiffness:g} N/m; it must take more along xi, and not all")
        require(loss.xi > last, f"at depth {depth:.6g} the loss {loss.xi:.6g} N/m is that of a smaller depth too")
        last = loss.xi
