from rotorstudy.studies.job import job

with job(snakemake):
    from pathlib import Path

    import numpy as np

    from rotorstudy.model.cracks import SERIES_ORDER
    from rotorstudy.model.registry import registry
    from rotorstudy.presentation import study_figures as figures
    from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, save_figure
    from rotorstudy.store import as_complex, load
    from rotorstudy.studies.config import load_study
    from rotorstudy.thesis.scoreboard import published

    SHORT = {
        "Single speed 88": "88 rad/s",
        "Single speed 308": "308 rad/s",
        "Combined speed from 50 to 199 with increment +1": "50 to 199 rad/s",
        "Combined speed from 200 to 350 with increment +1": "200 to 350 rad/s",
    }
    config = load_study(snakemake.input.config)
    records, spectra = load(snakemake.input.records), load(snakemake.input.spectra)
    thesis_spectra = load(snakemake.input.thesis_spectra)
    bias, dominance, stable = (load(snakemake.input[key]) for key in ("bias", "weight_dominance", "stability"))
    noisy, noisy_thesis = (
        {case: load(path).sel(record="steady state") for case, path in zip(config.cases, paths, strict=True)}
        for paths in (snakemake.input.monte_carlo, snakemake.input.monte_carlo_thesis)
    )
    printed = published(Path(snakemake.input.published).parent, ["2.2", "2.3", "2.5"])
    outputs = iter(zip(snakemake.output.png, snakemake.output.svg, strict=True))
    combined = {case: SHORT[case] for case in list(config.cases)[2:]}

    def save(picture):
        save_figure(picture, *next(outputs))

    # Figure 2.4: the switching function
    picture, axes = figure()
    speed, crack = 88.0, registry().get("crack", "switching")
    time = np.linspace(0, 4 * np.pi / speed, 2000)
    axes[0, 0].plot(time * 1e3, crack.function(speed * time), label="sudden opening")
    for order, style in ((7, "--"), (SERIES_ORDER, ":")):
        series = sum(s * np.exp(1j * k * speed * time) for k, s in crack.series(order).items()).real
        axes[0, 0].plot(time * 1e3, series, style, label=f"series to order {order}")
    axes[0, 0].set(
        xlabel="time (ms)", ylabel="opening, 0 closed to 1 open", title="Crack opening over two turns at 88 rad/s"
    )
    axes[0, 0].set_ylim(-0.15, 1.65)
    axes[0, 0].legend(loc="upper center", ncols=2)
    save(picture)

    # Figures 2.6 and 2.7: records in time
    for speed in config.shown_speeds_rad_s:
        title = f"Three turns at {speed:g} rad/s: integration lies on the closed form"
        save(figures.time_and_orbit(config, records, speed, title))

    # Figures 2.8 and 2.9: full spectra, with the printed values where there are any
    for speed in config.shown_speeds_rad_s:
        late = {"source": "from rest", "record": "half a sample late", "spectrum_method": "fft", "speed": speed}
        amplitude, plain, compensated = panels = (
            f"Amplitude, {speed:g} rad/s",
            f"Phase, record half a sample late, {speed:g} rad/s",
            f"Phase, compensated by the reference, {speed:g} rad/s",
        )

        def seen(data, phase, late=late):
            return as_complex(data.displacement.sel(**late, phase_reference=phase).isel(node=0))

        rows = {
            "physical signs": dict.fromkeys((amplitude, compensated), seen(spectra, "reference")),
            "the thesis's reading": {
                **dict.fromkeys((amplitude, compensated), seen(thesis_spectra, "reference")),
                plain: seen(thesis_spectra, "none"),
            },
        }
        marks = {}
        if speed == 88.0:
            for table, method, panel in (
                ("2.2", "fft", amplitude),
                ("2.3", "fft, uncompensated", plain),
                ("2.3", "fft, compensated", compensated),
            ):
                values = printed[(printed.table == table) & (printed.method == method)]
                marks[panel] = (values.item.astype(int), values.published)
        kinds = ("amplitude", "phase", "phase")
        save(figures.full_spectra(config.harmonics, rows, list(zip(panels, kinds, strict=True)), marks))

    # Error against noise: both estimators, the bound
    title = "Maximum likelihood sits on the bound; least squares of the equations does not"
    save(figures.error_against_noise({shown: noisy[case] for case, shown in combined.items()}, title))

    # Printed noise rows of Table 2.5 among our trials
    picture, axes = figure(height=2.8, width=4.5)
    names = {"c_H": "internal_damping", "c_E": "external_damping", "e": "eccentricity", "phi": "eccentricity_phase"}
    names["dk_xi"] = "stiffness_loss"
    rows = printed[(printed.table == "2.5") & (printed.noise_percent > 0)]
    for m, model in enumerate(("per harmonic, same at all speeds", "per harmonic", "white in time")):
        place, level = [], []
        for row in rows.itertuples():
            data = noisy_thesis[row.case.removesuffix(", with phase compensation")].sel(
                noise_model=model, noise=row.noise_percent
            )
            trials = data.estimate.sel(estimator="least_squares", parameter=names[row.item])
            factor = 180 / np.pi if row.item == "phi" else 1.0
            place.append(abs(row.published / factor - float(trials.mean())) / float(trials.std()))
            level.append(list(names).index(row.item) + (m - 1) * 0.22)
        axes[0, 0].semilogy(level, place, MARKERS[m], color=COLOURS[m], fillstyle="none", label=f"noise {model}")
    axes[0, 0].axhline(1.96, color="k", linestyle="--", linewidth=0.8, label="95 % of trials")
    axes[0, 0].set_xticks(
        range(len(names)), ["internal\ndamping", "external\ndamping", "eccentricity", "phase", "crack\nstiffness"]
    )
    axes[0, 0].set(
        ylabel="distance from our mean\n(our standard deviations)",
        title="Table 2.5: one draw per harmonic, used at all speeds",
    )
    axes[0, 0].legend(loc="upper left", fontsize=6)
    save(picture)

    # What wrong knowledge, weight dominance and internal damping do
    save(
        figures.bias(bias, combined, "Wrong mass or stiffness mostly costs maximum likelihood more than least squares")
    )
    case = next(iter(combined))
    title = "Weight dominance is not a small approximation"
    save(figures.weight_dominance(config, dominance, case, SHORT[case], title))
    save(figures.stability(stable, (r"$1 + c_E / c_H$", lambda ratio: 1 + ratio)))
