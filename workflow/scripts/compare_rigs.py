from rotorstudy.studies.job import job

with job(snakemake):
    from pathlib import Path

    import numpy as np
    import pandas as pd

    from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, save_figure
    from rotorstudy.presentation.tables import write_table
    from rotorstudy.store import as_complex, load
    from rotorstudy.thesis.checks import (
        largest_crack_response,
        limits,
        percent,
        physical_checks,
        slow_roll_bow,
        slow_roll_share,
    )
    from rotorstudy.thesis.replay import COLUMN, load_replay, thesis_estimates

    MOSTLY = 0.7  # share of -1X at slow roll from which on it is called the slow roll's
    reference = Path(snakemake.input.published).parent
    rows, shares, notes = [], [], []
    for path, found, seen in zip(
        snakemake.input.configs, snakemake.input.identification, snakemake.input.spectra, strict=True
    ):
        config, estimates, spectra = load_replay(path), load(found), load(seen)
        rig = config.name.replace("_", " ").capitalize()
        allowed, model = limits(config), config.model
        theta = dict(zip(model.names, thesis_estimates(config, reference, config.all_speeds), strict=True))
        theta["eccentricity"] = abs(theta["eccentricity_real"] + 1j * theta["eccentricity_imag"])
        bow = slow_roll_bow(config, spectra, COLUMN)
        scales = {
            "_damping": ("critical damping", allowed["critical damping"]),
            "eccentricity": ("1X of the slow roll", bow),
            "stiffness_loss": ("stiffness", allowed["stiffness"]),
        }
        best = estimates.sel(data_set=COLUMN, group=config.all_speeds)[["estimate", "low", "high"]]
        for name, (ours, _) in config.thesis_names.items():
            if ours.endswith("_phase"):
                continue
            what, scale = next(value for key, value in scales.items() if key in ours)
            row = {"rig": rig, "parameter": name, "relative to": what, "thesis": theta[ours] / scale}
            for estimator in config.estimators:
                here = best.sel(estimator=estimator, parameter=ours)
                row |= {f"{estimator.replace('_', ' ')}, {key}": float(here[key]) / scale for key in here.data_vars}
            here = best.sel(estimator="least_squares", parameter=[ours]).to_dataframe().reset_index()
            (check,) = physical_checks(config, here.assign(source="least squares"), bow).itertuples()
            row["largest possible"] = check.largest_possible / (scale * (1e6 if check.unit == "um" else 1.0))
            row["verdict on least squares"] = check.verdict
            rows.append(row)
        compensated = spectra.compensated.sel(version="corrected", data_set=COLUMN, spectrum_method=COLUMN)
        share = slow_roll_share(config, as_complex(compensated))
        parts = {n: share[:, config.harmonics.index(n)] for n in (-1, 2)}
        shares.append(parts[-1].min())
        there = ", ".join(f"of {n}X {percent(p.min())} to {percent(p.max())}" for n, p in parts.items())
        slow = np.abs(as_complex(compensated.sel(case=config.slow_roll, harmonic=-1))) * 1e6
        most = largest_crack_response(config, -1) * 1e6
        notes.append(
            f"{rig}: at slow roll there is already, as vectors, {there}; -1X is {slow:.0f} um there, and the weight "
            f"can make a crack within the impact tests do at most {most:.1f} um."
        )
    table = pd.DataFrame(rows)
    write_table(
        table,
        snakemake.output.csv,
        snakemake.output.html,
        "Parameters found for both rigs",
        [
            f"All published speeds together, column '{COLUMN}' of the printed spectra. Made comparable: dampings over "
            "critical damping, eccentricity over the 1X of the slow roll, stiffness losses over the stiffness.",
            "Same disc, cracks made in a similar way, so these should be alike; the impact tests allow losses of a "
            "few per cent and dampings of a few tenths at most.",
            *notes,
            "What does not come from weight is runout or unequal probes, which Eq. (3.1) leaves in: it takes off 0X "
            "and 1X only.",
        ],
        digits=4,
    )

    parameters = list(dict.fromkeys(table.parameter))
    picture, axes = figure(height=4.2, width=5.0)
    narrower = table.groupby("parameter")["largest possible"].min()[parameters]
    both_signs = [name.startswith("dk") for name in parameters]
    for part, sides, alpha in (("possible", 1, 0.25), ("possible in size", np.where(both_signs, -1, 0), 0.12)):
        place = np.arange(len(parameters))
        axes[0, 0].barh(place, sides * narrower, 0.8, color=COLOURS[2], alpha=alpha, label=part)
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
    if min(shares) > MOSTLY:
        title = "Both rigs: -1X of the slow roll is taken for a crack"
    else:
        title = "Parameters found for both rigs"
    axes[0, 0].set(xlabel=f"estimate, made dimensionless (1); all speeds, column '{COLUMN}'", title=title)
    picture.legend(loc="outside lower center", ncols=2)
    save_figure(picture, snakemake.output.png, snakemake.output.svg)
