from rotorstudy.job import job

with job(snakemake):
    from pathlib import Path

    import numpy as np
    import pandas as pd

    from rotorstudy.plots import COLOURS, MARKERS, figure, save_figure
    from rotorstudy.store import as_complex, load
    from rotorstudy.studies.checks import limits
    from rotorstudy.studies.replay import load_replay, thesis_estimates
    from rotorstudy.tables import write_table

    reference = Path(snakemake.input.published).parent
    rows = []
    for path, found, seen in zip(
        snakemake.input.configs, snakemake.input.identification, snakemake.input.spectra, strict=True
    ):
        config, estimates, spectra = load_replay(path), load(found), load(seen)
        allowed, model = limits(config), config.model
        theta = dict(zip(model.names, thesis_estimates(config, reference, config.all_speeds), strict=True))
        theta["eccentricity"] = abs(theta["eccentricity_real"] + 1j * theta["eccentricity_imag"])
        one = spectra.compensated.sel(version="corrected", data_set="fft", spectrum_method="regression", harmonic=1)
        bow = np.abs(as_complex(one.sel(case=config.slow_roll)))
        scales = {
            "_damping": ("critical damping", allowed["critical damping"]),
            "eccentricity": ("1X of the slow roll", bow),
        }
        scales["stiffness_loss"] = ("stiffness", allowed["stiffness"])
        for name, (ours, _) in config.thesis_names.items():
            if ours.endswith("_phase"):
                continue
            what, scale = next(value for key, value in scales.items() if key in ours)
            row = {"rig": config.name.replace("_", " ").capitalize(), "parameter": name, "relative to": what}
            row["thesis"] = theta[ours] / scale
            for estimator in config.estimators:
                best = estimates.sel(data_set="fft", group=config.all_speeds, estimator=estimator, parameter=ours)
                for key in ("estimate", "low", "high"):
                    row[f"{estimator.replace('_', ' ')}, {key}"] = float(best[key]) / scale
            rows.append(row)
    table = pd.DataFrame(rows)
    write_table(
        table,
        snakemake.output.csv,
        snakemake.output.html,
        "Parameters found for both rigs",
        "Made comparable: dampings over critical damping, eccentricity over the 1X of the slow roll, stiffness losses "
        "over the stiffness. The rigs have the same disc and cracks made the same way, so these should be alike; the "
        "impact tests allow losses of a few per cent and dampings of a few tenths at most.",
    )

    parameters = list(dict.fromkeys(table.parameter))
    picture, axes = figure(height=4.0, width=5.0)
    for r, rig in enumerate(dict.fromkeys(table.rig)):
        part = table[table.rig == rig].set_index("parameter").loc[parameters]
        for s, source in enumerate(("thesis", "least squares, estimate")):
            axes[0, 0].plot(
                part[source],
                np.arange(len(parameters)) + 0.3 * (r - 0.5),
                MARKERS[r],
                color=COLOURS[s],
                fillstyle=("none", "full")[s],
                label=f"{rig}, {source.removesuffix(', estimate')}",
            )
    axes[0, 0].axvline(0, color="k", linewidth=0.8)
    axes[0, 0].set_xscale("symlog", linthresh=0.1)
    axes[0, 0].set_yticks(range(len(parameters)), parameters)
    axes[0, 0].invert_yaxis()
    axes[0, 0].set(xlabel="estimate, made dimensionless (1)", title="Both rigs: -1X far beyond what a crack can do")
    picture.legend(loc="outside lower center", ncols=2)
    save_figure(picture, snakemake.output.png, snakemake.output.svg)
