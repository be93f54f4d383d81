"""Gap voltages in tables of amplitude and phase: where the shaft runs in its bearing, from where it lay at rest."""

import re

import numpy as np

from rotorstudy.measurement.conventions import Conventions, combine
from rotorstudy.measurement.tables import numbers_of
from rotorstudy.measurement.text_table import header_of, text_in
from rotorstudy.measurement.wide_tables import speed_column
from rotorstudy.units import RAD_PER_S

GAP = re.compile(r"(?P<probe>.+?)[\s_:,;/-]+(?:dc[\s_:,;/-]*)?gap\b.*", re.IGNORECASE)  # "DE X Gap (V)"
USUAL_V_PER_M = 7874.0  # 200 mV/mil, API 670


def gap_positions(path, conventions: Conventions) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """Mean positions by the gap voltages of a table, of nodes whose probes all have theirs.

    A voltage rises (becomes less negative) as the shaft comes nearer, for a probe whose `sign` is 1.

    returns : {node: (speed (row,), rad/s, position (row,), complex, m, from where the shaft lay at rest)}
    raises  : RotorstudyError for a cell that is no number
    """
    names, units, _ = header_of(path, conventions.csv)
    columns = {match["probe"].strip(): name for name in names if (match := GAP.fullmatch(name))}
    speed = speed_column(names, units)
    probes = [p for p in conventions.probes if p.channel in columns and p.gap_at_rest_V is not None]
    if not probes or speed is None:
        return {}
    text, found = text_in(path, conventions.csv), {}
    turning = numbers_of(text, speed[0], path) * RAD_PER_S[speed[1].replace("rad_per_s", "rad/s")]
    for node in {p.node for p in probes}:
        own = [p for p in probes if p.node == node]
        moved = [
            p.sign * (numbers_of(text, columns[p.channel], path) - p.gap_at_rest_V)
            / (p.sensitivity_V_per_m or USUAL_V_PER_M)
            for p in own
        ]  # fmt: skip
        if len(own) > 1:
            found[node] = turning, combine(conventions.direction_rad([p.angle_deg for p in own]), moved)
    return found
