"""Any records, or an imported spectrum, as a spectrum."""

from pathlib import Path

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.findings import Finding
from rotorstudy.model.rig import build_model
from rotorstudy.store import read_yaml


def read_spectrum(paths, rig_path):
    """Spectrum, Model with the measured nodes as sensors, and findings, of record files or of one imported spectrum.

    raises : RotorstudyError that lists the findings that are errors
    """
    from rotorstudy.measurement.measurement import read_measurement

    paths = [Path(path) for path in ([paths] if isinstance(paths, (str, Path)) else paths)]
    imported = [path for path in paths if _is_spectrum(path)]
    if imported:
        if len(paths) > 1:
            raise RotorstudyError(f"{imported[0]} is a spectrum over all speeds; give it alone, or the records instead")
        spectrum, findings = _imported(imported[0])
        given = {**read_yaml(rig_path), "sensors": list(spectrum.sensors)}
        model = build_model(given, str(rig_path))
    else:
        measurement = read_measurement(paths, rig_path)
        spectrum, model, findings = measurement.spectrum, measurement.rig, measurement.findings
        if measurement.errors or spectrum is None:
            said = "; ".join(f"{f.where}: {f.name}: {f.text}" for f in measurement.errors)
            raise RotorstudyError(
                f"{said}. Nothing is diagnosed from such records; correct them or leave them out ('rotorstudy import' "
                "draws a page of their quality)"
            )
    check_spectrum(spectrum, ", ".join(path.name for path in paths))
    return spectrum, model, findings


def _is_spectrum(path):
    if path.suffix != ".nc" or not path.is_file():
        return False
    import xarray as xr

    try:
        with xr.open_dataset(path, engine="netcdf4") as data:
            return "amplitude" in data and "displacement" not in data
    except (OSError, ValueError):
        return False  # reading it as a record says what is wrong


def _imported(path):
    from rotorstudy.measurement.measurement import load_spectrum
    from rotorstudy.store import load

    spectrum, data = load_spectrum(path), load(path)
    if "finding_name" not in data:
        return spectrum, []
    columns = [data[f"finding_{key}"].values.astype(str) for key in ("severity", "name", "where", "text")]
    return spectrum, [Finding(*map(str, row)) for row in zip(*columns, strict=True)]


def check_spectrum(spectrum, where):
    """A spectrum that can be trusted: finite, its covariance too, each speed once."""
    if not (np.isfinite(spectrum.amplitude).all() and np.isfinite(spectrum.covariance).all()):
        raise RotorstudyError(f"{where}: harmonics or their covariance are missing or not finite (NaN); import again")
    variance = np.diagonal(spectrum.covariance, axis1=-2, axis2=-1)
    if (variance < 0).any() or not variance.any():
        raise RotorstudyError(
            f"{where}: variances are negative or all zero; a diagnosis needs the noise of each harmonic"
        )
    twice = sorted({float(w) for w in spectrum.speed if np.sum(np.isclose(spectrum.speed, w, rtol=1e-6)) > 1})
    if twice:
        raise RotorstudyError(f"{where}: speed {twice[0]:g} rad/s is there twice; give each record once")
