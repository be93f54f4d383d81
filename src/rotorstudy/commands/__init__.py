"""The command line: a file a command, with its arguments in `add` and what it does in `run`."""
