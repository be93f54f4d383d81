"""Ranking of the pairs of spectrum method and estimator, and recommendation for each fault of a record."""

import re

import numpy as np
import pandas as pd
import xarray as xr

VALID = (0.90, 0.99)  # mean coverage of valid 95 % intervals; 100 trials determine it to 2 % for one parameter
SELDOM = 0.02  # largest share of failed trials of a recommended pair: a failure is noticed, another pair can be used
AS_GOOD = 1.05  # errors within this factor count as equal: 100 trials determine the mean of two or more to 5 %
FIRST = "use this if"  # a column; the first of its rows that are alike is the first choice
WORST, TYPICAL = "error over bound, worst rotor and noise", "error over bound, median"  # columns
ANY_FAULT = "not known which"
ABBREVIATION = re.compile("[b-df-hj-np-tv-xz]{3,}")  # a word without a vowel


def ranking(whole):
    """A DataFrame of the pairs of spectrum method and estimator by rotor, fault and noise, the smallest error first."""
    whole = whole.sel(noise=whole.noise > 0)
    over = np.sqrt(1 / whole.efficiency)
    columns = {
        "error over bound": np.exp(np.log(over).mean("parameter")),
        "worst parameter": over.max("parameter"),
        "which parameter": over.parameter[over.fillna(0).argmax("parameter")].drop_vars("parameter"),
        "coverage": whole.coverage.mean("parameter"),
        "failed": whole.failed,
        "time per estimate (ms)": 1e3 * whole.seconds,
    }
    table = xr.Dataset(columns).to_dataframe().reset_index()
    table = table[table["error over bound"].notna() | (table.failed == 1)]
    keys = ["rotor", "fault", "noise"]
    table = table[[*keys, "spectrum_method", "estimator", *columns]]
    return table.sort_values([*keys, "error over bound"]).reset_index(drop=True)


def advice(ranked):
    """A DataFrame of the three best pairs for each fault: those of the smallest error in their worst rotor and noise.

    Of the pairs that rarely fail, the best estimator of each spectrum method; among equals one with valid intervals,
    then one that never fails. At the end the same for an unknown fault.
    """
    every = pd.concat([ranked, ranked.assign(fault=ANY_FAULT)], ignore_index=True)
    keys = ["fault", "spectrum_method", "estimator"]
    every = every[every.groupby(keys).failed.transform("max") <= SELDOM]
    groups, error = every.groupby(keys, sort=False), "error over bound"
    table = groups[error].max().to_frame(WORST)
    cells = every.loc[groups[error].idxmax()]
    table["worst rotor and noise"] = [
        f"{rotor}, {noise:g} %" for rotor, noise in zip(cells.rotor, cells.noise, strict=True)
    ]
    table["worst parameter there"] = cells["which parameter"].to_numpy()
    table[TYPICAL] = groups[error].median()
    low, high = groups.coverage.min(), groups.coverage.max()
    table["intervals"] = np.select([low < VALID[0], ~(high <= VALID[1])], ["too narrow", "too wide"], "valid")
    table["lowest coverage"], table["highest coverage"] = low, high
    table["failed, largest share"] = groups.failed.max()
    table["time per estimate (ms)"] = groups["time per estimate (ms)"].median()
    rows = []
    for _, same in table.reset_index().groupby(keys[:2], sort=False):
        good = same[same[WORST] <= AS_GOOD * same[WORST].min()]
        good = good.assign(invalid=good.intervals != "valid", fails=good["failed, largest share"] > 0)
        good = good.sort_values(["invalid", "fails", WORST], kind="stable")
        rows.append({**good.iloc[0], "equally good estimators": ", ".join(good.estimator[1:]) or "none"})
    best = pd.DataFrame(rows, columns=[*keys, "equally good estimators", *table.columns])
    best["last"] = best.fault == ANY_FAULT
    best["step"] = np.round(np.log(best[WORST].astype(float)) / np.log(AS_GOOD))  # equals: by the median
    best = best.sort_values(["last", "fault", "step", TYPICAL], kind="stable").groupby("fault", sort=False).head(3)
    return best.drop(columns=["last", "step"]).reset_index(drop=True)


def with_words(told, use_if):
    """Advice with the column FIRST, its faults in the order of `use_if`."""
    words = {fault: text for fault, text in use_if.items() if text}
    words[ANY_FAULT] = "you do not know which of these holds"
    place = {fault: i for i, fault in enumerate(use_if)}
    told = told.sort_values("fault", key=lambda faults: faults.map(place).fillna(len(place)), kind="stable")
    told.insert(0, FIRST, [words.get(fault, f"the record has: {fault}") for fault in told.fault])
    return told


def in_sentences(told):
    """Advice as a page shows it, which is fewer columns; told : DataFrame of `with_words`."""
    return pd.DataFrame(
        {
            FIRST: row[FIRST],
            "spectrum method": named(row["spectrum_method"]),
            "estimator": named(row["estimator"]),
            "equally good": named(row["equally good estimators"]),
            "error, times the least possible": f"typically {row[TYPICAL]:.2g}, at worst {row[WORST]:.2g}",
            "at worst": f"{row['worst rotor and noise']} noise, {named(row['worst parameter there'])}",
            "its 95 % intervals": row["intervals"],
        }
        for row in told.to_dict("records")
    )


def named(plugin):
    """A plugin or parameter as a reader calls it, abbreviations in capitals."""
    return " ".join(word.upper() if ABBREVIATION.fullmatch(word) else word for word in str(plugin).split("_"))
