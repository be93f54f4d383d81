"""The command line: one file per command, with its arguments in `add` and its action in `run`."""
