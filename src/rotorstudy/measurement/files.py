"""Record files: every format gives the same raw record, in metres and in the project's axes."""

import re
import struct
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np

from rotorstudy.errors import RotorstudyError, reading, unknown_name
from rotorstudy.measurement.channel_names import as_known, stated_units
from rotorstudy.measurement.conventions import check_once, one_unit
from rotorstudy.measurement.netcdf_files import existing, read_netcdf
from rotorstudy.measurement.raw_record import assemble
from rotorstudy.measurement.text_table import header_of, layout_hint, numbers_in
from rotorstudy.measurement.uff import UFF_ORDERS, uff_sets
from rotorstudy.units import RAD_PER_S, SECONDS

KINDS = {"netcdf": (".nc", ".nc4"), "csv": (".csv", ".txt"), "matlab": (".mat",), "uff": (".uff", ".unv")}
SUFFIXES = {suffix: kind for kind, suffixes in KINDS.items() for suffix in suffixes}
MATRIX, COMPRESSED = 14, 15  # types of the elements of a MATLAB file
OVER_TIME = (0, 17)  # codes of the abscissa of data set 58: not stated, time
TOLERANCE = 1e-6  # of the length of a record: difference of the times of two of its channels
SAME_RATE = 0.01  # relative difference of a stated sampling rate and that of the times


class Channels:
    """Channels of a file: names; a function from a name to its values (samples,); units that the file states."""

    def __init__(self, names, values, units=()):
        self.names, self.values = list(names), values
        self.units = dict(zip(self.names, stated_units(self.names, units or [""] * len(self.names)), strict=True))

    def called(self, known):
        """These Channels by names of the rig file, of which a unit in brackets is no part."""
        own = dict(zip(as_known(self.names, known), self.names, strict=True))
        found = Channels(own, lambda name: self.values(own[name]))
        found.units = {name: self.units[of_file] for name, of_file in own.items()}
        return found


def read_file(path, conventions, nodes):
    """The RawRecord of each speed of a file, one after another; RotorstudyError if it contradicts the rig file."""
    path = existing(path)
    if kind_of(path) == "netcdf":
        yield from read_netcdf(path, conventions, nodes)
    else:
        yield _from_channels(path, conventions, nodes, open_channels(path, conventions))


def kind_of(path):
    """Kind of a record file by its suffix: netcdf, csv, matlab or uff; RotorstudyError for another one."""
    suffix = Path(path).suffix
    if suffix.lower() not in SUFFIXES:
        raise unknown_name("kind of record file", suffix, SUFFIXES, f"{path}; export it as one of these")
    return SUFFIXES[suffix.lower()]


def open_channels(path, conventions):
    """The Channels of a file that is no NetCDF file."""
    return {"csv": open_csv, "matlab": open_matlab, "uff": open_uff}[kind_of(path)](path, conventions)


def _from_channels(path, conventions, nodes, channels):
    """The raw record of a file with named channels."""

    def wanted(name, role):
        if f"{name} #1" in channels.names:
            raise RotorstudyError(f"{path}: two columns are named '{name}'; in the rig file call the first '{name} #1'")
        if name not in channels.names:
            hint = layout_hint(path, conventions.csv) if kind_of(path) == "csv" else ""
            hint += "; state 'sample_rate_Hz:' if it has none" * (role == "time")
            raise unknown_name(f"{role} channel", name, channels.names, f"{path}{hint}")
        return channels.values(name)

    if not conventions.probes:
        raise RotorstudyError(f"{path}: no probes; list them under 'measurement: probes:' in the rig file")
    channels, readings = channels.called(conventions.channels), []
    for probe in conventions.probes:
        if probe.node is None:
            raise RotorstudyError(f"probe '{probe.channel}' has no 'node:', which is optional for NetCDF files only")
        reading = wanted(probe.channel, "probe")
        probe, factor = probe.in_metres(channels.units.get(probe.channel), str(path))
        readings.append((probe, probe.node, factor * reading))
    check_once(conventions.probes, path)
    length = len(readings[0][2])
    time = _times(path, conventions, channels, wanted, length)
    key, is_stated = conventions.keyphasor.channel, "keyphasor" in conventions.model_fields_set
    keyphasor = wanted(key, "keyphasor") if is_stated or key in channels.names else None
    own = None
    if (name := conventions.speed_channel) is not None:
        speed = wanted(name, "speed")
        speed = speed[np.isfinite(speed)]  # an incomplete row has no speed
        unit = one_unit(name, channels.units.get(name), conventions, "speed_unit", RAD_PER_S, path)
        own = float(np.mean(speed)) * RAD_PER_S[unit] if len(speed) else None
    label = conventions.label_rad_per_s(path, own)
    for name, values in [("time", time), ("keyphasor", keyphasor), *((p.channel, r) for p, _, r in readings)]:
        if values is not None and len(values) != length:
            raise RotorstudyError(
                f"{path}: channel '{name}' has {len(values)} samples, '{readings[0][0].channel}' has {length}; "
                "all channels must have the same samples"
            )
    return assemble(readings, conventions, nodes, time, label, keyphasor, None, None, str(path))


def _times(path, conventions, channels, wanted, length):
    """(time,) s of the samples of a file; its times and the sampling rate that the rig states must agree."""
    name, rate = conventions.time_channel, conventions.sample_rate_Hz
    unit = one_unit(name, channels.units.get(name), conventions, "time_unit", SECONDS, path)
    if rate is None:
        time = wanted(name, "time") * SECONDS[unit]
        used = [*(probe.channel for probe in conventions.probes), conventions.keyphasor.channel]
        names = [one for one in channels.names if one not in used and _is_called(one, name)]
        for channel in used if len(names) > 1 else ():
            own = _own_times(channel, names, channels)
            values = channels.values(own) * SECONDS.get(channels.units[own], SECONDS[unit]) if own else time
            if len(values) == len(time) and np.abs(values - time).max() > TOLERANCE * np.ptp(time):
                raise RotorstudyError(
                    f"{path}: channel '{channel}' has times of its own, '{own}', which are not those of '{name}'; "
                    "export all channels at one rate, or those with other times to another file"
                )
        return time
    time = np.zeros(2)
    with suppress(RotorstudyError):  # of a date
        time = channels.values(name) * SECONDS[unit] if name in channels.names else time
    if (np.diff(time) > 0).all() and abs((own := (len(time) - 1) / np.ptp(time)) / rate - 1) > SAME_RATE:
        raise RotorstudyError(
            f"{path}: channel '{name}' has {own:.6g} samples per second, and the rig states sample_rate_Hz = {rate:g}; "
            "leave it out or correct it, or 'time_unit:'"
        )
    return np.arange(length) / rate


def _own_times(channel, names, channels):
    """The last of some columns before a channel, or in its struct, that increases strictly; None without one."""
    place, every = channel.rpartition(".")[0], channels.names
    before = every[: every.index(channel)] if channel in every and not place else every
    own = [one for one in names if one in before and one.rpartition(".")[0] == place]
    for one in reversed(own):
        with suppress(RotorstudyError):  # of a column of texts
            if (np.diff(channels.values(one)) > 0).all():
                return one
    return None


def _is_called(name, other):
    """Whether two channels have one name but for struct, unit and number; columns of a matrix have none."""
    one, two = (re.sub(r"[(\[][^:()\[\]]*[)\]]|[^\w(:]|[\d_]", "", n.rpartition(".")[2].lower()) for n in (name, other))
    return one == two and ":" not in name


def open_csv(path, conventions):
    """The Channels of a text file: its columns, laid out as `csv:` of the conventions says."""
    layout = conventions.csv
    values, wrong = numbers_in(path, layout)
    names, units, _ = header_of(path, layout)

    def channel(name):
        if name in wrong:
            line, cell = wrong[name]
            raise RotorstudyError(
                f"{path}, line {line}, column '{name}': '{cell}' is not a number; check 'csv: separator, decimal, "
                f"skip_rows, unit_rows' in the rig file{layout_hint(path, layout)}"
            )
        return values[:, names.index(name)]

    return Channels(names, channel, units)


def open_matlab(path, conventions):
    """The Channels of a .mat file: vectors by name, of a struct as 'struct.field', of a matrix as 'name(:,2)'."""
    from scipy.io import loadmat

    with reading("MATLAB file", path):
        _check_survived(path)
        try:
            found = loadmat(path, squeeze_me=True, struct_as_record=False)
        except NotImplementedError:  # scipy's error for MATLAB 7.3, which is HDF5
            raise RotorstudyError(f"{path}: a MATLAB 7.3 file, which is not supported; save it with '-v7'") from None
    vectors = {}

    def collect(name, value):
        if hasattr(value, "_fieldnames"):
            for key in value._fieldnames:
                collect(f"{name}.{key}", getattr(value, key))
        elif isinstance(value, np.ndarray) and value.ndim == 2 and value.dtype.kind in "iuf":
            vectors.update({f"{name}(:,{k + 1})": value[:, k] for k in range(value.shape[1])})
        elif np.ndim(value) <= 1 and np.asarray(value).dtype.kind in "iuf":
            vectors[name] = np.atleast_1d(value)

    for name, value in found.items():
        if not name.startswith("__"):
            collect(name, value)
    return Channels(vectors, lambda name: np.asarray(vectors[name], float))


def _check_survived(path):
    """Raise for a damaged file that ends the process in scipy 1.17, by reading it in another one."""
    kinds = {MATRIX}
    with path.open("rb") as file:
        start, at, end = file.read(128), 128, file.seek(0, 2)
        if not start:
            raise ValueError("it is empty")
        if start[124:126] in (b"\0\2", b"\2\0"):  # 7.3, which is not read
            return
        while 0 not in start[:4] and at < end:
            file.seek(at)
            kind, size = struct.unpack(">II" if start[126:] == b"MI" else "<II", file.read(8))
            kinds, at = {kind, *kinds} if at > 128 else {kind}, at + 8 + size
            if at > end or kind not in (MATRIX, COMPRESSED):
                raise ValueError("it is damaged or cut off")
    if MATRIX in kinds:
        code = "import sys; from scipy.io import loadmat; loadmat(sys.argv[1], squeeze_me=True, struct_as_record=False)"
        if subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True).returncode < 0:
            raise ValueError("it is damaged")


def open_uff(path, conventions):
    """The Channels of the data sets 58 of a UFF file, by their first text line or as 'node direction' ('3 +x')."""
    sets, kinds = uff_sets(path)
    if not sets:
        raise RotorstudyError(f"{path}: no data set 58 (found: {sorted(set(kinds))}); export time signals")
    letters, names = {1: "x", 2: "y", 3: "z"}, {}
    for one in sets:
        direction, label = int(one["rsp_dir"]), " ".join(str(one["id1"]).split())
        place = f"{int(one['rsp_node'])} {'-' if direction < 0 else '+'}{letters.get(abs(direction), abs(direction))}"
        for name in (place, label) if label and label.upper() != "NONE" else (place,):
            names.setdefault(name, []).append(one)
    names["time"] = sets[:1]

    def channel(name):
        if len(names[name]) > 1:
            raise RotorstudyError(
                f"{path}: {len(names[name])} data sets are named '{name}'; use the channel's other name (node "
                "and direction, or first text line), or write one speed per file"
            )
        return np.asarray(names[name][0]["x" if name == "time" else "data"], float)

    time = sets[0]["x"]
    for place, one in ((place, one) for place, found in names.items() for one in found):
        if np.iscomplexobj(one["data"]):
            wrong = "is a spectrum, of complex values; export its time signal"
        elif int(one["abscissa_spec_data_type"]) not in OVER_TIME:
            wrong = "is over frequency, or another quantity than time; export its time signal"
        elif len(one["data"]) != int(one["num_pts"]):
            wrong = f"has {len(one['data'])} values, and states {int(one['num_pts'])}; export the file again"
        elif len(one["x"]) == len(time) and np.abs(one["x"] - time).max() > TOLERANCE * np.ptp(time):
            wrong = f"has other times than the first, up to {np.max(one['x']):g} s; export them at one rate"
        else:
            continue
        raise RotorstudyError(f"{path}: data set '{place}' {wrong}")
    for probe in conventions.probes if conventions else ():
        kinds = {UFF_ORDERS.get(one["ordinate_spec_data_type"], probe.order) for one in names.get(probe.channel, ())}
        if probe.unit not in (None, "V") and kinds - {probe.order}:
            raise RotorstudyError(
                f"{path}: data set '{probe.channel}' is of a displacement, a velocity or an acceleration, and the rig "
                f"states another one by the unit '{probe.unit}'; correct 'unit:'"
            )
    axes = {name: "abscissa" if name == "time" else "ordinate" for name in names}
    labels = [str(names[name][0].get(f"{axis}_axis_units_lab", "")) for name, axis in axes.items()]
    return Channels(names, channel, labels)
