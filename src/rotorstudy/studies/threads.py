"""The number of BLAS threads, which numpy reads when it is imported: the matrices are small, threads slow them down."""

import os

NAMES = tuple(f"{library}_NUM_THREADS" for library in ("OPENBLAS", "OMP", "MKL"))


def use_one_thread() -> None:
    """State one thread for numpy, if it is not imported yet, and for processes that are started later."""
    os.environ.update(dict.fromkeys(NAMES, "1"))


def use_one_thread_unless_stated() -> None:
    """As `use_one_thread`, where the environment states no number."""
    for name in NAMES:
        os.environ.setdefault(name, "1")
