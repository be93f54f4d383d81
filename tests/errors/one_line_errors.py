"""What every error has to be: one line that says what is wrong."""

import pytest

from rotorstudy.errors import RotorstudyError


def refused(function, *words):
    """The message of the error that a function raises; each of some words has to be in it."""
    with pytest.raises(RotorstudyError) as caught:
        function()
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message
    return message
