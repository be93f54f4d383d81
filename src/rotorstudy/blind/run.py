"""Cases with a known truth: hide, seal, diagnose, reveal, score."""

import hashlib
import json
import logging
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from signal import SIG_DFL, SIGINT, SIGTERM, signal
from tempfile import TemporaryDirectory
from time import process_time
from traceback import extract_tb

import numpy as np

from rotorstudy.blind.criteria import judge
from rotorstudy.blind.injection import draw, order_of
from rotorstudy.blind.scoring import score
from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.rig import read_rig
from rotorstudy.store import chunk_of, copied, dataset, provenance, save, write_text

SALT_STREAM = 7  # separates the salts of seals from the random numbers of cases
DESCRIBED = {  # columns of the result -> long name
    "case": {
        "size": "size in standard deviations, of the smaller effect if two",
        "beside": "the same where the other of two effects is there, and of unknown size",
        "probability": "stated probability of the first cause",
        "gain_true": "error on held-out speeds after over before, against the signal without noise",
        "gain": "the same against the measurement",
        "seconds": "time of the diagnosis, of one core",
        **{name: f"{name} of the case" for name in ("group", "machine", "families", "verdict", "answer")},
        **{name: f"case is {name}" for name in ("known", "alone", "in_set", "wrong", "names_rotor")},
    },
    "criterion": {
        "reached": "value reached",
        "low": "lower 95 % bound",
        "high": "upper 95 % bound",
        "found": "count behind the value",
        "cases": "cases, or intervals where these are counted",
        "what": "quantity",
        "kind": "share, calibration or median",
        "needed": "values that are accepted",
        "status": "how it is judged",
        "reasons": "what went wrong most often",
    },
}

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
    fits = (found.search.base, found.best)
    before, after = (measured_response(one.model, held.speed, held.harmonics, one.theta) for one in fits)
    return verdict, {"speed": held.speed.tolist(), "before": before, "after": after}


def run_blind(config, out, *, cases=None, seed=None, cores=1, answer=diagnosed):
    """Run blind tests in a folder: Dataset of `summary`, DataFrames of criteria and cases, all files but figures."""
    stated = {"cases": cases, "seed": seed}
    config = config.model_copy(update={key: value for key, value in stated.items() if value is not None})
    if config.cases < 1 or config.seed < 0 or cores < 1:
        said = f"cases {config.cases}, seed {config.seed}, cores {cores}"
        raise RotorstudyError(f"blind: {said}: at least one case and one core are needed, and a seed of 0 or more")
    seals = Path(out) / "seals.json"
    with TemporaryDirectory() as folder:
        answers = Path(folder) / "answers.json"
        answer_chunk(config, 0, 1, seals, answers, out, cores=cores, answer=answer)
        return gather_chunks(config, out, [seals], [answers])


def answer_chunk(config, chunk, chunks, seals, answers, out, *, cores=1, answer=diagnosed):
    """Hide and diagnose the cases of a chunk, 0 to chunks - 1; the file `seals` is written before the diagnosis."""
    numbers = chunk_of(range(config.cases), chunk, chunks)
    orders, found = [order_of(config, config.seed, number) for number in numbers], []
    with TemporaryDirectory() as records, pool(cores) as mapped:
        folders = [Path(records) / f"case_{order.number}" for order in orders]
        hidden = list(mapped(draw, orders, folders))
        for order, folder in zip(orders, folders, strict=True):
            if order.number < config.records:
                for file in folder.iterdir():
                    copied(file, Path(out) / "records" / folder.name / file.name)
        salts = [salt_of(config.seed, i) for i in numbers]
        sealed = [seal(truth, salt) for truth, salt in zip(hidden, salts, strict=True)]
        write_text(seals, json.dumps({"seed": config.seed, "sha256": sealed}, indent=1))
        truths = [json.dumps({"truth": truth, "salt": salt}) for truth, salt in zip(hidden, salts, strict=True)]
        left_out = [truth["leave_out"] for truth in hidden]  # of the library, which is no secret
        for truth, one in zip(truths, mapped(partial(answer_case, answer=answer), folders, left_out), strict=True):
            found.append(json.dumps({"truth": truth, "answer": one}, default=_plain))
            log.info("case %d of %d", len(found), len(truths))
    write_text(answers, "[" + ",\n".join(found) + "]\n")


def gather_chunks(config, out, seals, answers):
    """Open the truth of all cases, score the answers and write all but the figures; seals, answers : files in order."""
    out, opened, told = Path(out), [], []
    published = [one for path in seals for one in _read(path)["sha256"]]
    answered = [one for path in answers for one in _read(path)]
    write_text(out / "seals.json", json.dumps({"seed": config.seed, "sha256": published}, indent=1))
    for i, (one, sealed) in enumerate(zip(answered, published, strict=True)):
        found, answer = json.loads(one["truth"]), one["answer"]
        check_seal(found["truth"], found["salt"], sealed, f"blind case {i}")
        opened.append(found["truth"])
        told.append({**answer["verdict"], "seconds": answer["seconds"]})
        held = answer["held_out"] or {}
        held |= {part: np.array(held[part][0]) + 1j * np.array(held[part][1]) for part in held if part != "speed"}
    write_text(out / "truths.json", "[" + ",\n".join(one["truth"] for one in answered) + "]\n")
    write_text(out / "verdicts.json", "[" + ",\n".join(map(json.dumps, told)) + "]\n")
    rows = score(opened, [one["answer"] for one in answered])
    criteria = judge(rows)
    attributes = {**provenance(config.model_dump(), [], config.seed), "cases": len(answered)}
    data = summary(rows, criteria).assign_attrs(attributes, title=config.title)
    save(data, out / "blind.nc")
    return data, criteria, rows


def salt_of(seed, index):
    """Salt of a case, drawn from its seed so that the same case has the same seal."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(SALT_STREAM, index))).bytes(16).hex()


def seal(truth, salt):
    """SHA-256 of truth, as canonical JSON, and salt, which keeps the truth from being guessed from its hash."""
    canonical = json.dumps(truth, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256((canonical + salt).encode()).hexdigest()


def check_seal(truth, salt, sealed, where):
    """Raise RotorstudyError if a truth is not the one that was sealed."""
    if seal(truth, salt) != sealed:
        raise RotorstudyError(
            f"{where}: the truth is not the one that was sealed (SHA-256 {seal(truth, salt)}, sealed {sealed}); "
            "it was altered after the diagnosis began. Run the blind tests again"
        )


def _read(path):
    return json.loads(Path(path).read_text(encoding="utf-8"))


def _plain(value):
    """A complex array as its real and imaginary parts, another number as float, for JSON."""
    return [value.real.tolist(), value.imag.tolist()] if isinstance(value, np.ndarray) else float(value)


def read_case(folder, records=("record.nc",)):
    """Spectrum, model, settings and findings of a case, by its records and rig file alone."""
    from rotorstudy.diagnosis.settings import read_settings

    rig = read_rig(folder / "rig.yaml")
    spectrum, model, findings = measured_spectrum([folder / name for name in records], rig)
    return spectrum, model, read_settings(rig.given, "rig.yaml"), tuple(findings)


def answer_case(folder, leave_out=(), answer=diagnosed, records=("record.nc",)):
    """Verdict (or "refused", "failed"), held-out predictions and seconds of one core, of what `read_case` reads."""
    start, held_out = process_time(), None
    try:
        spectrum, model, settings, findings = read_case(folder, records)
        settings = settings.model_copy(update={"leave_out": list(leave_out)})
    except RotorstudyError as error:
        verdict = {"verdict": "refused", "error": str(error).replace(f"{folder}/", "")}  # rows are alike anywhere
    else:
        try:
            verdict, held_out = answer(spectrum, model, settings, findings)
        except (RotorstudyError, ArithmeticError, LookupError, ValueError) as error:  # a diagnosis ends in a verdict
            where = extract_tb(error.__traceback__)[-1]
            said = f"{type(error).__name__}: {error} ({Path(where.filename).name}:{where.lineno})"
            verdict = {"verdict": "failed", "error": said}
    return {"verdict": verdict, "held_out": held_out, "seconds": process_time() - start}


def _end_silently():
    """A process ends at a signal without a traceback; the command says that it was stopped."""
    for one in (SIGINT, SIGTERM):
        signal(one, SIG_DFL)


@contextmanager
def pool(cores):
    """`map` over processes, in order; in this process for one core."""
    if cores == 1:
        yield map
        return
    executor = ProcessPoolExecutor(cores, initializer=_end_silently)
    try:
        yield executor.map
    finally:
        executor.shutdown(cancel_futures=True)


def summary(rows, criteria):
    """All cases and criteria as a Dataset; rows : of `scoring.score`, criteria : of `criteria.judge`, DataFrames."""
    variables = {}
    for dim, table in (("case", rows), ("criterion", criteria)):
        for name, said in DESCRIBED[dim].items():
            kind = {"b": "i1", "O": object}.get(table[name].dtype.kind, float)
            unit = "s" if name == "seconds" else "1"
            variables[f"{dim}_{name}"] = ((dim,), table[name].to_numpy().astype(kind), unit, said)
    coordinates = {
        "case": (rows.case.to_numpy(int), "1", "number of the case"),
        "criterion": (criteria.key.to_numpy(object), "1", "key of the acceptance criterion"),
    }
    return dataset(variables, coordinates, title="Blind tests of the diagnosis")
