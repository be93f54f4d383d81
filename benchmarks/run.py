"""Times that users feel, medians of several runs: python benchmarks/run.py"""

import resource
import statistics
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]


def median_of(runs, function):
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def python(code):
    subprocess.run([sys.executable, "-c", code], check=True)


def combined_identification(case):
    """Records of 65536 samples at 150 speeds, full spectra, identification by both estimators."""
    from rotorstudy.identification import Problem
    from rotorstudy.plugins import registry
    from rotorstudy.records import full_spectrum, simulate_records
    from rotorstudy.studies.config import load_study

    config = load_study(ROOT / "workflow" / "config" / "chapter_2.yaml")
    model = config.rig("physical")
    method = registry().get("spectrum", "regression")
    records = simulate_records(model, config.cases[case].speeds, config.harmonics, config.record.time)
    spectrum = full_spectrum(records, config.harmonics, method)
    for estimator in registry().plugins["estimator"].values():
        estimator.function(Problem(model, spectrum, tuple(config.unknowns)))


def full_crack_response():
    import yaml

    from rotorstudy import build_model, harmonic_response

    rig = yaml.safe_load((ROOT / "examples" / "jeffcott.yaml").read_text())
    rig["cracks"][0]["weight_dominance"] = False
    model = build_model(rig)
    speeds = [88.0]
    return median_of(20, lambda: harmonic_response(model, speeds, range(-15, 16)))


def main():
    bare = median_of(5, lambda: python("pass"))
    rows = [
        ("import rotorstudy", median_of(5, lambda: python("import rotorstudy")) - bare),
        (
            "import rotorstudy and load the zoo",
            median_of(5, lambda: python("import rotorstudy; rotorstudy.registry()")) - bare,
        ),
        ("full time-periodic crack, one speed, harmonics to 15", full_crack_response()),
        (
            "150 speeds of 65536 samples: records, spectra, identification",
            median_of(3, lambda: combined_identification("Combined speed from 50 to 199 with increment +1")),
        ),
    ]
    for name, seconds in rows:
        print(f"{name:64} {seconds:8.3f} s")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024 if sys.platform != "darwin" else 1024**2)
    print(f"{'peak memory of this process':64} {peak:8.0f} MB")


if __name__ == "__main__":
    main()
