"""The registry that finds the plugins.

A plugin is one file: a function with the equation, below what it states, such as `@Crack(source="a paper")`. The
registry gives it to pluggy as the hook of its kind, `rotorstudy_crack`; a module may also implement the hook itself,
for plugins that it makes. It is found if the file is in the project's plugins/ folder, in the folder
rotorstudy_plugins/ of the current folder, or in one listed in ROTORSTUDY_PLUGINS, or if an installed distribution
provides its module as an entry point in the group "rotorstudy".
"""

import os
import sys
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache, partial
from hashlib import sha256
from inspect import isfunction
from pathlib import Path
from traceback import walk_tb
from types import SimpleNamespace

import pluggy

from rotorstudy.errors import PluginError, RotorstudyError, unknown_name
from rotorstudy.model.kinds import KINDS, Hooks, hookimpl
from rotorstudy.model.options import check_options

FOLDERS_VARIABLE = "ROTORSTUDY_PLUGINS"
OWN_FOLDER = "rotorstudy_plugins"  # in the folder where a user works
PACKAGED = Path(__file__).parents[1] / "zoo"  # the project's plugins in an installed package
PROJECT = PACKAGED if PACKAGED.is_dir() else Path(__file__).parents[3] / "plugins"


class Registry:
    """The plugin library (zoo): plugins by kind and name, from the files in folders and below, and from entry points.

    failures : one line for each plugin file that did not load; the others are available all the same
    """

    def __init__(self, folders=(), entry_points=True, files=()):
        self._manager = pluggy.PluginManager("rotorstudy")
        self._manager.add_hookspecs(Hooks)
        self._given = {}  # kind -> plugins returned by the file that is being registered
        for kind in KINDS:
            getattr(self._manager.hook, f"rotorstudy_{kind}").call_historic(partial(self._given.__setitem__, kind))
        self.plugins = {kind: {} for kind in KINDS}
        self.failures = []
        for folder in folders:
            if not Path(folder).is_dir():
                wrong = "is a file; give its folder" if Path(folder).is_file() else "does not exist"
                raise PluginError(
                    f"plugin folder '{folder}' {wrong}; check {FOLDERS_VARIABLE} and the configuration (plugin_folders)"
                )
            self._add_files(sorted(Path(folder).rglob("*.py")))
        self._add_files(file for file in files if not any(_is_in(file, folder) for folder in folders))
        if entry_points:
            from importlib.metadata import entry_points as find

            for point in sorted(find(group="rotorstudy"), key=lambda p: (p.name, p.value)):
                self._add(f"entry point {point.name} = {point.value}", point.load)

    def _add_files(self, files):
        for file in files:
            self._add(file, lambda file=file: _import_file(file))

    def _add(self, place, load):
        hooks = None
        self._given.clear()
        try:
            hooks = _hooks_of(load())
            self._manager.register(hooks)
            self._manager.check_pending()
            asked = [kind for kind in KINDS if hasattr(hooks, f"rotorstudy_{kind}")]
            found = [(kind, plugin) for kind in asked for plugin in _plugins_of(kind, self._given.get(kind))]
        except BaseException as error:  # of any kind, but for a person who interrupts
            if isinstance(error, KeyboardInterrupt):
                raise
            self.failures.append(f"plugin {_blame(place, error)}: {said(error)}")
            if hooks and self._manager.is_registered(hooks):
                self._manager.unregister(hooks)
            return
        for kind, plugin in found:
            namesake = self.plugins[kind].get(plugin.name)
            same = namesake and Path(namesake.file).read_bytes() == Path(plugin.file).read_bytes()
            if same and (namesake is plugin or _is_in(namesake.file, PACKAGED)):
                continue  # imported by two modules, or of an installed package and of the clone it is from
            if namesake:
                both = f"{namesake.file} and {plugin.file}"
                raise PluginError(f"two plugins are called {kind} '{plugin.name}': {both}; rename one")
            self.plugins[kind][plugin.name] = plugin

    def get(self, kind, name, where=""):
        """The plugin of a kind by name; an unknown name is an error with a suggestion."""
        if name not in self.plugins[kind]:
            for other in (other for other, known in self.plugins.items() if name in known):
                place = f" in {where}" if where else ""
                raise RotorstudyError(f"unknown {kind} '{name}'{place}: it is of the kind {other}; state it as such")
            error = unknown_name(kind, name, self.plugins[kind], where)
            words = name.replace("_", " ").lower()
            mentioned = [one for one, plugin in self.plugins[kind].items() if words in (plugin.summary or "").lower()]
            if mentioned:
                error = type(error)(f"{error}; '{words}' is described by {' or '.join(mentioned)}")
            if self.failures:
                error = type(error)(f"{error}; some plugins did not load: {'; '.join(self.failures)}")
            raise error
        return self.plugins[kind][name]

    def confounders(self, effect):
        """{name: what separates them} of the effects that one can be confused with, by its plugin or by theirs."""
        effects = self.plugins["effect"]
        stated = {one.name: one.confounders[effect] for one in effects.values() if effect in one.confounders}
        return dict(sorted((effects[effect].confounders | stated).items()))

    def __iter__(self):
        """(kind, plugin) of the whole library, in a fixed order."""
        for kind, plugins in self.plugins.items():
            for name in sorted(plugins):
                yield kind, plugins[name]


def _is_in(file, folder):
    return Path(folder).resolve() in Path(file).resolve().parents


def _hooks_of(module):
    """The hooks of a module: those it implements, and one of each kind of its functions with a decorator."""
    hooks = {name: one for name, one in vars(module).items() if name.startswith("rotorstudy_")}
    for name, one in hooks.items():
        if not hasattr(one, "rotorstudy_impl"):
            raise PluginError(f"{name} is not marked; write @hookimpl above it")  # pluggy would ignore it
    functions = filter(isfunction, vars(module).values())
    stated = [plugin for function in functions for plugin in getattr(function, "plugins", ())]
    for kind, gives in KINDS.items():
        if own := [plugin for plugin in stated if type(plugin) is gives]:
            name = f"rotorstudy_{kind}"
            if name in hooks:
                raise PluginError(f"{name} and @{gives.__name__} above a function; state the plugins in one way")
            hooks[name] = hookimpl(lambda own=own: own)
    return SimpleNamespace(**hooks)


def _plugins_of(kind, given):
    """The plugins returned by the hook of a kind as a list; other types, also of what one states, are errors."""
    found = list(given) if isinstance(given, (list, tuple)) else [given]
    for plugin in found:
        if not isinstance(plugin, KINDS[kind]):
            raise PluginError(f"rotorstudy_{kind} must return a {KINDS[kind].__name__}, not {type(plugin).__name__}")
        if not str(plugin.source or "").strip():
            kind = type(plugin).__name__
            raise PluginError(f"{kind} '{plugin.name}' has no source; name the paper, book or equation it comes from")
        if not _is_in(plugin.file, PROJECT):  # whose plugins the tests check, so that no start waits for pydantic
            check_stated(plugin)
    return found


def check_stated(plugin):
    """Raise for a value that a plugin states of itself, and that its kind does not allow."""
    check_options(type(plugin).__init__, vars(plugin), f"@{type(plugin).__name__} of '{plugin.name}'", ("self",))


def _import_file(file):
    import importlib.util

    name = f"rotorstudy_plugin_{file.stem}_{sha256(str(file.resolve()).encode()).hexdigest()[:12]}"
    spec = importlib.util.spec_from_file_location(name, file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    sys.modules[name] = module
    return module


def said(error):
    """An exception in one line."""
    return f"{type(error).__name__}: {' '.join(str(error).split()) or 'no message'}"


def blamed(error):
    """One line with file and line for an exception raised inside a plugin; "" for any other exception."""
    lines = [f"{kind} '{plugin.name}' ({plugin.file}:{line}): {said(error)}" for kind, plugin, line in _passed(error)]
    return lines[-1] if lines else ""


def effects_failed(error):
    """{name: line as `blamed` gives} of the effects through whose files an exception was raised."""
    return {plugin.name: blamed(error) for kind, plugin, _ in _passed(error) if kind == "effect"}


def _passed(error):
    """(kind, plugin, line number) of the plugin files that an exception passed, the one that called first."""
    files = {plugin.file: (kind, plugin) for kind, plugin in registry()}
    return [(*files[file], line) for file, line in _frames(error) if file in files]


def _frames(error):
    """(file, line number) of the frames that an exception passed, the one that called first."""
    return [(frame.f_code.co_filename, line) for frame, line in walk_tb(error.__traceback__)]


def _blame(place, error):
    """'file:line' of the deepest frame inside the plugin itself."""
    lines = [getattr(error, "lineno", None), *(line for file, line in _frames(error) if file == os.path.abspath(place))]
    line = lines[-1]
    return f"{place}:{line}" if line else str(place)


def plugin_folders():
    """Paths: the project's plugins/ (or its copy in an installed package), the user's own, then ROTORSTUDY_PLUGINS."""
    try:
        here = os.getcwd()
    except FileNotFoundError:
        raise PluginError("the current folder does not exist any more; change to another one") from None
    return _plugin_folders(os.environ.get(FOLDERS_VARIABLE, ""), here, os.path.isdir(OWN_FOLDER))


@lru_cache
def _plugin_folders(listed, working_folder, has_own):
    own = [PROJECT, *([Path(working_folder, OWN_FOLDER)] if has_own else [])]
    extra = [Path(working_folder, folder) for folder in listed.split(os.pathsep) if folder]
    return tuple(dict.fromkeys(folder.resolve() for folder in own + extra))


_registry = lru_cache(Registry)
_CURRENT = ContextVar("registry", default=None)


def registry() -> Registry:
    """The plugin library of this process, loaded once.

    Returns
    -------
    Registry
        Plugins by kind and name.

    Raises
    ------
    PluginError
        If a plugin folder does not exist, or two plugins of a kind have the same name.
    """
    return _CURRENT.get() or _registry(plugin_folders())


@contextmanager
def using(zoo):
    """Context in which `registry()` is another Registry, such as one with a file that is being checked."""
    before = _CURRENT.set(zoo)
    try:
        yield zoo
    finally:
        _CURRENT.reset(before)
