from rotorstudy.job import job


def curves(whole, picture):
    """Error over the Cramer-Rao bound against noise, one curve an estimator, whole turns, plain regression."""
    drawn = whole.sel(spectrum_method="regression", fault=whole.fault[0], noise=whole.noise > 0)
    for axes, rotor in zip(picture.axes, whole.rotor.values, strict=False):
        for i, estimator in enumerate(whole.estimator.values):
            over = geometric_mean(drawn.efficiency.sel(rotor=rotor, estimator=estimator) ** -0.5)
            there = over.dropna("noise")
            axes.loglog(there.noise, there, style(i), color=COLOURS[i % len(COLOURS)], label=estimator)
        axes.axhline(1, color="0.5", linewidth=0.8, linestyle=":")
        axes.set_title(rotor)
        axes.set_xlabel("noise (% of rms)")
        axes.set_ylabel("error / Cramér-Rao bound")
        plain_log(axes, [float(n) for n in drawn.noise])


def bars(values, axes, ylabel):
    """One group of points a fault, one point a spectrum method; values (fault, spectrum_method)."""
    for i, method in enumerate(values.spectrum_method.values):
        place = np.arange(values.sizes["fault"]) + 0.8 * (i / (values.sizes["spectrum_method"] - 1 or 1) - 0.5)
        axes.semilogy(
            place, values.sel(spectrum_method=method), MARKERS[i % 7], color=COLOURS[i % len(COLOURS)], label=method
        )
    axes.set_xticks(np.arange(values.sizes["fault"]), [textwrap.fill(str(f), 12) for f in values.fault.values])
    axes.set_ylabel(ylabel)


def table_of(values, axes, label, limits, levels):
    """Numbers and colours over spectrum method and estimator; values (spectrum_method, estimator)."""
    image = axes.imshow(levels(values), cmap="cividis", vmin=limits[0], vmax=limits[1], aspect="auto")
    for (i, j), value in np.ndenumerate(values.values):
        bright = levels(values.values[i, j]) > np.mean(limits)
        shown = "fails" if np.isnan(value) else f"{value:.2g}" if value < 100 else f"{value:.0f}"
        axes.text(j, i, shown, ha="center", va="center", fontsize=5, color="black" if bright else "white")
    axes.set_xticks(range(values.sizes["estimator"]), values.estimator.values, rotation=45, ha="right")
    axes.set_yticks(range(values.sizes["spectrum_method"]), values.spectrum_method.values)
    axes.grid(False)
    return image


def geometric_mean(values, dims="parameter"):
    return np.exp(np.log(values).mean(dims))


def style(i):
    return MARKERS[i % len(MARKERS)] + ("-", "--", ":")[i // len(COLOURS) % 3]


with job(snakemake):
    import textwrap
    from pathlib import Path

    import numpy as np
    import xarray as xr

    from rotorstudy.plots import COLOURS, MARKERS, figure, plain_log, save_figure
    from rotorstudy.store import load, provenance, save
    from rotorstudy.studies.compare import advice, comparison, load_comparison, ranking
    from rotorstudy.studies.config import file_name
    from rotorstudy.tables import write_table

    config = load_comparison(snakemake.input.config)
    names = {file_name(name): name for name in config.rotors}
    parts = {(names[Path(p).parent.name], Path(p).stem): load(p) for p in snakemake.input.estimates}
    whole = comparison(parts)
    errors = {(names[Path(p).parent.name], Path(p).stem): load(p).harmonic_error for p in snakemake.input.spectra}
    save(whole.assign_attrs(provenance(config.model_dump(), [], config.seed), title=config.title),
         snakemake.output.comparison)  # fmt: skip

    ranked = ranking(whole)
    write_table(ranked, snakemake.output.tables[0], snakemake.output.pages[0], "Which estimator on which data",
                f"{config.trials} trials each; error over the Cramér-Rao bound of white noise, geometric mean over the "
                "parameters. Best first, for each rotor, fault of the record and noise.", 3)  # fmt: skip
    write_table(advice(ranked), snakemake.output.tables[1], snakemake.output.pages[1], "What to use",
                "For each fault of a record the three pairs of spectrum method and estimator whose error is smallest "
                "where it is largest: in the worst rotor and noise level. Intervals are honest if between 90 and 99 % "
                "of the stated 95 % intervals hold the truth everywhere.", 3)  # fmt: skip

    paths = {Path(p).stem: (p, str(Path(p).with_suffix(".svg"))) for p in snakemake.output.png}
    rotors = len(whole.rotor)
    picture, axes = figure(1, rotors, height=2.8, width=2.6)
    curves(whole, picture)
    axes[0, 0].legend(fontsize=5)
    picture.suptitle("Which estimator reaches the bound (whole turns, plain regression)", fontsize=9)
    save_figure(picture, *paths["estimators"])

    level = 1.0 if 1.0 in whole.noise else float(whole.noise.max())
    shown = xr.concat(
        [
            xr.concat([errors[rotor, m].sel(noise=level) for m in whole.spectrum_method.values],
                      xr.Variable("spectrum_method", whole.spectrum_method.values))
            for rotor in whole.rotor.values
        ],
        xr.Variable("rotor", whole.rotor.values),
    )  # fmt: skip
    picture, axes = figure(1, 1, height=3.0, width=5.5)
    bars(geometric_mean(shown, "rotor").transpose("fault", "spectrum_method"), axes[0, 0],
         "error of the harmonics / rms of the vibration")  # fmt: skip
    axes[0, 0].legend(fontsize=5, ncols=2)
    axes[0, 0].set_title(f"What each fault of a record costs each spectrum method ({level:g} % noise)")
    save_figure(picture, *paths["spectra"])

    at = whole.sel(noise=level)
    faults = whole.fault.values
    over = geometric_mean(at.efficiency**-0.5, ["parameter", "rotor"]).transpose(
        "fault", "spectrum_method", "estimator"
    )
    covered = at.coverage.mean(["parameter", "rotor"]).transpose("fault", "spectrum_method", "estimator")
    for name, values, limits, levels, label, title in (
        ("faults", over, (0, 2), np.log10, "log10 of error / bound",
         f"Error over the Cramér-Rao bound at {level:g} % noise, mean of all rotors: dark is good"),
        ("coverage", covered, (0, 1), lambda v: v, "coverage",
         f"Share of 95 % intervals that hold the truth at {level:g} % noise: 0.95 is honest"),
    ):  # fmt: skip
        picture, axes = figure(1, len(faults), height=3.2, width=2.7, sharey=True)
        for a, fault in zip(axes[0], faults, strict=True):
            image = table_of(values.sel(fault=fault), a, label, limits, levels)
            a.set_title(fault)
        picture.colorbar(image, ax=axes, label=label)
        picture.suptitle(title, fontsize=9)
        save_figure(picture, *paths[name])

    biased = [(names[Path(p).parent.name], Path(p).stem, load(p)) for p in snakemake.input.bias]
    studies = list(dict.fromkeys(study for study, *_ in biased))
    picture, axes = figure(1, len(studies), height=2.8, width=3.0)
    for a, study in zip(axes[0], studies, strict=True):
        for i, (_, estimator, data) in enumerate(part for part in biased if part[0] == study):
            error = abs(data.relative_error).isel(case=-1, estimator=0).max("known").median("parameter")
            a.plot(data.percent, 100 * error, style(i), color=COLOURS[i % len(COLOURS)], label=estimator)
        a.set_yscale("symlog", linthresh=1)
        a.set_title(study)
        a.set_xlabel("error of the known quantity (%)")
        a.set_ylabel("median error of the parameters (%)")
    axes[0, 0].legend(fontsize=5)
    picture.suptitle("What a wrong mass or stiffness costs each estimator (worst known quantity, no noise)", fontsize=9)
    save_figure(picture, *paths["bias"])
