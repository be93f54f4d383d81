from rotorstudy.job import job

with job(snakemake):
    from pathlib import Path

    import numpy as np
    import pandas as pd

    from rotorstudy.scoreboard import KEYS, load_reasons, published, score
    from rotorstudy.store import as_complex, load
    from rotorstudy.studies.checks import bow_magnification, bow_twins, physical_checks, slow_roll_bow
    from rotorstudy.studies.replay import load_replay
    from rotorstudy.tables import write_csv, write_scored_tables, write_table

    TABLES = ["3.4", "3.5", "3.6", "3.7", "3.8", "3.9"]
    config = load_replay(snakemake.input.config)
    spectra, identification = load(snakemake.input.spectra), load(snakemake.input.identification)

    rows = []
    for data_set in config.data_sets:  # a column of the thesis goes through the spectrum method it was made with
        here = spectra.sel(data_set=data_set, spectrum_method=data_set)
        for case in config.cases:
            printed_as = here.sel(version="as printed", case=case)
            plain = as_complex(printed_as.displacement)
            for n, value, mark in zip(config.harmonics, plain, printed_as.reference_phase.values, strict=True):
                numbers = {"amplitude": np.abs(value), "phase": np.angle(value), "reference phase": mark}
                for quantity, number in numbers.items():
                    own_table = {"amplitude": "3.5", "phase": "3.6", "reference phase": "3.7"}[quantity]
                    table = "3.4" if case == config.slow_roll else own_table
                    rows.append((table, case, str(n), np.nan, quantity, data_set, number))
            if data_set == "fft":
                compensated = as_complex(here.compensated.sel(version="corrected", case=case))
                rows += [
                    ("3.8", case, str(n), np.nan, "compensated phase", "fft", np.angle(value))
                    for n, value in zip(config.harmonics, compensated, strict=True)
                ]

    names = {"c_E": ("external_damping", 1.0), "c_H": ("internal_damping", 1.0), "e": ("eccentricity", 1.0)}
    names["phi"] = ("eccentricity_phase", 180 / np.pi)
    names |= {f"dk p_{n}": (f"stiffness_loss_p{n}", 1.0) for n in config.harmonics}
    best = identification.sel(estimator="least_squares", data_set="fft")
    for group in config.groups:
        for item, (ours, factor) in names.items():
            found = best.sel(group=group, parameter=ours)
            low, high = float(found.low) * factor, float(found.high) * factor
            rows.append(
                ("3.9", group, item, np.nan, "estimate", "least squares", float(found.estimate) * factor, low, high)
            )
    computed = pd.DataFrame(rows, columns=[*KEYS, "computed", "low", "high"])
    computed["cases"] = computed.case.map({g: " and ".join(cases) for g, cases in config.groups.items()}).fillna("")
    printed = published(Path(snakemake.input.published).parent, TABLES)
    scored = score(printed, computed, load_reasons(snakemake.input.reasons))
    write_csv(scored, snakemake.output.scored)

    replayed = "Printed values replayed and measured again."
    by_method, by_case = (["item"], ["case", "quantity", "method"]), (["item"], ["case"])
    tables = {
        "3.4": ("Slow roll at 3 Hz", f"{replayed} The phase of the mean is a misprint: see Table 3.8.", *by_method),
        "3.5": ("Amplitudes at 17, 20 and 22 Hz", replayed, *by_method),
        "3.6": ("Phases at 17, 20 and 22 Hz", replayed, *by_method),
        "3.7": ("Reference phases at 17, 20 and 22 Hz", replayed, *by_method),
        "3.8": ("Compensated phases", "Displacement minus reference signal, modulo a full turn.", *by_case),
        "3.9": (
            "Estimated parameters",
            "Ours from the published speeds only; 18, 19 and 21 Hz were never published. Columns: "
            + "; ".join(f"{group} from {' and '.join(cases)}" for group, cases in config.groups.items()),
            *by_case,
        ),
    }
    write_scored_tables(scored, tables, snakemake.output.csv[:6], snakemake.output.html[:6])

    # every estimate with its interval
    every = identification[["estimate", "low", "high"]].to_dataframe().reset_index()
    every = every.merge(identification.misfit.to_dataframe().reset_index(), on=["estimator", "data_set", "group"])
    write_table(
        every,
        snakemake.output.csv[6],
        snakemake.output.html[6],
        "Estimates of the replay with 95 % intervals",
        "Two estimators, two published columns, three groups. A misfit far above 1 says that the model does not "
        "explain the data, whatever the intervals are.",
    )

    # the estimates against what physics and the other measurements allow: ours, then the thesis's
    ours = every[every.data_set == "fft"].assign(source=lambda e: "here, " + e.estimator.str.replace("_", " "))
    ours = ours[["source", "group", "parameter", "estimate", "low", "high"]]
    thesis = printed[printed.table == "3.9"]
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
    left = np.abs(change - magnified) / np.abs(change)
    explained = [f"{case} {1 - part:.0%}" for case, part in zip(list(config.cases)[1:], left, strict=True)]
    bad = checks[checks.verdict.isin(["impossible", "implausible"])].source.value_counts()
    counts = checks.source.value_counts(sort=False)
    refused = ", ".join(f"{source} {bad.get(source, 0)} of {n}" for source, n in counts.items())
    static = config.model.structure.static_deflection[0].real
    write_table(
        checks,
        snakemake.output.csv[7],
        snakemake.output.html[7],
        "Which estimates are possible",
        f"Impossible or implausible: {refused} (the thesis prints no intervals; ours are from rounding for least "
        "squares, from rounding and model error for maximum likelihood). Why the eccentricity comes out near the bow: "
        "subtracting the slow roll leaves the bow's own magnification, that of an unbalance of the bow's size; it "
        f"explains this much of the change of 1X, as vectors: {', '.join(explained)}, if the slow roll is bow and "
        f"not runout. A bow and a free crack force at 1X cannot be told apart at all ({bow_twins(config)}). Taking "
        "the slow roll off also takes the crack's own 0X and 1X away, so dk p_0 and dk p_1 mean little. A phase mark "
        "that does not stand at the crack would turn dk p_n by n times that angle and leak into the damping. Weight "
        "dominance, which all of this assumes, does not hold here: the static deflection is "
        f"{static * 1e6:.0f} um, 1X without slow roll {np.abs(change).min() * 1e6:.0f} to "
        f"{np.abs(change).max() * 1e6:.0f} um.",
    )
