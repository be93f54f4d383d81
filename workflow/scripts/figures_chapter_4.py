from rotorstudy.studies.job import job

with job(snakemake):
    from pathlib import Path

    import numpy as np

    from rotorstudy.measurement.noise import noise_std, noisy, standard_normal
    from rotorstudy.presentation import study_figures as figures
    from rotorstudy.presentation.plots import save_figure
    from rotorstudy.store import as_complex, load
    from rotorstudy.studies.config import clean_spectrum, load_study
    from rotorstudy.thesis.scoreboard import published

    CASE = "20 to 50 Hz"
    config = load_study(snakemake.input.config)
    data = {key: load(path) for key, path in snakemake.input.items() if str(path).endswith(".nc")}
    printed = published(Path(snakemake.input.published).parent, [f"4.{n}" for n in range(2, 10)])
    outputs = iter(zip(snakemake.output.png, snakemake.output.svg, strict=True))
    hertz = dict(zip(config.shown_speeds_rad_s, ("20 Hz", "50 Hz"), strict=True))

    def save(picture):
        save_figure(picture, *next(outputs))

    # Figures 4.5 and 4.6: records in time
    for speed, text in hertz.items():
        steady, rest = as_complex(data["records"].displacement.sel(speed=speed, method="nearest").isel(node=0))
        left = np.abs(rest - steady).max() / np.abs(steady).max()
        title = f"Three turns at {text}; of the start from rest {left * 100:.1g} % is left after six seconds"
        save(figures.time_and_orbit(config, data["records"], speed, title))

    # Figures 4.7 and 4.8: full spectra of complete and incomplete cycles, without and with noise
    for speed, text in hertz.items():
        tables = {"20 Hz": ("4.2", "4.4", "4.6", "4.8"), "50 Hz": ("4.3", "4.5", "4.7", "4.9")}[text]
        incomplete = f"{text}, incomplete cycles"
        panels = amplitude, plain, reference, compensated = (
            f"Amplitude, {text}",
            "Phase of incomplete cycles, as it comes",
            "Phase of the reference signal, incomplete cycles",
            "Phase, compensated",
        )

        def seen(name, record, phase, method="regression", speed=speed):
            here = data[name].displacement.sel(
                source="from rest", record=record, spectrum_method=method, phase_reference=phase
            )
            return as_complex(here.sel(speed=speed, method="nearest").isel(node=0))

        mark = data["thesis_spectra"].reference_phase.sel(record="incomplete cycles", spectrum_method="fft_multiples")
        mark = np.exp(1j * mark.sel(speed=speed, method="nearest").values)
        whole, cut = (seen("thesis_spectra", f"{kind} cycles", "reference") for kind in ("complete", "incomplete"))
        steady = clean_spectrum(config, config.rig("thesis"), [speed])
        std = noise_std(steady, 0.01, "white in time", config.record.samples)
        numbers = standard_normal(config.monte_carlo.seed, 99, 1, (2, *steady.amplitude.shape))
        disturbed = whole + (noisy(steady.amplitude, std, numbers, "white in time")[0] - steady.amplitude)[0, :, 0]
        rows = {
            "physical sign": dict.fromkeys((amplitude, compensated), seen("spectra", "complete cycles", "reference")),
            "the thesis's sign": dict.fromkeys((amplitude, compensated), whole),
            "incomplete cycles": {
                amplitude: cut,
                plain: seen("thesis_spectra", "incomplete cycles", "none", "fft_multiples"),
                reference: mark,
                compensated: cut,
            },
            "with 1 % noise": dict.fromkeys((amplitude, compensated), disturbed),
        }
        column = "regression" if text == "50 Hz" else "fft"  # the headings of Table 4.7 are swapped
        marks = {}
        for panel, table, case, method in zip(
            panels,
            tables,
            (f"{text}, complete cycles", incomplete, incomplete, f"{text}, complete cycles"),
            ("regression", "fft", column, "regression"),
            strict=True,
        ):
            values = printed[(printed.table == table) & (printed.case == case) & (printed.method == method)]
            marks[panel] = (values.item.astype(int), values.published)
        kinds = ("amplitude", "phase", "phase", "phase")
        save(figures.full_spectra(config.harmonics, rows, list(zip(panels, kinds, strict=True)), marks))

    # Figure 4.9: error against noise, the thesis's way; then both estimators with the right sign
    thesis = {record: data["monte_carlo_thesis"].sel(record=record) for record in config.record.kinds}
    title = "The thesis's least squares: crack stiffness 44 scatters twenty times more than it need"
    save(figures.error_against_noise(thesis, title))
    best = {"exact steady state": data["monte_carlo"].sel(record="steady state")}
    save(figures.error_against_noise(best, "Maximum likelihood sits on the bound, and the bound of 44 is high"))

    save(figures.collinearity(data["identifiability"], CASE, "Crack stiffnesses 22 and 44 act alike"))
    title = "A second probe settles crack stiffness 44; higher speeds help, too"
    save(figures.measurements(data["identifiability"], CASE, "stiffness_loss_44", title))
    rigs = {"physical": "physical sign of the gyroscopic moment", "thesis": "the thesis's sign"}
    save(
        figures.campbell(data["whirl"], rigs, "The sign of the gyroscopic moment exchanges forward and backward whirl")
    )
    save(
        figures.bias(
            data["bias"],
            {CASE: CASE},
            "Wrong mass or modulus: resonances spoil the dampings, collinearity the crack stiffnesses",
        )
    )
    title = "Weight dominance needs a vibration small against the static deflection"
    save(figures.weight_dominance(config, data["weight_dominance"], CASE, CASE, title))
    save(figures.stability(data["stability"], ("$1 + c_E / c_H$, rotor without tilt", lambda ratio: 1 + ratio)))
