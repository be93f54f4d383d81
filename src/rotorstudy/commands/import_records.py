"""Convert measured records to a spectrum with covariance and a quality page."""

from dataclasses import replace
from pathlib import Path

from rotorstudy.commands.shared import HTML, NETCDF, check_file, tell
from rotorstudy.errors import RotorstudyError


def add(parser):
    parser.add_argument("records", nargs="+", help="record files (.nc, .csv, .mat, .uff) or tables of harmonics (.csv)")
    parser.add_argument("--rig", required=True, help="rig file; its section 'measurement:' says how to read the files")
    parser.add_argument("--out", required=True, help="NetCDF file to write")
    told = "HTML page to write (default: beside --out, under its name and _quality.html)"
    parser.add_argument("--quality", help=told)


def run(given):
    """Write the quality page, and the spectrum unless a finding is an error."""
    from rotorstudy.measurement.conventions import read_conventions
    from rotorstudy.measurement.corrections import averaged
    from rotorstudy.measurement.findings import worst_first
    from rotorstudy.measurement.measurement import read_measurement
    from rotorstudy.measurement.netcdf_files import measurement_dataset
    from rotorstudy.model.rig import read_rig
    from rotorstudy.presentation.quality_page import write_page
    from rotorstudy.store import provenance, save

    page = given.quality or Path(given.out).with_name(f"{Path(given.out).stem}_quality.html")
    check_file(given.out, given.rig, *given.records, suffixes=NETCDF)
    check_file(page, given.rig, given.out, *given.records, option="--quality", suffixes=HTML)
    rig = read_rig(given.rig)
    measurement, names = read_measurement(given.records, rig), ", ".join(Path(path).name for path in given.records)
    _, repeats = averaged(measurement.spectrum, names) if measurement.spectrum else (None, [])  # for what it finds
    shown = replace(measurement, findings=worst_first([*measurement.findings, *repeats]))
    write_page(shown, page, f"Quality of {names if len(given.records) <= 3 else f'{len(given.records)} records'}")
    tell(shown.findings)
    if measurement.errors:
        raise RotorstudyError(
            f"no spectrum was written, because of the errors above; omit or correct these records (see {page})"
        )
    attributes = {**provenance(rig.given, rig.plugins), "records": ", ".join(map(str, given.records))}
    attributes["measurement"] = read_conventions(rig.given, str(rig.path)).as_text()
    save(measurement_dataset(measurement).assign_attrs(attributes), given.out)
    count = len(measurement.spectrum.speed)
    print(f"wrote the spectrum at {count} speed(s) to {given.out} and its quality page to {page}")
    return {"spectrum": str(given.out), "page": str(page), "findings": [vars(one) for one in shown.findings]}
