"""`rotorstudy new`: a working plugin file to start from."""


def add(commands):
    """Add the command and its arguments to the subparsers."""
    parser = commands.add_parser("new", help="write a working plugin file to start from")
    parser.add_argument("kind", help="rotor, crack, depth, bearing, effect, spectrum or estimator")
    parser.add_argument("name", help="name of the plugin and its file")
    parser.add_argument(
        "--folder",
        help="output folder (default: plugins/<kind> in the project's folder, elsewhere the current folder)",
    )
    parser.set_defaults(func=run)


def run(given):
    """Write the file."""
    from rotorstudy.authoring.files import new_plugin

    path = new_plugin(given.kind, given.name, given.folder)
    print(f"wrote {path}; edit it, then: rotorstudy check {path}")
    return 0
