"""The page of the plugin library (zoo), and its table."""

import re

import pandas as pd

from rotorstudy.authoring.facts import tables
from rotorstudy.presentation.pages import to_index
from rotorstudy.presentation.tables import write_csv, write_html

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
