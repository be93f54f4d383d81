"""The command `rotorstudy`, also as `python -m rotorstudy`."""

import sys


def main():
    """Run the command line; Ctrl-C during its imports, which take most of the first second, is one line too."""
    try:
        from rotorstudy.commands.line import main as run
    except KeyboardInterrupt:
        print("stopped before anything was done", file=sys.stderr)
        return 130
    return run()


if __name__ == "__main__":
    sys.exit(main())
