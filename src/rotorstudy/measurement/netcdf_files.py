"""NetCDF files: records, displacement (speed, node, direction, time) with its phase reference; and measured spectra.

A spectrum is written by `rotorstudy import`, and read by `identify` and `diagnose`.
"""

from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from rotorstudy.errors import RotorstudyError, check_known, reading
from rotorstudy.measurement.channel_names import unit_of
from rotorstudy.measurement.conventions import Conventions, Probe, check_once
from rotorstudy.measurement.findings import Finding, NodeFacts, RecordFacts, facts_of
from rotorstudy.measurement.raw_record import assemble
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.response.coupling import check_harmonics
from rotorstudy.store import as_complex, dataset
from rotorstudy.units import RAD_PER_S, SECONDS, spin

OF_RECORD = {  # variables of a record: their dimensions but the speed
    "displacement": ("node", "direction", "time"),
    "time": ("time",),
    "keyphasor": ("time",),
    "reference": ("time",),
    "phase_mark_time": ("revolution",),
    "speed": (),
}
OF_SPECTRUM = {  # variables of a measured spectrum
    "amplitude": ("speed", "harmonic", "node", "part"),
    "covariance": ("speed", "node", "component", "other_component"),
    "probe_direction": ("node",),
    **{name: (name,) for name in ("speed", "harmonic", "node")},
}
OF_FINDING = ("severity", "name", "where", "text")
LARGEST_NODE = 10**6
COVARIANCE = "covariance of real and imaginary parts of the harmonics"
DIRECTION = "direction of the only probe of a node from x in the sense of rotation, NaN where the orbit is measured"


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
        if not (count := data.sizes["speed"]):
            raise RotorstudyError(f"{path}: no record; the dimension 'speed' is empty")
        probes, axes, as_read = _probes_of_netcdf(data, conventions)
        time = _scaled(data.time, SECONDS, "s", path)
        speeds = _scaled(data.speed, RAD_PER_S, "rad/s", path).tolist() if "speed" in data.coords else [None] * count
        for i, speed in enumerate(speeds):
            label = conventions.label_rad_per_s(Path(path), speed)
            where = f"{path}" if label is None else f"{path}, {spin(label, 6)}"
            one = data.isel(speed=i)
            readings = _readings(path, one, probes, conventions, where)
            keyphasor, reference = (one[name].values if name in data else None for name in ("keyphasor", "reference"))
            marks = _scaled(one.phase_mark_time, SECONDS, "s", path) if "phase_mark_time" in data else None
            marks = None if marks is None else marks[np.isfinite(marks)]
            raw = assemble(readings, axes, nodes, time, label, keyphasor, marks, reference, where)
            yield replace(raw, conventions=as_read)


def _check_netcdf(path, data):
    """Raise RotorstudyError for a file without displacement, or of other dimensions."""
    if "displacement" not in data and "amplitude" in data:
        raise RotorstudyError(f"{path}: a spectrum, not a record; it is imported already, the other commands take it")
    if "displacement" not in data:
        raise RotorstudyError(f"{path}: no variable 'displacement' (found: {', '.join(map(str, data.data_vars))})")
    for name in (name for name in OF_RECORD["displacement"] if name not in data.coords):
        raise RotorstudyError(f"{path}: no coordinate '{name}'; displacement needs one for each dimension but speed")
    for name, dims in OF_RECORD.items():
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
        check_known("direction", [probe.channel], directions, f"{path}; the channel of a probe is a direction")
        probe, factor = probe.in_metres(stated and (unit_of(stated) or stated), str(path))
        d = directions.index(probe.channel)
        found += [(probe, n, factor * values[k, d]) for k, n in enumerate(held_nodes) if probe.node in (None, n)]
    if not found:
        held = ", ".join(map(str, held_nodes))
        raise RotorstudyError(f"{where}: no probe of the rig file is at a node of this file (nodes {held})")
    return found


def _scaled(array, units, default, path):
    """Values of an xarray variable in SI, by its attribute `units`."""
    stated = array.attrs.get("units", default)
    unit = unit_of(stated) or stated
    check_known(f"unit of {array.name}", [unit], units, str(path))
    return np.asarray(array.values, float) * units[unit]


def measurement_dataset(measurement):
    """A Measurement as a Dataset: spectrum, covariance, facts and findings; RotorstudyError if no record is usable."""
    spectrum, facts, findings = measurement.spectrum, measurement.facts, measurement.findings
    if spectrum is None:
        raise RotorstudyError("no record is usable; see the findings")
    components = [f"{part} {n}X" for part in ("real", "imag") for n in spectrum.harmonics]
    variables = {
        "amplitude": (("speed", "harmonic", "node"), spectrum.amplitude, "m", "harmonics of the displacement x + j y"),
        "covariance": (OF_SPECTRUM["covariance"], spectrum.covariance, "m2", COVARIANCE),
        "probe_direction": (("node",), spectrum.directions, "rad", DIRECTION),
        "where": (("record",), np.array([one.where for one in facts], object), "1", "file and speed"),
    }
    for name, unit, long_name in facts_of(RecordFacts):
        variables[name] = (("record",), np.array([getattr(one, name) for one in facts], float), unit, long_name)
    for name, unit, long_name in facts_of(NodeFacts):
        values = [[getattr(one.nodes[node], name) for node in spectrum.sensors] for one in facts]
        variables[name] = (("record", "node"), np.array(values, float), unit, long_name)
    for name in OF_FINDING:
        said = np.array([getattr(finding, name) for finding in findings], object)
        variables[f"finding_{name}"] = (("finding",), said, "1", f"{name} of the finding")
    coordinates = {
        "speed": (spectrum.speed, "rad/s", "spin speed"),
        "harmonic": (spectrum.harmonics, "1", "harmonic, n > 0 forward, n < 0 backward"),
        "node": (np.array(spectrum.sensors), "1", "node"),
        "component": (components, "1", "part and harmonic"),
        "other_component": (components, "1", "part and harmonic"),
    }
    zero = "unloaded_line" if measurement.rig.from_unloaded_line else "at_rest"
    return dataset(variables, coordinates, title="measured spectrum", displacement_zero=zero)


def _problems(data):
    """What keeps a Dataset from being one of `measurement_dataset`, the worst first."""
    yield from (f"no variable '{name}'" for name in ("amplitude", "covariance") if name not in data)
    findings = [f"finding_{name}" for name in OF_FINDING]
    if "finding_name" in data and any(name not in data or data[name].dims != ("finding",) for name in findings):
        yield f"the findings need the variables {', '.join(findings)}, each along the dimension finding"
    for name, dims in OF_SPECTRUM.items():
        if name in data.variables:
            yield wrong_variable(data, name, dims)
        elif name != "probe_direction":
            yield f"no coordinate '{name}'"
    check_harmonics(data.harmonic.values.tolist())
    if (np.abs(data.node) > LARGEST_NODE).any() or (data.node % 1 != 0).any():
        yield f"node = {data.node.values.tolist()}; needed are whole numbers"
    if {data.sizes["component"], data.sizes["other_component"]} != {2 * data.sizes["harmonic"]}:
        yield f"{data.sizes['component']} components; needed are twice {data.sizes['harmonic']}"
    if "probe_direction" in data and np.isinf(data.probe_direction).any():
        yield "a probe_direction is infinite"


def is_spectrum(path):
    """Whether a file is a NetCDF file with a spectrum rather than with records."""
    if path.suffix.lower() not in (".nc", ".nc4"):
        return False
    with netcdf(path) as data:
        return "amplitude" in data and "displacement" not in data


def load_spectrum(path: str | Path) -> Spectrum:
    """The Spectrum in a file that `rotorstudy import` wrote.

    Parameters
    ----------
    path : path
        NetCDF file.

    Returns
    -------
    Spectrum

    Raises
    ------
    RotorstudyError
        If the file cannot be read or holds no spectrum.
    """
    return load_imported(path)[0]


def load_imported(path):
    """The Spectrum in a file that `rotorstudy import` wrote, its Findings, its zero, and its conventions as text."""
    with netcdf(path) as opened:
        data = opened.load()
    for problem in filter(None, _problems(data)):
        raise RotorstudyError(f"{path}: {problem}. Write the file with 'rotorstudy import'")
    spectrum = Spectrum(
        as_complex(data.amplitude.transpose(*OF_SPECTRUM["amplitude"])),
        data.speed.values,
        data.harmonic.values.astype(int),
        tuple(int(node) for node in data.node.values),
        data.covariance.transpose(*OF_SPECTRUM["covariance"]).values,
        data.probe_direction.values if "probe_direction" in data else None,
    )
    read = data.attrs.get("displacement_zero", "at_rest"), data.attrs.get("measurement")
    columns = [data[f"finding_{key}"].values.astype(str) for key in OF_FINDING if "finding_name" in data]
    return spectrum, [Finding(*map(str, row)) for row in zip(*columns, strict=True)], *read
