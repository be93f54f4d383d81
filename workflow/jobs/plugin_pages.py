"""Pages and tables of the plugin library (zoo), and of the numbers that others printed beside ours."""

import re

import pandas as pd

from rotorstudy.authoring.facts import tables
from rotorstudy.presentation.pages import to_index, write_csv, write_html
from rotorstudy.studies.published import beside_printed

PRINTED = ["quantity", "at", "speed", "change", "value", "computed", "unit", "deviation", "agrees", "reason", "source"]
COLUMNS = {  # of the page, few enough for a screen, and the headings of the facts shown in each
    "name": ("name", "claims"),
    "what it is": ("what it is", "in detail", "source"),
    "in a rig file": ("options", "inside options", "uncertain by", "parameters"),
    "checks and confounders": ("checked against", "confounders"),
}


def write_plugin_library(html, csv, index=None):
    """Write the page and the table of all plugins of the registry to two paths; index : page of all results, if any."""
    found = tables()
    count = sum(len(table) for table in found.values())
    write_csv(pd.concat([table.assign(kind=kind) for kind, table in found.items()]), csv)
    write_html(
        html,
        "Plugin library (zoo)",
        f"{count} models, each in one file in plugins/. Every claim is checked by the tests and by 'rotorstudy check'. "
        "An option marked '(needed)' has no default, a key inside an option with ? may be left out. "
        "zoo.csv has a separate column for each fact.",
        {f"{kind} ({len(table)})": shown(table) for kind, table in found.items()},
        links=to_index(html, index),
    )


def shown(table):
    """A table of facts as shown on the page: fewer columns, with several lines in a cell."""

    def cell(row, headings):
        unnamed = headings[0] if headings[0] in COLUMNS else None
        texts = {h: re.sub(r"; (?=\w+: )", "\n", row[h]) for h in headings if row.get(h)}  # one line per confounder
        return "\n".join(text if h == unnamed else f"{h}: {text}" for h, text in texts.items())

    rows = [{column: cell(row, headings) for column, headings in COLUMNS.items()} for _, row in table.iterrows()]
    found = pd.DataFrame(rows)
    return found.loc[:, (found != "").any()]


def write_published(html, csv, rigs, index=None):
    """Write the page and the table of all printed numbers of some rig files to two paths."""
    found = [beside_printed(rig) for rig in rigs]
    every = pd.concat(found)
    write_csv(every, csv)
    rows = []
    for one in found:
        agree, to_the_digit = (int(which.sum()) for which in (one.agrees, one.agrees & (one.reason == "")))
        rows.append((one.model.iloc[0], len(one), agree, to_the_digit, one.deviation.abs().max()))
    columns = ["machine", "numbers", "agree", "to the last digit printed", "largest deviation"]
    write_html(
        html,
        "Numbers that others printed",
        f"{len(every)} numbers of {len(found)} machines, {int(every.agrees.sum())} of which agree with ours. A number "
        "agrees if it is the same when rounded as printed; where another tolerance is used, its reason is stated. x is "
        "downward. Each machine is a rig file and a table in tests/published.",
        {
            "": pd.DataFrame(rows, columns=columns),
            **{rows.model.iloc[0]: rows[PRINTED].replace({"agrees": {True: "yes", False: "no"}}) for rows in found},
        },
        links=to_index(html, index),
    )
