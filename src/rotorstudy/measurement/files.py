"""Readers of record files: every format gives the same raw record, in metres and in the project's axes."""

from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.measurement.channels import open_csv, open_matlab, open_uff
from rotorstudy.measurement.conventions import Conventions, Probe, combine, measured_direction
from rotorstudy.units import RAD_PER_S, SECONDS

SUFFIXES = {
    ".nc": "netcdf",
    ".nc4": "netcdf",
    ".csv": "csv",
    ".txt": "csv",
    ".mat": "matlab",
    ".uff": "uff",
    ".unv": "uff",
}
UNITS = {"metre": "m", "meter": "m", "µm": "um", "μm": "um", "mils": "mil", "micrometer": "um", "micrometre": "um"}


@dataclass(frozen=True)
class RawRecord:
    """The signals of one speed in a file.

    time         : (time,) s
    channels     : list of Channel
    label        : speed in rad/s that the file or the rig file states, or None
    keyphasor    : (time,) V; marks (mark,) s when the phase mark passed; reference (time,): each may be None
    where        : file and, if it holds several speeds, which one
    conventions  : used to read it: the rig file's, or the project's own for a simulated record
    """

    time: np.ndarray
    channels: list = field(repr=False)
    label: float | None
    keyphasor: np.ndarray | None
    marks: np.ndarray | None
    reference: np.ndarray | None
    where: str
    conventions: object = field(repr=False)

    @property
    def nodes(self):
        """(node,) measured."""
        return tuple(sorted({channel.node for channel in self.channels}))

    def at(self, node):
        """Channels of a node."""
        return [channel for channel in self.channels if channel.node == node]

    @cached_property
    def displacement(self):
        """(node, time) complex x + j y in the project's axes, m; NaN where a sample is missing."""
        found = []
        for node in self.nodes:
            found.append(combine([c.direction for c in self.at(node)], [c.readings for c in self.at(node)]))
        return np.array(found)

    @property
    def directions(self):
        """(node,) rad, direction that the probes of a node show if it is only one, NaN for orbits."""
        return np.array([measured_direction([c.direction for c in self.at(node)]) for node in self.nodes])


class Channel(NamedTuple):
    """The signal of a probe: name, node, direction (rad from x in the sense of rotation), readings (time,) in m."""

    name: str
    node: int
    direction: float
    readings: np.ndarray


def read_file(path, conventions, nodes):
    """Raw records of a file, one for each speed: an iterator, so that only one need be in memory.

    nodes  : (node,) of the rig
    raises : RotorstudyError for a file that cannot be read, or that contradicts the rig file
    """
    path = _existing(path)
    if kind_of(path) == "netcdf":
        yield from _read_netcdf(path, conventions, nodes)
    else:
        yield _from_channels(path, conventions, nodes, *open_channels(path, conventions))


def kind_of(path):
    """Kind of a record file by its suffix: netcdf, csv, matlab or uff; RotorstudyError for another one."""
    kind = SUFFIXES.get(Path(path).suffix.lower())
    if kind is None:
        raise unknown_name("kind of record file", Path(path).suffix, SUFFIXES, str(path))
    return kind


def open_channels(path, conventions):
    """Names of the channels of a file that is no NetCDF file, and a function: name -> (samples,) values."""
    return {"csv": open_csv, "matlab": open_matlab, "uff": open_uff}[kind_of(path)](_existing(path), conventions)


def _existing(path):
    path = Path(path)
    if path.is_dir():
        raise RotorstudyError(f"record file '{path}' is a folder; give the files in it")
    if not path.is_file():
        raise RotorstudyError(f"record file '{path}' does not exist")
    return path


@contextmanager
def netcdf(path):
    """Context manager: a NetCDF file as an open Dataset; RotorstudyError if it cannot be read."""
    import xarray as xr

    path = _existing(path)
    try:
        with xr.open_dataset(path, engine="netcdf4", decode_times=False) as opened:
            yield opened
    except (OSError, ValueError) as error:
        raise RotorstudyError(f"{path}: not a readable NetCDF file ({str(error).splitlines()[0]})") from None


def table_columns(path, conventions):
    """Columns of a CSV file, of which the reader depends; none of another file."""
    if SUFFIXES.get(Path(path).suffix.lower()) != "csv" or not Path(path).is_file():
        return []
    layout = conventions.csv
    with Path(path).open(encoding="utf-8-sig", errors="replace") as lines:
        for _ in range(layout.skip_rows):
            next(lines, "")
        return [name.strip().strip('"') for name in next(lines, "").split(layout.separator)]


def _from_channels(path, conventions, nodes, names, channel):
    """The raw record of a file with named channels; channel(name) gives (samples,) values."""

    def wanted(name, role):
        if name not in names:
            raise unknown_name(f"{role} channel", name, names, str(path))
        return channel(name)

    if not conventions.probes:
        raise RotorstudyError(f"{path}: no probes; list them under 'measurement: probes:' in the rig file")
    readings = []
    for probe in conventions.probes:
        if probe.node is None:
            raise RotorstudyError(f"probe '{probe.channel}' has no 'node:', which is optional for NetCDF files only")
        factor = probe.metres(None, str(path))
        readings.append((probe, probe.node, factor * wanted(probe.channel, "probe")))
    length = len(readings[0][2])
    if conventions.sample_rate_Hz is not None:
        time = np.arange(length) / conventions.sample_rate_Hz
    else:
        time = wanted(conventions.time_channel, "time") * SECONDS[conventions.time_unit]
    key = conventions.keyphasor.channel
    keyphasor = channel(key) if key in names else None
    if keyphasor is None and "keyphasor" in conventions.model_fields_set:
        wanted(key, "keyphasor")
    label = conventions.label_rad_per_s(path.name)
    if conventions.speed_channel is not None:
        speed = wanted(conventions.speed_channel, "speed")
        speed = speed[np.isfinite(speed)]  # an incomplete row has no speed
        label = float(np.mean(speed)) * RAD_PER_S[conventions.speed_unit] if len(speed) else None
    for name, values in [("time", time), ("keyphasor", keyphasor), *((p.channel, r) for p, _, r in readings)]:
        if values is not None and len(values) != length:
            raise RotorstudyError(
                f"{path}: channel '{name}' has {len(values)} samples, '{readings[0][0].channel}' has {length}; "
                "all channels must have the same samples"
            )
    return _assemble(readings, conventions, nodes, time, label, keyphasor, None, None, str(path))


def _assemble(readings, conventions, nodes, time, label, keyphasor, marks, reference, where):
    """A RawRecord from readings [(probe, node, (time,) m)]."""
    time = np.asarray(time, float)
    if len(time) < 3:
        raise RotorstudyError(f"{where}: {len(time)} samples; the file is empty or incomplete")
    if not (np.diff(time) > 0).all():
        raise RotorstudyError(f"{where}: time does not increase strictly; check the time channel")
    for _, node, _ in readings:
        if node not in nodes:
            raise unknown_name("node", node, nodes, f"{where}; the probes must sit at nodes of the rig")
    channels = [
        Channel(probe.channel, node, float(conventions.direction_rad(probe.angle_deg)), values)
        for probe, node, values in readings
    ]
    if label is not None and not 0 < label < np.inf:
        raise RotorstudyError(f"{where}: the stated speed is {label:g} rad/s; it must be positive and finite")
    return RawRecord(time, channels, label, keyphasor, marks, reference, where, conventions)


def _read_netcdf(path, conventions, nodes):
    """Raw records of a NetCDF file: displacement (speed, node, direction, time), read by the conventions."""
    with netcdf(path) as data:
        _check_netcdf(path, data)
        data = data if "speed" in data.displacement.dims else data.expand_dims("speed")
        if not data.sizes["speed"]:
            raise RotorstudyError(f"{path}: no record; the dimension 'speed' is empty")
        probes, axes, as_read = _probes_of_netcdf(data, conventions)
        time = _scaled(data.time, {**SECONDS, "seconds": 1.0}, "s", path)
        speeds = [None] * data.sizes["speed"]
        if "speed" in data.coords:
            speeds = _scaled(data.speed, RAD_PER_S, "rad/s", path)
        for i, speed in enumerate(speeds):
            label = conventions.label_rad_per_s(path.name) if speed is None else float(speed)
            where = f"{path}" if label is None else f"{path}, {label:.6g} rad/s"
            one = data.isel(speed=i)
            readings = _readings(path, one, probes, conventions, where)
            signals = [one[name].values if name in data else None for name in ("keyphasor", "reference")]
            marks = None
            if "phase_mark_time" in data:
                marks = _scaled(one.phase_mark_time, SECONDS, "s", path).ravel()
                marks = marks[np.isfinite(marks)]
            raw = _assemble(readings, axes, nodes, time, label, signals[0], marks, signals[1], where)
            yield replace(raw, conventions=as_read)


def _check_netcdf(path, data):
    """Raise RotorstudyError for a file without displacement, or of other dimensions."""
    if "displacement" not in data:
        raise RotorstudyError(f"{path}: no variable 'displacement' (found: {', '.join(map(str, data.data_vars))})")
    wanted, held = ("speed", "node", "direction", "time"), set(data.displacement.dims)
    if held | {"speed"} != set(wanted) or not set(wanted[1:]) <= set(data.coords):
        raise RotorstudyError(
            f"{path}: displacement has dimensions {data.displacement.dims} and coordinates {list(data.coords)}; "
            f"needed are the dimensions {wanted}, with coordinates for all but speed"
        )


def _probes_of_netcdf(data, conventions):
    """Probes of a file, the conventions of their axes, and those it is read by."""
    x_and_y = [Probe(channel="x", angle_deg=0.0), Probe(channel="y", angle_deg=90.0)]
    directions = {str(name) for name in data.direction.values}
    simulated = "rotorstudy_version" in data.attrs and "reference" in data and directions == {"x", "y"}
    if simulated and not {probe.channel for probe in conventions.probes} & {"x", "y"}:  # in the project's axes
        own = Conventions(harmonics=conventions.harmonics)
        return x_and_y, own, own
    if conventions.probes:
        return conventions.probes, conventions, conventions
    # x and y of the file are those of the project, whatever the user's angles
    axes = conventions.model_copy(update={"rotation": "with_angles", "gravity_angle_deg": 0.0})
    return x_and_y, axes, conventions


def _readings(path, one, probes, conventions, where):
    """Readings [(probe, node, (time,) m)] of one speed."""
    values = one.displacement.transpose("node", "direction", "time").values
    stated = one.displacement.attrs.get("units")
    directions = [str(name) for name in one.direction.values]
    held_nodes = [conventions.node(label, str(path)) for label in one.node.values.tolist()]
    found = []
    for probe in probes:
        if probe.channel not in directions:
            raise unknown_name("direction", probe.channel, directions, f"{path}; the channel of a probe is a direction")
        factor, d = probe.metres(UNITS.get(stated, stated), str(path)), directions.index(probe.channel)
        found += [(probe, n, factor * values[k, d]) for k, n in enumerate(held_nodes) if probe.node in (None, n)]
    if not found:
        held = ", ".join(map(str, held_nodes))
        raise RotorstudyError(f"{where}: no probe of the rig file is at a node of this file (nodes {held})")
    return found


def _scaled(array, units, default, path):
    """Values of an xarray variable in SI, by its attribute `units`."""
    unit = array.attrs.get("units", default)
    if unit not in units:
        raise unknown_name(f"unit of {array.name}", unit, units, str(path))
    return np.asarray(array.values, float) * units[unit]
