"""Processor time and memory of a task, and its numbers, as JSON; used in both environments."""

import json
import resource
import statistics
import sys
import time


def report(prepare, runs, with_import=False):
    """Print the seconds of a task, the peak memory of the process and the numbers that the task gives.

    Processor time, as other work on the machine lengthens the time of the clock on the wall. Of several runs the median
    without the first, in which a package compiles or loads what it needs; `with_import` that of the process so far.
    """
    run, elapsed = prepare(), []
    for _ in range(runs):
        start = 0.0 if with_import else time.process_time()
        result = run()
        elapsed.append(time.process_time() - start)
    unit = 1024 if sys.platform != "darwin" else 1024**2
    found = {
        "seconds": statistics.median(elapsed[1:] or elapsed),
        "memory_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit,
        "real": result.real.tolist(),
        "imag": result.imag.tolist(),
    }
    print("\n" + json.dumps(found))
