"""Files, written atomically with units and provenance. Complex values have a last dimension part = real, imag."""

import os
from contextlib import contextmanager
from glob import escape
from pathlib import Path
from shutil import rmtree

import numpy as np

from rotorstudy.errors import RotorstudyError, reading

PART = ("real", "imag")


@contextmanager
def atomic(path):
    """A temporary path beside `path`, moved over it only when the block ends without an error."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = partial_path(path)
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        if isinstance(error, FileNotFoundError) or error.filename not in (None, temporary, str(temporary)):
            raise  # of a file that the block reads, or has not written
        raise _not_written(path, error) from None
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def whole_folder(path):
    """A temporary folder whose files are moved to the folder `path` when the block ends without an error.

    It is on the same disk, so that they can be moved: inside of a folder that exists, which may be one of its own.
    """
    path = Path(path)
    temporary = partial_path(path / path.name if path.is_dir() else path)
    try:
        temporary.mkdir(parents=True)
    except OSError as error:
        raise _not_written(path, error) from None
    try:
        yield temporary
        for file in sorted(file for file in temporary.rglob("*") if file.is_file()):
            place = path / file.relative_to(temporary)
            place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(file, place)
    finally:
        rmtree(temporary, ignore_errors=True)


def copied(source, path):
    """Copy a file, whole or not at all; RotorstudyError if it cannot be written."""
    text = Path(source).read_bytes()
    with atomic(path) as temporary:
        temporary.write_bytes(text)


def partial_path(path):
    """A hidden path beside `path` for this process alone. Those that killed processes left there are removed."""
    stem, suffix = f".{path.stem}.", f".partial{path.suffix}"
    for left in path.parent.glob(f"{escape(stem)}*{escape(suffix)}"):
        process = left.name.removeprefix(stem).removesuffix(suffix)
        if process.isdecimal() and not _runs(int(process)):
            rmtree(left) if left.is_dir() else left.unlink(missing_ok=True)
    return path.with_name(f"{stem}{os.getpid()}{suffix}")


def _runs(process):
    """Whether a process of that number runs; where this cannot be asked, it may."""
    if os.name != "posix":
        return True
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    return True


def write_text(path, text):
    """Write a text file atomically, in UTF-8 whatever the locale."""
    with atomic(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def as_complex(array):
    """Complex numpy array of a variable with a dimension `part`, which is removed."""
    values = array.transpose(..., "part").values
    return values[..., 0] + 1j * values[..., 1]


def dataset(variables, coordinates, **attributes):
    """xarray Dataset from {name: (dims, values, unit, long_name)} and of coordinates; complex values are split."""
    import xarray as xr

    data = {}
    for name, (dims, values, unit, long_name) in variables.items():
        if np.iscomplexobj(values):
            dims, values = (*dims, "part"), np.stack([np.real(values), np.imag(values)], axis=-1)
        data[name] = (dims, values, {"units": unit, "long_name": long_name})
    coords = {
        name: (name, values, {"units": unit, "long_name": long}) for name, (values, unit, long) in coordinates.items()
    }
    if any("part" in value[0] for value in data.values()):
        coords["part"] = ("part", list(PART), {"units": "1", "long_name": "real and imaginary part"})
    return xr.Dataset(data, coords, attributes)


def provenance(configuration, plugins=(), seed=None):
    """Attributes that state the origin of a file: the hash of its configuration, its plugins and its seed."""
    import hashlib
    import json

    from rotorstudy import __version__

    text = json.loads(json.dumps(configuration, default=str))  # all keys are texts: others cannot be sorted with them
    digest = hashlib.sha256(json.dumps(text, sort_keys=True).encode()).hexdigest()
    found = {
        "Conventions": "CF-1.11",
        "rotorstudy_version": __version__,
        "git_commit": _git_commit(),
        "configuration_sha256": digest,
        "plugins": ", ".join(sorted({f"{plugin.name} {plugin.version}" for plugin in plugins})),
    }
    return found if seed is None else {**found, "seed": int(seed)}


def _git_commit():
    import subprocess

    command = ["git", "-C", str(Path(__file__).parent), "rev-parse", "HEAD"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "not a git checkout"


def save(data, path):
    """Write a Dataset as NetCDF-4, atomically; RotorstudyError if it cannot be written, for example on a full disk."""
    with atomic(path) as temporary:
        try:
            data.to_netcdf(temporary, engine="netcdf4", format="NETCDF4")
        except RuntimeError as error:  # the library's, of what the disk refuses
            raise _not_written(path, error) from None


def save_along(pieces, path, dimension):
    """Write Datasets of length 1 along a dimension as one file, one in memory at a time; whole or not at all."""
    import netCDF4

    pieces = iter(pieces)
    with atomic(path) as temporary:
        first = next(pieces)
        growing = [name for name, values in first.variables.items() if values.dims[:1] == (dimension,)]
        try:
            first.to_netcdf(temporary, engine="netcdf4", format="NETCDF4", unlimited_dims=[dimension])
            with netCDF4.Dataset(temporary, "a") as file:
                for i, piece in enumerate(pieces, start=1):
                    for name in growing:
                        file[name][i] = piece[name].isel({dimension: 0}).values
        except (OSError, RuntimeError) as error:
            raise _not_written(path, error) from None


def _not_written(path, error):
    said = getattr(error, "strerror", None) or error
    return RotorstudyError(f"{path}: cannot be written ({said}); is the disk full or the folder read-only?")


def load(path):
    """Read a Dataset into memory; RotorstudyError if it is damaged."""
    import xarray as xr

    said = "NetCDF file; a result is made again if you delete it"
    with reading(said, path), xr.open_dataset(path, engine="netcdf4") as data:
        return data.load()


def chunk_of(items, chunk, chunks):
    """The items of one of several chunks of almost equal length, in order; chunk : 0 to chunks - 1."""
    return [items[i] for i in np.array_split(np.arange(len(items)), chunks)[chunk].tolist()]


def gathered(parts, dimension):
    """One Dataset from those of all chunks, in order; variables without the dimension are those of the first."""
    import xarray as xr

    same = {"compat": "override", "combine_attrs": "override", "join": "exact"}
    return xr.concat(parts, dimension, data_vars="minimal", coords="minimal", **same)


def files_by_name(kind, made, paths):
    """Files to be written by what each holds, whose name it has, never by position in a list."""
    found = {name: [] for name in made}
    missing = []
    for path in map(Path, paths):
        found.get(path.stem, missing).append(path)
    if missing:
        names = ", ".join(dict.fromkeys(path.stem for path in missing))
        raise RotorstudyError(f"no {kind} was made for: {names} (made: {', '.join(found)})")
    extra = [name for name, files in found.items() if not files]
    if extra:
        raise RotorstudyError(f"no file is named for the {kind}: {', '.join(extra)}; add it to the rule's outputs")
    return found
