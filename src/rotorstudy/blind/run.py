"""A complete blind test: hide, seal, diagnose, reveal, score."""

import json
import logging
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from shutil import copytree
from signal import SIG_DFL, SIGINT, signal
from tempfile import TemporaryDirectory
from time import process_time
from traceback import extract_tb

from rotorstudy.blind.criteria import judge
from rotorstudy.blind.injection import draw, order_of
from rotorstudy.blind.scoring import score
from rotorstudy.blind.sealing import check_seal, salt_of, seal
from rotorstudy.blind.summary import summary
from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.rig import read_rig
from rotorstudy.store import provenance, save, write_text

log = logging.getLogger(__name__)


def diagnosed(spectrum, model, settings, findings):
    """Verdict of the package's own diagnosis, and its predictions at the held-out speeds."""
    from rotorstudy.diagnosis import investigate
    from rotorstudy.response.measured import measured_response

    found = investigate(spectrum, model, settings=settings, findings=findings)
    verdict = json.loads(found.verdict.model_dump_json())
    held = found.held_out
    if held is None:
        return verdict, None
    before, after = (
        measured_response(fit.model, held.speed, held.harmonics, fit.theta) for fit in (found.search.base, found.best)
    )
    return verdict, {"speed": held.speed.tolist(), "before": before, "after": after}


def run_blind(config, out, *, cases=None, seed=None, cores=1, answer=diagnosed):
    """Run blind tests and write everything except the figures to a folder.

    config : BlindConfig;  cases, seed : override those of the configuration
    answer : function(spectrum, model, settings, findings) -> verdict dict, held-out predictions or None
    returns: Dataset of `summary.summary`, list of Criterion, DataFrame of cases
    Apart from times the result depends on configuration and seed alone, not on the number of cores.
    """
    cases, seed = config.cases if cases is None else cases, config.seed if seed is None else seed
    if cases < 1 or seed < 0 or cores < 1:
        raise RotorstudyError(f"blind: cases {cases}, seed {seed}, cores {cores}: at least 1, 0 and 1 are needed")
    out = Path(out)
    answered = answer_cases(config, range(cases), out / "seals.json", out, seed=seed, cores=cores, answer=answer)
    return judge_cases(config, out, answered, _published(out / "seals.json"), seed)


def answer_cases(config, numbers, seals, out, *, seed=None, cores=1, answer=diagnosed):
    """Hide and diagnose the cases of some numbers; their seals are written to the file `seals` before the diagnosis."""
    seed, out = config.seed if seed is None else seed, Path(out)
    orders = [order_of(config, seed, number) for number in numbers]
    with TemporaryDirectory() as records, _pool(cores) as mapped:
        folders = [Path(records) / f"case_{order.number}" for order in orders]
        hidden = list(mapped(draw, orders, folders))
        for order, folder in zip(orders, folders, strict=True):
            if order.number < config.records:
                copytree(folder, out / "records" / folder.name, dirs_exist_ok=True)
        salts = [salt_of(seed, i) for i in numbers]
        sealed = [seal(truth, salt) for truth, salt in zip(hidden, salts, strict=True)]
        write_text(seals, json.dumps({"seed": seed, "sha256": sealed}, indent=1))
        truths = [json.dumps({"truth": truth, "salt": salt}) for truth, salt in zip(hidden, salts, strict=True)]
        left_out, answered = [truth["leave_out"] for truth in hidden], []  # of the library, which is no secret
        for truth, one in zip(truths, mapped(partial(answer_case, answer=answer), folders, left_out), strict=True):
            answered.append({"truth": truth, "answer": one})
            log.info("case %d of %d", len(answered), len(truths))
    return answered


def judge_cases(config, out, answered, published, seed):
    """Open the truth of all cases, score the answers, and write everything except the figures; see `run_blind`."""
    opened = []
    for i, (one, sealed) in enumerate(zip(answered, published, strict=True)):
        found = json.loads(one["truth"])
        check_seal(found["truth"], found["salt"], sealed, f"blind case {i}")
        opened.append(found["truth"])
    out, answers = Path(out), [one["answer"] for one in answered]
    write_text(out / "truths.json", "[" + ",\n".join(one["truth"] for one in answered) + "]\n")
    told = [{**one["verdict"], "seconds": one["seconds"]} for one in answers]
    write_text(out / "verdicts.json", "[" + ",\n".join(json.dumps(one, default=float) for one in told) + "]\n")
    rows = score(opened, answers)
    criteria = judge(rows)
    attributes = {**provenance(config.model_dump(), [], seed), "cases": len(answered)}
    data = summary(rows, criteria).assign_attrs(attributes, title=config.title)
    save(data, out / "blind.nc")
    return data, criteria, rows


def _published(seals):
    return json.loads(Path(seals).read_text(encoding="utf-8"))["sha256"]


def answer_case(folder, leave_out=(), answer=diagnosed):
    """Verdict, held-out predictions and seconds of one core, from the record and the rig file in a folder alone.

    Records that are refused, and an error of the diagnosis, are answers too: "refused" and "failed", with the `error`.
    """
    from rotorstudy.diagnosis.settings import read_settings

    start, held_out = process_time(), None
    try:
        rig = read_rig(folder / "rig.yaml")
        spectrum, model, findings = measured_spectrum([folder / "record.nc"], rig)
        settings = read_settings(rig.given, "rig.yaml").model_copy(update={"leave_out": list(leave_out)})
    except RotorstudyError as error:
        verdict = {"verdict": "refused", "error": str(error)}
    else:
        try:
            verdict, held_out = answer(spectrum, model, settings, tuple(findings))
        except (RotorstudyError, ArithmeticError, LookupError, ValueError) as error:  # a diagnosis ends in a verdict
            where = extract_tb(error.__traceback__)[-1]
            said = f"{type(error).__name__}: {error} ({Path(where.filename).name}:{where.lineno})"
            verdict = {"verdict": "failed", "error": said}
    return {"verdict": verdict, "held_out": held_out, "seconds": process_time() - start}


@contextmanager
def _pool(cores):
    """`map` over processes, in order; in this process for one core."""
    if cores == 1:
        yield map
        return
    executor = ProcessPoolExecutor(cores, initializer=signal, initargs=(SIGINT, SIG_DFL))  # no traceback of each
    try:
        yield executor.map
    finally:
        executor.shutdown(cancel_futures=True)
