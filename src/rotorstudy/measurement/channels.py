"""Files of named channels: text, MATLAB, and universal files.

Each function(path, conventions) returns the names of the channels and a function from a name to its values (samples,).
"""

import re
import struct
import subprocess
import sys

import numpy as np

from rotorstudy.errors import RotorstudyError, reading
from rotorstudy.measurement.text_table import header_of, layout_hint, numbers_in

MATRIX, COMPRESSED = 14, 15  # types of the elements of a MATLAB file
TOLERANCE = 1e-6  # of the length of a record: difference of the times of two of its channels


def open_csv(path, conventions):
    """Columns of a text file, laid out as `csv:` of the conventions says."""
    layout = conventions.csv
    values, wrong = numbers_in(path, layout)
    names = header_of(path, layout)[0]

    def channel(name):
        if name in wrong:
            line, cell = wrong[name]
            raise RotorstudyError(
                f"{path}, line {line}, column '{name}': '{cell}' is not a number; check 'csv: separator, decimal, "
                f"skip_rows, unit_rows' in the rig file{layout_hint(path, layout)}"
            )
        return values[:, names.index(name)]

    return names, channel


def open_matlab(path, conventions):
    """Channels of a .mat file: a vector by its name, of a struct as 'struct.field', of a matrix as 'name(:,2)'."""
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
    return list(vectors), lambda name: np.asarray(vectors[name], float)


def _check_survived(path):
    """Raise for a damaged file that ends the process in scipy 1.17, by reading it in another one.

    One whose elements are all compressed has checksums, so that damage is an error. Version 4 has no elements.
    """
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
    """Channels of the data sets 58 of a UFF file, by their first text line or as 'node direction' ('3 +x')."""
    try:
        import pyuff
    except ImportError:
        raise RotorstudyError(f"{path}: UFF files need the package pyuff; pip install pyuff") from None
    with reading("UFF file", path):
        opened = pyuff.UFF(str(path))
        kinds = [int(kind) for kind in np.atleast_1d(opened.get_set_types())]
        sets = [opened.read_sets(i) for i, kind in enumerate(kinds) if kind == 58]
    if not sets:
        raise RotorstudyError(f"{path}: no data set 58 (found: {sorted(set(kinds))}); export time signals")
    letters = {1: "x", 2: "y", 3: "z"}
    names = {}
    for one in sets:
        direction = int(one["rsp_dir"])
        place = f"{int(one['rsp_node'])} {'-' if direction < 0 else '+'}{letters.get(abs(direction), abs(direction))}"
        names.setdefault(place, []).append(one)
        label = re.sub(r"\s+", " ", str(one["id1"])).strip()
        if label and label.upper() != "NONE":
            names.setdefault(label, []).append(one)
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
        elif len(one["data"]) != int(one["num_pts"]):
            wrong = f"has {len(one['data'])} values, and states {int(one['num_pts'])}; export the file again"
        elif len(one["x"]) == len(time) and np.abs(one["x"] - time).max() > TOLERANCE * np.ptp(time):
            wrong = f"has other times than the first, up to {np.max(one['x']):g} s; export them at one rate"
        else:
            continue
        raise RotorstudyError(f"{path}: data set '{place}' {wrong}")
    return list(names), channel
