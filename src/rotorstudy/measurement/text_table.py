"""Text files of columns: their layout, stated or guessed, and rows that are all as wide as the header."""

import codecs
import csv
import io
import json
import re
import warnings
from array import array
from collections import Counter, deque
from contextlib import suppress
from itertools import islice
from pathlib import Path

import numpy as np
import pandas as pd

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.channel_names import is_unit
from rotorstudy.measurement.conventions import WHITESPACE, CsvLayout

LINES = 400  # read for a guess
FIRST = 1 << 16  # bytes, of which one at least is no space
ROWS = 3  # at least of data
LARGEST_VALUE = 1e100  # its square is a number
LARGEST_WHOLE = 10**9  # of a node or a harmonic
LONGEST = 1000  # characters in a cell of a table
MOST_COLUMNS = 5000  # a table of 250 probes with ten harmonics each
SEPARATORS = (";", "\t", ",", "|", ":", WHITESPACE[0])
CLOCK = re.compile(r"\d:\d\d:\d\d")  # a time of day, which ":" does not divide into columns
COMMENTS = ("#", "%", "//")  # at the start of lines between the rows
MISSING = {"", "nan", "-nan", "na", "n/a", "n.a.", "#n/a", "#na", "<na>", "null", "none", "-", "--", "---"}
MISSING |= {"1.#ind", "-1.#ind", "1.#qnan", "-1.#qnan"}  # instead of a reading, in lower case
NO_UNIT = {"", "-", "1", "°"}  # in rows of units
COMMENT = "comment"  # the last column of LabVIEW, whose cells are left out in rows without one


def guess_layout(path):
    """The CsvLayout of a text file with one row of names and rows of numbers below it."""
    with _opened(path) as file:
        lines = list(islice(file, LINES))
    separators = [one for one in SEPARATORS if one != ":" or not any(map(CLOCK.search, lines))]
    ways = [(separator, decimal) for separator in separators for decimal in (".", ",")]
    (_, rows), separator, decimal = max(((_table(lines, *way), *way) for way in ways), key=lambda found: found[0][0])
    if len(rows) < ROWS or rows[0] == 0:
        raise RotorstudyError(
            f"{path}: no table of numbers below a row of names in its first {LINES} lines; it needs a header and "
            f"{ROWS} rows"
        )
    first = cells_in(lines[rows[0]], separator)
    narrowest, widest = len(_trimmed(first)), len(first)
    above = [_names(line, separator) for line in lines[: rows[0]]]
    widths = [len(cells) - ("".join(cells[-1:]).lower() == COMMENT) for cells in above]
    named = [narrowest <= width <= widest for width in widths]
    header = rows[0] - 1
    while header > 0 and not named[header] and (not above[header] or lines[header].lstrip().startswith(COMMENTS)):
        header -= 1
    if not named[header]:
        raise RotorstudyError(
            f"{path}, line {rows[0] + 1}: the row has {narrowest} cells, and the line above it names "
            f"{len(above[header])} columns; each column needs a name"
        )
    while header > 0 and named[header - 1] and _are_units(above[header]):  # units, not names
        header -= 1
    return CsvLayout(separator=separator, decimal=decimal, skip_rows=header, unit_rows=rows[0] - header - 1)


def layout_hint(path, stated):
    """'; it looks like csv: {separator: ";"}' if a text file looks otherwise than its CsvLayout states, else ''."""
    with suppress(RotorstudyError):
        if (found := guess_layout(path)) != stated:
            other = json.dumps(found.model_dump(exclude_defaults=True))
            return "; leave 'csv:' out" if other == "{}" else f"; the file looks like 'csv: {other}' in 'measurement:'"
    return ""


def header_of(path, layout):
    """Names of the columns, the text of the row of units below each, and the number of lines above the numbers."""
    with _opened(path) as file:
        above = deque(islice(file, layout.skip_rows), maxlen=1)
        lines = enumerate(file, start=layout.skip_rows + 1)
        header, names = next(((i, cells) for i, line in lines if (cells := _names(line, layout.separator))), (0, None))
        below = list(islice(lines, layout.unit_rows))
    if names is None:
        raise RotorstudyError(f"{path}: no header from line {layout.skip_rows + 1} on; check 'csv: skip_rows'")
    units = []
    for number, line in below:
        cells = _names(line, layout.separator)
        numeric = sum(_is_number(cell, layout.decimal) and cell != "1" for cell in cells)
        are_numbers = numeric and numeric >= sum(map(bool, cells)) / 2
        if are_numbers and not line.lstrip().startswith(COMMENTS):
            raise RotorstudyError(f"{path}, line {number}: numbers, and not units; correct 'csv: unit_rows'")
        units = units or ([] if are_numbers else cells)
    if len(names) > MOST_COLUMNS:
        raise RotorstudyError(f"{path}: {len(names)} columns, at most {MOST_COLUMNS} are read; is a row a sample?")
    for before in (_names(line, layout.separator) for line in above):
        units = units or (before if len(before) == len(names) and _are_units(before) else [])
    names = [name or f"Unnamed: {i}" for i, name in enumerate(names)]
    count = Counter(names)  # a rig file has to say which one it means
    names = [f"{name} #{names[: i + 1].count(name)}" if count[name] > 1 else name for i, name in enumerate(names)]
    return names, [*units, *[""] * len(names)][: len(names)], header + layout.unit_rows


def rows_of(path, layout):
    """(number of the line, cells) of each row, blank lines and comments left out; RotorstudyError for another width."""
    names, _, above = header_of(path, layout)
    with _opened(path) as file:
        for number, line in enumerate(islice(file, above, None), start=above + 1):
            cells = cells_in(line, layout.separator)
            if len(cells) == len(names) - 1 and names[-1].lower() == COMMENT:
                cells = [*cells, ""]
            cells = cells if len(cells) == len(names) or any(cells[len(names) :]) else cells[: len(names)]
            if not any(cells) or cells[0].startswith(COMMENTS):
                continue
            if len(cells) != len(names) or "\0" in line or ('"' in line and line.count('"') % 2):
                wrong = f"{len(cells)} cells, and the header names {len(names)} columns"
                wrong = wrong if len(cells) != len(names) else "a quote that is not closed, or a NUL"
                cure = f"correct the line, or check 'csv:' in the rig file{layout_hint(path, layout)}"
                cure = cure if next(file, None) else "the file is cut off: remove its last line"
                raise RotorstudyError(f"{path}, line {number}: {wrong}; {cure}")
            yield number, cells


def numbers_in(path, layout):
    """(row, column) numbers of a text file, NaN for missing readings; {column: (line, cell) of its first text}."""
    names, _, above = header_of(path, layout)
    if layout.decimal == ".":  # numpy reads a table without gaps several times faster, and refuses any other
        separator = None if layout.separator in WHITESPACE else layout.separator
        refused = suppress(ValueError, UserWarning)  # a warning for a table without rows
        with _opened(path) as file, warnings.catch_warnings(action="error"), refused:
            rows = islice(file, above, None)
            found = np.loadtxt(rows, comments=None, delimiter=separator, quotechar='"', ndmin=2)
            if found.shape[1] == len(names):
                return found, {}
    values, wrong = array("d"), {}
    for line, cells in rows_of(path, layout):
        for column, cell in enumerate(cells):
            try:
                values.append(number(cell, layout.decimal))
            except ValueError:
                values.append(np.nan)
                if cell.lower() not in MISSING:
                    wrong.setdefault(names[column], (line, cell))
    return np.frombuffer(values).reshape(-1, len(names)) if values else np.zeros((0, len(names))), wrong


def text_in(path, layout):
    """The cells of a text file as a data frame of texts by the line, with decimal points; empty columns left out."""
    lines, rows = [], []
    for line, cells in rows_of(path, layout):
        if any(len(cell) > LONGEST for cell in cells):
            raise RotorstudyError(f"{path}, line {line}: a cell of more than {LONGEST} characters; correct it")
        lines.append(line)
        rows.append([_with_point(cell, f"{path}, line {line}") for cell in cells] if layout.decimal == "," else cells)
    if not rows:
        raise RotorstudyError(f"{path}: a table without rows below its header; leave the file out")
    text = pd.DataFrame(rows, index=lines, columns=header_of(path, layout)[0], dtype=str)
    return text[[name for name in text if not name.startswith("Unnamed: ") or text[name].any()]]


def numbers_of(text, column, path, may_lack=False):
    """(row,) numbers of a column; may_lack : whether readings may be missing, which are NaN."""
    numbers = []
    for line, cell in text[column].items():
        try:
            numbers.append(np.nan if may_lack and cell.lower() in MISSING else number(cell))
        except ValueError:
            cure = "correct it, or leave the cell empty if the reading is missing" if may_lack else "correct it"
            raise RotorstudyError(f"{path}, line {line}, column '{column}': '{cell}' is not a number; {cure}") from None
    if not may_lack and not (np.abs(numbers) <= LARGEST_VALUE).all():
        raise RotorstudyError(f"{path}: column '{column}' has values that are not finite, or beyond {LARGEST_VALUE:g}")
    return np.array(numbers)


def whole_numbers(text, column, path):
    """(row,) whole numbers of a column."""
    numbers = numbers_of(text, column, path)
    if not (numbers == np.rint(numbers)).all() or (np.abs(numbers) > LARGEST_WHOLE).any():
        raise RotorstudyError(f"{path}: column '{column}' must hold whole numbers, at most {LARGEST_WHOLE}")
    return numbers.astype(int)


def number(cell, decimal="."):
    """The number in a cell; ValueError if it is none. Digits in groups are none: 1.234 may be meant as 1234."""
    if decimal == ",":
        cell = "" if "." in cell else cell.replace(",", ".")
    return float("" if "_" in cell else cell)


def cells_in(line, separator):
    """The cells of a line, without the spaces around them."""
    if separator in WHITESPACE:
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    try:
        return [cell.strip().strip('"').strip() for cell in next(csv.reader([line], delimiter=separator), [""])]
    except csv.Error:  # a cell of more than 100,000 characters
        return [line]


def _opened(path):
    """A file as text, see `decoded`."""
    return decoded(Path(path).open("rb"), path)


def decoded(file, path):
    """An open file of bytes as text without its byte order mark: UTF-8, UTF-16, or else Windows-1252."""
    first = file.read(FIRST)
    file.seek(0)
    packed = first.startswith((b"PK\3\4", b"\x1f\x8b"))
    if packed or not first.strip():
        file.close()
        wrong = "a workbook or a compressed file; export it as text, or unpack it"
        raise RotorstudyError(f"{path}: {wrong if packed else 'the file is empty; export it again, or leave it out'}")
    if first.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    elif b"\0" in first[:2]:
        encoding = "utf-16-be" if first[0] == 0 else "utf-16-le"
    else:
        try:
            codecs.getincrementaldecoder("utf-8")().decode(first)
            encoding = "utf-8-sig"
        except UnicodeDecodeError:
            encoding = "cp1252"
    return io.TextIOWrapper(file, encoding, errors="replace")


def _with_point(cell, where):
    """A cell of a table with decimal commas: a number with a decimal point."""
    if _is_number(cell, ","):
        return cell.replace(",", ".")
    if _is_number(cell, ".") and re.search(r"\d", cell):
        raise RotorstudyError(f"{where}: '{cell}' has a point, and the decimal sign is ','; correct it")
    return cell


def _table(lines, separator, decimal):
    """The longest run of rows of numbers: how many of its cells are numbers, times their share; its lines (from 0)."""
    best, rows, score = (0.0, []), [], 0.0
    for i, line in enumerate(lines):
        cells = cells_in(line, separator)
        if not any(cells) or cells[0].startswith(COMMENTS):
            continue
        numeric, filled = sum(_is_number(cell, decimal) for cell in cells), sum(map(bool, cells))
        if not numeric or numeric < filled / 2:
            rows, score = [], 0.0
            continue
        rows, score = [*rows, i], score + numeric**2 / filled
        best = max(best, (score, rows), key=lambda found: found[0])
    return best


def _is_number(cell, decimal):
    try:
        number(cell, decimal)
    except ValueError:
        return False
    return True


def _are_units(cells):
    """Whether cells are units, and no names."""
    return all(cell in NO_UNIT or is_unit(cell) for cell in cells)


def _trimmed(cells):
    """Cells without the empty ones at the end."""
    while cells and not cells[-1]:
        cells = cells[:-1]
    return cells


def _names(line, separator):
    """The names in a header, without the sign that makes it a comment where spaces separate the names."""
    cells = _trimmed(cells_in(line, separator))
    return cells[1:] if separator in WHITESPACE and cells[:1] and cells[0] in COMMENTS else cells
