"""Measured frequency responses of what bearings stand on: motion over force, as impact tests give them."""

from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.channel_names import unit_of
from rotorstudy.measurement.uff import UFF_ORDERS, uff_sets
from rotorstudy.units import percent

AHEAD = 0.9  # share of the frequencies; of a foundation without damping, noise alone gives one half
COLUMNS = ("frequency_Hz", "response", "force", "real", "imaginary")
UFF_AXES, RESPONSE_FUNCTION = "xyz", 4  # codes of data set 58
UFF_UNITS = {"abscissa": ("Hz",), "ordinate": ("m", "m/s", "m/s2"), "orddenom": ("n",)}  # that its labels may state


def receptances_in(file: str | Path, order: int = 0) -> tuple[np.ndarray, dict]:
    """Frequencies, rad/s, and {(response, force): (frequency,) m/N} of a CSV (COLUMNS, of a derivative) or a UFF 58."""
    path = Path(file)
    if not path.is_file():
        raise RotorstudyError(f"file {file} does not exist; give its path from the rig file")
    return _receptances(path, order, path.stat().st_mtime_ns)


@lru_cache(maxsize=16)
def _receptances(path, order, changed):
    """As `receptances_in`, of a file as it was changed last."""
    found = _of_uff(path) if path.suffix.lower() in (".uff", ".unv") else _of_csv(path, order)
    frequency = next(iter(found.values()), ((), (), 0))[0]
    wrong = [f"{high:g} Hz after {low:g} Hz" for low, high in pairwise([0.0, *frequency]) if not high > low]
    if wrong:
        raise RotorstudyError(f"{path}: the frequencies must increase from above zero, but {wrong[0]} is stated")
    if len(frequency) < 2:
        raise RotorstudyError(f"{path}: one frequency tells no mass from a stiffness; give two or more")
    for pair, (own, values, _) in found.items():
        if not len(own) == len(values) == len(frequency) or np.any(own != frequency) or not np.isfinite(values).all():
            raise RotorstudyError(
                f"{path}: the response at {pair[0]} to a force at {pair[1]} has other "
                "frequencies than the first, or values that are no numbers; export all with the same frequencies"
            )
    omega = 2 * np.pi * frequency
    receptances = {pair: values / (1j * omega) ** power for pair, (_, values, power) in found.items()}
    for (response, force), values in receptances.items():
        ahead = np.mean(values.imag > 0)
        if response == force and ahead > AHEAD:
            raise RotorstudyError(
                f"{path}: the motion at {response} runs ahead of a force there at {percent(ahead)} of the frequencies, "
                "which no foundation does; state its 'quantity:', or change the sign of the imaginary part"
            )
    return omega, receptances


def _of_csv(path, order):
    """{(response, force): (frequency, Hz, values, order of the derivative)} of a CSV file."""
    from rotorstudy.measurement.conventions import CsvLayout  # late: with pydantic, which plugins load without
    from rotorstudy.measurement.text_table import numbers_of, text_in

    text = text_in(path, CsvLayout())
    if set(text) != {*COLUMNS}:
        raise RotorstudyError(f"{path}: needs the columns {', '.join(COLUMNS)}")
    frequency, real, imaginary = (numbers_of(text, name, path) for name in ("frequency_Hz", "real", "imaginary"))
    pairs = [tuple(one.replace(" ", "") for one in pair) for pair in zip(text["response"], text["force"], strict=True)]
    of = {pair: np.array([one == pair for one in pairs]) for pair in dict.fromkeys(pairs)}
    return {pair: (frequency[rows], (real + 1j * imaginary)[rows], order) for pair, rows in of.items()}


def _of_uff(path):
    """The same of the frequency response functions of a UFF file; a force against an axis turns the sign.

    Rotations, moments and scalars are left out.
    """
    found = {}
    for one in uff_sets(path)[0]:
        ends = [(one.get(f"{end}_node"), one.get(f"{end}_dir", 0)) for end in ("rsp", "ref")]
        if one["func_type"] == RESPONSE_FUNCTION and all(0 < abs(axis) <= len(UFF_AXES) for _, axis in ends):
            pair = tuple(f"{node}{UFF_AXES[abs(direction) - 1]}" for node, direction in ends)
            order = UFF_ORDERS.get(one["ordinate_spec_data_type"], 0)
            for axis, known in UFF_UNITS.items():
                unit = unit_of(str(one.get(f"{axis}_axis_units_lab") or ""))
                if unit not in (None, *known):
                    raise RotorstudyError(
                        f"{path}: the response at {pair[0]} to a force at {pair[1]} is in '{unit}'; export it in SI "
                        "units (Hz, m, m/s or m/s2 per N)"
                    )
            found[pair] = one["x"], one["data"] * np.sign(ends[0][1] * ends[1][1]), order
    if not found:
        raise RotorstudyError(f"{path} has no frequency response function in a data set 58")
    return found
