"""A measured spectrum on disk: written by `rotorstudy import`, read by `identify` and `diagnose`."""

from pathlib import Path

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.findings import Finding, NodeFacts, RecordFacts, facts_of
from rotorstudy.measurement.netcdf_files import netcdf, wrong_variable
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.response.coupling import check_harmonics
from rotorstudy.store import as_complex, dataset

DIMENSIONS = {
    "amplitude": ("speed", "harmonic", "node", "part"),
    "covariance": ("speed", "node", "component", "other_component"),
    "probe_direction": ("node",),
    **{name: (name,) for name in ("speed", "harmonic", "node")},
}
OF_FINDING = ("severity", "name", "where", "text")
LARGEST_NODE = 10**6
COVARIANCE = "covariance of real and imaginary parts of the harmonics"
DIRECTION = "direction of the only probe of a node from x in the sense of rotation, NaN where the orbit is measured"


def measurement_dataset(measurement):
    """A Measurement as a Dataset: spectrum, covariance, facts and findings; RotorstudyError if no record is usable."""
    spectrum, facts, findings = measurement.spectrum, measurement.facts, measurement.findings
    if spectrum is None:
        raise RotorstudyError("no record is usable; see the findings")
    components = [f"{part} {n}X" for part in ("real", "imag") for n in spectrum.harmonics]
    variables = {
        "amplitude": (("speed", "harmonic", "node"), spectrum.amplitude, "m", "harmonics of the displacement x + j y"),
        "covariance": (DIMENSIONS["covariance"], spectrum.covariance, "m2", COVARIANCE),
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


def _check_imported(path, data):
    """Raise RotorstudyError unless a Dataset is what `measurement_dataset` gives."""

    def refused(problem):
        return RotorstudyError(f"{path}: {problem}. Write the file with 'rotorstudy import'")

    for name in ("amplitude", "covariance"):
        if name not in data:
            raise refused(f"no variable '{name}'")
    findings = [f"finding_{name}" for name in OF_FINDING]
    for name in findings if "finding_name" in data else []:
        if name not in data or data[name].dims != ("finding",):
            raise refused(f"the findings need the variables {', '.join(findings)}, each along the dimension finding")
    for name, dims in DIMENSIONS.items():
        if name not in data.variables:
            if name == "probe_direction":
                continue
            raise refused(f"no coordinate '{name}'")
        if wrong := wrong_variable(data, name, dims):
            raise refused(wrong)
    check_harmonics(data.harmonic.values.tolist())
    if (np.abs(data.node) > LARGEST_NODE).any() or (data.node % 1 != 0).any():
        raise refused(f"node = {data.node.values.tolist()}; needed are whole numbers")
    if {data.sizes["component"], data.sizes["other_component"]} != {2 * data.sizes["harmonic"]}:
        raise refused(f"{data.sizes['component']} components; needed are twice {data.sizes['harmonic']}")
    if "probe_direction" in data and np.isinf(data.probe_direction).any():
        raise refused("a probe_direction is infinite")


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
    """The Spectrum in a file that `rotorstudy import` wrote, its Findings, and the zero of its displacements."""
    with netcdf(path) as opened:
        data = opened.load()
    _check_imported(path, data)
    spectrum = Spectrum(
        as_complex(data.amplitude.transpose(*DIMENSIONS["amplitude"])),
        data.speed.values,
        data.harmonic.values.astype(int),
        tuple(int(node) for node in data.node.values),
        data.covariance.transpose(*DIMENSIONS["covariance"]).values,
        data.probe_direction.values if "probe_direction" in data else None,
    )
    zero = data.attrs.get("displacement_zero", "at_rest")
    if "finding_name" not in data:
        return spectrum, [], zero
    columns = [data[f"finding_{key}"].values.astype(str) for key in OF_FINDING]
    return spectrum, [Finding(*map(str, row)) for row in zip(*columns, strict=True)], zero
