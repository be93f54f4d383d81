"""Measured frequency responses of what bearings stand on: motion over force, as impact tests give them."""

import csv
from functools import lru_cache
from pathlib import Path

import numpy as np

from rotorstudy.errors import RotorstudyError

COLUMNS = ("frequency_Hz", "response", "force", "real", "imaginary")
UFF_ORDERS, UFF_AXES, RESPONSE_FUNCTION = {8: 0, 11: 1, 12: 2}, "xyz", 4  # codes of data set 58


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
    if len(frequency) < 2 or frequency[0] <= 0 or (np.diff(frequency) <= 0).any():
        raise RotorstudyError(f"{path}: the frequencies must increase from above zero, two at least")
    for pair, (own, values, _) in found.items():
        if len(own) != len(frequency) or np.any(own != frequency) or not np.isfinite(values).all():
            raise RotorstudyError(
                f"{path}: the response at {pair[0]} to a force at {pair[1]} has other "
                "frequencies than the first, or values that are no numbers; export all with the same frequencies"
            )
    omega = 2 * np.pi * frequency
    return omega, {pair: values / (1j * omega) ** power for pair, (_, values, power) in found.items()}


def _of_csv(path, order):
    """{(response, force): (frequency, Hz, values, order of the derivative)} of a CSV file."""
    rows = {}
    with path.open(newline="", encoding="utf-8-sig") as file:
        reader = csv.DictReader(file)
        if set(reader.fieldnames or ()) != {*COLUMNS}:
            raise RotorstudyError(f"{path}: needs the columns {', '.join(COLUMNS)}")
        for row in reader:
            try:
                frequency, real, imaginary = (float(row[name]) for name in ("frequency_Hz", "real", "imaginary"))
            except (TypeError, ValueError):
                raise RotorstudyError(f"{path}, line {reader.line_num}: a cell is not a number; correct it") from None
            pair = tuple(str(row[name]).replace(" ", "") for name in ("response", "force"))
            rows.setdefault(pair, []).append((frequency, real + 1j * imaginary))
    split = {pair: np.array(values).T for pair, values in rows.items()}
    return {pair: (frequency.real, values, order) for pair, (frequency, values) in split.items()}


def _of_uff(path):
    """The same of the frequency response functions of a UFF file; a force against an axis turns the sign."""
    from rotorstudy.measurement.files import uff_sets  # late: with pydantic, which plugins load without

    found = {}
    for one in uff_sets(path)[0]:
        if one["func_type"] == RESPONSE_FUNCTION:
            ends = [(one[f"{end}_node"], one[f"{end}_dir"]) for end in ("rsp", "ref")]
            pair = tuple(f"{node}{UFF_AXES[abs(direction) - 1]}" for node, direction in ends)
            order = UFF_ORDERS.get(one["ordinate_spec_data_type"], 0)
            found[pair] = one["x"], one["data"] * np.sign(ends[0][1] * ends[1][1]), order
    if not found:
        raise RotorstudyError(f"{path} has no frequency response function in a data set 58")
    return found
