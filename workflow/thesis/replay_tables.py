"""Tables of a replayed experiment: printed values, estimates, physical checks, and the response of the models."""

import numpy as np
import pandas as pd

from rotorstudy.presentation.pages import Table
from rotorstudy.response.measured import measured_response
from rotorstudy.store import as_complex
from rotorstudy.units import percent
from thesis import checks
from thesis.replay import BOTH_DAMPINGS, COLUMN, DAMPINGS, remove_slow_roll, rounding_draws, thesis_estimates
from thesis.scoreboard import KEYS, load_reasons, published, score, scored_tables
from thesis.texts import page


def shown_compensated(spectra):
    """(case, harmonic) compensated spectrum of the column shown on pages, misprints corrected, m."""
    here = spectra.sel(version="corrected", data_set=COLUMN, spectrum_method=COLUMN)
    return as_complex(here.compensated)


def already_there(config, compensated):
    """harmonic -> its share already present at slow roll, in words."""
    share = checks.slow_roll_share(config, compensated)
    return {n: checks.slow_roll_text(n, share[:, h]) for h, n in enumerate(config.harmonics)}


def by_key(config, cases, values):
    """(case, harmonic, quantity, column) -> value;  values : (quantity, column) -> (case, harmonic)"""
    places = [(c, h, case, str(n)) for c, case in enumerate(cases) for h, n in enumerate(config.harmonics)]
    return {(case, n, *key): one[c, h] for key, one in values.items() for c, h, case, n in places}


def scored_rows(config, reference, spectra, identification, response, reasons):
    """Rows of the scoreboard: measured values, estimates, and `response` (higher case, harmonic) with the thesis's."""
    printed, values = published(reference, list(config.sheets)), {}
    for data_set in config.data_sets:  # each column by the spectrum method it was made with
        here = spectra.sel(data_set=data_set, spectrum_method=data_set)
        as_printed, corrected = (here.sel(version=version) for version in ("as printed", "corrected"))
        plain, compensated = as_complex(as_printed.displacement), as_complex(corrected.compensated)
        values["amplitude", data_set], values["phase", data_set] = np.abs(plain), np.angle(plain)
        values["reference phase", data_set] = as_printed.reference_phase.values
        values["compensated phase", data_set] = np.angle(compensated)
        if data_set == "regression":
            values["amplitude", "experiment"] = np.abs(as_complex(corrected.corrected))
    drawn = np.abs(remove_slow_roll(config, rounding_draws(config, reference, "regression")))
    found = {"computed": by_key(config, config.cases, values)}  # with the range within rounding, where it is known
    found["computed"] |= by_key(config, config.higher_cases, {("amplitude", "simulation"): np.abs(response)})
    for end, size in (("low", drawn.min(axis=0)), ("high", drawn.max(axis=0))):
        found[end] = by_key(config, config.cases, {("amplitude", "experiment"): size})
    in_tables, rows = printed[printed.table != config.estimates_table], []
    for row in in_tables[KEYS].to_dict("records"):
        key = (row["case"], row["item"], row["quantity"], row["method"])
        rows.append({**row, **{name: by.get(key, np.nan) for name, by in found.items()}})
    best = identification.sel(estimator="least_squares", data_set=COLUMN)
    for row in printed.loc[printed.table == config.estimates_table, KEYS].to_dict("records"):
        ours, factor = config.thesis_names[row["item"]]
        group = config.thesis_groups.get(row["case"], row["case"])
        estimate = best.sel(group=group, parameter=ours)
        own = {"computed": estimate.estimate, "low": estimate.low, "high": estimate.high}
        own = {name: float(value) * factor for name, value in own.items()}
        rows.append({**row, **own, "cases": " and ".join(config.groups[group])})
    replayed = [table for table, rows in in_tables.groupby("table") if set(rows.method) <= set(config.data_sets)]
    return score(printed, pd.DataFrame(rows), load_reasons(reasons), measured_again=replayed)


def all_estimates(identification):
    """Every estimate with its interval and the misfit of its fit, one row each, SI."""
    every = identification[["estimate", "low", "high", "misfit"]].to_dataframe().reset_index()
    return every.assign(estimator=every.estimator.str.replace("_", " "))


def printed_estimates(config, reference, order):
    """The thesis's estimates with one unit of their last digit as interval; order : of the parameters."""
    printed = published(reference, [config.estimates_table])
    thesis = printed.assign(parameter=printed.item.map({item: name for item, (name, _) in config.thesis_names.items()}))
    thesis = thesis[["case", "parameter", "published", "last_digit"]]
    both = thesis[thesis.parameter.isin(DAMPINGS)].groupby("case", sort=False)[["published", "last_digit"]].sum()
    thesis = pd.concat([thesis, both.reset_index().assign(parameter=BOTH_DAMPINGS)], ignore_index=True)
    thesis = thesis.sort_values("parameter", key=lambda column: column.map(order.index), kind="stable")
    low, high = (thesis.published + sign * thesis.last_digit for sign in (-1, 1))
    renamed = thesis.rename(columns={"case": "group", "published": "estimate"}).assign(source="thesis")
    return renamed[["source", "group", "parameter", "estimate"]].assign(low=low, high=high)


def estimate_checks(config, reference, spectra, identification):
    """Physical checks of our estimates, then of the thesis's: a DataFrame, see `physical_checks`."""
    every = all_estimates(identification)
    ours = every[every.data_set == COLUMN].assign(source=lambda e: "here, " + e.estimator)
    ours = ours[["source", "group", "parameter", "estimate", "low", "high"]]
    thesis = printed_estimates(config, reference, list(identification.parameter.values))
    bow = float(np.abs(shown_compensated(spectra)[config.slow, config.harmonics.index(1)]))
    return checks.physical_checks(config, pd.concat([ours, thesis], ignore_index=True), bow)


def checks_table(config, spectra, checked):
    """The Table of the physical checks; checked : of `estimate_checks`."""
    compensated = shown_compensated(spectra)
    said = {"refused": checks.refused_text(checked), "bow": checks.bow_text(config, compensated)}
    said |= {"confounders": checks.bow_confounders(config), "weight": checks.weight_text(config, compensated)}
    backward = already_there(config, compensated)[-1]
    return page("physical_checks", checked, digits=4, column=COLUMN, backward=backward, **said)


def response_table(config, spectra, identification, thesis_response):
    """Measured harmonics beside those of every identified model; thesis_response : (higher case, harmonic), m."""
    compensated = shown_compensated(spectra)
    corrected, still = remove_slow_roll(config, compensated)[config.higher], compensated[config.slow]
    responses = {"thesis's estimates": thesis_response}
    for estimator in config.estimators:
        here = identification.simulated.sel(estimator=estimator, data_set=COLUMN, group=config.all_speeds)
        responses[estimator.replace("_", " ")] = as_complex(here)
    measured = compensated[config.higher]
    sizes = {
        "slow roll": np.broadcast_to(still, measured.shape),
        "as measured": measured,
        "change from slow roll": measured - still,
        "compared": corrected,
    }
    for name, values in responses.items():
        sizes |= {name: values, f"{name}, off": values - corrected}
    rows = pd.MultiIndex.from_product([config.higher_cases, config.harmonics], names=["case", "harmonic"])
    columns = {f"{name} (µm)": np.abs(values).ravel() * 1e6 for name, values in sizes.items()}
    table = pd.DataFrame(columns, rows).reset_index()
    off = {name: np.sqrt((table[f"{name}, off (µm)"] ** 2).sum()) for name in responses}
    whole = np.sqrt((table["compared (µm)"] ** 2).sum())
    distances = ", ".join(f"{name} {percent(value / whole)} of the measured" for name, value in off.items())
    largest = [checks.largest_crack_response(config, n) * 1e6 for n in (-1, 2)]
    said, already = {"distances": distances, "group": config.all_speeds}, already_there(config, compensated)
    said |= {"largest_backward": largest[0], "largest_second": largest[1]}
    return page("response", table, digits=4, column=COLUMN, backward=already[-1], second=already[2], **said)


def tables(config, reference, reasons, spectra, identification, **others):
    """The tables of a replayed experiment, and the rows of the scoreboard, by name.

    others : results that only figures show
    """
    groups = published(reference, [config.estimates_table]).case.unique()
    thetas = np.array([thesis_estimates(config, reference, group) for group in groups])
    last = measured_response(config.model, config.speeds[config.higher], config.harmonics, thetas)[-1, ..., 0]
    scored = scored_rows(config, reference, spectra, identification, last, reasons)
    sheets = {name: (sheet.title, sheet.note, ["item"], sheet.across) for name, sheet in config.sheets.items()}
    estimates = checks.shown_estimates(config, all_estimates(identification))
    return {
        "scored": Table(scored),
        **scored_tables(scored, sheets),
        "estimates": page("estimates", estimates, digits=4, groups=", ".join(config.groups)),
        "physical_checks": checks_table(config, spectra, estimate_checks(config, reference, spectra, identification)),
        "response": response_table(config, spectra, identification, last),
    }
