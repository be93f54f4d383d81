"""`rotorstudy check`: check the invariants of the plugins in a file."""


def add(commands):
    """Add the command and its arguments to the subparsers."""
    parser = commands.add_parser("check", help="check a plugin file against every invariant of its kind")
    parser.add_argument("file", help="plugin file")
    parser.set_defaults(func=run)


def run(given):
    """Check every invariant; status 1 if one fails."""
    from rotorstudy.authoring.files import check_file, left_to_write

    rows = check_file(given.file)
    for kind, name, outcome in rows:
        wrong = f"\n       {outcome.wrong}" if outcome.wrong else ""
        print(f"{outcome.state}  {kind} {name}: {outcome.statement}{wrong}")
    states = [outcome.state for _, _, outcome in rows]
    unclaimed = states.count("not claimed")
    print(f"{states.count('holds')} of {len(states) - unclaimed} hold" + f", {unclaimed} not claimed" * bool(unclaimed))
    if left := left_to_write(given.file):
        print(f"note: {' and '.join(left)} in {given.file} still have the text of the template; replace it")
    return 1 if "fails" in states else 0
