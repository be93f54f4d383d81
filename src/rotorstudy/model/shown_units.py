"""The units that a reader uses: stated by `units:` of a rig file, by `--units`, or those of its probes."""

from contextlib import contextmanager
from contextvars import ContextVar

from rotorstudy.errors import RotorstudyError, unknown_name
from rotorstudy.units import AMPLITUDES, LENGTHS, RAD_PER_S, UNBALANCES, Units, showing

QUANTITY = {
    **dict.fromkeys(LENGTHS, "length"),
    **dict.fromkeys(UNBALANCES, "unbalance"),
    **dict.fromkeys(RAD_PER_S, "speed"),
    **dict.fromkeys(AMPLITUDES, "amplitude"),
}  # word -> what it is the unit of
UNBALANCE_WITH = {"um": "g mm", "mil": "oz in"}  # a length of vibration
_asked = ContextVar("asked", default=())


@contextmanager
def asked(words):
    """Within the block these words, those of `--units`, have precedence over the rig file; `oz in` needs no quotes."""
    joined = []
    for word in words:
        if joined and f"{joined[-1]} {word}" in QUANTITY:
            joined[-1] += f" {word}"
        else:
            joined.append(word)
    units_of({}, joined)
    before = _asked.set(tuple(joined))
    try:
        yield
    finally:
        _asked.reset(before)


def units_of(rig, words=(), where="the rig"):
    """The Units for a rig dict, and words that have precedence; by default those of its probes, else µm, g mm, rpm."""
    measurement = rig.get("measurement") if isinstance(rig.get("measurement"), dict) else {}
    probes = measurement.get("probes")
    inch = any(isinstance(p, dict) and p.get("unit") == "mil" for p in (probes if isinstance(probes, list) else []))
    found = Units("mil", UNBALANCE_WITH["mil"]) if inch else Units()
    if (stated := measurement.get("table_amplitude")) in AMPLITUDES:
        found = found._replace(amplitude=stated)
    own = rig.get("units") or []
    own = own if isinstance(own, list) else [own]
    stated = {}
    for given, place in ((own, f"{where}, units"), (words, "--units")):
        taken = {}
        for word in given:
            if str(word) not in QUANTITY:
                raise unknown_name("unit", word, QUANTITY, place)
            if (quantity := QUANTITY[word]) in taken:
                raise RotorstudyError(f"{place}: {taken[quantity]} and {word} are both units of {quantity}; keep one")
            taken[quantity] = word
        stated |= taken
    if length := stated.get("length"):
        stated.setdefault("unbalance", UNBALANCE_WITH[length])
    return found._replace(**stated)


def shown_for(rig, where="the rig"):
    """A block in which texts and figures have the units of a rig dict."""
    return showing(units_of(rig if isinstance(rig, dict) else {}, _asked.get(), where))
