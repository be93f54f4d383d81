from rotorstudy.studies.job import job

with job(snakemake):
    from pathlib import Path

    import numpy as np
    import pandas as pd

    from rotorstudy.presentation.tables import write_csv, write_scored_tables, write_table
    from rotorstudy.response.harmonic import measured_response
    from rotorstudy.store import as_complex, load
    from rotorstudy.thesis.checks import (
        bow_confounders,
        bow_text,
        higher_cases,
        largest_crack_response,
        percent,
        physical_checks,
        refused_text,
        shown_estimates,
        slow_roll_bow,
        slow_roll_share,
        slow_roll_text,
        weight_text,
    )
    from rotorstudy.thesis.printed import with_deviation
    from rotorstudy.thesis.replay import (
        BOTH_DAMPINGS,
        COLUMN,
        DAMPINGS,
        load_replay,
        remove_slow_roll,
        rounding_draws,
        thesis_estimates,
    )
    from rotorstudy.thesis.scoreboard import KEYS, load_reasons, published, score

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
    best = identification.sel(estimator="least_squares", data_set=COLUMN)
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
    replayed = [table for table, rows in in_tables.groupby("table") if set(rows.method) <= set(config.data_sets)]
    scored = score(printed, computed, load_reasons(snakemake.input.reasons), measured_again=replayed)
    write_csv(scored, snakemake.output.scored)
    count = len(config.sheets)
    sheets = {name: (sheet.title, sheet.note, ["item"], sheet.across) for name, sheet in config.sheets.items()}
    write_scored_tables(scored, sheets, snakemake.output.csv[:count], snakemake.output.html[:count])
    extra = iter(zip(snakemake.output.csv[count:], snakemake.output.html[count:], strict=True))

    # every estimate with its interval
    every = identification[["estimate", "low", "high"]].to_dataframe().reset_index()
    every = every.merge(identification.misfit.to_dataframe().reset_index(), on=["estimator", "data_set", "group"])
    every["estimator"] = every.estimator.str.replace("_", " ")
    write_table(
        shown_estimates(config, every),
        *next(extra),
        "Estimates of the replay with 95 % intervals",
        f"Two estimators, two published columns, groups {', '.join(config.groups)}. A misfit far above 1 says that the "
        "model does not explain the data, whatever the intervals are.",
        digits=4,
    )

    # the estimates against what physics and the other measurements allow: ours, then the thesis's
    ours = every[every.data_set == COLUMN].assign(source=lambda e: "here, " + e.estimator)
    ours = ours[["source", "group", "parameter", "estimate", "low", "high"]]
    thesis = thesis.assign(parameter=thesis.item.map({item: name for item, (name, _) in names.items()}))
    thesis = thesis[["case", "parameter", "published", "last_digit"]]
    both = thesis[thesis.parameter.isin(DAMPINGS)].groupby("case", sort=False)[["published", "last_digit"]].sum()
    thesis = pd.concat([thesis, both.reset_index().assign(parameter=BOTH_DAMPINGS)], ignore_index=True)
    order = list(identification.parameter.values)
    thesis = thesis.sort_values("parameter", key=lambda column: column.map(order.index), kind="stable")
    thesis = pd.DataFrame(
        {
            "source": "thesis",
            "group": thesis.case,
            "parameter": thesis.parameter,
            "estimate": thesis.published,
            "low": thesis.published - thesis.last_digit,
            "high": thesis.published + thesis.last_digit,
        }
    )
    bow = slow_roll_bow(config, spectra, COLUMN)
    checks = physical_checks(config, pd.concat([ours, thesis], ignore_index=True), bow)
    here = spectra.sel(version="corrected", data_set=COLUMN, spectrum_method=COLUMN)
    compensated = as_complex(here.compensated)
    share = slow_roll_share(config, compensated)
    already = {n: slow_roll_text(config, n, share[:, h]) for h, n in enumerate(config.harmonics)}
    write_table(
        checks,
        *next(extra),
        "Which estimates are possible",
        [
            f"Impossible or implausible: {refused_text(checks)}.",
            f"Ours are from the column '{COLUMN}' of the printed spectra. The thesis prints no intervals; ours are "
            "from rounding for least squares, from rounding and model error for maximum likelihood.",
            "The impact tests bound the sum of both dampings; neither can be negative, so it bounds each of them, too.",
            bow_text(config, compensated),
            f"A bow and a free crack force at 1X cannot be told apart ({bow_confounders(config)}).",
            "Taking the slow roll off also takes the crack's own 0X and 1X away, so dk p_0 and dk p_1 mean little.",
            f"{already[-1]}. Only 0X and 1X of the slow roll are taken off, so the whole -1X is taken for a crack.",
            "A phase mark that does not stand at the crack would turn dk p_n by n times that angle and leak into the "
            "damping; dk p_n is therefore judged by size.",
            weight_text(config, compensated),
        ],
        digits=4,
    )

    # measured against models
    largest = {n: largest_crack_response(config, n) * 1e6 for n in (-1, 2)}
    corrected = as_complex(here.corrected)
    rows, slow = [], list(config.cases).index(config.slow_roll)
    for c, case in zip(higher_cases(config), higher, strict=True):
        models = {"thesis's estimates": responses[next(reversed(responses))][higher.index(case)]}
        for estimator in config.estimators:
            models[estimator.replace("_", " ")] = as_complex(
                identification.simulated.sel(estimator=estimator, data_set=COLUMN, group=config.all_speeds, case=case)
            )
        for h, n in enumerate(config.harmonics):
            row = {
                "case": case,
                "harmonic": n,
                "slow roll (um)": np.abs(compensated[slow, h]) * 1e6,
                "as measured (um)": np.abs(compensated[c, h]) * 1e6,
                "change from slow roll (um)": np.abs(compensated[c, h] - compensated[slow, h]) * 1e6,
                "compared (um)": np.abs(corrected[c, h]) * 1e6,
            }
            for name, values in models.items():
                row |= {
                    f"{name} (um)": np.abs(values[h]) * 1e6,
                    f"{name}, off (um)": np.abs(values[h] - corrected[c, h]) * 1e6,
                }
            rows.append(row)
    table = pd.DataFrame(rows)
    off = {name: np.sqrt((table[f"{name}, off (um)"] ** 2).sum()) for name in models}
    whole = np.sqrt((table["compared (um)"] ** 2).sum())
    distances = ", ".join(f"{name} {percent(value / whole)} of the measured" for name, value in off.items())
    write_table(
        table,
        *next(extra),
        "Measured spectrum against the identified models",
        [
            f"Column '{COLUMN}' of the printed spectra. What is compared has 0X and 1X of the slow roll taken off, as "
            "the thesis does; its other harmonics are as measured.",
            "'off' is the distance as a complex number, so it sees the phase, which a comparison of amplitudes does "
            f"not. Over all speeds and harmonics: {distances}, estimates of {config.all_speeds}.",
            f"{already[-1]}; {already[2]}.",
            f"The weight can make a crack within the impact tests do at most {largest[-1]:.1f} um at -1X and "
            f"{largest[2]:.1f} um at 2X when the rotor turns slowly. More than that at slow roll is runout or unequal "
            "probes, and stays in what is compared.",
        ],
        digits=4,
    )
