"""Blind tests in chunks, each a job of its own, for a cluster: the numbers of one run, whatever the chunks."""

import json
from pathlib import Path

import numpy as np

from rotorstudy.blind.run import answer_cases, diagnosed, judge_cases
from rotorstudy.chunks import chunk_of
from rotorstudy.store import write_text


def answer_chunk(config, chunk, chunks, seals, answers, out, *, cores=1, answer=diagnosed):
    """Hide and diagnose the cases of a chunk, 0 to chunks - 1; the files `seals` and `answers` are written."""
    numbers = chunk_of(range(config.cases), chunk, chunks)
    found = answer_cases(config, numbers, seals, out, cores=cores, answer=answer)
    write_text(answers, "[" + ",\n".join(json.dumps(one, default=_plain) for one in found) + "]\n")


def gather_chunks(config, out, seals, answers):
    """Score the cases of all chunks; what is written and returned is that of `run_blind`."""
    published = [one for path in seals for one in _read(path)["sha256"]]
    write_text(Path(out) / "seals.json", json.dumps({"seed": config.seed, "sha256": published}, indent=1))
    answered = [one for path in answers for one in _read(path)]
    for one in answered:
        held = one["answer"]["held_out"] or {}
        held |= {part: np.array(held[part][0]) + 1j * np.array(held[part][1]) for part in held if part != "speed"}
    return judge_cases(config, out, answered, published, config.seed)


def _read(path):
    return json.loads(Path(path).read_text(encoding="utf-8"))


def _plain(value):
    """A complex array as its real and imaginary parts, another number as float, for JSON."""
    return [value.real.tolist(), value.imag.tolist()] if isinstance(value, np.ndarray) else float(value)
