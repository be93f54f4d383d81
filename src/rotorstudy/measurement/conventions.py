"""The section `measurement:` of a rig file: channels, their units and the directions of the probes."""

from itertools import zip_longest
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt, Lt

from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.structure import Reading
from rotorstudy.response.coupling import check_harmonics
from rotorstudy.units import DERIVATIVES, METRES, RAD_PER_S, spin

LEAST_ANGLE_RAD = 0.05  # between the probes of a node: nearly parallel ones show one direction, not an orbit
SAME_SPEED = 0.02  # relative difference of two stated speeds
HARMONICS = [0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5]
WHITESPACE = (" ", r"\s+")  # separators that stand for any number of spaces and tabs


class Probe(Strict):
    """A displacement probe, or a transducer of velocity or acceleration; docs/measured_records.md has every key."""

    channel: str
    node: int | None = None
    angle_deg: float
    unit: Literal["m", "mm", "um", "mil", "V", "m/s", "mm/s", "in/s", "m/s2", "g"] | None = None
    sensitivity_V_per_m: Annotated[float, Gt(0)] | None = None
    sign: Literal[1, -1] = 1
    gap_at_rest_V: float | None = None
    on: str | int | None = None
    relative_to: str | int | None = None

    @property
    def order(self):
        """Of the derivative of the displacement by time that it shows."""
        return DERIVATIVES.get(self.unit, (0,))[0]

    def in_metres(self, stated, where):
        """This probe, in the unit that the file states (or None) if the rig states none, and its factor to SI."""
        unit = one_unit(self.channel, stated, self, "unit", (*METRES, *DERIVATIVES, "V"), where)
        channel, per_metre = f"{where}: channel '{self.channel}'", self.sensitivity_V_per_m
        if unit is None:
            raise RotorstudyError(f"{channel} has no unit; state 'unit:' in the rig file ({', '.join(METRES)}, V)")
        if unit == "V" and per_metre is None:
            raise RotorstudyError(f"{channel} is in V; give sensitivity_V_per_m")
        if unit in METRES and per_metre is not None:
            raise RotorstudyError(f"{channel} is in {unit}; remove sensitivity_V_per_m, of V")
        size = 1 / per_metre if unit == "V" else METRES.get(unit) or DERIVATIVES[unit][1]
        return self.model_copy(update={"unit": unit}), self.sign * size


class Keyphasor(Strict):
    """The phase mark and its sensor, at angles in the sense of the user; docs/measured_records.md has every key."""

    channel: str = "keyphasor"
    sensor_angle_deg: float = 0.0
    mark_angle_deg: float = 0.0
    edge: Literal["center", "rising", "falling"] = "center"
    polarity: Literal["positive", "negative", "auto"] = "auto"
    threshold_V: float | None = None
    hysteresis: Annotated[float, Ge(0), Lt(1)] = 0.2


class CsvLayout(Strict):
    """Layout of a CSV file: lines above the header, and between the header and the numbers."""

    separator: Literal[",", ";", "\t", "|", ":", *WHITESPACE] = ","
    decimal: Literal[".", ","] = "."
    skip_rows: Annotated[int, Ge(0)] = 0
    unit_rows: Annotated[int, Ge(0)] = 0


class Conventions(Strict):
    """The section `measurement:`; docs/measured_records.md explains every key."""

    rotation: Literal["with_angles", "against_angles"] = "with_angles"
    gravity_angle_deg: float = 0.0
    probes: list[Probe] = []
    keyphasor: Keyphasor = Keyphasor()
    time_channel: str = "time"
    time_unit: Literal["s", "ms"] = "s"
    sample_rate_Hz: Annotated[float, Gt(0)] | None = None
    speed_channel: str | None = None
    speed_unit: Literal["rad/s", "Hz", "rpm"] = "rad/s"
    speeds_rad_per_s: dict[str, Annotated[float, Gt(0)]] = {}
    speeds_Hz: dict[str, Annotated[float, Gt(0)]] = {}
    speeds_rpm: dict[str, Annotated[float, Gt(0)]] = {}
    harmonics: list[int] = HARMONICS
    csv: CsvLayout = CsvLayout()
    table_node: int | None = None
    table_noise_m: Annotated[float, Ge(0)] = 0.0
    table_phase: Literal["lead", "lag"] = "lead"
    table_amplitude: Literal["peak", "peak_to_peak", "rms"] = "peak"
    displacement_zero: Literal["at_rest", "unloaded_line"] = "at_rest"
    slow_roll_below_rpm: Annotated[float, Gt(0)] | None = None
    node_of_label: dict[int | str, int] = {}

    def as_text(self):
        """What a spectrum depends on, as JSON, without defaults; slow roll is taken off afterwards."""
        return self.model_dump_json(exclude_defaults=True, exclude={"slow_roll_below_rpm"})

    @property
    def channels(self):
        """Names of the channels of a record."""
        others = self.time_channel, self.keyphasor.channel, *filter(None, [self.speed_channel])
        return [*dict.fromkeys([*(probe.channel for probe in self.probes), *others])]

    @property
    def sense(self):
        """1 if the shaft rotates in the direction of the user's angles, else -1."""
        return 1 if self.rotation == "with_angles" else -1

    @property
    def shaft_angles(self):
        """How angles on the shaft are counted in these conventions, in words."""
        return f"from the shaft's reference line {'in' if self.sense > 0 else 'against'} the sense of rotation"

    def direction_rad(self, angle_deg):
        """Angle in rad from x, in the sense of rotation, of a direction in the user's angles (degrees)."""
        return self.sense * np.deg2rad(np.asarray(angle_deg) - self.gravity_angle_deg)

    @property
    def mark_rad(self):
        """Angle (rad) of the shaft's reference line from x when the mark passes its sensor."""
        mark = self.sense * np.deg2rad(self.keyphasor.mark_angle_deg)
        return float(self.direction_rad(self.keyphasor.sensor_angle_deg) - mark)

    def reading(self, nodes, directions=()):
        """The Reading of records of some nodes. directions : (node,) rad of their only probes, NaN for orbits."""
        reading = Reading({}, float(self.sense * np.deg2rad(self.gravity_angle_deg)), self.mark_rad)
        for node, only in zip_longest(nodes, directions, fillvalue=np.nan):
            own = [probe for probe in self.probes if probe.node in (None, node)]
            if own:
                reading.probes[node] = {one.channel: float(self.direction_rad(one.angle_deg)) for one in own}
            if np.isfinite(only):
                each = reading.probes_at(node).items()
                along = {name: a for name, a in each if abs(np.sin(a - only)) < LEAST_ANGLE_RAD}
                reading.probes[node] = along or {"probe": float(only)}
        return reading

    def node(self, label, where):
        """Node of the rig for the label of a node in a file."""
        label, *given = (str(one).removesuffix(".0") for one in (label, *self.node_of_label))
        if not given and label.isdecimal():
            return int(label)
        known = dict(zip(given, self.node_of_label.values(), strict=True))
        check_known("node label", [label], known, f"{where}; list it under 'measurement: node_of_label:'")
        return known[label]

    @property
    def stated_speeds(self):
        """[(name of a file, key that states its speed, rad/s)]."""
        given = {f"speeds_{unit.replace('/', '_per_')}": factor for unit, factor in RAD_PER_S.items()}
        return [(name, key, w * factor) for key, factor in given.items() for name, w in getattr(self, key).items()]

    def label_rad_per_s(self, path, own=None):
        """The speed stated for a file, and by the file itself (`own`), in rad/s, or None; RotorstudyError if two."""
        stated = next((speed for name, _, speed in self.stated_speeds if name == path.name), None)
        if None not in (own, stated) and not abs(own / stated - 1) <= SAME_SPEED:
            raise RotorstudyError(
                f"{path}: the file states a speed of {spin(own)}, the rig {spin(stated)}; correct or leave out "
                "'measurement: speeds_...' or 'speed_channel:'"
            )
        return own if stated is None else stated


def one_unit(channel, stated, section, key, known, where):
    """The unit of a channel: as the file states it (or None), or a key of a section; RotorstudyError if they differ."""
    own = getattr(section, key)
    if stated is None or own == stated:
        return own
    if stated not in known:
        raise RotorstudyError(
            f"{where}: channel '{channel}' is in '{stated}', which is not read; convert it to one of "
            f"{', '.join(known)}, or take the text out of the file if it is no unit"
        )
    if own is not None and key in section.model_fields_set:
        raise RotorstudyError(
            f"{where}: the file states the unit '{stated}' for channel '{channel}', the rig '{own}'; correct the wrong "
            f"one ('{key}:')"
        )
    return stated


def read_conventions(rig, where):
    """The Conventions of a rig dict; without a section `measurement:` those of the project's own records."""
    where = f"{where}, measurement"
    found = check_config(Conventions, {} if rig.get("measurement") is None else rig["measurement"], where)
    if 1 not in check_harmonics(found.harmonics, f"{where}.harmonics"):
        raise RotorstudyError(f"{where}.harmonics: harmonic 1 is missing, which the checks of the record need")
    named = [name for name, *_ in found.stated_speeds]
    twice = sorted({name for name in named if named.count(name) > 1})
    if twice:
        raise RotorstudyError(f"{where}: the speed of '{twice[0]}' is given in two units; keep one")
    return found


def check_once(probes, where, of_nodes=False):
    """RotorstudyError if two probes read one signal. of_nodes : the file has signals of a name for each node."""
    signals = [(probe.channel, probe.node if of_nodes else None) for probe in probes]
    for channel, _ in (one for one in signals if signals.count(one) > 1):
        raise RotorstudyError(f"{where}: '{channel}' is that of two probes under 'measurement: probes:'")


def measured_direction(directions_rad):
    """Direction (rad) of the first of probes at directions (probe,) if all show only that one; NaN for an orbit."""
    spread = np.linalg.svd(_axes(directions_rad), compute_uv=False)
    single = len(directions_rad) < 2 or spread[-1] < LEAST_ANGLE_RAD
    return float(directions_rad[0]) if single else np.nan


def combine(directions_rad, readings):
    """z = x + j y (time,), m, by least squares from probes (probe, time); of one direction, the motion along it."""
    along = measured_direction(directions_rad)
    if np.isfinite(along):
        same = np.sign(np.cos(np.asarray(directions_rad) - along))
        return np.exp(1j * along) * np.mean(same[:, None] * np.asarray(readings), axis=0)
    x, y = np.linalg.pinv(_axes(directions_rad)) @ np.asarray(readings)
    return x + 1j * y


def _axes(directions_rad):
    """(probe, 2) unit vectors."""
    return np.column_stack([np.cos(directions_rad), np.sin(directions_rad)])
