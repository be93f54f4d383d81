"""What names of channels say about a probe: its plane, its direction, its unit."""

import re

UNITS = {
    "um": ("um", "µm", "μm", "micron", "microns", "micrometer", "micrometre"),
    "mil": ("mil", "mils"),
    "mm": ("mm",),
    "m": ("m",),
    "V": ("v", "volt", "volts"),
    "s": ("s", "sec"),
    "ms": ("ms",),
    "rpm": ("rpm", "rev", "cpm"),
    "Hz": ("hz",),
    "rad/s": ("rad",),
    "other": ("g", "mv", "mms", "ins", "ips", "a", "bar", "psi", "degc", "°c", "kw", "mw", "pa"),
}
UNIT_OF = {word: unit for unit, words in UNITS.items() for word in words}
SHORT = {"m", "s", "g", "v", "a"}  # letters that are a unit only in brackets or in a row of units
STATED = {word: unit for word, unit in UNIT_OF.items() if unit != "other"}  # what a header says for sure
STATED |= dict.fromkeys(("second", "seconds"), "s") | dict.fromkeys(("msec", "millisecond", "milliseconds"), "ms")
STATED |= {
    "thou": "mil",
    "mv": "mV",
    "rad/s": "rad/s",
    "r/min": "rpm",
    "rev/min": "rpm",
    "1/min": "rpm",
    "min-1": "rpm",
    "ips": "in/s",
}
STATED |= {unit: unit for unit in ("m/s", "mm/s", "in/s", "m/s2", "g")}
NOT_READ = (  # units of other quantities or sizes, in which no channel is read
    "nm", "cm", "dm", "km", "in", "inch", "inches", "ft", "uin", "µin", "us", "µs", "μs", "usec", "ns", "min", "hr",
    "hour", "hours", "minute", "minutes", "day", "days",
    "khz", "krpm", "rps", "1/s", "rev/s", "deg/s", "cm/s", "ft/s", "deg", "kv", "a", "ma", "db", "%", "counts", "bar",
    "mbar", "psi", "pa", "kpa", "mpa", "n", "kn", "w", "kw", "mw", "degc", "°c", "degf", "°f", "k", "kg",
)  # fmt: skip
STATED |= {word: word for word in NOT_READ}
SPEED_WORDS = {"rpm", "speed", "drehzahl", "rev", "cpm"}
PEAK = {"pp", "pk", "p", "rms"}
LEFT, RIGHT = {"l", "left"}, {"r", "right"}
LEAST_ANGLE = 15  # degrees; a smaller number beside "left" counts probes
DIRECTIONS = {
    "x": -45.0,
    "y": 45.0,
    "v": 0.0,
    "vert": 0.0,
    "vertical": 0.0,
    "h": -90.0,
    "hor": -90.0,
    "horiz": -90.0,
    "horizontal": -90.0,
}


def words_in(name):
    """Words and numbers of a name in lower case: `Brg1_X [um]` -> brg, 1, x, um."""
    return re.findall(r"[^\W\d_]+|\d+(?:\.\d+)?", name.lower())


def unit_in(name, stated=""):
    """Unit by the text below a header, else by the name; None if neither says one, "other" if it is no length.

    A single letter is a unit only in brackets or below the header, as in `y (m)`.
    """
    if re.search(r"[a-zA-Z]\s*/\s*s", f"{name} {stated}") and "rad" not in name + stated:
        return "other"
    for text in (stated, *re.findall(r"[\[(]([^\])]*)[\])]", name)):
        found = "".join(words_in(text.split("pp")[0].split("pk")[0]))
        if found in UNIT_OF:
            return UNIT_OF[found]
        for word in words_in(text):
            if word in UNIT_OF:
                return UNIT_OF[word]
    words = [word for word in words_in(name) if word in UNIT_OF and word not in SHORT]
    return UNIT_OF[words[-1]] if words else None


def stated_units(names, below):
    """The units that headers have in brackets, or the texts below them, or None; (V) beside (H) is a direction."""
    letters = "smg" if any(re.search(r"[\[(][Hh][\])]", name) for name in names) else "smgV"
    return [_stated(name, text, letters) for name, text in zip(names, below, strict=True)]


def _stated(name, below, letters):
    """The unit of a column by its name or header, one in brackets preferred; `DE (NS) (um)` names the plane first."""
    bracketed, found = re.findall(r"[\[(]([^\])]*)[\])]", name), []
    for text in (below, *(one for one in bracketed if len(one) != 1 or one in letters)):
        word = re.sub(r"[\s^]|(0-)?\b(pp|p-p|pk-?pk|pk|peak|rms)\b", "", text.lower()).replace("²", "2")
        found += [STATED[word]] if word in STATED else []
    return next((unit for unit in found if unit not in NOT_READ), next(iter(found), None))


def angle_in(name):
    """Angle (degrees) of a probe from straight up, positive to the left, by a name such as `1X`, `45L`, `DE vert`.

    X is taken to be 45 degrees to the right of the top and Y to the left of it, as API 670 has it. None without a word.
    """
    words = words_in(name)
    for before, word in zip(["", *words], words, strict=False):
        if word in LEFT | RIGHT:
            size = float(before) if before[:1].isdigit() and float(before) >= LEAST_ANGLE else 45.0
            return size if word in LEFT else -size
    found = [DIRECTIONS[word] for word in words if word in DIRECTIONS]
    return found[-1] if len(found) == 1 else None


def numbered_angles(names):
    """Planes and angles (degrees, from straight up, positive to the left) of probes named by angles: `DE 45`, `DE 135`.

    The numbers count from the horizontal on the right if none is beyond 180, else from straight up. None unless each
    name has one number, and the two of a plane are 90 degrees apart.
    """
    planes, angles = [], []
    for name in names:
        words = words_in(name)
        numbers = [word for word in words if word[:1].isdigit() and LEAST_ANGLE <= float(word) <= 360]
        if len(numbers) != 1:
            return None
        planes.append(tuple(word for word in words if word != numbers[0]))
        angles.append(float(numbers[0]))
    apart = [[a for p, a in zip(planes, angles, strict=True) if p == plane] for plane in dict.fromkeys(planes)]
    pairs = [one for one in apart if len(one) > 1]
    if not pairs or any(len(one) > 2 or abs(one[0] - one[1]) % 180 != 90 for one in pairs):
        return None
    zero = 90 if max(angles) <= 180 else 0
    return planes, [(angle - zero + 180) % 360 - 180 for angle in angles]


def plane_in(name):
    """The words of a name that say neither direction nor unit, equal for the probes of a node."""
    words = words_in(name)
    sides = [word for word in words if word in LEFT | RIGHT]
    large = {word for word in words if sides and word[:1].isdigit() and float(word) >= LEAST_ANGLE}
    unit = set() if unit_in(name) is None else set(UNIT_OF)
    return tuple(word for word in words if word not in {*DIRECTIONS, *LEFT, *RIGHT, *large, *unit, *PEAK})
