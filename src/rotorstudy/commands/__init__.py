"""The command line: one file per command, with its arguments in `add` and its action in `run`."""

import os

for _library in ("OPENBLAS", "OMP", "MKL"):  # before numpy is imported: the matrices are small, threads slow them down
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")
