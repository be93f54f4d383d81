from rotorstudy.job import job

with job(snakemake):
    from pathlib import Path

    import numpy as np
    import pandas as pd

    from rotorstudy.response import measured_response
    from rotorstudy.scoreboard import KEYS, load_reasons, published, score
    from rotorstudy.store import as_complex, load
    from rotorstudy.studies.checks import bow_magnification, bow_twins, physical_checks, slow_roll_bow
    from rotorstudy.studies.printed import with_deviation
    from rotorstudy.studies.replay import load_replay, remove_slow_roll, rounding_draws, thesis_estimates
    from rotorstudy.tables import write_csv, write_scored_tables, write_table

    config = load_replay(snakemake.input.config)
    spectra, identification = load(snakemake.input.spectra), load(snakemake.input.identification)
    reference = Path(snakemake.input.published[0]).parent
    printed = published(reference, list(config.sheets))
    higher = [case for case in config.cases if case != config.slow_roll]

    # what was measured, by case, harmonic, quantity and column of the thesis
    found = {}
    for data_set in config.data_sets:  # a column of the thesis goes through the spectrum method it was made with
        here = spectra.sel(data_set=data_set, spectrum_method=data_set)
        for case in config.cases:
            printed_as = here.sel(version="as printed", case=case)
            plain, mark = as_complex(printed_as.displacement), printed_as.reference_phase.values
            compensated = as_complex(here.compensated.sel(version="corrected", case=case))
            clean = as_complex(here.corrected.sel(version="corrected", case=case))
            for h, n in enumerate(config.harmonics):
                found[case, str(n), "amplitude", data_set] = np.abs(plain[h])
                found[case, str(n), "phase", data_set] = np.angle(plain[h])
                found[case, str(n), "reference phase", data_set] = mark[h]
                found[case, str(n), "compensated phase", data_set] = np.angle(compensated[h])
                if data_set == "regression":
                    found[case, str(n), "amplitude", "experiment"] = np.abs(clean[h])

    # what rounding leaves open about the harmonics without slow roll
    drawn = np.abs(remove_slow_roll(config, rounding_draws(config, reference, "regression")))
    open_range = {
        (case, str(n), "amplitude", "experiment"): (drawn[:, c, h].min(), drawn[:, c, h].max())
        for c, case in enumerate(config.cases)
        for h, n in enumerate(config.harmonics)
    }

    # what the thesis's own estimates respond with
    speeds = [config.cases[case] for case in higher]
    responses = {}
    for group in dict.fromkeys(printed[printed.table == config.estimates_table].case):
        theta = thesis_estimates(config, reference, group)
        responses[group] = measured_response(config.model, speeds, config.harmonics, theta)[..., 0]
        for case, response in zip(higher, responses[group], strict=True):  # the last group, of all speeds, stays
            found |= {
                (case, str(n), "amplitude", "simulation"): np.abs(value)
                for n, value in zip(config.harmonics, response, strict=True)
            }
    in_tables = printed[printed.table != config.estimates_table]
    rows = []
    for row in in_tables.to_dict("records"):
        key = (row["case"], row["item"], row["quantity"], row["method"])
        low, high = open_range.get(key, (np.nan, np.nan))
        rows.append({**{k: row[k] for k in KEYS}, "computed": found[key], "low": low, "high": high})

    names = config.thesis_names
    best = identification.sel(estimator="least_squares", data_set="fft")
    thesis = printed[printed.table == config.estimates_table]
    for row in thesis.to_dict("records"):
        ours, factor = names[row["item"]]
        group = config.thesis_groups.get(row["case"], row["case"])
        estimate = best.sel(group=group, parameter=ours)
        rows.append(
            {
                **{k: row[k] for k in KEYS},
                "computed": float(estimate.estimate) * factor,
                "low": float(estimate.low) * factor,
                "high": float(estimate.high) * factor,
                "cases": " and ".join(config.groups[group]),
            }
        )
    computed = with_deviation(pd.DataFrame(rows), printed)
    scored = score(printed, computed, load_reasons(snakemake.input.reasons), measured_again=in_tables.table.unique())
    write_csv(scored, snakemake.output.scored)
    count = len(config.sheets)
    sheets = {name: (sheet.title, sheet.note, ["item"], sheet.across) for name, sheet in config.sheets.items()}
    write_scored_tables(scored, sheets, snakemake.output.csv[:count], snakemake.output.html[:count])
    extra = iter(zip(snakemake.output.csv[count:], snakemake.output.html[count:], strict=True))

    # every estimate with its interval
    every = identification[["estimate", "low", "high"]].to_dataframe().reset_index()
    every = every.merge(identification.misfit.to_dataframe().reset_index(), on=["estimator", "data_set", "group"])
    write_table(
        every,
        *next(extra),
        "Estimates of the replay with 95 % intervals",
        f"Two estimators, two published columns, groups {', '.join(config.groups)}. A misfit far above 1 says that the "
        "model does not explain the data, whatever the intervals are.",
    )

    # the estimates against what physics and the other measurements allow: ours, then the thesis's
    ours = every[every.data_set == "fft"].assign(source=lambda e: "here, " + e.estimator.str.replace("_", " "))
    ours = ours[["source", "group", "parameter", "estimate", "low", "high"]]
    thesis = pd.DataFrame(
        {
            "source": "thesis",
            "group": thesis.case,
            "parameter": thesis.item.map({item: name for item, (name, _) in names.items()}),
            "estimate": thesis.published,
            "low": thesis.published - thesis.last_digit,
            "high": thesis.published + thesis.last_digit,
        }
    )
    bow = slow_roll_bow(config, spectra, "fft")
    checks = physical_checks(config, pd.concat([ours, thesis], ignore_index=True), bow)
    compensated = as_complex(spectra.compensated.sel(version="corrected", data_set="fft", spectrum_method="regression"))
    change, magnified = bow_magnification(config, compensated)
    share = 1 - np.abs(change - magnified) / np.abs(change)
    sizes = "; ".join(
        f"{case} {np.abs(m) * 1e6:.0f} um of {np.abs(c) * 1e6:.0f} um, {part:.0%} as vectors"
        for case, m, c, part in zip(higher, magnified, change, share, strict=True)
    )
    if share.min() > 0.5:
        verdict = "that is why the eccentricity comes out near the bow"
    else:
        verdict = (
            "so 1X of the slow roll is not a bow alone: part of it is runout, which does not resonate, or an "
            "unbalance works against the bow"
        )
    bad = checks[checks.verdict.isin(["impossible", "implausible"])].source.value_counts()
    counts = checks.source.value_counts(sort=False)
    refused = ", ".join(f"{source} {bad.get(source, 0)} of {n}" for source, n in counts.items())
    static = config.model.structure.static_deflection[config.model.measured[0]].real
    write_table(
        checks,
        *next(extra),
        "Which estimates are possible",
        f"Impossible or implausible: {refused} (the thesis prints no intervals; ours are from rounding for least "
        "squares, from rounding and model error for maximum likelihood). Subtracting the slow roll leaves the bow's "
        "own magnification, that of an unbalance of the bow's size; if all of the slow roll's 1X were bow, that would "
        f"be of the measured change of 1X: {sizes}; {verdict}. A bow and a free crack force at 1X cannot be told apart "
        f"at all ({bow_twins(config)}). Taking the slow roll off also takes the crack's own 0X and 1X away, so dk p_0 "
        "and dk p_1 mean little. A phase mark that does not stand at the crack would turn dk p_n by n times that angle "
        "and leak into the damping. Weight dominance, which all of this assumes, does not hold here: the static "
        "deflection is "
        f"{static * 1e6:.0f} um, 1X without slow roll {np.abs(change).min() * 1e6:.0f} to "
        f"{np.abs(change).max() * 1e6:.0f} um.",
    )

    # measured against models
    rows = []
    for c, case in enumerate(higher):
        measured = as_complex(
            spectra.corrected.sel(version="corrected", data_set="regression", spectrum_method="regression", case=case)
        )
        models = {"thesis's estimates": responses[next(reversed(responses))][c]}
        for estimator in config.estimators:
            models[estimator.replace("_", " ")] = as_complex(
                identification.simulated.sel(
                    estimator=estimator, data_set="regression", group=config.all_speeds, case=case
                )
            )
        for h, n in enumerate(config.harmonics):
            row = {"case": case, "harmonic": n, "measured (um)": np.abs(measured[h]) * 1e6}
            for name, values in models.items():
                row |= {
                    f"{name} (um)": np.abs(values[h]) * 1e6,
                    f"{name}, off (um)": np.abs(values[h] - measured[h]) * 1e6,
                }
            rows.append(row)
    table = pd.DataFrame(rows)
    off = {name: np.sqrt((table[f"{name}, off (um)"] ** 2).sum()) for name in models}
    whole = np.sqrt((table["measured (um)"] ** 2).sum())
    write_table(
        table,
        *next(extra),
        "Measured spectrum against the identified models",
        "Slow roll taken off. 'off' is the distance as a complex number, so it sees the phase, which a comparison of "
        "amplitudes does not. Over all speeds and harmonics: "
        + ", ".join(f"{name} {value / whole:.0%} of the measured" for name, value in off.items())
        + f", estimates of {config.all_speeds}.",
    )
