"""Everything in `rotorstudy.__all__` says in numpydoc form what it takes, gives and raises, with shapes and units.

ruff compares sections with signatures (D417, DOC) and looks for hints (ANN); what it cannot know, that an array states
its shape by dimension names and its unit, is looked for here.
"""

import ast
import inspect
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import rotorstudy

RULES = "D1,D2,D3,D4,DOC,ANN"
IGNORED = "D107,D105,D203,D205,D212,D213,D400,D401,D413,D415,D416,DOC502,ANN202,ANN204,ANN401"
# blank lines, mood and full stop of the first line are left to the writer, as are private and special methods; DOC502
# would forbid to state an error that a function called inside raises
DIMENSION = (
    "speed|harmonic|sensor|node|element|dof|coordinate|component|row|parameter|unknown|name|mode|time|revolution|trial"
)
AXIS = rf"(?:\.\.\.|1|(?:{DIMENSION})(?: \* (?:{DIMENSION}))?)"
SHAPE = re.compile(rf"\({AXIS}(?:, {AXIS})*,?\)")
UNIT = re.compile(r"\b(?:m|rad|rad/s|s|N|N/m|1/s|kg|SI|unit|units|int|1|share|shares|variance)\b")
ARRAYS = ("ArrayLike", "ndarray")


def public():
    """(name, file, first line, last line) of every function and class in `rotorstudy.__all__`."""
    for name in rotorstudy.__all__:
        found = getattr(rotorstudy, name)
        if inspect.isclass(found) or inspect.isfunction(inspect.unwrap(found)):
            lines, first = inspect.getsourcelines(inspect.unwrap(found))
            yield name, inspect.getsourcefile(inspect.unwrap(found)), first, first + len(lines) - 1


def complaints_of(files):
    """What ruff says of files: (file, line, text)."""
    found = subprocess.run(
        [sys.executable, "-m", "ruff", "check", "--isolated", "--preview", "--select", f"{RULES},D417",
         "--ignore", IGNORED, "--config", 'lint.pydocstyle.convention="numpy"', "--output-format", "json", *files],
        capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    assert found.stdout, found.stderr
    return [
        (m["filename"], m["location"]["row"], f"{m['code']} {m['message']}")
        for m in json.loads(found.stdout)
        if not re.search("exception `[a-z_]", m["message"])  # a function that makes an error, not one
    ]


def private_lines(text):
    """Lines of private functions, and of those inside a function."""
    tree = ast.parse(text)
    every = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    inner = [f for node in every for f in ast.walk(node) if f != node and isinstance(f, ast.FunctionDef)]
    hidden = [node for node in every if node.name.startswith("_")] + inner
    return {line for node in hidden for line in range(node.lineno, node.end_lineno + 1)}


def silent_arrays(text, first=1, last=10**9):
    """Array arguments and results whose description lacks a shape by dimension names, or a unit."""
    hidden = private_lines(text)
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.FunctionDef) or node.lineno in hidden or not first <= node.lineno <= last:
            continue
        said = ast.get_docstring(node) or ""
        given = {one.split(" :")[0]: one for one in re.split(r"\n(?=\S)", section(said, "Parameters"))}
        arrays = [
            (a.arg, given.get(a.arg, "")) for a in [*node.args.args, *node.args.kwonlyargs] if is_array(a.annotation)
        ]
        if is_array(node.returns):
            is_property = any("property" in ast.unparse(d) for d in node.decorator_list)
            arrays.append(("result", said if is_property else section(said, "Returns")))
        for name, words in arrays:
            if not (SHAPE.search(words) and UNIT.search(words)):
                yield f"{node.name}: {name} lacks its shape or unit: {' '.join(words.split())!r}"


def is_array(hint):
    return hint is not None and any(kind in ast.unparse(hint) for kind in ARRAYS)


def section(docstring, heading):
    """The text of a section of a numpydoc docstring, "" without it."""
    _, _, rest = docstring.partition(f"\n{heading}\n{'-' * len(heading)}\n")
    return re.split(r"\n[\w ]+\n-+\n", rest)[0]


PUBLIC = list(public())


@pytest.fixture(scope="module")
def complaints():
    return complaints_of(sorted({file for _, file, _, _ in PUBLIC}))


@pytest.mark.parametrize(("name", "file", "first", "last"), PUBLIC, ids=[name for name, *_ in PUBLIC])
def test_a_public_object_is_documented_in_full(complaints, name, file, first, last):
    text = Path(file).read_text()
    lines = set(range(first, last + 1)) - private_lines(text)
    said = [wrong for where, line, wrong in complaints if where == file and line in lines]
    assert said + list(silent_arrays(text, first, last)) == []


WRONG = '''"""Doc."""
from numpy.typing import ArrayLike


def load(speed: ArrayLike, node):
    """Force of a load.

    Parameters
    ----------
    speed : array
        How fast it turns.
    """
    if node:
        raise ValueError
    return speed
'''


def test_what_is_missing_is_found(tmp_path):
    path = tmp_path / "wrong.py"
    path.write_text(WRONG)
    said = " ".join(text for _, _, text in complaints_of([path]))
    assert all(code in said for code in ("D417", "DOC201", "DOC501", "ANN001", "ANN201"))
    assert list(silent_arrays(WRONG)) == ["load: speed lacks its shape or unit: 'speed : array How fast it turns.'"]
    right = WRONG.replace(" : array\n        How", " : array (speed,)\n        In rad/s, how")
    assert list(silent_arrays(right)) == []
