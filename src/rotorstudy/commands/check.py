"""Check a rig file (loads, critical speeds, anything odd), or the invariants of a plugin file."""

from pathlib import Path

from rotorstudy.commands.shared import YAML


def add(parser):
    parser.add_argument("file", help="rig file (.yaml) or plugin file (.py)")


def run(given):
    """Check the file by its suffix; status 1 if something is wrong."""
    return _rig(given.file) if Path(given.file).suffix.lower() in YAML else _plugins(given.file)


def _rig(file):
    from rotorstudy.presentation.rotor_page import check_data, check_words
    from rotorstudy.studies.rig_check import check_rig

    found = check_rig(file)
    print("\n".join(check_words(found)))
    return 1 if found.errors else 0, check_data(found)


def _plugins(file):
    from rotorstudy.authoring.files import check_file, left_to_write

    rows = check_file(file)
    for i, (kind, name, outcome) in enumerate(rows):
        again = outcome.wrong in (one.wrong for *_, one in rows[:i])
        reason = outcome.wrong and (", for the same reason" if again else f"\n       {outcome.wrong}")
        print(f"{outcome.state}  {kind} {name}: {outcome.statement}{reason}")
    states = [outcome.state for _, _, outcome in rows]
    unclaimed = states.count("not claimed")
    print(f"{states.count('holds')} of {len(states) - unclaimed} hold" + f", {unclaimed} not claimed" * bool(unclaimed))
    if left := left_to_write(file):
        print(f"note: {' and '.join(left)} in {file} still have the text of the template; replace it")
    facts = [{"kind": kind, "name": name, **outcome._asdict()} for kind, name, outcome in rows]
    return 1 if "fails" in states else 0, {"checks": facts}
