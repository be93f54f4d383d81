"""Inputs that grow towards new branches of a reader, by libFuzzer. On request (pip install atheris):

    python tests/errors/coverage_guided.py KIND CORPUS -max_total_time=600

KIND is text, rig, ross, mat or uff. The folder CORPUS keeps an input for each new branch: a run goes on where the last
one ended. Further options are those of libFuzzer. It stops at an exception that is no RotorstudyError and at a number
that is not finite, and writes the input to a file.
"""

import os
import random
import sys
import tempfile
import warnings
from pathlib import Path

import atheris
import pytest

with atheris.instrument_imports(include=["rotorstudy.measurement", "rotorstudy.authoring", "rotorstudy.yaml_file"]):
    from test_fuzz_readers import PIECES, SUFFIX, hold_text, refused, seeds

kind, corpus, *options = sys.argv[1:]
folder = Path(tempfile.mkdtemp())
path = folder / f"input.{SUFFIX.get(kind, kind)}"
path.touch()
os.makedirs(corpus, exist_ok=True)
for number, content in enumerate(seeds(folder)[kind]):
    Path(corpus, f"seed_{number}").write_bytes(bytes([number]) + content)
pieces = ("".join(f"\\x{byte:02x}" for byte in piece) for piece in PIECES if len(piece) in range(1, 99))
(folder / "pieces").write_text("".join(f'"{piece}"\n' for piece in pieces))


def one(content):
    """The first byte says by which of its ways a file is read."""
    refused(kind, content[1:], path, random.Random(content[:1]))


warnings.simplefilter("ignore")
if kind == "text":
    hold_text(pytest.MonkeyPatch())
atheris.Setup(
    [sys.argv[0], corpus, f"-dict={folder / 'pieces'}", "-max_len=6000", "-len_control=0", "-timeout=100", *options],
    one,
)
atheris.Fuzz()
