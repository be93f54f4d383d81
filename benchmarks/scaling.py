"""Cost against the size of a problem, with exponents: python benchmarks/scaling.py [--page]

Processor seconds of one thread, medians. --page writes the rows to `docs/scaling.csv` and, between marks, to
`docs/large.md`; a test compares both.
"""

import os

os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1"))

import statistics
import sys
import time
import timeit
from copy import deepcopy

import numpy as np
import pandas as pd
from marked_pages import ROOT, table, with_numbers

from rotorstudy import Problem, Spectrum, build_model, harmonic_response, measured_response, registry
from rotorstudy.inference.estimate import estimate_by
from rotorstudy.measurement.harmonics import estimate
from rotorstudy.measurement.noise import with_noise
from rotorstudy.measurement.spectrum import independent_covariance
from rotorstudy.studies.config import load_study

ROWS, PAGE = ROOT / "docs/scaling.csv", ROOT / "docs/large.md"
SPEEDS = np.linspace(50.0, 100.0, 51)


def shaft(elements, **crack):
    """The rotor of Chapter 6 on a mesh of some elements, a multiple of four."""
    rig = deepcopy(load_study(ROOT / "workflow" / "config" / "chapter_6.yaml").rigs["physical"])
    rig["rotor"]["elements"][0]["count"] = elements
    for item in [*rig["rotor"]["discs"], *rig["bearings"], *rig["effects"], *rig["cracks"]]:
        item["node"] = 1 + (item["node"] - 1) * elements // 4
    rig["cracks"][0] |= crack
    return build_model(rig)


def seconds(function):
    """Median processor time of two calls of a function, s; a first call is not counted."""
    return statistics.median(timeit.repeat(function, timer=time.process_time, repeat=3, number=1)[1:])


def response(elements, speeds, harmonics):
    """Response of the uncracked shaft of Chapter 6."""
    model = shaft(elements).without({"switching"})
    listed = list(range(-harmonics, harmonics + 1))
    return lambda: measured_response(model, SPEEDS[0] + np.arange(speeds), listed)


def cracked(elements, harmonics):
    """Response with the fully time-periodic crack at one speed."""
    model = shaft(elements, weight_dominance=False)
    return lambda: harmonic_response(model, [100.0], range(-harmonics, harmonics + 1), order=harmonics)


def estimates(trials):
    """Maximum-likelihood estimates of all trials of a Monte Carlo study of the shaft."""
    model, harmonics = shaft(4), [0, 1, 2, 3, -1, -2, -3]
    shown = measured_response(model, SPEEDS[::10], harmonics)
    clean = Spectrum(shown, SPEEDS[::10], np.array(harmonics), model.sensors, independent_covariance(shown.real**2))
    numbers = np.random.default_rng(1).normal(size=(trials, 2, *shown.shape))
    noisy = with_noise(clean, 0.01, "white in time", 2000, numbers)
    problem = Problem(model, noisy, ("internal_damping", "stiffness_loss_22", "bearing_damping_xx[1]"))
    method = registry().get("estimator", "maximum_likelihood")
    return lambda: estimate_by(method, problem)


def record(samples):
    """Harmonics and covariance of one node from a record of 200 samples a revolution."""
    angle = 2 * np.pi * np.arange(samples) / 200
    signal = np.exp(1j * angle) + 0.01 * np.random.default_rng(1).normal(size=(2, samples)).T @ [1, 1j]
    return lambda: estimate(signal, angle, samples // 200, [0, 1, -1, 2, -2, 3, -3])


SWEEPS = {  # what, against what: sizes and the function that prepares each
    ("response, 15 harmonics, 51 speeds", "elements"): ((12, 24, 48, 100, 200), lambda n: response(n, 51, 7)),
    ("response, 15 harmonics, 20 elements", "speeds"): ((50, 200, 800), lambda n: response(20, n, 7)),
    ("response, 20 elements, 51 speeds", "harmonics each way"): ((5, 10, 20), lambda n: response(20, 51, n)),
    ("cracked rotor, one speed, harmonics to 15", "elements"): ((24, 48, 96, 192), lambda n: cracked(n, 15)),
    ("cracked rotor, one speed, 24 elements", "harmonics each way"): ((5, 10, 20), lambda n: cracked(24, n)),
    ("maximum-likelihood estimates", "trials"): ((25, 50, 100, 200), estimates),
    ("harmonics of a record with covariance", "samples"): ((10_000, 100_000, 1_000_000), record),
}


def measured():
    """Rows: what, against, size, seconds, exponent (of the last two sizes)."""
    rows = []
    for (what, against), (sizes, prepared) in SWEEPS.items():
        times = [seconds(prepared(size)) for size in sizes]
        exponent = np.log(times[-1] / times[-2]) / np.log(sizes[-1] / sizes[-2])
        rows += [(what, against, *pair, exponent) for pair in zip(sizes, times, strict=True)]
        print(what, against, dict(zip(sizes, np.round(times, 4), strict=True)), f"exponent {exponent:.2f}", flush=True)
    return pd.DataFrame(rows, columns=["what", "against", "size", "seconds", "exponent"])


def page(rows):
    """The text of the page with some rows: a line of its table for each sweep."""
    lines = []
    for (what, against), sweep in rows.groupby(["what", "against"], sort=False):
        shown = ", ".join(f"{n:,d}: {s:.2g}" for n, s in zip(sweep["size"], sweep["seconds"], strict=True))
        lines.append((what, against, shown, f"{sweep.exponent.iloc[0]:.1f}"))
    whole = table(("what", "against", "seconds at each size", "exponent"), lines)
    return with_numbers(PAGE.read_text(encoding="utf-8"), "scaling", whole)


if __name__ == "__main__":
    found = measured()
    if "--page" in sys.argv:
        found.to_csv(ROWS, index=False, float_format="%.4g")
        PAGE.write_text(page(pd.read_csv(ROWS)), encoding="utf-8")
