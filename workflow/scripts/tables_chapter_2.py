from rotorstudy.job import job

with job(snakemake):
    from pathlib import Path

    import numpy as np
    import pandas as pd

    from rotorstudy.scoreboard import KEYS, load_reasons, published, score
    from rotorstudy.store import as_complex, load
    from rotorstudy.studies.config import load_study
    from rotorstudy.tables import write_csv, write_scored_tables, write_table

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
    identification = load(snakemake.input.identification)
    noisy = {case: load(path) for case, path in zip(config.cases, snakemake.input.monte_carlo, strict=True)}

    # what each column of the thesis is made of: source, record, spectrum method, phase reference
    columns = {
        ("2.2", "amplitude", "regression"): ("closed form", "complete", "regression", "none"),
        ("2.2", "amplitude", "fft"): ("integration", "complete", "fft", "none"),
        ("2.3", "phase", "regression"): ("closed form", "complete", "regression", "none"),
        ("2.3", "phase", "fft, uncompensated"): ("integration", "half a sample late", "fft", "none"),
        ("2.3", "phase", "fft, compensated"): ("integration", "half a sample late", "fft", "reference"),
    }
    rows = []
    for (table, quantity, method), (source, record, spectrum_method, phase) in columns.items():
        found = spectra.displacement.sel(
            source=source, record=record, spectrum_method=spectrum_method, phase_reference=phase, speed=88.0
        )
        for n, value in zip(config.harmonics, as_complex(found.isel(node=0)), strict=True):
            number = np.abs(value) if quantity == "amplitude" else np.angle(value)
            rows.append((table, "88 rad/s", str(n), np.nan, quantity, method, number))
    for speed in config.shown_speeds_rad_s:
        for method, record in (("regression", "complete"), ("fft", "one sample late")):
            found = spectra.reference_phase.sel(spectrum_method=method, record=record, speed=speed)
            rows += [
                ("2.4", f"{speed:g} rad/s", str(n), np.nan, "reference phase", method, value)
                for n, value in zip(config.harmonics, found.values, strict=True)
            ]
    for case in config.cases:
        for variant, phase in (("without", "none"), ("with", "reference")):
            exact = identification.estimate.sel(
                case=case, phase_reference=phase, spectrum_method="fft", estimator="least_squares"
            )
            for name, (ours, factor) in PARAMETERS.items():
                value = float(exact.sel(parameter=ours)) * factor
                rows.append(
                    ("2.5", f"{case}, {variant} phase compensation", name, 0.0, "estimate", "least squares", value)
                )
    computed = pd.DataFrame(rows, columns=[*KEYS, "computed"])
    printed = published(Path(snakemake.input.published).parent, TABLES)

    # noise rows: one unknown realisation was printed; say where it falls among ours
    percentiles = []
    for row in printed[(printed.table == "2.5") & (printed.noise_percent > 0)].to_dict("records"):
        case = row["case"].removesuffix(", with phase compensation")
        ours, factor = PARAMETERS[row["item"]]
        trials = (
            noisy[case].estimate.sel(noise=row["noise_percent"], estimator="least_squares", parameter=ours) * factor
        )
        share = {
            m: float((trials.sel(noise_model=m) < row["published"]).mean()) * 100 for m in trials.noise_model.values
        }
        percentiles.append(
            {
                **{key: row[key] for key in KEYS},
                "computed": float(trials.sel(noise_model="per harmonic, same at all speeds").mean()),
                **{f"percentile_{short}": share[model] for short, model in MODELS.items()},
                **{f"std_{short}": float(trials.sel(noise_model=model).std()) for short, model in MODELS.items()},
            }
        )
    computed = pd.concat([computed, pd.DataFrame(percentiles)], ignore_index=True)
    values = printed.set_index(KEYS).published
    computed["deviation"] = [
        abs(c - values.get(tuple(k), np.nan)) for k, c in zip(computed[KEYS].values, computed.computed, strict=True)
    ]
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
