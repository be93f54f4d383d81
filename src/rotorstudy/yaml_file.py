"""Read YAML files that may come from anyone: bounded in size, depth and expansion; plain numbers, texts and lists."""

import re
from pathlib import Path

import yaml

from rotorstudy.errors import RotorstudyError, unknown_name

MOST_BYTES = 5_000_000
MOST_VALUES = 200_000  # aliases and merge keys written out
DEEPEST = 40  # lists and mappings within each other
LARGEST_WHOLE = 10**15  # exactly a floating-point number; longer ones are slow to read
KINDS = {str: "text", list: "list", int: "number", float: "number"}
# several times faster where the installed package has the one in C
SafeLoader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
NUMBER = re.compile(r"[-+]?(\d[\d_]*\.?[\d_]*|\.\d[\d_]*)[eE][-+]?\d+$")


def read_yaml(path):
    """A YAML file as a dict."""
    path = Path(path)
    if path.is_dir():
        raise RotorstudyError(f"'{path}' is a folder; give a YAML file in it")
    if not path.is_file():
        raise RotorstudyError(f"file '{path}' does not exist")
    if path.stat().st_size > MOST_BYTES:
        raise RotorstudyError(f"{path}: larger than {MOST_BYTES / 1e6:g} MB; a configuration is a short text")
    try:
        text = path.read_text(encoding="utf-8")
        _check_depth(text)
        loader = Loader(text)
        node = loader.get_single_node()
        _check_expansion(node)
        found = loader.construct_document(node) if node is not None else None
    except (yaml.YAMLError, ValueError, KeyError) as error:  # of a value that its tag does not allow, the last two
        place = getattr(error, "problem_mark", None)
        at = f" line {place.line + 1}" if place else ""
        what = " ".join(str(getattr(error, "problem", None) or error).split())
        what = "it is not in UTF-8; save it as such a text" if isinstance(error, UnicodeDecodeError) else what
        if place and re.match(" *\t", text.split("\n")[place.line]):
            what = "the line begins with a tab; indent it with spaces"
        raise RotorstudyError(f"{path}{at}: not valid YAML: {what}") from None
    if not isinstance(found, dict):
        what = f"found a {KINDS.get(type(found), 'value')}; is it the right file?"
        what = "the file is empty" if found is None else what
        raise RotorstudyError(f"{path}: expected keys and values, {what}")
    return found


def read_study(path):
    """The YAML file of a study; one with `based_on: FILE` states only what differs (null leaves a key out)."""
    found = read_yaml(path)
    return _changed(read_yaml(base), found, path) if (base := base_of(path, found)) else found


def base_of(path, found):
    """The file that a study is based on, taken out of what was found in its file; None for most."""
    base = found.pop("based_on", None)
    if not isinstance(base, str | None):
        raise RotorstudyError(f"{path}, based_on: {base!r} is not the name of a file")
    return base and Path(path).parent / base


def _changed(base, changes, path):
    both = dict(base)
    for key, new in changes.items():
        if new is not None:
            inside = isinstance(new, dict) and isinstance(base.get(key), dict)
            both[key] = _changed(base[key], new, path) if inside else new
        elif both.pop(key, None) is None:
            raise unknown_name("key to leave out", key, base, str(path))
    return both


def _check_depth(text):
    """Raise if lists and mappings are nested too deeply for the reader, which calls itself for each."""
    depth = 0
    for event in yaml.parse(text, Loader=SafeLoader):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if depth > DEEPEST:
            raise _refused(f"more than {DEEPEST} lists and mappings within each other", event.start_mark)


def _check_expansion(root):
    """Raise if the values, aliases written out, are too many, or one contains itself."""
    sizes = {}  # of each node, 0 while its parts are counted

    def size(node):
        if id(node) not in sizes:
            sizes[id(node)] = 0
            children = node.value if isinstance(node, yaml.CollectionNode) else []
            if isinstance(node, yaml.MappingNode):
                children = [part for pair in children for part in pair]
            sizes[id(node)] = 1 + sum(map(size, children))
            if sizes[id(node)] > MOST_VALUES:
                raise _refused(f"more than {MOST_VALUES} values with the aliases written out", node.start_mark)
        elif not sizes[id(node)]:
            raise _refused("an alias contains itself", node.start_mark)
        return sizes[id(node)]

    if root is not None:
        size(root)


def _refused(problem, mark):
    return yaml.constructor.ConstructorError(None, None, problem, mark)


class Loader(SafeLoader):
    """YAML's safe loader, with an error for a key given twice, for dates and for numbers not decimal or huge.

    50e-6 and 2e5 are read as the numbers they are; YAML 1.1 takes them as text, for lack of a point or of a sign.
    """

    def construct_mapping(self, node, deep=False):
        seen = set()
        for key, value in node.value:
            if key.tag.endswith(":bool"):  # `on:`, a truth to YAML 1.1
                key.tag = "tag:yaml.org,2002:str"
            if not isinstance(key, yaml.ScalarNode) or key.tag.rsplit(":")[-1] in ("null", "float"):
                raise _refused("a key must be a text or a whole number", key.start_mark)
            if value.value == "" and value.tag.endswith(":null") and re.search(r":|^\d+$", key.value):
                what = "write a space after a colon, and numbers with a decimal point, not a comma"
                raise _refused(f"'{key.value}' has no value; {what}", key.start_mark)
            if key.value in seen:
                raise _refused(f"key '{key.value}' is given twice", key.start_mark)
            seen.add(key.value)
        return super().construct_mapping(node, deep)

    def decimal(self, node):
        if re.search(r"^[-+]?0[\dbox]|[_:]", node.value):  # 010, 0x10 and 1:30 are 8, 16 and 90 to YAML 1.1
            raise _refused(f"'{node.value}': write a number in decimal digits, a text in quotes", node.start_mark)
        return self.construct_yaml_float(node)

    def whole(self, node):
        if len(node.value) > 30 or abs(value := self.decimal(node)) > LARGEST_WHOLE:
            raise _refused(f"whole number beyond {LARGEST_WHOLE:.0e}", node.start_mark)
        return int(value)

    def unusual(self, node):
        raise _refused(f"a value of type {node.tag.rsplit(':')[-1]}; write a text in quotes", node.start_mark)


Loader.add_implicit_resolver("tag:yaml.org,2002:float", NUMBER, list("-+.0123456789"))
Loader.add_constructor("tag:yaml.org,2002:int", Loader.whole)
Loader.add_constructor("tag:yaml.org,2002:float", Loader.decimal)
for name in ("timestamp", "binary", "set", "omap", "pairs"):
    Loader.add_constructor(f"tag:yaml.org,2002:{name}", Loader.unusual)
