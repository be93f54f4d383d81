"""What every check is made of: a failure that says where and by how much, and claims that are tried both ways.

A check takes a plugin, states what must hold in the first line of its docstring, and raises BrokenInvariant if it does
not. Tolerances have their reasons beside them.
"""

from functools import wraps

from rotorstudy.errors import PluginError, RotorstudyError
from rotorstudy.model.kinds import KINDS

HARMONICS = [0, 1, 2, 3, 5, 7, -1, -3, -5]
SPEEDS = [50.0, 88.0, 120.0, 150.0, 199.0]  # rad/s
ROUND_OFF = 1e-9  # relative; some thousand products of numbers of 16 digits


class BrokenInvariant(AssertionError):
    """A plugin does not hold what its kind requires or what it claims; the message says where and by how much."""


def require(holds, message):
    """Raise BrokenInvariant with a message unless something holds."""
    if not holds:
        raise BrokenInvariant(message)


def kind_of(plugin):
    """Name of the kind of a plugin."""
    return next(name for name, kind in KINDS.items() if isinstance(plugin, kind))


def claimed(flag, refused_with=None):
    """Make a check one of a claim: a plugin that sets the flag must pass it, and one that does not must fail it.

    So a claim is tried both ways: who has the property without claiming it is told to claim it.

    refused_with : error by which a plugin without the claim must refuse the input of the check, instead of giving a
                   wrong result
    """

    denial = refused_with or (BrokenInvariant, RotorstudyError)

    def of(check):
        @wraps(check)
        def tried(plugin):
            if getattr(plugin, flag):
                return check(plugin)
            try:
                check(plugin)
            except PluginError:
                raise
            except denial:
                return None
            except BrokenInvariant as error:
                raise BrokenInvariant(f"{error}; without {flag} it must refuse this with an error") from None
            raise BrokenInvariant(f"it does, but does not claim it: say {flag}=True")

        tried.flag = flag
        return tried

    return of


def is_claimed(check, plugin):
    """Whether a check is required of all plugins of the kind, or of a property that this one claims."""
    flag = getattr(check, "flag", None)
    return flag is None or getattr(plugin, flag)


def stated(plugin):
    """says in one line what it is, and where its equation comes from"""
    require(plugin.summary, "the function has no docstring; its first line is what users see")
    require(len(plugin.summary) < 120, f"the first line of the docstring has {len(plugin.summary)} letters; keep 120")
    require(plugin.summary.endswith((".", ")")), "the first line of the docstring is no sentence with a full stop")
    require(plugin.source, "no source; name the paper, book or equation")


def numbers_checked(plugin):
    """says which published or closed-form numbers it was checked against"""
    require(len(plugin.checked) > 10, "'checked' is empty; name the numbers of the paper or closed form it agrees with")
