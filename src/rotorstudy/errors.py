"""Errors that say in one line what is wrong, where, what is allowed, and what to do."""

from contextlib import contextmanager
from difflib import get_close_matches

UNITS = ("m", "um", "mm", "mil", "deg", "rad", "kg", "s", "rpm", "Hz", "Pa")  # the end of most keys
LONGEST = 1500  # characters of a message; what it repeats of the input is cut in the middle


class RotorstudyError(Exception):
    """An error in the input; the message is one line."""

    def __str__(self):
        text = " ".join(super().__str__().split())
        return text if len(text) <= LONGEST else f"{text[: LONGEST // 2]} ... {text[-(LONGEST // 2) :]}"


class PluginError(RotorstudyError):
    """A plugin file that cannot be imported, a name registered twice, or an invalid result of a plugin."""


class CannotAct(RotorstudyError):
    """An effect that cannot act at the given place of this rotor."""


class RigError(RotorstudyError):
    """An error of what a rig file states, found where its name is not known: the command line says which file."""


class MissingValue(RigError):
    """An amplitude without a value in the rig file."""


class NoSteadyState(RigError):
    """No periodic response at a speed: an undamped resonance, a jump, or bearings that do not carry the rotor."""


class NotHeld(RigError):
    """A rotor that can move without a restoring force."""


class UnidentifiableError(RotorstudyError):
    """Unknowns that the data cannot separate, named in `parameters`."""

    def __init__(self, message, parameters=()):
        super().__init__(message)
        self.parameters = tuple(parameters)


@contextmanager
def reading(kind, path):
    """Context in which another package reads a file; whatever it raises is one line: "not a readable KIND"."""
    try:
        yield
    except RotorstudyError:
        raise
    except Exception as error:  # of a damaged file: any
        said = next(iter(str(error).splitlines()), "") or type(error).__name__
        raise RotorstudyError(f"{path}: not a readable {kind} ({said})") from None


def unknown_name(kind, name, known, where="", error=RotorstudyError):
    """The error for an unknown name, with the closest known one: `unknown crack 'swiching'; did you mean ...`."""
    near = get_close_matches(str(name), [str(k) for k in known], n=1)
    stem, _, unit = near[0].rpartition("_") if near else ("", "", "")
    other = unit in UNITS and str(name).rpartition("_")[0] == stem != ""  # as `length_mm` is of `length_m`
    hint = f"; did you mean '{near[0]}'{' (its end is its unit)' * (other or str(name) == stem)}?" if near else ""
    if str(name) == "0" and "1" in map(str, known):
        hint = "; they are numbered from 1"
    place = f" in {where}" if where else ""
    in_order = sorted(map(str, known), key=lambda one: (0, int(one), "") if one.isdecimal() else (1, 0, one))
    return error(f"unknown {kind} '{name}'{place}{hint} (known: {', '.join(in_order) or 'none'})")


def check_known(kind, names, known, where="", error=RotorstudyError):
    """Raise the error of `unknown_name` for the first of some names that is not known."""
    for name in names:
        if name not in known:
            raise unknown_name(kind, name, known, where, error)


class NoConvergenceError(RotorstudyError):
    """A fit that did not converge; the data may be far from any prediction of the model."""
