"""Errors for the person who made the mistake: what, where, what is allowed, what to do."""

from difflib import get_close_matches


class RotorstudyError(Exception):
    """A mistake in the input, told in one line."""


class PluginError(RotorstudyError):
    """A plugin file that does not import, a name registered twice, a plugin that returns nonsense."""


class CannotAct(RotorstudyError):
    """An effect cannot act at the place it is asked for on this rotor."""


class NoSteadyState(RotorstudyError):
    """No periodic response there: an undamped resonance, a motion that jumps, bearings that carry nothing."""


class UnidentifiableError(RotorstudyError):
    """The data cannot separate the unknowns; `parameters` names those that trade off."""

    def __init__(self, message, parameters=()):
        super().__init__(message)
        self.parameters = tuple(parameters)


def unknown_name(kind, name, known, where="", error=RotorstudyError):
    """The error for a name nobody registered, with the near miss: `unknown crack 'swiching'; ...`."""
    near = get_close_matches(str(name), [str(k) for k in known], n=1)
    hint = f"; did you mean '{near[0]}'?" if near else ""
    place = f" in {where}" if where else ""
    allowed = ", ".join(sorted(map(str, known))) or "none"
    return error(f"unknown {kind} '{name}'{place}{hint} (known: {allowed})")


class NoConvergenceError(RotorstudyError):
    """A fit that did not converge: its data may be far from what the model can predict."""
