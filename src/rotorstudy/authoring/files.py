"""Write a new plugin file from a template, and check the invariants of a plugin file."""

import tokenize
from keyword import iskeyword
from pathlib import Path

from rotorstudy.errors import PluginError, RotorstudyError, check_known
from rotorstudy.model.kinds import KINDS
from rotorstudy.model.registry import OWN_FOLDER, Registry, plugin_folders, registry, using
from rotorstudy.store import write_text

TEMPLATES = Path(__file__).parent / "templates"
NAME_IN_TEMPLATE = "my_model"
PLACEHOLDERS = {
    "source": "the paper and equation it comes from",
    "checked": "the published or closed-form numbers it was compared with",
}


def new_plugin(kind, name, folder=None):
    """Write a working, commented plugin file, by default in the project's or the user's folder, and return its path."""
    check_known("kind", [kind], ["rig", *KINDS])  # as the command says it, which writes a rig otherwise
    if not name.isidentifier() or not name.isascii() or name != name.lower() or iskeyword(name):
        told = "use lower-case letters, digits and _, no keyword of Python"
        raise RotorstudyError(f"name '{name}': {told}, such as my_{kind}")
    taken = registry().plugins[kind].get(name)
    if taken:
        raise RotorstudyError(f"{kind} '{name}' exists: {taken.file}; choose another name")
    folder = Path(folder) if folder else _folder_of(kind)
    path = folder / f"{name}.py"
    if path.exists():
        raise RotorstudyError(f"file '{path}' exists; choose another name, or remove it first")
    write_text(path, (TEMPLATES / f"{kind}.py").read_text(encoding="utf-8").replace(NAME_IN_TEMPLATE, name))
    return path


def left_to_write(path):
    """Names of the fields in a plugin file that still have the text of the template."""
    with tokenize.open(path) as file:  # in the encoding that the file declares
        text = file.read()
    return [name for name, words in PLACEHOLDERS.items() if f'"{words}"' in text]


def _folder_of(kind):
    """The project's folder for plugins of a kind; outside a project the one of the user."""
    own = plugin_folders()[0]
    if Path("plugins").resolve() != own:
        return Path(OWN_FOLDER)
    for plugin in registry().plugins[kind].values():
        if own in Path(plugin.file).parents:
            return Path(plugin.file).parent
    return own / f"{kind}s"


def check_file(path):
    """Check every invariant of every plugin in a file: list of (kind, name, Outcome)."""
    from rotorstudy.authoring.invariants import outcomes

    path = Path(path)
    if not path.is_file():
        wrong = "is a folder; give a file in it" if path.is_dir() else "does not exist; `rotorstudy new` writes one"
        raise RotorstudyError(f"file '{path}' {wrong}")
    if path.suffix != ".py":
        raise RotorstudyError(f"file '{path}' is neither a rig file (.yaml) nor a plugin file (.py)")
    zoo = Registry(plugin_folders(), files=[path])
    mine = [(kind, plugin) for kind, plugin in zoo if Path(plugin.file).resolve() == path.resolve()]
    if not mine:
        failed = (line for line in zoo.failures if str(path) in line or str(path.resolve()) in line)
        none = f"{path} contains no plugin; state what it is above a function, as @Crack(source=...)"
        raise PluginError(next(failed, none))
    with using(zoo):
        return [(kind, plugin.name, outcome) for kind, plugin in mine for outcome in outcomes(plugin)]
