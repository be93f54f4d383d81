"""A person who interrupts, and a scheduler that terminates."""

import os
import signal
import subprocess
import sys
import time

import pytest

from rotorstudy.__main__ import main

SLOW = """
import signal, sys, time
from rotorstudy.commands import line, simulate
from rotorstudy.store import atomic

def slow(given):
    with atomic(given.out) as temporary:
        temporary.write_text("half")
        print("started", flush=True)
        try:
            for _ in range(600):  # a signal just before a sleep does not end that one
                time.sleep(0.1)
        except KeyboardInterrupt as error:
            raise ValueError("as a library may answer") if "library" in given.out else error

simulate.run = slow
signal.signal(signal.SIGINT, signal.default_int_handler)  # which a shell turns off for what runs in the background
sys.exit(line.main(["simulate", "rig.yaml", "--speeds", "100", "--out", sys.argv[1]]))
"""


def started(out):
    """A process that has begun to write a file."""
    call = [sys.executable, "-c", SLOW, str(out)]
    process = subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "started\n" and len(os.listdir(out.parent)) == 1
    return process


@pytest.mark.parametrize("name", ["out.nc", "library.nc"])
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_gives_one_line_and_leaves_no_partial_file(number, status, name, tmp_path):
    process = started(tmp_path / name)
    process.send_signal(number)
    _, err = process.communicate(timeout=600)
    assert process.returncode == status and err == "stopped; files that were finished are kept\n"
    assert os.listdir(tmp_path) == []


def test_a_second_of_work_is_not_needed_to_see_the_partial_file(tmp_path):
    """The control: a kill that no program can answer leaves it."""
    process = started(tmp_path / "out.nc")
    process.kill()
    process.communicate(timeout=600)
    time.sleep(0.05)
    assert len(os.listdir(tmp_path)) == 1


def test_an_interruption_while_the_package_is_imported_is_one_line(monkeypatch, capsys):
    class Interrupting:
        def find_spec(self, name, path, target=None):
            if name == "rotorstudy.commands.line":
                raise KeyboardInterrupt

    monkeypatch.setattr(sys, "argv", ["rotorstudy", "plugins"])
    assert main() == 0 and "breathing" in capsys.readouterr().out  # the control
    monkeypatch.delitem(sys.modules, "rotorstudy.commands.line")
    monkeypatch.setattr(sys, "meta_path", [Interrupting(), *sys.meta_path])
    assert main() == 130 and capsys.readouterr().err == "stopped before anything was done\n"
