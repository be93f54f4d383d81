"""What every error has to be: one line that says what is wrong."""

import copy

import pytest

from rotorstudy.errors import RotorstudyError

DROP = object()


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
