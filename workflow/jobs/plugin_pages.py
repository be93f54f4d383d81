"""Pages and tables of the plugin library (zoo), and of the numbers that others printed beside ours."""

import re

import pandas as pd

from rotorstudy.authoring.facts import tables
from rotorstudy.studies.published import beside_printed
from thesis.texts import page

PRINTED = ["quantity", "at", "speed", "change", "value", "computed", "unit", "deviation", "agrees", "reason", "source"]
COLUMNS = {  # of the page, few enough for a screen, and the headings of the facts shown in each
    "name": ("name", "claims"),
    "what it is": ("what it is", "in detail", "source"),
    "in a rig file": ("options", "inside options", "uncertain by", "parameters"),
    "checks and confounders": ("checked against", "confounders"),
}


def plugin_library():
    """The Table of all plugins of the registry."""
    found = tables()
    rows = pd.concat([table.assign(kind=kind) for kind, table in found.items()])
    pages = {f"{kind} ({len(table)})": shown(table) for kind, table in found.items()}
    return {"zoo": page("zoo", rows, shown=pages, count=len(rows))}


def shown(table):
    """A table of facts as shown on the page: fewer columns, with several lines in a cell."""

    def cell(row, headings):
        unnamed = headings[0] if headings[0] in COLUMNS else None
        texts = {h: re.sub(r"; (?=\w+: )", "\n", row[h]) for h in headings if row.get(h)}  # one line per confounder
        return "\n".join(text if h == unnamed else f"{h}: {text}" for h, text in texts.items())

    rows = [{column: cell(row, headings) for column, headings in COLUMNS.items()} for _, row in table.iterrows()]
    found = pd.DataFrame(rows)
    return found.loc[:, (found != "").any()]


def published(rigs):
    """The Table of all printed numbers of some rig files."""
    found = [beside_printed(rig) for rig in rigs]
    every, rows = pd.concat(found), []
    for one in found:
        agree, to_the_digit = (int(which.sum()) for which in (one.agrees, one.agrees & (one.reason == "")))
        rows.append((one.model.iloc[0], len(one), agree, to_the_digit, one.deviation.abs().max()))
    columns = ["machine", "numbers", "agree", "to the last digit printed", "largest deviation"]
    shown = {"": pd.DataFrame(rows, columns=columns)}
    shown |= {one.model.iloc[0]: one[PRINTED].replace({"agrees": {True: "yes", False: "no"}}) for one in found}
    counts = {"count": len(every), "machines": len(found), "agree": int(every.agrees.sum())}
    return {"published": page("published", every, shown=shown, **counts)}
