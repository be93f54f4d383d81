"""Run times relevant to users, medians of several runs: python benchmarks/run.py"""

import os
import resource
import statistics
import subprocess
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as in the workflow: threads slow down small solves
ROOT = Path(__file__).parents[1]


def median_of(runs, function):
    """Median wall-clock time of a function, s."""
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def python(code):
    """Run code in a new interpreter."""
    subprocess.run([sys.executable, "-c", code], check=True)


def combined_identification(case):
    """Records of 65536 samples at 150 speeds, full spectra, identification by both estimators."""
    from rotorstudy.inference.problem import Problem
    from rotorstudy.measurement.full_spectra import full_spectrum
    from rotorstudy.measurement.simulated_records import simulate_records
    from rotorstudy.model.registry import registry
    from rotorstudy.studies.config import load_study

    config = load_study(ROOT / "workflow" / "config" / "chapter_2.yaml")
    model = config.rig("physical")
    method = registry().get("spectrum", "regression")
    records = simulate_records(model, config.cases[case].speeds, config.harmonics, config.record.time)
    spectrum = full_spectrum(records, config.harmonics, method)
    for estimator in registry().plugins["estimator"].values():
        estimator.function(Problem(model, spectrum, tuple(config.unknowns)))


def full_crack_response():
    """Seconds for the response of a Jeffcott rotor with the full time-periodic crack."""
    import yaml

    from rotorstudy import build_model, harmonic_response

    rig = yaml.safe_load((ROOT / "examples" / "jeffcott.yaml").read_text())
    rig["cracks"][0]["weight_dominance"] = False
    model = build_model(rig)
    speeds = [88.0]
    return median_of(20, lambda: harmonic_response(model, speeds, range(-15, 16)))


def shaft(elements, **crack):
    """The rotor of Chapter 6 on a mesh of some elements, a multiple of four."""
    import copy

    from rotorstudy import build_model
    from rotorstudy.studies.config import load_study

    rig = copy.deepcopy(load_study(ROOT / "workflow" / "config" / "chapter_6.yaml").rigs["physical"])
    rig["rotor"]["elements"][0]["count"] = elements
    for item in [*rig["rotor"]["discs"], *rig["bearings"], *rig["effects"], *rig["cracks"]]:
        item["node"] = 1 + (item["node"] - 1) * elements // 4
    rig["cracks"][0] |= crack
    return build_model(rig)


def full_crack_shaft():
    """Seconds for the response of the rotor of Chapter 6 with the full time-periodic crack."""
    from rotorstudy import harmonic_response

    model = shaft(4, weight_dominance=False)
    return median_of(5, lambda: harmonic_response(model, [100.0], range(-15, 16)))


def mesh_response(elements, speeds=51):
    """Seconds for the response of the rotor of Chapter 6 on a mesh at a number of speeds."""
    import numpy as np

    from rotorstudy import measured_response

    model, speeds = shaft(elements), np.linspace(50.0, 100.0, speeds)
    return median_of(1 if elements > 50 else 5, lambda: measured_response(model, speeds, list(range(-7, 8))))


def diagnosis(effect, **values):
    """Seconds for a diagnosis: seven speeds, five nodes, 1 % noise, an effect hidden in the rotor of Chapter 6."""
    from dataclasses import replace

    import numpy as np

    from rotorstudy import Spectrum, make_term, measured_response
    from rotorstudy.diagnosis import diagnose
    from rotorstudy.measurement.noise import noise_std
    from rotorstudy.measurement.spectrum import independent_covariance

    model, speeds, harmonics = shaft(4).without({"switching"}), np.linspace(50.0, 110.0, 7), list(range(-5, 6))
    hidden = make_term("effect", {"kind": effect, **values}, model.structure, model.sensors)
    shown = measured_response(model.plus(hidden), speeds, harmonics)
    clean = Spectrum(shown, speeds, np.array(harmonics), model.sensors, independent_covariance(np.ones(shown.shape)))
    std, draws = noise_std(clean, 0.01, "white in time", 2000), np.random.default_rng(3).normal(size=(2, *shown.shape))
    noisy = clean.with_amplitude(shown + std * (draws[0] + 1j * draws[1]))
    noisy = replace(noisy, covariance=independent_covariance(std**2))
    return median_of(1, lambda: diagnose(noisy, model))


def main():
    """Print every run time and the peak memory."""
    bare = median_of(5, lambda: python("pass"))
    rows = [
        ("import rotorstudy", median_of(5, lambda: python("import rotorstudy")) - bare),
        (
            "import rotorstudy and load the plugins",
            median_of(5, lambda: python("import rotorstudy; rotorstudy.registry()")) - bare,
        ),
        ("full time-periodic crack, one speed, harmonics to 15", full_crack_response()),
        *((f"{n} elements, 51 speeds, 15 harmonics", mesh_response(n)) for n in (4, 8, 20, 48, 100, 200)),
        *((f"4 elements, {n} speeds, 15 harmonics", mesh_response(4, n)) for n in (102, 204, 408)),
        ("4 elements, full time-periodic crack, one speed, harmonics to 15", full_crack_shaft()),
        (
            "150 speeds of 65536 samples: records, spectra, identification",
            median_of(3, lambda: combined_identification("Combined speed from 50 to 199 with increment +1")),
        ),
        ("diagnosis, 7 speeds, 5 nodes: anisotropic support", diagnosis("support_anisotropy", node=2,
            support_anisotropy_N_per_m=5e3, support_anisotropy_phase_rad=0.7)),
        ("diagnosis, 7 speeds, 5 nodes: breathing crack", diagnosis("breathing_crack", element=2,
            stiffness_loss=0.1)),
        ("diagnosis, 7 speeds, 5 nodes: cubic stiffness", diagnosis("cubic_stiffness", node=2,
            cubic_stiffness_N_per_m3=1e14)),
    ]  # fmt: skip
    for name, seconds in rows:
        print(f"{name:64} {seconds:8.3f} s")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024 if sys.platform != "darwin" else 1024**2)
    print(f"{'peak memory of this process':64} {peak:8.0f} MB")


if __name__ == "__main__":
    main()
