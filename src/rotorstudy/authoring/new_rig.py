"""Write a new rig file: an example machine, with a section `measurement:` for a record file if one is given."""

from pathlib import Path
from typing import NamedTuple

from rotorstudy.authoring.ross_model import read_ross
from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.guess import PAIR, VIEW, guess_measurement
from rotorstudy.measurement.measurement import read_measurement
from rotorstudy.model.rig import read_rig
from rotorstudy.store import write_text

TEMPLATES = Path(__file__).parent / "templates"
PLANES = (3, 9, 5, 7, 2, 10, 1, 11, 4, 6, 8)  # nodes of the template, those of probes first
NAME_IN_TEMPLATE = "my_machine"
OPPOSITE = {"with_angles": "against_angles", "against_angles": "with_angles"}


class NewRig(NamedTuple):
    """A rig file that was written: sentences on what was guessed from records, and what differs from ROSS."""

    path: Path
    guessed: list[str]
    changed: list[str]


def new_rig(name, folder=None, records=(), ross=None):
    """Write a commented rig file that every command reads, guessed from records or of ROSS, and return a NewRig."""
    path = new_path(name, folder)
    rotor = read_ross(ross) if ross else None
    planes = rotor.planes if rotor else PLANES
    section, guessed = guess_measurement(records[0], planes) if records else (_usual_probes(planes), [])
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, _text(path.stem, section, guessed, rotor))
    if records and _turns_back(records[0], read_rig(path)):
        section = section | {"rotation": OPPOSITE[section["rotation"]]}
        guessed = [*guessed, "sense of rotation: against the angles, as the orbits of 1X say"]
        write_text(path, _text(path.stem, section, guessed, rotor))
    return NewRig(path, guessed, rotor.said if rotor else [])


def new_path(name, folder):
    """Path of a new rig file; RotorstudyError if it exists or the name is none."""
    name = name.removesuffix(".yaml")
    if not name or name != Path(name).name or name.startswith("."):
        raise RotorstudyError(f"name '{name}': use one without folders, such as my_machine; --folder states the folder")
    path = Path(folder or "") / f"{name}.yaml"
    if path.exists():
        raise RotorstudyError(f"file '{path}' exists; choose another name, or remove it first")
    return path


def _usual_probes(planes):
    """A section `measurement:` with probes at 45 degrees to the vertical at the first two planes."""
    probes = [
        {"channel": f"{i}{name}", "node": node, "angle_deg": angle, "unit": "um"}
        for i, node in enumerate(planes[:2], start=1)
        for name, angle in zip("XY", PAIR, strict=True)
    ]
    keyphasor = {"channel": "keyphasor", "sensor_angle_deg": 0, "mark_angle_deg": 0}
    return {**VIEW, "probes": probes, "keyphasor": keyphasor}


def _text(name, section, guessed, rotor):
    """The rig file: a template with its sections filled."""
    template = TEMPLATES / ("rig_of_ross.yaml" if rotor else "rig.yaml")
    text = template.read_text(encoding="utf-8").replace(NAME_IN_TEMPLATE, name)
    if rotor:
        own = "\n".join(_section({key: value}) for key, value in rotor.sections.items())
        text = text.replace("rotor: {}\n", _comment("Different from ROSS:", rotor.said) + own)
    measured = {probe.get("node") for probe in section.get("probes", ())} | {section.get("table_node")}
    measured = sorted((measured | set(section.get("node_of_label", {}).values())) - {None})
    text = text.replace("sensors: [3, 9]", f"sensors: {measured}" if measured else "sensors: [3, 9]")
    filled = _comment("Guessed from the records; confirm or correct each line:", guessed)
    return text.replace("measurement: {}\n", filled + _section({"measurement": section}))


def _section(content):
    import yaml

    return yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=110, allow_unicode=True)


def _comment(title, lines):
    return "".join(f"# {line}\n" for line in (title, *(f"  {line}" for line in lines))) if lines else ""


def _turns_back(record, rig):
    """Whether the orbits of a record say that the shaft turns against the sense stated in a rig."""
    try:
        findings = read_measurement([record], rig).findings
    except RotorstudyError:
        return False
    return "rotation" in rig.given["measurement"] and "sense of rotation" in {finding.name for finding in findings}
