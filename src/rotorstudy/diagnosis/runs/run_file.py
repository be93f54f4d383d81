"""The file of runs: each run with its records, and what was added to the machine in it."""

from pathlib import Path

from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.options import AtLeastOne, NonNegative
from rotorstudy.yaml_file import read_yaml


class AddedUnbalance(Strict):
    """An unbalance in a run: g mm at an angle of the user's picture from the shaft's reference line, degrees."""

    node: int | str
    unbalance_g_mm: NonNegative | None = None
    angle_deg: float = 0.0
    std_g_mm: NonNegative = 0.0


class RunItem(Strict):
    """A run in a file of runs."""

    name: str
    records: AtLeastOne[str]
    unbalances: list[AddedUnbalance] = []
    effects: list[dict] = []
    own: list[str] = []
    slow_roll: bool = False


def read_runs(path: str | Path) -> list[RunItem]:
    """The runs listed in a file; RotorstudyError if there is none, two have one name, or a key is unknown."""
    given = read_yaml(path)
    check_known("section", given, ["runs"], str(path))
    if not isinstance(given.get("runs"), list) or not given["runs"]:
        raise RotorstudyError(f"{path}: 'runs:' must be a list of runs, each starting with '- name:'")
    items = []
    for i, one in enumerate(given["runs"]):
        where = f"{path}, runs[{i}]"
        if not isinstance(one, dict):
            raise RotorstudyError(f"{where}: expected keys and values, found {type(one).__name__}")
        added = one.get("unbalances") or []
        if not isinstance(added, list) or not all(isinstance(part, dict) for part in added):
            raise RotorstudyError(f"{where}, unbalances: must be a list, each starting with '- node:'")
        added = [check_config(AddedUnbalance, part, f"{where}, unbalances[{k}]") for k, part in enumerate(added)]
        if any(part.unbalance_g_mm and "angle_deg" not in part.model_fields_set for part in added):
            raise RotorstudyError(f"{where}, unbalances: unbalance_g_mm without angle_deg; state where it was added")
        items.append(check_config(RunItem, {**one, "unbalances": added}, where))
    names = [item.name for item in items]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise RotorstudyError(f"{path}: two runs are named '{twice[0]}'; give each its own name")
    return items
