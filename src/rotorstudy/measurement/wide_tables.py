"""Tables of amplitude and phase with a column for each probe and harmonic, as monitoring systems export them.

    Speed (rpm),DE X 1X Amp (mil pp),DE X 1X Phase (deg),DE X 2X Amp (mil pp),DE X 2X Phase (deg),DE Y 1X Amp ...

They become tables of a probe's amplitude and phase, with a row for each (`probe_tables`).
"""

import re
from typing import NamedTuple

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.channel_names import SPEED_WORDS, UNIT_OF, words_in

QUANTITY = re.compile(
    r"(?P<probe>.+?)[\s_:,;/-]+(?P<harmonic>\d+)x?[\s_:,;/-]*(?P<what>amp|mag|pha?s)[a-z]*\b(?P<unit>.*)", re.IGNORECASE
)
SPEED_UNITS = {"rpm": "rpm", "Hz": "Hz", "rad/s": "rad_per_s"}
SIZES = {  # words of a unit -> how the amplitude is stated
    "peak_to_peak": re.compile(r"\b(pp|p-p|pk-?pk|p2p|peak.to.peak)\b", re.IGNORECASE),
    "rms": re.compile(r"\brms\b", re.IGNORECASE),
    "peak": re.compile(r"\b(pk|0-p|0-pk|peak)\b", re.IGNORECASE),
}
TURNS = {"lag": re.compile(r"\blag", re.IGNORECASE), "lead": re.compile(r"\blead", re.IGNORECASE)}


class WideTable(NamedTuple):
    """The columns of a wide table.

    speed : (column, unit as in `speed_rpm`)
    pairs : {(probe, harmonic): (column of the amplitude, column of the phase)}
    units : of the amplitude and of the phase, as in `amplitude_mil`
    size, turn : how the headers state amplitudes (a value of `table_amplitude`) and phases (`table_phase`), or None
    """

    speed: tuple[str, str]
    pairs: dict
    units: tuple[str, str]
    size: str | None
    turn: str | None

    @property
    def columns(self):
        """Names of the columns of the table with a row for each probe and harmonic."""
        return [f"speed_{self.speed[1]}", "probe", "harmonic", f"amplitude_{self.units[0]}", f"phase_{self.units[1]}"]


def wide_table(names):
    """The WideTable of columns with these names, or None if they are those of another file.

    Every amplitude needs its phase, and all of a kind one unit.
    """
    found = {}
    for name in names:
        match = QUANTITY.fullmatch(name)
        if match:
            what = "phase" if match["what"].lower().startswith("ph") else "amplitude"
            found.setdefault((match["probe"].strip(), int(match["harmonic"])), {})[what] = (name, match["unit"])
    speed = _speed(names)
    pairs = {key: (own["amplitude"], own["phase"]) for key, own in found.items() if len(own) == 2}
    if speed is None or not pairs or len(pairs) < len(found):
        return None
    sizes, turns = ({texts[i][1] for texts in pairs.values()} for i in (0, 1))
    lengths, angles = {_unit(text, ("m", "mm", "um", "mil")) for text in sizes}, {_angle(text) for text in turns}
    if len(lengths) > 1 or len(angles) > 1 or None in lengths:
        return None
    return WideTable(
        speed,
        {key: (amplitude[0], phase[0]) for key, (amplitude, phase) in pairs.items()},
        (lengths.pop(), angles.pop()),
        _stated(SIZES, sizes),
        _stated(TURNS, turns),
    )


def in_rows(text, table):
    """A wide table (a data frame of text) with a row for each speed, probe and harmonic that is complete."""
    import pandas as pd

    rows = [
        (speed, probe, str(harmonic), *cells)
        for i, speed in enumerate(text[table.speed[0]])
        for (probe, harmonic), names in table.pairs.items()
        if all(cells := [text[name][i] for name in names])
    ]
    return pd.DataFrame(rows, columns=table.columns)


def check_stated(table, conventions, path):
    """Raise RotorstudyError if the headers of a wide table contradict the rig file."""
    for key, own, stated in (
        ("table_amplitude", table.size, conventions.table_amplitude),
        ("table_phase", table.turn, conventions.table_phase),
    ):
        if own not in (None, stated):
            raise RotorstudyError(
                f"{path}: its header says {own.replace('_', ' ')}, and 'measurement: {key}:' of the rig file is "
                f"{stated}; state '{key}: {own}'"
            )


def _speed(names):
    """(name, unit) of the first column of a speed, or None."""
    for name in names:
        if any(word in SPEED_WORDS for word in words_in(name)):
            unit = _unit(name, SPEED_UNITS)
            if unit:
                return name, SPEED_UNITS[unit]
    return None


def _unit(text, known):
    """The first of some units that a text names, or None."""
    return next((UNIT_OF[word] for word in words_in(text) if UNIT_OF.get(word) in known), None)


def _angle(text):
    return "rad" if "rad" in words_in(text) else "deg"


def _stated(words, texts):
    """The first of some words that the texts of units say."""
    return next((name for name, word in words.items() if any(word.search(text) for text in texts)), None)
