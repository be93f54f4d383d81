"""Records in NetCDF files: displacement (speed, node, direction, time) with its phase reference."""

from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from rotorstudy.errors import RotorstudyError, reading, unknown_name
from rotorstudy.measurement.channel_names import unit_of
from rotorstudy.measurement.conventions import Conventions, Probe, check_once
from rotorstudy.measurement.raw_record import assemble
from rotorstudy.units import RAD_PER_S, SECONDS, spin

DIMENSIONS = {  # that variables of a record need, all but the speed
    "displacement": ("node", "direction", "time"),
    "time": ("time",),
    "keyphasor": ("time",),
    "reference": ("time",),
    "phase_mark_time": ("revolution",),
    "speed": (),
}


def existing(path):
    """The Path of a file; RotorstudyError if there is none."""
    path = Path(path)
    if path.is_dir():
        raise RotorstudyError(f"record file '{path}' is a folder; give the files in it")
    if not path.is_file():
        what = "is a device or a pipe; write it to a file" if path.exists() else "does not exist"
        raise RotorstudyError(f"record file '{path}' {what}")
    return path


@contextmanager
def netcdf(path):
    """Context manager: a NetCDF file as an open Dataset; RotorstudyError if it cannot be read."""
    import xarray as xr

    path = existing(path)
    with reading("NetCDF file", path), xr.open_dataset(path, engine="netcdf4", decode_times=False) as opened:
        yield opened


def read_netcdf(path, conventions, nodes):
    """Raw records of a NetCDF file: displacement (speed, node, direction, time), read by the conventions."""
    with netcdf(path) as data:
        _check_netcdf(path, data)
        data = data if "speed" in data.displacement.dims else data.expand_dims("speed")
        if not data.sizes["speed"]:
            raise RotorstudyError(f"{path}: no record; the dimension 'speed' is empty")
        probes, axes, as_read = _probes_of_netcdf(data, conventions)
        time = _scaled(data.time, SECONDS, "s", path)
        speeds = [None] * data.sizes["speed"]
        if "speed" in data.coords:
            speeds = _scaled(data.speed, RAD_PER_S, "rad/s", path)
        for i, speed in enumerate(speeds):
            label = conventions.label_rad_per_s(Path(path), None if speed is None else float(speed))
            where = f"{path}" if label is None else f"{path}, {spin(label, 6)}"
            one = data.isel(speed=i)
            readings = _readings(path, one, probes, conventions, where)
            signals = [one[name].values if name in data else None for name in ("keyphasor", "reference")]
            marks = None
            if "phase_mark_time" in data:
                marks = _scaled(one.phase_mark_time, SECONDS, "s", path).ravel()
                marks = marks[np.isfinite(marks)]
            raw = assemble(readings, axes, nodes, time, label, signals[0], marks, signals[1], where)
            yield replace(raw, conventions=as_read)


def _check_netcdf(path, data):
    """Raise RotorstudyError for a file without displacement, or of other dimensions."""
    if "displacement" not in data and "amplitude" in data:
        raise RotorstudyError(f"{path}: a spectrum, not a record; it is imported already, the other commands take it")
    if "displacement" not in data:
        raise RotorstudyError(f"{path}: no variable 'displacement' (found: {', '.join(map(str, data.data_vars))})")
    for name in (name for name in DIMENSIONS["displacement"] if name not in data.coords):
        raise RotorstudyError(f"{path}: no coordinate '{name}'; displacement needs one for each dimension but speed")
    for name, dims in DIMENSIONS.items():
        if name in data.variables:
            if wrong := wrong_variable(data, name, ("speed", *dims), {"speed"}):
                raise RotorstudyError(f"{path}: {wrong}")
            if not isinstance(unit := data[name].attrs.get("units", ""), str):
                raise RotorstudyError(f"{path}: the unit of {name} is {unit}; needed is a text")


def wrong_variable(data, name, dims, optional=frozenset()):
    """What is wrong with a variable that should be numbers along some dimensions, of which it may lack some; or ""."""
    found = data[name]
    if set(found.dims) | optional != set(dims) | optional:
        return f"{name} has dimensions {found.dims} and coordinates {list(data.coords)}; needed are {dims}"
    return "" if found.dtype.kind in "iuf" else f"the values of {name} are of type {found.dtype}; needed are numbers"


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
    check_once(probes, path, of_nodes=True)
    found = []
    for probe in probes:
        if probe.channel not in directions:
            raise unknown_name("direction", probe.channel, directions, f"{path}; the channel of a probe is a direction")
        factor, d = probe.metres(stated and (unit_of(stated) or stated), str(path)), directions.index(probe.channel)
        found += [(probe, n, factor * values[k, d]) for k, n in enumerate(held_nodes) if probe.node in (None, n)]
    if not found:
        held = ", ".join(map(str, held_nodes))
        raise RotorstudyError(f"{where}: no probe of the rig file is at a node of this file (nodes {held})")
    return found


def _scaled(array, units, default, path):
    """Values of an xarray variable in SI, by its attribute `units`."""
    stated = array.attrs.get("units", default)
    unit = unit_of(stated) or stated
    if unit not in units:
        raise unknown_name(f"unit of {array.name}", unit, units, str(path))
    return np.asarray(array.values, float) * units[unit]
