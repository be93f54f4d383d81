"""The page of the numbers that others printed, beside ours."""

import pandas as pd

from rotorstudy.presentation.pages import to_index
from rotorstudy.presentation.tables import write_csv, write_html
from rotorstudy.studies.published import beside_printed

SHOWN = ["quantity", "at", "speed", "change", "value", "computed", "unit", "deviation", "agrees", "reason", "source"]


def write_published(html, csv, rigs, index=None):
    """Write the page and the table of all printed numbers of some rig files to two paths."""
    found = [beside_printed(rig) for rig in rigs]
    every = pd.concat(found)
    write_csv(every, csv)
    machines = pd.DataFrame(
        {
            "machine": rows.model.iloc[0],
            "numbers": len(rows),
            "agree": int(rows.agrees.sum()),
            "to the last digit printed": int((rows.agrees & (rows.reason == "")).sum()),
            "largest deviation": rows.deviation.abs().max(),
        }
        for rows in found
    )
    write_html(
        html,
        "Numbers that others printed",
        f"{len(every)} numbers of {len(found)} machines, {int(every.agrees.sum())} of which agree with ours. A number "
        "agrees if it is the same when rounded as printed; where another tolerance is used, its reason is stated. x is "
        "downward. Each machine is a rig file and a table in tests/published.",
        {
            "": machines,
            **{rows.model.iloc[0]: rows[SHOWN].replace({"agrees": {True: "yes", False: "no"}}) for rows in found},
        },
        links=to_index(html, index),
    )
