"""Units: factors to SI for units in files, and SI values as text in the units that the reader uses.

In every text `±` is one standard deviation; intervals state their coverage (95 %).
"""

from collections.abc import Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

import numpy as np

METRES = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "mil": 2.54e-5}
DERIVATIVES = {"m/s": (1, 1.0), "mm/s": (1, 1e-3), "in/s": (1, 25.4e-3), "m/s2": (2, 1.0), "g": (2, 9.80665)}
RAD_PER_S = {"rad/s": 1.0, "Hz": 2 * np.pi, "rpm": np.pi / 30}
SECONDS = {"s": 1.0, "ms": 1e-3}
SHOWN = {"rad": ("°", 180 / np.pi), "s": ("ms", 1e3), "1": ("", 1.0)}
LENGTHS = {"um": ("µm", 1e6), "mil": ("mil", 1 / 2.54e-5)}
UNBALANCES = {"g mm": ("g mm", 1e6), "oz in": ("oz in", 1 / (0.028349523125 * 0.0254))}
AMPLITUDES = {"peak_to_peak": ("pp", 2.0), "peak": ("peak", 1.0)}
ENDINGS = {  # of names of options and stated numbers -> unit
    "_rad_per_s": "rad/s", "_rad_per_N_m": "rad/(N m)", "_N_m": "N m", "_rad": "rad", "_m": "m", "_Pa_s": "Pa s",
    "_s": "s",
}  # fmt: skip
SMALL_LENGTH = 1e-3  # m
ANY_ANGLE = np.deg2rad(90.0)  # standard deviation of an angle from which on it may be any
HALF_INTERVAL = 1.959964  # standard deviations: a half of a 95 % interval
LONG = 1e7  # numbers from this size are written with an exponent,
SHORT = 1e-4  # and below this
MOST_DIGITS = 9  # of a number that is known better
LISTED = 8  # speeds; of more, their number and range are said


class Units(NamedTuple):
    """What a reader sees: vibration, unbalance, speeds (the other unit of a speed follows it), 1X over speed."""

    length: str = "um"
    unbalance: str = "g mm"
    speed: str = "rpm"
    amplitude: str = "peak_to_peak"


_units = ContextVar("units")  # what is shown; the defaults of Units outside of any block


@contextmanager
def showing(units: Units):
    """Within the block every text and figure has these units."""
    before = _units.set(units)
    try:
        yield units
    finally:
        _units.reset(before)


def units_shown() -> Units:
    """The units of texts and figures."""
    return _units.get(Units())


def shown_unit(unit: str) -> tuple[str, float]:
    """The display unit of an SI unit, and the factor to it."""
    wanted = units_shown()
    own = {"m": LENGTHS[wanted.length], "kg m": UNBALANCES[wanted.unbalance], "rad/s": shown_speed()}
    return (SHOWN | own).get(unit, (unit, 1.0))


def shown_speed() -> tuple[str, float]:
    """The display unit of a speed in rad/s, and the factor to it."""
    unit = units_shown().speed
    return unit, 1 / RAD_PER_S[unit]


def shown_amplitude() -> tuple[str, float]:
    """The display unit of an amplitude over speed in m, such as 'µm pp', and the factor to it."""
    (unit, factor), (name, times) = shown_unit("m"), AMPLITUDES[units_shown().amplitude]
    return f"{unit} {name}", factor * times


def number(value: float, digits: int = 3) -> str:
    """A number with some significant digits, with an exponent only if it is very large or small: 1140, not 1.14e+03."""
    text = f"{value:.{digits}g}"
    return np.format_float_positional(float(text), trim="-") if SHORT <= abs(value) < LONG else text


def quantity(value: float, unit: str, std: float | None = None, digits: int = 3) -> str:
    """A value, SI, with its unit as engineers write it, digits by its standard deviation: 12.00 ± 0.10 µm."""
    if unit == "rad" and std is not None and std >= ANY_ANGLE:
        return "any angle"
    unit, factor = shown_unit(unit)
    if std is None or not np.isfinite(std):
        return f"{number(value * factor, digits)} {unit}".strip()
    return f"{' ± '.join(as_certain_as((value * factor, std * factor), std * factor))} {unit}".strip()


def um(metres: float, digits: int = 2) -> str:
    """A length of vibration: 55 µm."""
    return quantity(metres, "m", digits=digits)


def spin(speed: float, digits: int = 4) -> str:
    """A speed in rad/s as text, in the reader's unit first: 3600 rpm (377 rad/s)."""
    return spins([speed], digits)


def spins(speeds, digits: int = 4) -> str:
    """Speeds in rad/s as text: 2865, 3342 and 3600 rpm (300, 350 and 377 rad/s); of many their number and range."""
    if len(speeds) > LISTED:
        return f"{len(speeds)} speeds from {spin(min(speeds), digits)} to {spin(max(speeds), digits)}"
    first = units_shown().speed
    second = "rad/s" if first == "rpm" else "rpm"
    both = [[number(w / RAD_PER_S[unit], digits) for w in speeds] for unit in (first, second)]
    own, other = (" and ".join(filter(None, [", ".join(one[:-1]), one[-1]])) for one in both)
    return f"{own} {first} ({other} {second})"


def as_certain_as(values: Sequence[float], std: float) -> list[str]:
    """Numbers rounded to two significant digits of a standard deviation, with one exponent: 1.184e+07, 0.054e+07."""
    largest = max(map(abs, values))
    power = int(np.floor(np.log10(largest))) if largest >= LONG or 0 < largest < SHORT else 0
    digits = power - (int(np.floor(np.log10(std))) - 1 if std > 0 else power - 3)
    if digits > MOST_DIGITS:
        return [f"{value:.{2 if value == std else MOST_DIGITS}g}" for value in values]
    exponent = f"e{power:+03d}" * bool(power)
    return [f"{round(value / 10.0**power, digits) + 0.0:.{max(0, digits)}f}{exponent}" for value in values]


def ends_of_interval(value: float, std: float, least: float = -np.inf, most: float = np.inf) -> tuple[float, float]:
    """The 95 % interval of a normally distributed value, as far as it is possible; all of it if none of it is."""
    low, high = value - HALF_INTERVAL * std, value + HALF_INTERVAL * std
    return (max(low, least), min(high, most)) if low < most and high > least else (low, high)


def interval(unit: str, std: float, ends: tuple[float, float]) -> str:
    """An interval, in SI, with the digits of a standard deviation: 11.80 to 12.20 µm."""
    unit, factor = shown_unit(unit)
    return f"{' to '.join(as_certain_as([factor * end for end in ends], std * factor))} {unit}".strip()


def with_interval(value: float, std: float, unit: str, ends: tuple[float, float] | None = None) -> str:
    """A value in its unit with its standard deviation and its 95 % interval: 100.2 ± 4.0 mm (95 %: 92.4 to 108.0).

    Angles, unbalances and lengths below 1 mm are written in the reader's units; an angle may be any. ends : of the
    interval; 1.96 standard deviations from the value by default
    """
    if unit == "rad" and std >= ANY_ANGLE:
        return "any angle"
    low, high = ends or ends_of_interval(value, std)
    if unit in ("rad", "kg m") or (unit == "m" and abs(value) < SMALL_LENGTH):
        unit, factor = shown_unit(unit)
        value, std, low, high = (factor * one for one in (value, std, low, high))
    value, std, low, high = as_certain_as((value, std, low, high), std)
    own = "" if unit == "1" else f" {unit}"
    return f"{value:>9} ± {std}{own} (95 %: {low} to {high})"


def unit_ending(name: str) -> tuple[str, str]:
    """The ending of a name that states a unit, and that unit: ("_rad_per_s", "rad/s"); empty without one."""
    return next(((ending, unit) for ending, unit in ENDINGS.items() if name.endswith(ending)), ("", ""))


def percent(share: float, digits: int = 3) -> str:
    """A share in percent: 12.3 %."""
    return f"{number(100 * share, digits)} %"


def p_value(value: float) -> str:
    """A p-value: p = 0.012, or p < 1e-6."""
    return "p < 1e-6" if value < 1e-6 else f"p = {value:.2g}"
