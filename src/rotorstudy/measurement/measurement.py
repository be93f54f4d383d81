"""From files and a rig file to a spectrum with covariance, clean records, facts and findings."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement import quality
from rotorstudy.measurement.analysis import analyse_each
from rotorstudy.measurement.conventions import read_conventions
from rotorstudy.measurement.corrections import averaged, without_missing_mean, without_slow_roll
from rotorstudy.measurement.files import read_file
from rotorstudy.measurement.findings import Finding, RecordFacts, errors_among, worst_first
from rotorstudy.measurement.full_spectra import full_spectrum
from rotorstudy.measurement.lines import check_lines
from rotorstudy.measurement.netcdf_files import is_spectrum, load_imported
from rotorstudy.measurement.plausibility import check_labels, check_probes, check_speeds, check_together
from rotorstudy.measurement.raw_record import LARGEST_READING
from rotorstudy.measurement.records import Record
from rotorstudy.measurement.resonances import check_resonances
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.measurement.table_spectra import check_stated, read_table
from rotorstudy.measurement.tables import open_table, with_harmonics_of_tables
from rotorstudy.model.kinds import SpectrumMethod
from rotorstudy.model.model import Model
from rotorstudy.model.rig import RigFile, read_rig
from rotorstudy.response.coupling import check_speed

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Measurement:
    """Result of reading record files.

    spectrum : Spectrum over all usable speeds, or None if there is none
    records  : list of Record, clean: whole revolutions, project's axes, time zero at the shaft's reference line, with a
               reference signal; tables of harmonics give none
    facts    : list of RecordFacts, one for each record or speed of a table
    findings : list of Finding, worst first
    rig      : Model with the measured nodes as sensors
    """

    spectrum: Spectrum | None
    records: list[Record]
    facts: list[RecordFacts]
    findings: list[Finding]
    rig: Model

    @property
    def errors(self):
        """Findings that are errors."""
        return errors_among(self.findings)


def measured_spectrum(
    paths: Sequence[str | Path], rig: str | Path | RigFile, method: SpectrumMethod | None = None
) -> tuple[Spectrum, Model, list[Finding]]:
    """The spectrum to be fitted, from record files, tables of harmonics, or one imported spectrum.

    Parameters
    ----------
    paths : list of paths
        Files of records, tables of harmonics, or one spectrum that `rotorstudy import` wrote.
    rig : path or RigFile
        Its section `measurement:` states the conventions of the files.
    method : SpectrumMethod, optional
        Applied to the clean records, instead of the fit and the block covariance of `rotorstudy import`.

    Returns
    -------
    Spectrum, Model, list of Finding
        The model has the measured nodes as sensors.

    Raises
    ------
    RotorstudyError
        For files that cannot be read, and for findings that are errors, which are listed.
    """
    rig, paths = read_rig(rig), _listed(paths)
    conventions = read_conventions(rig.given, str(rig.path))
    imported = [path for path in paths if is_spectrum(path)]
    if imported:
        if len(paths) > 1:
            raise RotorstudyError(f"{imported[0]} is a spectrum over all speeds; give it alone, or give the records")
        if method is not None:
            raise _no_record_for(method, imported[0], "is a spectrum")
        spectrum, findings, zero, read = load_imported(imported[0])
        if rig.given.get("measurement") and read not in (None, conventions.as_text()):
            raise RotorstudyError(
                f"{imported[0]}: it was imported by another section 'measurement:' than that of {rig.path}, {read}; "
                "import the records again, or give this rig file the same section"
            )
        stated = [conventions.model_copy(update={"displacement_zero": zero})]
        model = measured_model(rig, spectrum.sensors, stated, spectrum.directions)
    else:
        measurement = read_measurement(paths, rig, with_signals=method is not None)
        spectrum, model, findings = measurement.spectrum, measurement.rig, measurement.findings
        if measurement.errors or spectrum is None:
            said = "; ".join(f"{f.where}: {f.name}: {f.text}" for f in measurement.errors)
            raise RotorstudyError(
                f"{said}. Correct these records or leave them out ('rotorstudy import' writes a page on their quality)"
            )
        if method is not None:
            spectrum = _spectrum_by(method, measurement)
    where = ", ".join(path.name for path in paths)
    check_spectrum(spectrum, where)
    spectrum, notes = averaged(spectrum, where)
    spectrum, slow = without_slow_roll(spectrum, model, conventions.slow_roll_below_rpm, where)
    spectrum, coupled = without_missing_mean(spectrum, model, where)
    findings = worst_first([*findings, *notes, *slow, *coupled])
    for finding in findings:
        if finding.severity == "warning":  # now: what follows may take minutes
            log.info("%s", finding)
    return spectrum, model, findings


def check_numbers(spectrum, where):
    """Raise RotorstudyError unless speeds, harmonics and their covariance can be those of a rotor."""
    if not (np.isfinite(spectrum.amplitude).all() and np.isfinite(spectrum.covariance).all()):
        raise RotorstudyError(f"{where}: harmonics or their covariance are missing or not finite (NaN); import again")
    check_speed(spectrum.speed)
    for name, values, unit in (("speed", spectrum.speed, "rad/s"), ("harmonic", np.abs(spectrum.amplitude), "m")):
        if (largest := np.max(values)) > LARGEST_READING:
            raise RotorstudyError(f"{where}: a {name} of {largest:g} {unit}, at most {LARGEST_READING:g} is believed")


def check_spectrum(spectrum, where):
    """Raise RotorstudyError unless a fit can use a spectrum: its numbers are possible, and it states its noise."""
    check_numbers(spectrum, where)
    if not spectrum.amplitude.any():
        raise RotorstudyError(f"{where}: every harmonic is zero; nothing was measured")
    variance = np.diagonal(spectrum.covariance, axis1=-2, axis2=-1)
    if (variance < 0).any() or not variance.any():
        raise RotorstudyError(f"{where}: variances are negative or all zero; a fit needs the noise of each harmonic")


def _listed(paths):
    """Paths as a list; none is an error."""
    paths = [Path(path) for path in ([paths] if isinstance(paths, (str, Path)) else paths)]
    if not paths:
        raise RotorstudyError("no record files; give at least one")
    return paths


def _no_record_for(method, where, what):
    """The error of a SpectrumMethod without records in time."""
    return RotorstudyError(
        f"spectrum '{method.name}' needs records in time, and {where} {what}; leave the method out, or give the records"
    )


def _spectrum_by(method, measurement):
    """Spectrum of clean records by a SpectrumMethod, with the phase of the marks, or of the reference without marks."""
    if len(measurement.records) < len(measurement.spectrum.speed):
        speeds = {record.speed for record in measurement.records}
        table = next(one.where for one in measurement.facts if one.measured_speed not in speeds)
        raise _no_record_for(method, table, "is a table of harmonics or a run-up")
    spectra = []
    for record in measurement.records:  # already cut to whole revolutions
        phase = "reference" if record.marks is None else "keyphasor"
        harmonics = measurement.spectrum.harmonics
        spectra.append(full_spectrum([record], harmonics, method, phase, whole_revolutions=False))
    together = {name: np.concatenate([getattr(one, name) for one in spectra]) for name in ("amplitude", "covariance")}
    return replace(measurement.spectrum, **together)


def read_measurement(
    paths: Sequence[str | Path], rig: str | Path | RigFile, *, with_signals: bool = True
) -> Measurement:
    """Read record files by the conventions of a rig file.

    Parameters
    ----------
    paths : list of paths
        Files of records (NetCDF, CSV, MATLAB, UFF) or tables of harmonics (CSV), in any order.
    rig : path or RigFile
        Its section `measurement:` states the conventions of the files.
    with_signals : bool, optional
        Keep the clean records; False leaves `records` empty, so that one record is in memory at a time.

    Returns
    -------
    Measurement
        Spectrum, clean records, facts and findings.

    Raises
    ------
    RotorstudyError
        For a file that cannot be read or contradicts the rig file. Faults of the signals themselves are findings; a
        record with an error is left out of the spectrum.
    """
    rig, paths = read_rig(rig), _listed(paths)
    conventions = read_conventions(rig.given, str(rig.path))
    opened = [open_table(path, conventions.csv) for path in paths]
    in_time = [path for path, table in zip(paths, opened, strict=True) if table is None]
    tables = [table.called(conventions.channels) for table in opened if table is not None]
    of_probes = [table for table in tables if table.by_probe]
    conventions = with_harmonics_of_tables(conventions, of_probes)
    nodes, found, findings = rig.model.structure.measurable, [], []
    for table in tables:
        findings += check_stated(table, conventions)
        of_speeds, notes = read_table(table, conventions, nodes)
        found += of_speeds
        findings += notes
    analysed, read_by, notes = _analysed_records(in_time, conventions, nodes, with_signals)
    stated = [conventions] * len(found) + read_by
    found, findings = found + analysed, findings + notes
    findings += [finding for one in found for finding in one.findings]
    findings += [*check_lines(found), *check_probes(conventions.probes, rig.path.name)]
    findings += check_labels(in_time, conventions, rig.path.name)
    sensors, single = common_probes(found, rig)
    directions = np.array([single.get(node, np.nan) for node in sensors])
    model = measured_model(rig, sensors, stated, directions)
    usable = sorted((one for one in found if np.isfinite(one.speed)), key=lambda one: one.speed)
    if not usable:
        return Measurement(None, [], found, worst_first(findings), model)
    of_sensors = [[one.nodes[node] for node in model.sensors] for one in usable]
    speed, harmonics = np.array([one.speed for one in usable]), np.array(conventions.harmonics)
    amplitude, covariance = (
        np.array([[getattr(one, name) for one in own] for own in of_sensors]) for name in ("amplitude", "covariance")
    )
    spectrum = Spectrum(np.swapaxes(amplitude, 1, 2), speed, harmonics, model.sensors, covariance, directions)
    named = ", ".join(path.name for path in paths)
    check_numbers(spectrum, named)
    records = []
    for record in (one.record for one in usable if one.record is not None):
        chosen = [record.sensors.index(node) for node in model.sensors]
        records.append(replace(record, displacement=record.displacement[chosen], sensors=model.sensors))
    findings += check_together(spectrum, model, named)
    findings += check_speeds(spectrum.speed, model, named)
    if of_probes or any(one.is_tracked for one in found):
        findings += check_resonances(spectrum, bool(of_probes), named)
    return Measurement(spectrum, records, found, worst_first(findings), model)


def _analysed_records(paths, conventions, nodes, with_signals):
    """RecordFacts of records, one in memory at a time, without probes dead in all; their conventions; findings."""

    def analysed(dead):
        for path in paths:
            log.info("reading %s and fitting its harmonics", path)
            for raw in read_file(path, conventions, nodes):
                left = [channel for channel in raw.channels if (channel.node, channel.name) not in dead]
                yield raw, analyse_each(replace(raw, channels=left), with_signals)

    found, stated, probes, first = [], [], [], None
    for raw, own in analysed(dead=()):
        found += own
        stated.append(raw.conventions)
        probes.append({(channel.node, channel.name) for channel in raw.channels})
        first = first or raw.where
    dead = frozenset.intersection(*(one.dead for one in found)) if found else frozenset()
    if not dead or any(names <= dead for names in probes):
        return found, stated, []
    return [one for _, own in analysed(dead) for one in own], stated, quality.left_out(dead, first)


def common_probes(found, rig):
    """Sensors: those of the rig file, or all measured nodes; {node: rad} of single probes; records must not differ."""
    usable = [one for one in found if np.isfinite(one.speed)]
    nodes, single = [(one.where, f"nodes {sorted(one.nodes)}") for one in found], []
    for one in usable:
        each = [f"{node} ({np.rad2deg(angle):.6g}° from x)" for node, angle in sorted(one.directions.items())]
        single.append((one.where, f"a single probe at node {', '.join(each)}" if each else "no single probe"))
    for where, has, (first, had) in ((*one, told[0]) for told in (nodes, single) for one in told):
        if has != had:
            raise RotorstudyError(
                f"{where} has {has}, {first} has {had}; all records of one measurement need the same probes (is a row "
                "of a table missing?)"
            )
    measured = sorted(found[0].nodes)
    wanted = rig.given.get("sensors") or measured
    for node in (node for node in wanted if node not in measured):
        raise RotorstudyError(
            f"{rig.path}: 'sensors' has node {node}, but the records have nodes {measured}; leave it out"
        )
    return wanted, usable[0].directions if usable else {}


def measured_model(rig, sensors, stated, directions):
    """The Model with the measured nodes as sensors; stated : Conventions of the records;  directions : (sensor,)."""
    zeros = {one.displacement_zero for one in stated}
    if len(zeros) > 1:
        raise RotorstudyError(
            "displacements of some records count from the unloaded line, of others from the shaft at "
            "rest, as in simulated records; read them separately"
        )
    model = rig.measured_at(sensors, stated[0].reading(sensors, directions))
    return replace(model, from_unloaded_line=zeros == {"unloaded_line"})
