"""What names of channels say about a probe: its plane, its direction, its unit."""

import re

WORDS = {  # of each unit that is read
    "um": "um µm μm micron microns micrometer micrometre micrometers micrometres",
    "mil": "mil mils thou",
    "mm": "mm millimeter millimetre millimeters millimetres",
    "m": "m meter metre meters metres",
    "V": "v volt volts",
    "s": "s sec second seconds",
    "ms": "ms msec millisecond milliseconds",
    "rpm": "rpm rev cpm r/min rev/min 1/min min-1",
    "Hz": "hz",
    "rad/s": "rad rad/s",
    "m/s": "m/s",
    "mm/s": "mm/s",
    "in/s": "in/s inch/s inches/s ips",
    "m/s2": "m/s2",
    "g": "g",
}
NOT_READ = (  # units of other quantities or sizes, in which no channel is read
    "nm cm dm km in inch inches ft uin µin us µs μs usec ns min hr hour hours minute minutes day days khz krpm rps 1/s "
    "rev/s deg/s cm/s ft/s deg kv ma mv mvolt a db % counts bar mbar psi pa kpa mpa n kn w kw mw degc °c degf °f k kg "
    "lb lbf kgf"
)
UNIT_OF = {word: unit for unit, words in WORDS.items() for word in words.split()} | {w: w for w in NOT_READ.split()}
SIGNALS = ("um", "mil", "mm", "m", "V", "s", "ms", "rpm", "Hz", "rad/s")  # of a probe, of time or of speed
SHORT = {word for word in UNIT_OF if len(word) < 2} | {  # words that mean other things outside of brackets
    "in", "ft", "pa", "rad", "rev", "deg", "min", "hour", "hours", "minute", "minutes", "day", "days", "bar", "second",
}  # fmt: skip
CLEAR = ("um", "mil", "mm", "ms", "rpm", "m/s", "mm/s", "in/s")  # at the end of a name, too; 100 Hz may be a filter's
_TOP = r"(?:peak|pk|p)"
KINDS = {  # what says of which kind an amplitude or a phase is, the first that is found
    "peak_to_peak": rf"s?{_TOP}[\s/-]*(?:to|2)?[\s-]*{_TOP}|ss|da",
    "rms": "rms|eff",
    "peak": rf"(?:0|zero)[\s/-]*(?:to)?[\s-]*{_TOP}|pk|peak",
    "lag": "lag(?:ging)?|delay",
    "lead": "lead(?:ing)?",
}
_BEFORE = r"(?:\b|(?<=[a-zµμ]{2})|(?<=\bv))"
KIND = re.compile(rf"{_BEFORE}(?:{'|'.join(KINDS.values())}|dc)\b")
SCALED = re.compile(r"[\d/*·×^%]|\bper\b|\bx\b")  # makes another unit of one: um/s, mil x 10
SCALED_NAME = re.compile(r"[*·×/]\s*10+\b|\bx\s*10{2,}\b(?!\s*k?hz)|\b10\s*(\^|\*\*)")  # but x10: of bearing 10
AT_THE_END = re.compile(r"[\s_.,:;-]([a-zµμ]+(?:/s)?)$")
SPEED_WORDS = {"rpm", "speed", "drehzahl", "rev", "cpm"}
PEAK = {"pp", "pk", "p", "rms"}
LEFT, RIGHT = {"l", "left"}, {"r", "right"}
LEAST_ANGLE = 15  # degrees; a smaller number beside "left" counts probes
DIRECTIONS = {"x": -45.0, "y": 45.0} | dict.fromkeys(("v", "vert", "vertical"), 0.0)
DIRECTIONS |= dict.fromkeys(("h", "hor", "horiz", "horizontal"), -90.0)


def words_in(name):
    """Words and numbers of a name in lower case: `Brg1_X [um]` -> brg, 1, x, um."""
    return re.findall(r"[^\W\d_]+|\d+(?:\.\d+)?", name.lower())


def unit_in(name, stated=""):
    """Unit of a signal by its name and the text below it; None if neither says one, "other" for another quantity."""
    (unit,) = stated_units([name], [stated])
    held = [UNIT_OF[word] for word in words_in(name) if word in UNIT_OF and word not in SHORT]
    unit = unit or (held[-1] if held else None)
    return unit if unit is None or unit in SIGNALS else "other"


def unit_of(text):
    """The unit that a text such as `mil pp` says, as the text itself if it is in no known form; None without one."""
    if is_unit(text):
        return UNIT_OF[bare(text)]
    words = KIND.sub(" ", text.lower().replace("_", " "))
    held = {UNIT_OF[word] for word in words_in(words) if word in UNIT_OF and word not in SHORT}
    return held.pop() if len(held) == 1 and not SCALED.search(words) else text.strip() if held else None


def is_unit(text):
    """Whether a text is a unit, and nothing else."""
    return bare(text) in UNIT_OF


def kind_in(text, kinds):
    """The one of some KINDS that a text says, or None."""
    text = text.lower().replace("_", " ")
    return next((kind for kind in kinds if re.search(rf"{_BEFORE}(?:{KINDS[kind]})\b", text)), None)


def bare(text):
    """A text without brackets, and without what says of which kind an amplitude or a phase is."""
    text = re.sub(r"/\s*sec(onds?)?\b", "/s", text.lower().replace("_", " ").replace("²", "2"))
    return re.sub(r"[\s^\[\](),;]", "", KIND.sub(" ", text))


def stated_units(names, below):
    """The units that headers have in brackets or at their end, or the texts below; (V) beside (H) is a direction."""
    letters = "smg" if any(re.search(r"[\[(][Hh][\])]", name) for name in names) else "smgV"
    return [_stated(name, text, letters) for name, text in zip(names, below, strict=True)]


def _stated(name, below, letters):
    """The unit of a column, one that is read preferred; `DE (NS) (um)` names the plane first."""
    bracketed = [one for one in re.findall(r"[\[(]([^\])]*)[\])]", name) if len(one) != 1 or one in letters]
    found = [unit for text in (below, *bracketed) if (unit := unit_of(text))]
    last = AT_THE_END.search(KIND.sub("", name.lower()).strip())
    found += [UNIT_OF[last[1]]] if last and UNIT_OF.get(last[1]) in CLEAR and last[1] not in SHORT else []
    held = {word for word in words_in(name) if word in UNIT_OF and word not in SHORT}
    if (found or held) and SCALED_NAME.search(name.lower()):
        return name
    return next((unit for unit in found if unit in WORDS), next(iter(found), None))


def as_known(names, known):
    """The names, as known where a unit in brackets is the only difference: `DE X (um)` as `DE X`; not if two are so."""
    stems, own = _without_units(names), _without_units(known)
    meant = {stem: one for stem, one in zip(own, known, strict=True) if own.count(stem) == 1 and one not in names}
    return [n if n in known or stems.count(s) > 1 else meant.get(s, n) for n, s in zip(names, stems, strict=True)]


def _without_units(names):
    """Names without their units in brackets, of those that are read: NS may be a side."""
    bracket, units = r"\s*[\[(]([^\])]*)[\])]", stated_units(names, [""] * len(names))
    return [
        re.sub(bracket, lambda text, unit=unit: "" if unit in WORDS and unit_of(text[1]) == unit else text[0], name)
        for name, unit in zip(names, units, strict=True)
    ]


def angle_in(name):
    """Angle (degrees) of a probe from straight up, positive to the left, by a name such as `1X`, `45L`, `DE vert`.

    X is taken to be 45 degrees to the right of the top and Y to the left of it, as API 670 has it. None without a word.
    """
    words = words_in(name)
    for before, word in zip(["", *words], words, strict=False):
        if word in LEFT | RIGHT:
            size = float(before) if before[:1].isdecimal() and float(before) >= LEAST_ANGLE else 45.0
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
        numbers = [word for word in words if word[:1].isdecimal() and LEAST_ANGLE <= float(word) <= 360]
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
    large = {word for word in words if sides and word[:1].isdecimal() and float(word) >= LEAST_ANGLE}
    unit = set() if unit_in(name) is None else set(UNIT_OF)
    return tuple(word for word in words if word not in {*DIRECTIONS, *LEFT, *RIGHT, *large, *unit, *PEAK})
