"""Plugin kinds, their hooks, and the registry that finds them.

A plugin is one file: a function that is the equation, and a hook that names it. It is found if the file lies in the
project's plugins/ folder or in a folder listed in ROTORSTUDY_PLUGINS, or if an installed distribution offers its module
under the entry point group "rotorstudy".
"""

import os
import sys
from collections.abc import Callable
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

import pluggy

from rotorstudy.errors import PluginError, unknown_name
from rotorstudy.options import option_names

hookimpl = pluggy.HookimplMarker("rotorstudy")
_hookspec = pluggy.HookspecMarker("rotorstudy")

FOLDERS_VARIABLE = "ROTORSTUDY_PLUGINS"


@dataclass(frozen=True)
class Plugin:
    """What every plugin states: a name, the function that is the model, and where its equation comes from.

    example : options to check it with, where some have no default
    checked : which published or closed-form numbers it was checked against
    """

    name: str
    function: Callable
    source: str
    example: dict = field(default_factory=dict, compare=False, kw_only=True)
    checked: str = field(default="", kw_only=True)

    @property
    def summary(self):
        """First line of the function's docstring."""
        return (self.function.__doc__ or "").strip().split("\n")[0]

    @property
    def file(self):
        return self.function.__code__.co_filename

    @property
    def version(self):
        """First digits of the SHA-256 of its file: changes whenever the model does."""
        return sha256(Path(self.file).read_bytes()).hexdigest()[:8]


@dataclass(frozen=True)
class Rotor(Plugin):
    """function(**options) -> Structure"""


@dataclass(frozen=True)
class Crack(Plugin):
    """function(angle, **options) -> opening between 0 (closed) and 1 (open); angle (...) rad from crack edge down.

    The opening has the shape of `angle` if the shaft loses stiffness along the weak direction xi alone (it points from
    the axis to the middle of the crack edge), or is (3, ...): shares xi, eta and xi-eta of the loss in the frame that
    turns with the shaft, dk * [[xi, xi-eta], [xi-eta, eta]].

    series    : function(order, **options) -> {k: s_k} or {k: (xi, eta, xi-eta)}, Fourier coefficients of e^{jk*angle}
                for |k| <= order; without it they come from the function, see `rotorstudy.cracks.crack_series`
    symmetric : it claims to open as it shuts: xi and eta are even in the angle, xi-eta is odd
    """

    series: Callable = None
    symmetric: bool = False


@dataclass(frozen=True)
class CrackDepth(Plugin):
    """function(depth_ratio, diameter_m, youngs_modulus_Pa, **options) -> hinge compliance in xi and eta, rad/(N m).

    Of the open crack; depth_ratio is its depth over the diameter of the shaft.

    valid : lowest and highest depth ratio it holds for
    """

    valid: tuple[float, float] = (0.0, 0.5)


@dataclass(frozen=True)
class Bearing(Plugin):
    """function(structure, node, **options) -> list of Parameter

    Claims about its example with every parameter at its typical size, verified by `rotorstudy.invariants`:
    positive_damping : the symmetric part of its damping takes energy out of every motion
    symmetric        : no cross-coupling feeds a whirl; with positive damping too, no motion ever gains energy
    """

    positive_damping: bool = False
    symmetric: bool = False


@dataclass(frozen=True)
class Effect(Plugin):
    """function(structure, **options) -> list of Parameter; for acts_on "output" function(sensors, **options).

    twins     : names of effects it can be confused with, and what separates them; each twin names it back
    places    : function(structure, sensors) -> list of option dicts, one for each place it can act at; by default each
                node (each sensor) if it has an option `node`, else one place without options
    candidate : whether diagnosis offers it as a cause; a free force at every harmonic would explain anything
    shape     : option -> (low, high), in which an option that stands inside a nonlinear force is searched
    fixed     : it is there with its typical amplitude or not at all: a cable is swapped or not
    fold      : the phase of its amplitude is so many times the angle of its direction: 2 for two stiffnesses
    positive  : its amplitudes cannot be negative: a damping that makes energy, a crack that stiffens
    """

    acts_on: str = "rotor"
    twins: tuple[tuple[str, str], ...] = ()
    places: Callable | None = field(default=None, compare=False)
    candidate: bool = True
    shape: dict = field(default_factory=dict, compare=False)
    fixed: bool = False
    fold: int = 1
    positive: bool = False

    def __post_init__(self):
        if self.places is None:
            object.__setattr__(self, "places", self._usual_places)

    def _usual_places(self, structure, sensors):
        if "node" not in option_names(self.function):
            return [{}]
        return [{"node": node} for node in (sensors if self.acts_on == "output" else structure.nodes)]


@dataclass(frozen=True)
class SpectrumMethod(Plugin):
    """function(signal, time, speed, harmonics) -> amplitude, covariance

    signal     : (..., time) complex or real; time (time,) s; speed rad/s; harmonics (harmonic,) int
    amplitude  : (..., harmonic) complex, phase counted from the first sample
    covariance : (..., component, component) of real parts, then imaginary parts

    What it claims to do, and is checked for:
    any_length            : the harmonics asked for do not leak into each other, whole revolutions or not
    uses_marks            : function(signal, time, speed, harmonics, marks) with marks (revolution,) s on the clock of
                            time; the phase is counted from the mark
    tolerates_wrong_speed : the stated speed may be wrong by a thousandth
    tolerates_outliers    : a few samples may be spikes
    """

    any_length: bool = False
    uses_marks: bool = False
    tolerates_wrong_speed: bool = False
    tolerates_outliers: bool = False


@dataclass(frozen=True)
class Estimator(Plugin):
    """function(problem) -> Estimate, see `rotorstudy.identification`

    What it claims to do, and is checked for, both ways:
    uses_covariance         : harmonics stated to be noisier count less
    fits_output             : estimates terms of the sensors too
    handles_rank_deficiency : gives the unknowns that are determined even if others trade off
    tolerates_outliers      : one harmonic may be wrong by far more than stated
    """

    uses_covariance: bool = False
    fits_output: bool = False
    handles_rank_deficiency: bool = False
    tolerates_outliers: bool = False


class Hooks:
    """A plugin file implements one of these with @hookimpl; it returns one plugin or a list of them."""

    @_hookspec
    def rotorstudy_rotor():
        """Rotor: the base structure without effects."""

    @_hookspec
    def rotorstudy_crack():
        """Crack: an opening function of the shaft angle."""

    @_hookspec
    def rotorstudy_depth():
        """CrackDepth: how far the shaft bends more for a crack of some depth."""

    @_hookspec
    def rotorstudy_bearing():
        """Bearing: stiffness and damping at a node."""

    @_hookspec
    def rotorstudy_effect():
        """Effect: a table of entries on the rotor or on the measured output."""

    @_hookspec
    def rotorstudy_spectrum():
        """SpectrumMethod: record to harmonics with covariance."""

    @_hookspec
    def rotorstudy_estimator():
        """Estimator: problem to estimate."""


KINDS = {
    "rotor": Rotor,
    "crack": Crack,
    "depth": CrackDepth,
    "bearing": Bearing,
    "effect": Effect,
    "spectrum": SpectrumMethod,
    "estimator": Estimator,
}


class Registry:
    """The zoo: plugins by kind and name.

    files    : single files besides those of the folders
    failures : one line for each plugin file that did not load; the rest of the zoo is there all the same
    """

    def __init__(self, folders=(), entry_points=True, files=()):
        self._manager = pluggy.PluginManager("rotorstudy")
        self._manager.add_hookspecs(Hooks)
        self.plugins = {kind: {} for kind in KINDS}
        self.failures = []
        for folder in folders:
            if not Path(folder).is_dir():
                wrong = "is a file; name the folder it lies in" if Path(folder).is_file() else "does not exist"
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
        module = None
        try:
            module = load()
            self._manager.register(module)
            self._manager.check_pending()
            found = [(kind, plugin) for kind in KINDS for plugin in _plugins_of(module, kind)]
        except Exception as error:
            self.failures.append(f"plugin {_blame(place, error)}: {_said(error)}")
            if module and self._manager.is_registered(module):
                self._manager.unregister(module)
            return
        for kind, plugin in found:
            twin = self.plugins[kind].get(plugin.name)
            if twin:
                raise PluginError(
                    f"two plugins are called {kind} '{plugin.name}': {twin.file} and {plugin.file}; rename one"
                )
            self.plugins[kind][plugin.name] = plugin

    def get(self, kind, name, where=""):
        """The plugin of a kind by name; an unknown name is an error with the near miss."""
        if name not in self.plugins[kind]:
            error = unknown_name(kind, name, self.plugins[kind], where)
            if self.failures:
                error = type(error)(f"{error}; some plugins did not load: {'; '.join(self.failures)}")
            raise error
        return self.plugins[kind][name]

    def __iter__(self):
        """(kind, plugin) of the whole zoo, in a fixed order."""
        for kind, plugins in self.plugins.items():
            for name in sorted(plugins):
                yield kind, plugins[name]


def _is_in(file, folder):
    return Path(folder).resolve() in Path(file).resolve().parents


def _plugins_of(module, kind):
    """What the hook of a kind returns, as a list; anything but plugins of that kind is an error."""
    hook = getattr(module, f"rotorstudy_{kind}", None)
    found = hook() if hook else []
    found = list(found) if isinstance(found, (list, tuple)) else [found]
    for plugin in found:
        if not isinstance(plugin, KINDS[kind]):
            raise PluginError(f"rotorstudy_{kind} must return a {KINDS[kind].__name__}, not {type(plugin).__name__}")
        if not str(plugin.source or "").strip():
            raise PluginError(f"{kind} '{plugin.name}' has no source; name the paper, book or equation it comes from")
    return found


def _import_file(file):
    import importlib.util

    name = f"rotorstudy_plugin_{file.stem}_{sha256(str(file.resolve()).encode()).hexdigest()[:12]}"
    spec = importlib.util.spec_from_file_location(name, file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    sys.modules[name] = module
    return module


def _said(error):
    """An exception in one line."""
    return f"{type(error).__name__}: {' '.join(str(error).split()) or 'no message'}"


def blamed(error):
    """One line for an exception that came out of a plugin of the zoo, with file and line; "" if it did not.

    For the end of a command or a job: whoever wrote the plugin sees the place, and no traceback of the engine.
    """
    files, trace, found = {plugin.file: (kind, plugin.name) for kind, plugin in registry()}, error.__traceback__, ""
    while trace:
        file = trace.tb_frame.f_code.co_filename
        if file in files:
            kind, name = files[file]
            found = f"{kind} '{name}' ({file}:{trace.tb_lineno}): {_said(error)}"
        trace = trace.tb_next
    return found


def _blame(place, error):
    """'file:line' of the deepest frame inside the plugin itself."""
    line = getattr(error, "lineno", None)
    trace = error.__traceback__
    while trace:
        if trace.tb_frame.f_code.co_filename == str(place):
            line = trace.tb_lineno
        trace = trace.tb_next
    return f"{place}:{line}" if line else str(place)


def plugin_folders():
    """The project's own plugins/ folder (or its copy in an installed package), then those of ROTORSTUDY_PLUGINS."""
    return _plugin_folders(os.environ.get(FOLDERS_VARIABLE, ""), os.getcwd())


@lru_cache
def _plugin_folders(listed, working_folder):
    project, packaged = Path(__file__).parents[2] / "plugins", Path(__file__).parent / "zoo"
    own = [packaged if packaged.is_dir() else project]
    extra = [Path(working_folder, folder) for folder in listed.split(os.pathsep) if folder]
    return tuple(dict.fromkeys(folder.resolve() for folder in own + extra))


@lru_cache
def _registry(folders):
    return Registry(folders)


_CURRENT = ContextVar("registry", default=None)


def registry():
    """The zoo of this process, loaded once."""
    return _CURRENT.get() or _registry(plugin_folders())


@contextmanager
def using(zoo):
    """Inside this context, `registry()` is another zoo: one with a file that is being checked."""
    before = _CURRENT.set(zoo)
    try:
        yield zoo
    finally:
        _CURRENT.reset(before)
