"""What every error has to be: one line that says what is wrong; and a small rig whose records are accepted."""

import copy

import pytest
from machines import jeffcott_rig

from rotorstudy import RotorstudyError
from rotorstudy.commands.line import main

DROP = object()
RIG = jeffcott_rig(measurement={"harmonics": [0, 1, -1]})


def refused(function, *words, match=None):
    """The message of the error that a function raises; some words have to be in it, or a pattern."""
    with pytest.raises(RotorstudyError, match=match) as caught:
        function()
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message
    return message


def changed(part, path, to):
    """A copy of nested mappings and lists with the value at a path replaced, or its key taken out by DROP."""
    part = copy.deepcopy(part)
    *above, last = path
    inner = part
    for key in above:
        inner = inner[key]
    if to is DROP:
        del inner[last]
    else:
        inner[last] = to
    return part


def run(*arguments, status=0):
    """Run a command of rotorstudy, that has to end with a status."""
    assert main([str(one) for one in arguments]) == status


def undiagnosed(capsys, folder, rig, path, *words):
    """Records that `diagnose` refuses by a rig file, with some words, and leaves nothing behind."""
    status = main(["diagnose", str(path), "--rig", str(rig), "--out", str(folder / "out")])
    printed = capsys.readouterr()
    assert status == 1 and printed.out == ""
    error = printed.err.strip().splitlines()[-1]
    assert error.startswith("error: ")
    for word in words:
        assert word in error, error
    assert not (folder / "out").exists() and not list(folder.glob(".*partial"))
