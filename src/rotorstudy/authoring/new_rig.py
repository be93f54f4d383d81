"""Write a new rig file: an example machine, with a section `measurement:` for a record file if one is given."""

from pathlib import Path
from typing import NamedTuple

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.guess import VIEW, guess_measurement
from rotorstudy.measurement.measurement import read_measurement
from rotorstudy.model.rig import read_rig
from rotorstudy.store import write_text

TEMPLATES = Path(__file__).parent / "templates"
PLANES = (3, 9, 5, 7, 2, 10, 1, 11, 4, 6, 8)  # nodes of the template, those of probes first
PROBES = {
    **VIEW,
    "probes": [
        {"channel": f"{plane}{name}", "node": node, "angle_deg": angle, "unit": "um"}
        for plane, node in ((1, 3), (2, 9))
        for name, angle in (("X", -45.0), ("Y", 45.0))
    ],
    "keyphasor": {"channel": "keyphasor", "sensor_angle_deg": 0, "mark_angle_deg": 0},
}
NAME_IN_TEMPLATE = "my_machine"
OPPOSITE = {"with_angles": "against_angles", "against_angles": "with_angles"}


class NewRig(NamedTuple):
    """A rig file that was written: its path, and what was guessed from the records, in sentences."""

    path: Path
    said: list[str]


def new_rig(name, folder=None, records=()):
    """Write a commented rig file that every command reads, and return a NewRig.

    Parameters
    ----------
    name : str
        Of the rig and its file.
    folder : path, optional
        The current one by default.
    records : sequence of path, optional
        Record files of the machine; the first one shows how to read them.

    Returns
    -------
    NewRig

    Raises
    ------
    RotorstudyError
        For a name that is no name of a file, a file that exists, or records that cannot be read.
    """
    path = new_path(name, folder)
    section, said = guess_measurement(records[0], PLANES) if records else (PROBES, [])
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, _text(path.stem, section, said))
    if records and _turns_back(records[0], read_rig(path)):
        section = section | {"rotation": OPPOSITE[section["rotation"]]}
        said = [*said, "sense of rotation: against the angles, as the orbits of 1X say"]
        write_text(path, _text(path.stem, section, said))
    return NewRig(path, said)


def new_path(name, folder):
    """Path of a new rig file; RotorstudyError if it exists or the name is none."""
    name = name.removesuffix(".yaml")
    if not name or name != Path(name).name or name.startswith("."):
        raise RotorstudyError(
            f"name '{name}': use a name without folders, such as my_machine; --folder states the folder"
        )
    path = Path(folder or "") / f"{name}.yaml"
    if path.exists():
        raise RotorstudyError(f"file '{path}' exists; choose another name, or remove it first")
    return path


def _text(name, section, said):
    """The rig file."""
    import yaml

    guessed = ["# Guessed from the records; confirm or correct each line:", *(f"#   {line}" for line in said)]
    filled = yaml.safe_dump(
        {"measurement": section}, sort_keys=False, default_flow_style=None, width=110, allow_unicode=True
    )
    template = (TEMPLATES / "rig.yaml").read_text(encoding="utf-8").replace(NAME_IN_TEMPLATE, name)
    return template.replace("measurement: {}\n", "\n".join([*(guessed if said else []), filled]))


def _turns_back(record, rig):
    """Whether the orbits of a record say that the shaft turns against the sense stated in a rig."""
    try:
        findings = read_measurement([record], rig).findings
    except RotorstudyError:
        return False
    return "rotation" in rig.given["measurement"] and "sense of rotation" in {finding.name for finding in findings}
