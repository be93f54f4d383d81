"""The number of BLAS threads: the matrices are small, and threads that wait for each other take ten times as long."""

import os
from collections.abc import Callable
from functools import wraps

OF_BLAS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
NAMES = (*OF_BLAS, "OMP_NUM_THREADS")


def use_one_thread() -> None:
    """State one thread for numpy, if it is not imported yet, and for processes that are started later."""
    os.environ.update(dict.fromkeys(NAMES, "1"))


def use_one_thread_unless_stated() -> None:
    """As `use_one_thread`, where the environment states no number."""
    for name in NAMES:
        os.environ.setdefault(name, "1")


def on_one_thread(function: Callable) -> Callable:
    """The function on one thread, also if numpy is imported already, where none is stated for BLAS."""

    @wraps(function)
    def limited(*given, **more):
        from threadpoolctl import threadpool_limits

        if any(name in os.environ for name in OF_BLAS):
            return function(*given, **more)
        with threadpool_limits(1, user_api="blas"):
            return function(*given, **more)

    return limited
