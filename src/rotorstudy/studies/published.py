"""Numbers that others printed beside ours: a rig file, and beside it a table (CSV) of what was printed of that machine.

A row of the table is a number as it was printed, with `quantity` and `unit`; `at`, the number of a mode or a node (of
the shape of a mode, both: `1/3`); `speed` with its unit; `change`, other values of items of the rig
(`bearings.bearing_stiffness_N_per_m=1e6`, or with a label `bearings.left....`, several separated by blanks); its
`source`. It agrees if it is the same when rounded as printed. Where that cannot be asked, `tolerance` is a relative
difference, with the `reason`.
"""

from copy import deepcopy
from decimal import Decimal, InvalidOperation
from functools import cached_property, partial
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.model.bearings import dynamic_stiffness
from rotorstudy.model.rig import build_model
from rotorstudy.response.harmonic import harmonic_response
from rotorstudy.response.stability import eigenvalues
from rotorstudy.response.statics import static_deflection, static_loads
from rotorstudy.response.whirl import OVERDAMPED, critical_speeds, damped_modes, time_invariant
from rotorstudy.units import RAD_PER_S
from rotorstudy.yaml_file import read_yaml

COLUMNS = ["quantity", "at", "speed", "change", "value", "unit", "tolerance", "reason", "source"]
SI = {**RAD_PER_S, **dict.fromkeys(["1/s", "m", "N", "N/m", "N s/m", "1"], 1.0), "MN/m": 1e6, "kN s/m": 1e3}
AT_REST = 1e-9  # rad/s, where modes are those at standstill
FURTHER = 1.02  # critical speeds are sought up to this multiple of the highest one printed
CROSSINGS = 80  # speeds between which critical speeds are sought


def beside_printed(rig: str | Path):
    """A DataFrame of the numbers printed in the table (.csv) of the name of a rig file, beside ours.

    Each has the `computed` value in the unit printed, the relative `deviation`, and the difference `allowed`.
    """
    path = Path(rig).with_suffix(".csv")
    rows = pd.read_csv(path, dtype=str, keep_default_na=False)
    if list(rows.columns) != COLUMNS:
        raise RotorstudyError(f"{path}: columns {list(rows.columns)}; expected {COLUMNS}")
    given, computed = read_yaml(rig), {}
    for (change, speed), group in rows.groupby(["change", "speed"], sort=False):
        where = f"{path}, line {group.index[0] + 2}"
        machine = _Machine(_changed(given, change, where), _speed(speed, where), group)
        for line, row in group.iterrows():
            computed[line] = machine.quantity(row, f"{path}, line {line + 2}")
    rows["computed"] = pd.Series(computed)
    rows["allowed"] = [_allowed(row, f"{path}, line {line + 2}") for line, row in rows.iterrows()]
    printed = rows.value.astype(float)
    rows["deviation"] = (rows.computed - printed) / printed.where(printed != 0)
    rows["agrees"] = (rows.computed - printed).abs() <= rows.allowed
    return rows.assign(model=Path(rig).stem)


def _changed(rig, change, where):
    """The rig with other values of its items, as a row states them."""
    rig = deepcopy(rig)
    for one in change.split():
        path, _, value = one.partition("=")
        section, *label, key = path.split(".")
        items = [item for item in rig.get(section, []) if label in ([], [str(item.get("label"))])]
        if not items or not value:
            raise RotorstudyError(f"{where}: change '{one}'; expected section.key=value or section.label.key=value")
        for item in items:
            item[key] = float(value)
    return rig


def _speed(text, where):
    """A speed with its unit, rad/s; 0 if none is stated."""
    value, _, unit = text.partition(" ")
    check_known("unit of the speed", [unit] if text else [], RAD_PER_S, where)
    return float(value or 0) * RAD_PER_S.get(unit, 1.0)


def _allowed(row, where):
    """Largest difference from the printed value, in its unit: half of its last digit, or as stated."""
    try:
        printed, stated = Decimal(row.value), Decimal(row.tolerance or 0)
    except InvalidOperation:
        raise RotorstudyError(f"{where}: value '{row.value}' and tolerance '{row.tolerance}' must be numbers") from None
    if bool(row.tolerance) != bool(row.reason):
        raise RotorstudyError(f"{where}: a tolerance needs a reason, and a reason a tolerance")
    return float(abs(stated * printed) if row.tolerance else Decimal("0.5").scaleb(printed.as_tuple().exponent))


class _Machine:
    """A rig at a speed, and what is printed of it."""

    def __init__(self, rig, speed, rows):
        self.model, self.speed, self.rows = build_model(rig), speed, rows

    def quantity(self, row, where):
        """The value of a row, in its unit."""
        check_known("quantity", [row.quantity], QUANTITIES, where)
        check_known("unit", [row.unit], SI, where)
        return float(QUANTITIES[row.quantity](self, *map(int, row["at"].split("/")))) / SI[row.unit]

    @cached_property
    def whirl(self):
        """Eigenvalues (mode,) of the motions that oscillate, 1/s, each with a positive frequency."""
        values = eigenvalues(self.model, [max(self.speed, AT_REST)])[0]
        both = len(values) == 2 * len(self.model.structure.dofs)  # isotropic: backward whirl has a negative frequency
        values = np.where(values.imag < 0, values.conj(), values) if both else values[values.imag > 0]
        return values[values.imag > OVERDAMPED * np.abs(values)]

    @cached_property
    def modes(self):
        return damped_modes(self.model, [self.speed], len(self.whirl))

    @cached_property
    def criticals(self):
        """Critical speeds of forward and of any whirl, rad/s."""
        named = self.rows[self.rows.quantity.str.endswith("critical_speed")]
        highest = FURTHER * max(float(row.value) * SI[row.unit] for _, row in named.iterrows())
        speeds = np.geomspace(highest / 100, highest, CROSSINGS)
        forward, backward = critical_speeds(time_invariant(self.model), highest, (1, -1), speeds=speeds)
        return forward, np.sort(np.concatenate([forward, backward]))

    @cached_property
    def deflection(self):
        return static_deflection(self.model, [self.speed or 1.0], self.model.theta).value.reshape(-1)

    def load(self, node):
        loads = static_loads(self.model, self.deflection, self.speed or 1.0)
        return sum(load.force.real for load in loads if load.node == node)

    @cached_property
    def response(self):
        """1X and -1X (2, dof), m."""
        return harmonic_response(self.model, [self.speed], [1, -1])[0]

    def axes(self, node):
        """Forward and backward part of the 1X orbit, and its amplitudes along x and y, m."""
        forward, backward = self.response[:, self.model.structure.index(node)]
        return np.abs([forward, backward, forward + backward.conj(), forward - backward.conj()])

    def axis_ratio(self, mode, node):
        """Minor over major axis of a mode's orbit, positive for forward whirl."""
        at = self.model.structure.index(node)
        forward, backward = np.abs(self.modes.forward[0, mode - 1, at]), np.abs(self.modes.backward[0, mode - 1, at])
        return (forward - backward) / (forward + backward)

    def coefficient(self, node, part, place):
        """Stiffness (part 0) or damping (1) of the bearing at the node of a rotor that has one coordinate."""
        (term,) = (term for term in self.model.terms if term.carries)
        stiffness = dynamic_stiffness(term, [self.speed], [1])[0, 0, *map("xy".index, place)]
        return stiffness.imag / self.speed if part else stiffness.real


def _nth(values, n):
    """The n-th, from 1; NaN if there are fewer."""
    return values[n - 1] if n <= len(values) else np.nan


QUANTITIES = {
    "natural_frequency": lambda machine, n: _nth(np.sort(np.abs(machine.whirl)), n),
    "damped_frequency": lambda machine, n: _nth(np.sort(machine.whirl.imag), n),
    "growth_rate": lambda machine, n: _nth(machine.whirl[np.argsort(machine.whirl.imag)].real, n),
    "forward_critical_speed": lambda machine, n: _nth(machine.criticals[0], n),
    "critical_speed": lambda machine, n: _nth(machine.criticals[1], n),
    "static_deflection": lambda machine, node: machine.deflection[machine.model.structure.index(node)].real,
    "bearing_load": lambda machine, node: machine.load(node),
    "amplitude_x": lambda machine, node: machine.axes(node)[2],
    "amplitude_y": lambda machine, node: machine.axes(node)[3],
    "major_axis": lambda machine, node: machine.axes(node)[:2].sum(),
    "axis_ratio": _Machine.axis_ratio,
}
for _part, _name in enumerate(("stiffness", "damping")):
    for _place in product("xy", repeat=2):
        QUANTITIES[f"{_name}_{''.join(_place)}"] = partial(_Machine.coefficient, part=_part, place=_place)
