"""`rotorstudy check`: the invariants of a plugin file."""


def add(commands):
    parser = commands.add_parser("check", help="try every invariant of its kind on a plugin file; say what holds")
    parser.add_argument("file", help="plugin file")
    parser.set_defaults(func=run)


def run(given):
    """Try every invariant; status 1 if one fails."""
    from rotorstudy.authoring.files import check_file, left_to_write

    rows = check_file(given.file)
    broken = [row for row in rows if row[-1]]
    for kind, name, claim, wrong in rows:
        print(f"{'fails' if wrong else 'holds'}  {kind} {name}: {claim}" + (f"\n       {wrong}" if wrong else ""))
    print(f"{len(rows) - len(broken)} of {len(rows)} hold")
    if left := left_to_write(given.file):
        print(f"note: {' and '.join(left)} in {given.file} still say what the template says; name your own")
    return 1 if broken else 0
