"""Invariants of every plugin kind, one file per kind; `rotorstudy check` and the tests run the same list."""

from typing import NamedTuple

from rotorstudy.authoring.invariants import bearing, crack, effect, estimator, rotor, spectrum
from rotorstudy.authoring.invariants.base import BrokenInvariant, is_claimed, kind_of, numbers_checked, stated
from rotorstudy.errors import RotorstudyError
from rotorstudy.model.kinds import KINDS
from rotorstudy.model.registry import blamed

MODULES = (rotor, crack, bearing, effect, spectrum, estimator)


def _named(kind):
    """The checks named after a kind, as `crack_is_bounded`, in order."""
    own = ((name, one) for module in MODULES for name, one in vars(module).items())
    return tuple(one for name, one in own if name.startswith(f"{kind}_") and one.__module__.startswith(__name__))


INVARIANTS = {kind: _named(kind) for kind in KINDS}
INVARIANTS["bearing"] = (*_named("term"), *INVARIANTS["bearing"])
INVARIANTS["effect"] += _named("term")


class Outcome(NamedTuple):
    """Result of one check: its statement, the state "holds", "fails" or "not claimed", and what is wrong or ""."""

    statement: str
    state: str
    wrong: str


def invariants_of(plugin):
    """The checks of a plugin, in order."""
    return (stated, numbers_checked, *INVARIANTS[kind_of(plugin)])


def outcomes(plugin):
    """An Outcome for each check of a plugin, in order; any error is a failure."""
    return [_outcome(check, plugin) for check in invariants_of(plugin)]


def _outcome(check, plugin):
    try:
        check(plugin)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # a plugin may raise any
        said = " ".join(str(error).split()) or type(error).__name__
        told = isinstance(error, (BrokenInvariant, RotorstudyError))
        return Outcome(check.__doc__, "fails", said if told else blamed(error) or f"{type(error).__name__}: {said}")
    return Outcome(check.__doc__, "holds" if is_claimed(check, plugin) else "not claimed", "")
