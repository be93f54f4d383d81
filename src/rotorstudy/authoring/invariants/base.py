"""Building blocks of checks: failures with place and size, and claims that are checked both ways.

A check takes a plugin, states in its docstring what must hold, and otherwise raises BrokenInvariant.
"""

from functools import wraps

from rotorstudy.errors import PluginError, RotorstudyError
from rotorstudy.model.kinds import KINDS
from rotorstudy.model.registry import blamed, check_stated

HARMONICS = [0, 1, 2, 3, 5, 7, -1, -3, -5]
SPEEDS = [50.0, 88.0, 120.0, 150.0, 199.0]  # rad/s
ROUND_OFF = 1e-9  # relative, of some thousand products


class BrokenInvariant(AssertionError):
    """A plugin violates a requirement of its kind or a claim; the message says where and by how much."""


def require(holds, message):
    """Raise BrokenInvariant with a message unless `holds`."""
    if not holds:
        raise BrokenInvariant(message)


def kind_of(plugin):
    """Name of the kind of a plugin."""
    return next(name for name, kind in KINDS.items() if isinstance(plugin, kind))


def claimed(flag, refused_with=None):
    """Decorate the check of a claim: a plugin that sets the flag must pass, any other fail, or raise `refused_with`."""

    denial = refused_with or (BrokenInvariant, RotorstudyError)
    told = f"; without {{}} it must raise {refused_with.__name__}" if refused_with else ""

    def of(check):
        @wraps(check)
        def tried(plugin):
            if getattr(plugin, flag):
                return check(plugin)
            try:
                check(plugin)
            except Exception as error:
                if isinstance(error, denial) and not isinstance(error, PluginError):
                    return None
                raise BrokenInvariant(f"{blamed(error) or error}{told.format(flag)}") from None
            raise BrokenInvariant(f"it has the property but does not claim it: set {flag}=True")

        tried.flag = flag
        return tried

    return of


def is_claimed(check, plugin):
    """Whether a check applies to every plugin of the kind, or to a property that this plugin claims."""
    flag = getattr(check, "flag", None)
    return flag is None or getattr(plugin, flag)


def stated(plugin):
    """states in one line what it is, and the source of its equation"""
    require(plugin.summary, "the function has no docstring; its first line is what users see")
    length = len(plugin.summary)
    require(length < 120, f"the first line of the docstring has {length} characters; at most 120 are allowed")
    require(plugin.summary.endswith((".", ")")), "the first line of the docstring must end with a full stop")
    require(plugin.source, "no source; state the paper, book or equation")
    check_stated(plugin)


def numbers_checked(plugin):
    """states the published or closed-form numbers it was checked against"""
    told = "state the published or closed-form numbers it agrees with"
    require(len(plugin.checked) > 10, f"checked = {plugin.checked!r} says too little; {told}")
