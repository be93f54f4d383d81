"""Each published number beside ours, with its status and the reason for a difference."""

from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.measurement.table_spectra import last_digit
from rotorstudy.presentation.pages import Table
from thesis.texts import page

KEYS = ["table", "case", "item", "noise_percent", "quantity", "method"]
COLUMNS = [*KEYS, "published", "last_digit", "computed", "unit", "origin", "status", "reason"]
PRINTED = ["table", "case", "quantity", "method"]  # what a printed column of a spectrum is
PLACE = ["speed_rad_s", "node", "source", "record", "spectrum_method", "phase_reference"]  # ours of such a column
STATUSES = ("reproduced", "explained", "not reproducible")


def published(folder, tables=None):
    """Printed values of some tables (such as "2.3"), or all, as a DataFrame: KEYS, published, last_digit and unit."""
    spectrum = _printed(folder, "full_spectrum", PRINTED, PLACE)
    spectrum = spectrum.assign(noise_percent=np.nan, unit=np.where(spectrum.quantity == "amplitude", "m", "rad"))
    estimates = _printed(folder, "identified_parameters", ["table", "case", "noise_percent"])
    estimates[["item", "unit"]] = estimates["item"].str.extract(r"(.+) \((.+)\)")
    estimates = estimates.assign(quantity="estimate", method="least squares")
    both = pd.concat([spectrum, estimates.astype({"noise_percent": float})], ignore_index=True)
    check_known("printed table", tables or (), both.table.unique(), str(folder))
    both = both[[*KEYS, "published", "last_digit", "unit"]]
    return both if tables is None else both[both.table.isin(tables)].reset_index(drop=True)


def _printed(folder, name, keys, others=()):
    """The values in a file with a column for each item, as printed: keys, item, published, last_digit, by table."""
    path = Path(folder) / f"{name}.csv"
    if not path.is_file():
        raise RotorstudyError(f"printed values: file '{path}' does not exist")
    wide = pd.read_csv(path, dtype=str, keep_default_na=False).drop(columns=[*others])
    found = wide.melt(keys, var_name="item", value_name="text").replace("", np.nan).dropna(subset="text")
    found = found.sort_values("table", key=lambda names: names.map(list(wide.table).index), kind="stable")
    return found.assign(published=found.text.astype(float), last_digit=found.text.map(last_digit))


def agreeing(printed, computed):
    """(row,) whether values are the printed ones within a unit of the last digit, as print rounds or truncates."""
    distance = computed - printed.published
    turned = np.angle(np.exp(1j * distance.fillna(0))) + 0 * distance
    return distance.where(printed.unit != "rad", turned).abs() <= printed.last_digit * (1 + 1e-6)


def score(printed, computed, reasons, measured_again=()):
    """The scoreboard, COLUMNS, of printed values beside computed ones; one that differs without a reason is an error.

    computed : DataFrame with KEYS and `computed`, and perhaps further columns that reasons quote as {column}, as they
               may the `deviation` from the print and its `percent`
    reasons  : list of {"table": ..., further keys to match, "status": ..., "reason": ...}; the first match applies, to
               rows that do not agree, or with "even_if_equal" also to those that agree by coincidence
    measured_again : tables of measurements, replayed as records; all other values are "computed anew"
    """
    merged = printed.merge(computed, on=KEYS, how="left", validate="one_to_one")
    deviation = (merged.computed - merged.published).abs()
    merged = merged.assign(deviation=deviation, percent=100 * deviation / merged.published.abs())
    status, text = [], []
    for row, same in zip(merged.to_dict("records"), agreeing(merged, merged.computed), strict=True):
        rule = next((r for r in reasons if _matches(r, row)), None)
        if same and not (rule and rule.get("even_if_equal")):
            status.append("reproduced")
            text.append("")
            continue
        if rule is None:
            key = ", ".join(f"{k} {row[k]}" for k in KEYS)
            raise RotorstudyError(
                f"{key}: published {row['published']:g}, computed {row['computed']:g}, and no reason given; "
                "add one to the list of reasons"
            )
        status.append(rule["status"])
        text.append(" ".join(rule["reason"].format(**row).split()))
    origin = np.where(merged.table.isin(measured_again), "measured again", "computed anew")
    return merged.assign(status=status, reason=text, origin=origin)[COLUMNS]


def _matches(rule, row):
    for key, wanted in rule.items():
        if key in ("status", "reason", "even_if_equal"):
            continue
        wanted = wanted if isinstance(wanted, list) else [wanted]
        if row[key] not in wanted and str(row[key]) not in map(str, wanted):
            return False
    return True


def load_reasons(path):
    """Reasons from a YAML list; an unknown status raises RotorstudyError."""
    reasons = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    for rule in reasons:
        if rule.get("status") not in STATUSES[1:]:
            place = f"{path}: status {rule.get('status')!r} of table {rule.get('table')}"
            raise RotorstudyError(f"{place} (allowed: {STATUSES[1:]})")
    return reasons


def scoreboard(scored):
    """The Table of the scoreboard over the rows of all chapters, which are CSV files."""
    rows, numbers = pd.concat([pd.read_csv(path, dtype={"table": str, "item": str}) for path in scored]), {}
    rows = in_table_order(rows[COLUMNS])
    for name, origin in (("anew", "computed anew"), ("again", "measured again")):
        own = rows[rows.origin == origin]
        numbers |= {name: len(own), f"{name}_reproduced": (own.status == "reproduced").sum()}
    counts = rows.groupby(["table", "status"], sort=False).size().unstack(fill_value=0)
    counts = counts.reindex(columns=list(STATUSES), fill_value=0).reset_index()
    counts.insert(1, "values", counts[list(STATUSES)].sum(axis=1))
    shown, choose = {"Every value": rows, "Number of values by table": counts}, KEYS[:1] + KEYS[4:] + COLUMNS[-3:-1]
    return {"scoreboard": page("scoreboard", rows, shown=shown, choose=choose, below="reason", **numbers)}


def in_table_order(scored):
    """Rows ordered by table number, 4.9 before 4.10; the order within a table stays."""
    numbers = scored.table.map(lambda name: tuple(int(part) for part in name.split(".")))
    return scored.iloc[sorted(range(len(scored)), key=lambda i: numbers.iloc[i])].reset_index(drop=True)


def side_by_side(scored, rows, columns):
    """Rows of a scoreboard for readers: published and ours next to each other, lengths in µm, by key columns."""
    small = scored.unit == "m"
    lengths = {key: (scored[key] * 1e6).round(9).where(small, scored[key]) for key in ("published", "computed")}
    scored = scored.assign(**lengths, unit=scored.unit.where(~small, "µm"))
    mixed = scored.groupby(columns, dropna=False).unit.nunique().max() > 1
    rows = [*rows, "unit"] if mixed else rows
    wide = scored.drop_duplicates([*rows, *columns], keep="first")
    result = wide[rows].drop_duplicates().reset_index(drop=True)
    for key, part in wide.groupby(columns, sort=False, dropna=False):
        label = ", ".join(str(k) for k in key if str(k) not in ("", "nan"))
        label = label if mixed else f"{label} ({part.unit.iloc[0]})"
        part = part[[*rows, "published", "computed", "status"]]
        names = {"published": f"{label}: thesis", "computed": f"{label}: here", "status": f"{label}: status"}
        result = result.merge(part.rename(columns=names), on=rows, how="left")
    return result


def table_name(number):
    """ "2.5" -> "table_2_5", the name of its files."""
    return f"table_{number}".replace(".", "_")


def scored_tables(scored, described):
    """{"table_2_5": Table} of print beside ours; described : number -> (title, note, row keys, column keys)."""
    return {
        table_name(number): Table(
            side_by_side(scored[scored.table == number], down, across), f"Table {number}: {title}", note
        )
        for number, (title, note, down, across) in described.items()
    }
