from rotorstudy.studies.job import job

with job(snakemake):
    from pathlib import Path

    import numpy as np
    import pandas as pd

    from rotorstudy.presentation.tables import write_csv, write_scored_tables, write_table
    from rotorstudy.store import load
    from rotorstudy.studies.config import load_study
    from rotorstudy.thesis.printed import estimate_rows, noise_rows, spectrum_rows, with_deviation
    from rotorstudy.thesis.scoreboard import load_reasons, published, score

    TABLES = ["2.2", "2.3", "2.4", "2.5"]
    # names in the thesis's tables: ours, factor to their unit
    PARAMETERS = {
        "c_H": ("internal_damping", 1.0),
        "c_E": ("external_damping", 1.0),
        "e": ("eccentricity", 1.0),
        "phi": ("eccentricity_phase", 180 / np.pi),
        "dk_xi": ("stiffness_loss", 1.0),
    }
    MODELS = {
        "shared": "per harmonic, same at all speeds",
        "per_harmonic": "per harmonic",
        "white": "white in time",
    }
    config = load_study(snakemake.input.config)
    spectra = load(snakemake.input.spectra)
    identification = load(snakemake.input.identification).sel(source="steady state", record="one sample late")
    noisy = {
        case: load(path).sel(record="steady state")
        for case, path in zip(config.cases, snakemake.input.monte_carlo, strict=True)
    }

    # what each column of the thesis is made of
    steady = {"source": "steady state", "record": "complete", "spectrum_method": "regression"}
    whole = {"source": "from rest", "record": "complete", "spectrum_method": "fft"}
    late = {"source": "from rest", "record": "half a sample late", "spectrum_method": "fft"}
    at = {"phase_reference": "none", "speed": 88.0}
    columns = {
        ("2.2", "88 rad/s", "amplitude", "regression"): {**steady, **at},
        ("2.2", "88 rad/s", "amplitude", "fft"): {**whole, **at},
        ("2.3", "88 rad/s", "phase", "regression"): {**steady, **at},
        ("2.3", "88 rad/s", "phase", "fft, uncompensated"): {**late, **at},
        ("2.3", "88 rad/s", "phase", "fft, compensated"): {**late, **at, "phase_reference": "reference"},
    }
    for speed in config.shown_speeds_rad_s:
        for method, record in (("regression", "complete"), ("fft", "one sample late")):
            where = {"record": record, "spectrum_method": method, "speed": speed}
            columns["2.4", f"{speed:g} rad/s", "reference phase", method] = where
    rows = spectrum_rows(spectra, columns)
    for case in config.cases:
        for variant, phase in (("without", "none"), ("with", "reference")):
            exact = identification.estimate.sel(
                case=case, phase_reference=phase, spectrum_method="fft", estimator="least_squares"
            )
            rows += estimate_rows(exact, "2.5", f"{case}, {variant} phase compensation", PARAMETERS)
    printed = published(Path(snakemake.input.published).parent, TABLES)
    under_noise = printed[(printed.table == "2.5") & (printed.noise_percent > 0)]
    rows += noise_rows(
        under_noise,
        lambda case: noisy[case.removesuffix(", with phase compensation")],
        PARAMETERS,
        MODELS,
        mean_of="per harmonic, same at all speeds",
    )
    computed = with_deviation(pd.DataFrame(rows), printed)
    scored = score(printed, computed, load_reasons(snakemake.input.reasons))
    write_csv(scored, snakemake.output.scored)

    rotor = config.rig(config.main_rig).structure
    assumed = pd.DataFrame(
        [
            ("mass of disc", 2.0, rotor.mass[0, 0], "kg"),
            ("intact shaft stiffness", 7.6e5, rotor.stiffness[0, 0], "N/m"),
            ("shaft deflection", 2.58e-5, rotor.static_deflection[0].real, "m"),
            *(
                (label, thesis, float(identification.true.sel(parameter=ours)) * factor, unit)
                for label, thesis, ours, factor, unit in (
                    ("additive crack stiffness", 2.5e5, "stiffness_loss", 1.0, "N/m"),
                    ("external damping", 100.0, "external_damping", 1.0, "N s/m"),
                    ("internal damping", 20.0, "internal_damping", 1.0, "N s/m"),
                    ("phase of unbalance", 30.0, "eccentricity_phase", 180 / np.pi, "deg"),
                    ("disc eccentricity", 5e-6, "eccentricity", 1.0, "m"),
                )
            ),
        ],
        columns=["parameter", "thesis", "here", "unit"],
    )
    write_table(
        assumed,
        snakemake.output.csv[0],
        snakemake.output.html[0],
        "Table 2.1: Assumed parameters of the 2-DOF rotor",
        "The deflection follows from mass and stiffness.",
    )
    by_method = (["item"], ["case", "method"])
    tables = {
        "2.2": (
            "Amplitudes of the full spectrum at 88 rad/s",
            "Regression columns agree to the last digit; see 7X of the FFT.",
            *by_method,
        ),
        "2.3": (
            "Phases of the full spectrum at 88 rad/s",
            "The record of the uncompensated column starts half a sample late.",
            *by_method,
        ),
        "2.4": (
            "Phases of the reference signal",
            "The FFT columns are n w dt: a record that starts one sample late.",
            *by_method,
        ),
        "2.5": (
            "Assumed and estimated parameters",
            "Noise rows: our mean over the trials; the printed one is a single draw.",
            ["case", "noise_percent"],
            ["item"],
        ),
    }
    write_scored_tables(scored, tables, snakemake.output.csv[1:], snakemake.output.html[1:])
