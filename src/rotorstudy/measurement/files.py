"""Readers of record files: every format gives the same raw record, in metres and in the project's axes."""

from pathlib import Path

import numpy as np

from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.measurement.channels import open_csv, open_matlab, open_uff
from rotorstudy.measurement.conventions import check_once
from rotorstudy.measurement.netcdf_files import existing, read_netcdf
from rotorstudy.measurement.raw_record import assemble
from rotorstudy.measurement.text_table import header_of, layout_hint
from rotorstudy.measurement.wide_tables import check_stated, wide_table
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


def read_file(path, conventions, nodes):
    """The RawRecord of each speed of a file, an iterator, so that only one need be in memory; nodes (node,) of the rig.

    RotorstudyError for a file that cannot be read, or that contradicts the rig file.
    """
    path = existing(path)
    if kind_of(path) == "netcdf":
        yield from read_netcdf(path, conventions, nodes)
    else:
        yield _from_channels(path, conventions, nodes, *open_channels(path, conventions))


def kind_of(path):
    """Kind of a record file by its suffix: netcdf, csv, matlab or uff; RotorstudyError for another one."""
    kind = SUFFIXES.get(Path(path).suffix.lower())
    if kind is None:
        raise unknown_name("kind of record file", Path(path).suffix, SUFFIXES, f"{path}; export it as one of these")
    return kind


def open_channels(path, conventions):
    """Names of the channels of a file that is no NetCDF file, and a function: name -> (samples,) values."""
    return {"csv": open_csv, "matlab": open_matlab, "uff": open_uff}[kind_of(path)](existing(path), conventions)


def table_columns(path, conventions):
    """Columns of a CSV file, of which the reader depends; none of another file."""
    if SUFFIXES.get(Path(path).suffix.lower()) != "csv" or not Path(path).is_file():
        return []
    names, units, _ = header_of(path, conventions.csv)
    wide = wide_table(names, units, path)
    if wide is None:
        return names
    check_stated(wide, conventions, path)
    return wide.columns


def _from_channels(path, conventions, nodes, names, channel):
    """The raw record of a file with named channels; channel(name) gives (samples,) values."""

    def wanted(name, role):
        if name not in names:
            hint = layout_hint(path, conventions.csv) if kind_of(path) == "csv" else ""
            raise unknown_name(f"{role} channel", name, names, f"{path}{hint}")
        return channel(name)

    if not conventions.probes:
        raise RotorstudyError(f"{path}: no probes; list them under 'measurement: probes:' in the rig file")
    readings = []
    for probe in conventions.probes:
        if probe.node is None:
            raise RotorstudyError(f"probe '{probe.channel}' has no 'node:', which is optional for NetCDF files only")
        reading = wanted(probe.channel, "probe")
        readings.append((probe, probe.node, probe.metres(None, str(path)) * reading))
    check_once(conventions.probes, path)
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
    return assemble(readings, conventions, nodes, time, label, keyphasor, None, None, str(path))
