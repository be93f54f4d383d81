from rotorstudy.studies.workflow import job

PAGE_WIDTH = 7.0  # inches, two columns of a journal; text keeps its size in print
ROW = 3  # panels side by side
BEST = 7  # pairs that the page shows of each rotor, fault and noise; the CSV file has all


def panels(count, height, **options):
    """A page-wide figure of `count` panels and a spare one for what explains them: figure, axes (count,), spare."""
    columns = min(ROW, count + 1)
    rows = -(-(count + 1) // columns)
    picture, axes = figure(rows, columns, height=height, width=PAGE_WIDTH / columns, **options)
    axes = axes.flatten()
    for unused in axes[count:]:
        unused.axis("off")
    return picture, axes[:count], axes[count]


def style(i, count):
    """Colour, line and marker of curve i; later ones are smaller, so that equal curves show one inside the other."""
    return {
        "color": COLOURS[i % len(COLOURS)],
        "marker": MARKERS[i % len(MARKERS)],
        "linestyle": ("-", "--", ":")[i // len(COLOURS) % 3],
        "markersize": 7 - 4 * i / max(count - 1, 1),
        "fillstyle": "none",
        "linewidth": 0.9,
    }


def explain(spare, drawn):
    """The legend of one panel, in the spare one."""
    handles, labels = drawn.get_legend_handles_labels()
    spare.legend(handles, labels, loc="center", fontsize=7, frameon=False)


def curves(over, picture, axes):
    """Error over the Cramer-Rao bound against noise, one curve an estimator; over (rotor, estimator, noise)."""
    for a, rotor in zip(axes, over.rotor.values, strict=True):
        for i, estimator in enumerate(over.estimator.values):
            there = over.sel(rotor=rotor, estimator=estimator).dropna("noise")
            a.loglog(there.noise, there, **style(i, over.sizes["estimator"]), label=estimator)
        a.axhline(1, color="0.5", linewidth=0.8, linestyle=":")
        a.set_title(rotor)
        plain_log(a, [float(n) for n in over.noise])
        a.yaxis.set_major_formatter("{x:g}")
    axes[0].set_ylim(0.7 * min(1, float(over.min())), 1.4 * float(over.max()))
    picture.supxlabel("white noise (% of rms)", fontsize=8)
    picture.supylabel("error / Cramér-Rao bound", fontsize=8)


def bars(values, axes, ylabel):
    """One group of points a fault, one point a spectrum method; values (fault, spectrum_method)."""
    groups = np.arange(values.sizes["fault"])
    for i, method in enumerate(values.spectrum_method.values):
        place = groups + 0.7 * (i / (values.sizes["spectrum_method"] - 1 or 1) - 0.5)
        axes.semilogy(
            place, values.sel(spectrum_method=method), MARKERS[i % 7], color=COLOURS[i % len(COLOURS)], label=method
        )
    axes.set_xticks(groups, [textwrap.fill(str(f), 11) for f in values.fault.values], fontsize=6)
    axes.set_xticks(groups[1:] - 0.5, minor=True)
    axes.tick_params(axis="x", which="both", length=0)
    axes.grid(False, axis="x")
    axes.grid(True, axis="x", which="minor")  # lines between the groups
    axes.set_ylabel(ylabel)


def shown(value):
    """A number of a table: two digits, or one and a power of ten."""
    if np.isnan(value):
        return "fails"
    return f"{value:.2g}" if value < 99.5 else f"{value:.0f}" if value < 999.5 else f"{value:.0e}".replace("e+0", "e")


def table_of(values, axes, norm):
    """Numbers and colours over estimator and spectrum method; values (estimator, spectrum_method)."""
    image = axes.imshow(values, cmap="cividis", norm=norm, aspect="auto")
    for (i, j), value in np.ndenumerate(values.values):
        bright = norm(value) > 0.5
        axes.text(j, i, shown(value), ha="center", va="center", fontsize=5.5, color="black" if bright else "white")
    axes.set_xticks(range(values.sizes["spectrum_method"]), values.spectrum_method.values, rotation=90, fontsize=6.5)
    axes.set_yticks(range(values.sizes["estimator"]), values.estimator.values, fontsize=6.5)
    axes.grid(False)
    return image


def best_by_worst(values):
    """Labels of the smallest of the largest values over the faults: (spectrum method, estimator) or (spectrum method,).

    One that fails somewhere is none of the best.
    """
    worst = values.max("fault", skipna=False).fillna(np.inf)
    place = worst.argmin(...)
    return [str(worst[dim][int(index)].values) for dim, index in place.items()]


def geometric_mean(values, dims="parameter"):
    return np.exp(np.log(values).mean(dims))


with job(snakemake):
    import textwrap
    from pathlib import Path

    import numpy as np
    import xarray as xr
    from matplotlib.colors import LogNorm, Normalize

    from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, plain_log, save_figure
    from rotorstudy.presentation.tables import write_csv, write_html, write_table
    from rotorstudy.store import load, provenance, save
    from rotorstudy.studies.compare import HONEST, advice, comparison, load_comparison, ranking
    from rotorstudy.studies.config import file_name

    config = load_comparison(snakemake.input.config)
    names = {file_name(name): name for name in config.rotors}
    parts = {(names[Path(p).parent.name], Path(p).stem): load(p) for p in snakemake.input.estimates}
    whole = comparison(parts)
    errors = {(names[Path(p).parent.name], Path(p).stem): load(p).harmonic_error for p in snakemake.input.spectra}
    save(whole.assign_attrs(provenance(config.model_dump(), [], config.seed), title=config.title),
         snakemake.output.comparison)  # fmt: skip

    ranked = ranking(whole)
    write_csv(ranked, snakemake.output.tables[0])
    best = ranked.groupby(["rotor", "fault", "noise"], sort=False).head(BEST).rename(columns={"noise": "noise (%)"})
    write_html(
        snakemake.output.pages[0],
        "Which estimator on which data",
        f"{config.trials} trials each; error over the Cramér-Rao bound of white noise, geometric mean over the "
        f"parameters, and that of the worst parameter; coverage of the stated 95 % intervals; share of trials that "
        f"failed. The {BEST} best of each noise level, for each rotor and fault of the record; all are in ranking.csv.",
        {
            f"{rotor}, {fault}": part.drop(columns=["rotor", "fault"])
            for (rotor, fault), part in best.groupby(["rotor", "fault"], sort=False)
        },
        3,
    )
    write_table(
        advice(ranked),
        snakemake.output.tables[1],
        snakemake.output.pages[1],
        "What to use",
        "For each fault of a record, and for one that is not known, the three spectrum methods whose error is smallest "
        "where it is largest: in the worst rotor and noise level. Beside each the estimator to use with it, and those "
        "whose error is within 5 % of it; pairs that fail in more than 2 % of the trials are left out. 1 is the "
        "Cramér-Rao bound. Intervals are honest if between 90 and 99 % of the stated 95 % intervals hold the truth "
        "everywhere.",
        3,
    )

    paths = {Path(p).stem: (p, str(Path(p).with_suffix(".svg"))) for p in snakemake.output.png}
    drawn = whole.sel(spectrum_method="regression", fault=whole.fault[0], noise=whole.noise > 0)
    over = geometric_mean(drawn.efficiency**-0.5)
    picture, axes, spare = panels(len(whole.rotor), 1.9, sharey=True)
    curves(over, picture, axes)
    explain(spare, axes[0])
    most = over.max(["rotor", "noise"])
    near = [str(e) for e in most.estimator.values if most.sel(estimator=e) < 1.25]
    picture.suptitle(
        f"{len(near)} of {len(most)} estimators stay within 1.25 times the Cramér-Rao bound on all rotors; "
        f"the largest error is {shown(float(most.max()))} times\n(whole turns, plain regression)",
        fontsize=8,
    )
    save_figure(picture, *paths["estimators"])

    level = 1.0 if 1.0 in whole.noise else float(whole.noise.max())
    harmonics = xr.concat(
        [
            xr.concat([errors[rotor, m].sel(noise=level) for m in whole.spectrum_method.values],
                      xr.Variable("spectrum_method", whole.spectrum_method.values))
            for rotor in whole.rotor.values
        ],
        xr.Variable("rotor", whole.rotor.values),
    )  # fmt: skip
    picture, axes = figure(1, 1, height=3.4)
    cost = geometric_mean(harmonics, "rotor").transpose("fault", "spectrum_method")
    bars(cost, axes[0, 0], "error of harmonics / rms of vibration")
    picture.legend(loc="outside lower center", ncols=3, fontsize=6, frameon=False, columnspacing=1, handletextpad=0.2)
    axes[0, 0].set_title(f"{best_by_worst(cost)[0]} loses least where it loses most\n({level:g} % noise)")
    save_figure(picture, *paths["spectra"])

    at = whole.sel(noise=level)
    faults = whole.fault.values
    over = geometric_mean(at.efficiency**-0.5, ["parameter", "rotor"]).transpose(
        "fault", "spectrum_method", "estimator"
    )
    covered = at.coverage.mean(["parameter", "rotor"]).transpose("fault", "spectrum_method", "estimator")
    honest = ((covered >= HONEST[0]) & (covered <= HONEST[1])).all("fault")
    method, estimator = best_by_worst(over)
    for name, values, norm, label, told in (
        ("faults", over, LogNorm(1, 100, clip=True), "error / Cramér-Rao bound\n(mean of all rotors)",
         f"{method} with {estimator} has the smallest error in its worst fault ({level:g} % noise); dark is good"),
        ("coverage", covered, Normalize(0, 1), "share of intervals that hold\nthe truth; 0.95 is honest",
         f"{int(honest.sum())} of {honest.size} pairs state 95 % intervals that hold with every fault "
         f"({level:g} % noise)"),
    ):  # fmt: skip
        picture, axes, spare = panels(len(faults), 2.0)
        for i, (a, fault) in enumerate(zip(axes, faults, strict=True)):
            image = table_of(values.sel(fault=fault).transpose("estimator", "spectrum_method"), a, norm)
            a.set_title(fault)
            a.tick_params(labelbottom=i + ROW > len(axes), labelleft=i % ROW == 0)
        spare.set_xlim(axes[0].get_xlim())
        for j, method in enumerate(values.spectrum_method.values):  # the columns of the panel above the spare one
            spare.text(j, 1.0, method, rotation=90, ha="center", va="top", fontsize=6.5,
                       transform=spare.get_xaxis_transform())  # fmt: skip
        scale = spare.inset_axes([0.0, 0.1, 1.0, 0.08])
        picture.colorbar(image, cax=scale, label=label, orientation="horizontal", format="{x:g}")
        scale.minorticks_off()
        picture.suptitle(told, fontsize=8)
        save_figure(picture, *paths[name])

    biased = [(names[Path(p).parent.name], Path(p).stem, load(p)) for p in snakemake.input.bias]
    studies = list(dict.fromkeys(study for study, *_ in biased))
    picture, axes = figure(1, len(studies), height=3.0, width=PAGE_WIDTH / max(2, len(studies)), sharey=True)
    costs = []
    for a, study in zip(axes[0], studies, strict=True):
        own = [part for part in biased if part[0] == study]
        for i, (_, estimator, data) in enumerate(own):
            # NaN where the estimator found nothing for one of the known quantities: a gap, not the error of the others
            error = abs(data.relative_error).isel(case=-1, estimator=0).max("known", skipna=False)
            error = 100 * error.median("parameter", skipna=False)
            a.plot(data.percent, error, **style(i, len(own)), label=estimator)
            lost = data.percent[np.isnan(error)]
            place = 0.97 - 0.05 * i  # of the height of the panel, a row an estimator
            a.plot(lost, np.full(len(lost), place), "x", color=COLOURS[i % len(COLOURS)],
                   transform=a.get_xaxis_transform())  # fmt: skip
            costs.append(error.where(abs(data.percent) == 1, drop=True))
        a.set_yscale("symlog", linthresh=1)
        a.yaxis.set_major_formatter("{x:g}")
        a.set_title(study)
        a.set_xlabel("error of the known quantity (%)")
    axes[0, 0].set_ylim(0, 300)
    axes[0, 0].set_ylabel("median error of the parameters (%)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    handles.append(axes[0, 0].plot([], [], "x", color="0.4")[0])
    picture.legend(handles, [*labels, "no estimate"], loc="outside lower center", ncols=4, fontsize=7, frameon=False)
    costs = np.concatenate([c.values.ravel() for c in costs])
    wrong = "A mass or stiffness held wrong"
    if np.isfinite(costs).any():
        wrong += f" by 1 % moves the parameters by {np.nanmin(costs):.1g} to {np.nanmax(costs):.1g} %"
    picture.suptitle(f"{wrong} (worst known quantity, no noise)", fontsize=8)
    save_figure(picture, *paths["bias"])
