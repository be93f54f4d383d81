"""The rotor of the comparison of packages, in the words and axes of ROSS, and what a task reports of itself.

Nodes count from 0, y points upwards, the weight acts along -y, the shaft turns from x to y. It is the shaft of Chapter
6 of the thesis without its crack and its internal damping. Plain numbers, read in both environments.
"""

import json
import resource
import statistics
import sys
import time

LENGTH = 0.45  # m
DIAMETER = 0.015  # m
STEEL = {"rho": 7850.0, "E": 2.1e11, "Poisson": 0.3}
GRAVITY = 9.8065  # m/s2, of ROSS
# place along the shaft as a share of its length
DISCS = (
    {"place": 0.25, "m": 0.799, "Id": 6.856e-3, "Ip": 13.712e-3},
    {"place": 0.75, "m": 0.7231, "Id": 5.6502e-3, "Ip": 11.3004e-3},
)
BEARINGS = (
    {"place": 0.0, "kxx": 106788.0, "kyy": 128592.0, "cxx": 90.0, "cyy": 95.0},
    {"place": 1.0, "kxx": 115788.0, "kyy": 127788.0, "cxx": 77.0, "cyy": 86.0},
)
UNBALANCE = (  # kg m and rad
    {"place": 0.25, "magnitude": 2.0e-5, "phase": 0.785},
    {"place": 0.75, "magnitude": 2.2e-5, "phase": 0.262},
)
CRACK = {"place": 0.5, "depth_ratio": 0.2}  # in the element before that place; depth over diameter

SPEED = 100.0  # rad/s, of every task at one speed
SPEEDS = tuple(50.0 + i for i in range(51))  # rad/s
STEP = 1e-4  # s
DURATION = 0.5  # s, of the response from rest
SETTLING = 1.0  # s; slow transients decay as exp(-18.7 t/s), one at 1796 rad/s, hardly excited, as exp(-7.6 t/s)
REVOLUTIONS = 4  # of the settled record
STEPS = 1024  # a revolution where a crack is integrated
HARMONICS = (1, -1, 2, -2, 3, -3)


def node(place, elements):
    """Node, from 0, of a place along the shaft."""
    return round(place * elements)


def report(tasks):
    """Run the task that the command line names, and print its seconds, the peak memory and its numbers, as JSON.

    tasks : {name: function of the numbers beside it, if any, that prepares the task and returns it}. Processor time,
            as other work on the machine lengthens the time of the clock on the wall. Of several runs the median without
            the first, in which a package compiles or loads what it needs; of `first` that of the process so far.
    """
    (name, *numbers), runs = sys.argv[1].split(), int(sys.argv[2])
    run, elapsed = tasks[name](*map(int, numbers)), []
    for _ in range(runs):
        start = 0.0 if name == "first" else time.process_time()
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
