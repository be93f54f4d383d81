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

    SPECTRA = {  # quantity -> phase reference and the tables at 20 and 50 Hz
        "amplitude": ("none", "4.2", "4.3"),
        "phase": ("none", "4.4", "4.5"),
        "reference phase": (None, "4.6", "4.7"),
        "compensated phase": ("reference", "4.8", "4.9"),
    }
    METHODS = {"regression": "regression", "fft": "fft_multiples"}
    SWAPPED = {"regression": "fft_multiples", "fft": "regression"}  # headings of the incomplete cycles of Table 4.7
    PARAMETERS = {
        "c_H": ("internal_damping", 1.0),
        "c_E": ("external_damping", 1.0),
        "e": ("eccentricity", 1.0),
        "phi": ("eccentricity_phase", 180 / np.pi),
        "dk_22": ("stiffness_loss_22", 1.0),
    }
    CASE = "20 to 50 Hz"
    config = load_study(snakemake.input.config)
    spectra, identification = load(snakemake.input.spectra), load(snakemake.input.identification)
    noisy = load(snakemake.input.monte_carlo)

    columns = {}
    for quantity, (phase, *tables) in SPECTRA.items():
        for table, speed, at in zip(tables, config.shown_speeds_rad_s, ("20 Hz", "50 Hz"), strict=True):
            for record in config.record.kinds:
                methods = SWAPPED if (table, record) == ("4.7", "incomplete cycles") else METHODS
                for printed_as, method in methods.items():
                    where = {"record": record, "spectrum_method": method, "speed": speed}
                    if phase:
                        where |= {"source": "from rest", "phase_reference": phase}
                    columns[table, f"{at}, {record}", quantity, printed_as] = where
    rows = spectrum_rows(spectra, columns)

    estimates = identification.estimate.sel(
        case=CASE, source="from rest", spectrum_method="regression", estimator="least_squares"
    )
    variants = {
        "complete cycles": ("complete cycles", "reference"),
        "incomplete cycles, without phase compensation": ("incomplete cycles", "none"),
        "incomplete cycles, with phase compensation": ("incomplete cycles", "reference"),
    }
    for variant, (record, phase) in variants.items():
        rows += estimate_rows(
            estimates.sel(record=record, phase_reference=phase), "4.10", f"{CASE}, {variant}", PARAMETERS
        )
    printed = published(Path(snakemake.input.published).parent, [f"4.{n}" for n in range(2, 11)])
    rows += noise_rows(
        printed[printed.noise_percent > 0],
        lambda case: noisy.sel(record=variants[case.removeprefix(f"{CASE}, ")][0]),
        PARAMETERS,
        {"per_harmonic": "per harmonic", "white": "white in time"},
        mean_of="white in time",
    )
    computed = with_deviation(pd.DataFrame(rows), printed)
    scored = score(printed, computed, load_reasons(snakemake.input.reasons))
    write_csv(scored, snakemake.output.scored)

    rotor = config.rig("thesis").structure
    k, u = rotor.stiffness, rotor.static_deflection.real
    true = identification.true
    assumed = pd.DataFrame(
        [
            ("mass of disc", "m", 2.0, rotor.mass[0, 0], "kg"),
            ("polar moment of inertia", "I_p", 0.0048, -rotor.gyroscopic[1, 1], "kg m^2"),
            ("diametral moment of inertia", "I_d", 0.0024, rotor.mass[1, 1], "kg m^2"),
            ("shaft stiffness", "k_22", 5.779e5, k[0, 0], "N/m"),
            ("shaft stiffness", "k_24", 2.2016e4, k[0, 1], "N"),
            ("shaft stiffness", "k_44", 1.7613e4, k[1, 1], "N m"),
            ("additive crack stiffness", "dk_22", 1.7337e5, float(true.sel(parameter="stiffness_loss_22")), "N/m"),
            ("additive crack stiffness", "dk_44", 1.7612e3, float(true.sel(parameter="stiffness_loss_44")), "N m"),
            ("external damping", "c_E", 27.0, float(true.sel(parameter="external_damping")), "N s/m"),
            ("internal damping", "c_H", 20.0, float(true.sel(parameter="internal_damping")), "N s/m"),
            ("shaft deflection", "u_x0", 3.57e-5, u[0], "m"),
            ("tilt at rest", "phi_y0", -4.46e-5, u[1], "rad"),
            ("disc eccentricity", "e", 3e-5, float(true.sel(parameter="eccentricity")), "m"),
            (
                "phase of eccentricity",
                "phi",
                30.0,
                float(true.sel(parameter="eccentricity_phase")) * 180 / np.pi,
                "deg",
            ),
        ],
        columns=["parameter", "symbol", "thesis", "here", "unit"],
    )
    write_table(
        assumed,
        snakemake.output.csv[0],
        snakemake.output.html[0],
        "Table 4.1: Assumed parameters of the rotor with an offset disc",
        "Stiffness and deflection follow from the shaft: 210 GPa, 15 mm, disc at 0.20 m of 0.36 m. The thesis prints "
        "u_x0 and phi_y0 rounded up; its tables are made with the unrounded numbers.",
    )
    by_method = (["item"], ["case", "method"])
    transient = (
        "From rest, the seventh second; the tilt is hardly damped, and its free vibration is still in the record."
    )
    swapped = "The thesis's headings of the incomplete cycles are swapped; here regression stands under its own name."
    headings = {
        "4.2": (
            "Amplitudes at 20 Hz",
            f"{transient} 7X of complete cycles: one misprint, .0562 for .0565.",
        ),
        "4.3": ("Amplitudes at 50 Hz", transient),
        "4.4": ("Phases at 20 Hz", "Regression of the thesis counts from 100 samples before the record."),
        "4.5": ("Phases at 50 Hz", "Regression of the thesis counts from 100 samples before the record."),
        "4.6": ("Phases of the reference signal at 20 Hz", "Complete cycles: zero to round-off."),
        "4.7": ("Phases of the reference signal at 50 Hz", swapped),
        "4.8": ("Compensated phases at 20 Hz", "Compensation takes the unknown start of the record away."),
        "4.9": ("Compensated phases at 50 Hz", "What compensation leaves at 7X is leakage."),
    }
    sheets = {name: (*heading, *by_method) for name, heading in headings.items()}
    sheets["4.10"] = (
        "Assumed and estimated parameters",
        "Rows under noise: our mean over the trials; the printed one is a single draw. The column of dk_44 is missing "
        "in the source; its error is in the figure of errors against noise.",
        ["case", "noise_percent"],
        ["item"],
    )
    write_scored_tables(scored, sheets, snakemake.output.csv[1:], snakemake.output.html[1:])
