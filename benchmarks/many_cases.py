"""The loop of everything that has many cases, one case of the independent simulator, and shares with their bounds.

Who imports it before numpy has one thread of BLAS, unless the environment states another number.
"""

import json
import warnings
from contextlib import suppress
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic

from rotorstudy.threads import use_one_thread_unless_stated

use_one_thread_unless_stated()

import numpy as np

from rotorstudy.blind.injection import draw
from rotorstudy.blind.run import answer_case, pool
from rotorstudy.blind.scoring import score_case, share_bounds
from rotorstudy.errors import RotorstudyError
from rotorstudy.store import copied, write_text


def rows_of(run, cases, file=None, *, key="case", processes=1, minutes=np.inf, line=str):
    """DataFrame of a row for each case; a row is printed, and in the file, CSV, as soon as its case is done.

    run     : function of a case that gives its row, a dict; of several processes one that they can import
    cases   : {value of the column `key`: case}; those that the file has already are not run again
    minutes : after which no case is begun;  line : function of a row, for what is printed
    """
    import pandas as pd

    rows = pd.read_csv(file).to_dict("records") if file and Path(file).exists() else []
    known, end = {row[key] for row in rows}, monotonic() + 60 * minutes
    asked = {name: case for name, case in cases.items() if name not in known}
    with pool(processes) as mapped:
        for name, row in zip(asked, mapped(partial(_until, end, run), asked.values()), strict=True):
            if row is not None:
                rows.append({key: name} | row)
                print(line(rows[-1]), flush=True)
            if file and rows:
                write_text(file, pd.DataFrame(rows).to_csv(index=False, float_format="%.6g"))
    return pd.DataFrame(rows)


def _until(end, run, case):
    """The row of a case, without warnings; None if the clock, which processes share, is beyond the end."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return run(case) if monotonic() < end else None


def run_case(order, out, records=None):
    """Row of an Order: drawn, diagnosed, scored; all but the record stays in OUT/cases, that in `records`, if given."""
    kept, name = Path(out) / "cases" / f"{order.number:04d}", f"{order.number:04d}"
    with TemporaryDirectory() as beside:
        folder = Path(records or beside) / name
        try:
            truth = stored(order, folder)
        except RotorstudyError as problem:
            row = {"seed": order.seed, "kind": order.kind, "families": "", "machine": "", "known": False}
            return row | {"verdict": "not drawn", "named": str(problem), "size": np.nan}
        answer = answer_case(folder, truth["leave_out"])
        for file in ("rig.yaml", "case.json"):
            copied(folder / file, kept / file)
    write_text(kept / "verdict.json", json.dumps(answer["verdict"], indent=1))
    return score_case(truth, answer)


def stored(order, folder):
    """Truth of an Order; record, rig file and `case.json` with the truth are drawn into a folder if not there."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    if not (folder / "case.json").exists():
        with TemporaryDirectory(dir=folder.parent, prefix=".new") as new:
            truth = draw(order, Path(new) / "case")
            (Path(new) / "case" / "case.json").write_text(json.dumps(truth, indent=1), encoding="utf-8")
            with suppress(OSError):  # another process was faster, with the same content
                (Path(new) / "case").rename(folder)
    return json.loads((folder / "case.json").read_bytes())


def shares(found):
    """Table of shares with 95 % bounds, and of medians; found : {what: (case,) whether it is so, or a number}."""
    import pandas as pd

    rows = []
    for what, values in found.items():
        values, bounds, value = np.asarray(values), (np.nan, np.nan), np.nan
        if values.dtype == bool:
            bounds = share_bounds(int(values.sum()), len(values))
        if len(values):
            value = np.mean(values) if values.dtype == bool else np.median(values)
        rows.append({"what": what, "value": value, "low": bounds[0], "high": bounds[1], "cases": len(values)})
    return pd.DataFrame(rows)
