"""Records on disk: NetCDF with displacement (speed, node, direction, time), read only if it says what it is."""

from pathlib import Path

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.records import Record
from rotorstudy.store import dataset, load


def records_dataset(records):
    """Records of one time base as a Dataset.

    returns : displacement (speed, node, direction, time) m, reference (speed, time), keyphasor (speed, time) V
    """
    z = np.array([record.displacement for record in records])
    displacement = np.stack([z.real, z.imag], axis=2)
    variables = {"displacement": (("speed", "node", "direction", "time"), displacement, "m", "shaft displacement")}
    for name, unit in (("reference", "1"), ("keyphasor", "V")):
        signals = [getattr(record, name) for record in records]
        if all(signal is not None for signal in signals):
            variables[name] = (("speed", "time"), np.array(signals), unit, f"{name} signal")
    coordinates = {
        "speed": (np.array([record.speed for record in records]), "rad/s", "spin speed"),
        "node": (np.array(records[0].sensors), "1", "node"),
        "direction": (["x", "y"], "1", "x vertically down, y from x in the sense of rotation"),
        "time": (records[0].time, "s", "time"),
    }
    return dataset(variables, coordinates, title="records")


def load_records(path):
    """Records from a NetCDF file with displacement (speed, node, direction, time) in m and direction x, y.

    Optional: reference (speed, time), keyphasor (speed, time) in V.
    raises : RotorstudyError if the file is missing, no NetCDF, or lacks a variable, a dimension or the unit m
    """
    if not Path(path).is_file():
        raise RotorstudyError(f"record file '{path}' does not exist")
    try:
        data = load(path)
    except (OSError, ValueError) as error:
        raise RotorstudyError(f"{path}: not a NetCDF file that can be read ({str(error).splitlines()[0]})") from None
    if "displacement" not in data:
        raise RotorstudyError(f"{path}: no variable 'displacement' (found: {', '.join(map(str, data.data_vars))})")
    wanted = ("speed", "node", "direction", "time")
    if set(data.displacement.dims) != set(wanted):
        raise RotorstudyError(f"{path}: displacement has dimensions {data.displacement.dims}; needed are {wanted}")
    unit = data.displacement.attrs.get("units", "not stated")
    if unit != "m":
        raise RotorstudyError(f"{path}: displacement has units '{unit}'; only m is read, so that nobody has to guess")
    if sorted(map(str, data.direction.values)) != ["x", "y"]:
        raise RotorstudyError(f"{path}: directions are {list(data.direction.values)}; needed are x and y")
    displacement = data.displacement.transpose(*wanted)
    z = displacement.sel(direction="x").values + 1j * displacement.sel(direction="y").values
    records = []
    for i, w in enumerate(data.speed.values):
        signals = {name: data[name].values[i] for name in ("reference", "keyphasor") if name in data}
        where = f"{path}, {w:g} rad/s"
        sensors = tuple(int(n) for n in data.node.values)
        records.append(Record(data.time.values, z[i], float(w), sensors, where=where, **signals))
    return records
