"""Plugin kinds, what each states and claims: decorators of the functions of a plugin file, and the hooks of pluggy."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace
from typing import Literal, NamedTuple

import numpy as np
import pluggy

from rotorstudy.errors import PluginError, check_known
from rotorstudy.model.options import NonNegative, Share, Whole, option_names

hookimpl = pluggy.HookimplMarker("rotorstudy")


@dataclass(frozen=True)
class Plugin:
    """What every plugin states, as the decorator of the function that is the model: `@Crack(source="a paper")`.

    name    : by default that of the function
    source  : of its equation: a paper, a book
    example : options for its checks, where some have no default, or nothing happens with it: a gap that closes
    checked : the published or closed-form numbers it was checked against
    """

    name: str = ""
    function: Callable = None
    source: str = ""
    example: dict = field(default_factory=dict, compare=False, kw_only=True)
    checked: str = field(default="", kw_only=True)

    def __new__(cls, *_, **stated):
        check_known("property", stated, [one.name for one in fields(cls)], f"@{cls.__name__}", PluginError)
        return super().__new__(cls)

    def __post_init__(self):
        if callable(self.name):
            raise PluginError(f"write @{type(self).__name__}(source=...) above the function, with brackets")

    def __call__(self, function):
        """The function, marked as the model of this plugin, by which the registry finds it."""
        plugin = replace(self, name=self.name or function.__name__, function=function)
        function.plugins = [*getattr(function, "plugins", ()), plugin]
        return function

    @property
    def summary(self):
        """First line of the function's docstring."""
        return (self.function.__doc__ or "").strip().split("\n")[0]

    @property
    def file(self):
        """Path of the file that defines its function."""
        return self.function.__code__.co_filename

    @property
    def version(self):
        """First digits of the SHA-256 of its file, so that it changes with the model."""
        return sha256(Path(self.file).read_bytes()).hexdigest()[:8]


@dataclass(frozen=True)
class Rotor(Plugin):
    """function(**options) -> Structure

    uncertain : path of a number among its options -> relative standard deviation where a rig states none, see
                `rotorstudy.model.rig_numbers`
    """

    uncertain: dict = field(default_factory=dict, compare=False)


@dataclass(frozen=True)
class Crack(Plugin):
    """function(angle, **options) -> breathing function, 0 (closed) to 1 (open); angle (...) rad from crack edge down.

    It has the shape of `angle` if the shaft loses stiffness along the weak direction xi alone (from the axis to the
    middle of the crack edge), or is (3, ...): shares xi, eta and xi-eta of the loss in the rotating frame,
    dk * [[xi, xi-eta], [xi-eta, eta]].

    series    : function(order, **options) -> {k: s_k} or {k: (xi, eta, xi-eta)}, Fourier coefficients of e^{jk*angle}
                for |k| <= order; without it they come from the function, see `rotorstudy.model.cracks.crack_series`
    symmetric : claim that it opens as it closes: xi and eta are even in the angle, xi-eta is odd
    """

    series: Callable | None = None
    symmetric: bool = False

    def is_positive(self, parameter):
        """Whether an amplitude cannot be negative: no crack adds stiffness."""
        return True


@dataclass(frozen=True)
class CrackDepth(Plugin):
    """function(depth_ratio, diameter_m, youngs_modulus_Pa, **options) -> hinge compliance in xi and eta, rad/(N m).

    The compliance is that of the open crack; depth_ratio is its depth over the diameter of the shaft.

    valid : lowest and highest valid depth ratio
    partly_open : function(depth_ratio, direction, **options) -> complex rotation (...), along xi + j eta, by a unit
                  moment that pulls most at the angle `direction` (...) from xi, where only what is in tension opens;
                  the gradient of a strain energy, so that it is continuous and symmetric in the direction
    """

    valid: tuple[float, float] = (0.0, 0.5)
    partly_open: Callable | None = None


@dataclass(frozen=True)
class Bearing(Plugin):
    """function(structure, node, **options) -> list of Parameter

    defaults : option -> function(structure, node) -> its value, a number, where the rig states none
    uncertain : path of a number among its options -> relative standard deviation where a rig states none, see
                `rotorstudy.model.rig_numbers`
    changeable : numbers among its options that wear, dirt or heat may change, of which diagnosis tries each as a cause
    load : its options of size and angle (rad, from gravity) of a static load on which its entries depend; constant
           forces on the rotor change it
    running : function(speed, **options) -> eccentricity over clearance, and angle (rad) from gravity in the sense of
              rotation, of the position at which a journal runs in its film

    Claims about its example with every parameter at its typical size, each checked both ways:
    positive_damping : the symmetric part of its damping dissipates energy in every motion
    symmetric        : its coefficients are symmetric, so that no cross-coupling drives a whirl
    """

    defaults: dict = field(default_factory=dict)
    uncertain: dict = field(default_factory=dict, compare=False)
    changeable: tuple[str, ...] = ()
    load: tuple[str, str] | None = None
    running: Callable | None = field(default=None, compare=False)
    positive_damping: bool = False
    symmetric: bool = False

    def is_positive(self, parameter):
        """Whether an amplitude is a spring, a damper or a mass, not a cross-coupling: a bearing carries, and damps."""
        direct = (np.trace(np.real(e.matrix)) for e in parameter.entries if e.on == "z" and e.gain is None)
        return any(trace < 0 for trace in direct)


class Feared(NamedTuple):
    """A fault that operators fear: how large it must be to be seen is stated in every diagnosis.

    size    : the option or parameter that is its size
    largest : the size up to which it is looked for, of a parameter in typical sizes
    shape   : option -> (factor, scale) of its other shape options, as in `Effect.shape`; vibration is that there
    worst   : option -> values, of which the least favourable counts
    places  : function(structure) -> list of (where, as a verdict names it, and options); by default `Effect.places`
    measure : what to measure where it cannot be seen
    """

    size: str
    largest: float
    shape: dict = {}
    worst: dict = {}
    places: Callable | None = None
    measure: str = "nearer to it, or at speeds near a mode that moves it"


@dataclass(frozen=True)
class Effect(Plugin):
    """function(structure, **options) -> list of Parameter; for acts_on "output" function(sensors, **options),
    or function(sensors, structure, **options) where the typical size follows from the rotor.

    confounders : name of an effect it can be confused with -> what separates them; one of the two says so
    places    : function(structure, sensors) -> list of option dicts, one for each place where it can act; by default
                each node (each sensor) if it has an option `node`, else one place without options
    candidate : whether diagnosis considers it as a cause; a free force at every harmonic would explain anything
    hypothesis : options with which diagnosis tries it, where a cause has more freedom than the defaults give
    shape     : option -> (low, high), the search range of an option that enters nonlinearly, or (low, high, scale) in
                units of one of the usual sizes of the rotor: `length`, `vibration` (the largest at the node, if records
                tell it), `frequency`, `time`, `shaft`
    form      : option -> (low, high), in which a real one differs from the default in an unknown way (the front of a
                crack), any value as likely as another; then as the first two of `any_form`: `identify --cause`
                fits these
    stated    : function of the structure, and of the options and amplitudes that it names -> {name: number}, further
                sizes of a verdict, positive and in SI: the depth of a crack in m by its share of the diameter
    alternatives : option -> function() -> its possible values, of which diagnosis tries each; the cause is the same
    formulas  : option -> function() -> further values of an alternative, published formulas that are simpler than the
                physics: `identify --cause` tries them where the others do not explain the records
    fixed     : present with its typical amplitude or absent: a cable is swapped or not
    fold      : ratio of the phase of its amplitude to the angle of its direction: 2 for two stiffnesses
    positive  : its amplitudes cannot be negative (damping, stiffness loss of a crack), together with those of the rig;
                or the names of those that cannot, of which forces in time are powers of one law, positive together
    base_rate : how often it is a cause, relative to a usual effect, before anything is measured
    change_rate : how often it is what changed between two runs, likewise; by default as `base_rate`
    at_discs  : what changed of it between two runs may be at several discs at once, as one fault
    place_rate : function(structure, **place) -> how often it is at a place, relative to its other places; by default
                it is at all places alike
    parts     : options that number the parts of one fault (the harmonics of a runout), which count as one cause
    brings    : names of effects that come with it at the same place as parts of one fault (the unbalance of an added
                mass that is eccentric)
    switches  : its force changes its law within a revolution; where it never does, it is a constant force and a
                stiffness, and not considered as a cause
    nuisance  : standard deviation of its amplitude in any measuring chain, where it is never exactly zero; or
                "clearance", the largest one of the oil films, where these carry the machine, anew in each run
    changes_bearing : its amplitude is the relative change of the option `number` of the bearings at its `node`, which
                are built anew; its entries are the derivative
    together  : function(structure, one, other) of the options of two of them on a rotor, which raises CannotAct where
                they cannot be there together
    feared    : Feared, of a fault that operators fear
    any_form  : option -> value, with which diagnosis tries it, so that it can have forms near its own; parameter ->
                (mean, standard deviation) of its amplitudes then, in typical sizes, as of published forms; and its
                alternatives then
    form_error : largest standard deviation of the error of its form, as a fraction of what it changes, where published
                forms of it differ by more than `diagnosis: form_error` of the rig; or that of some parameters
    """

    acts_on: Literal["rotor", "output"] = "rotor"
    confounders: dict = field(default_factory=dict, compare=False)
    places: Callable | None = field(default=None, compare=False)
    candidate: bool = True
    hypothesis: dict = field(default_factory=dict, compare=False)
    shape: dict[str, tuple] = field(default_factory=dict, compare=False)
    form: tuple[dict, dict, dict] = field(default=({}, {}, {}), compare=False)
    stated: Callable | None = field(default=None, compare=False)
    alternatives: dict = field(default_factory=dict, compare=False)
    formulas: dict = field(default_factory=dict, compare=False)
    fixed: bool = False
    fold: Whole = 1
    positive: bool | tuple[str, ...] = False
    parts: tuple[str, ...] = ()
    brings: tuple[str, ...] = ()
    switches: bool = False
    base_rate: NonNegative = 1.0
    change_rate: NonNegative | None = None
    at_discs: bool = False
    place_rate: Callable | None = field(default=None, compare=False)
    nuisance: NonNegative | Literal["clearance"] = 0.0
    changes_bearing: bool = False
    together: Callable | None = field(default=None, compare=False)
    feared: Feared | None = field(default=None, compare=False)
    any_form: tuple[dict, dict, dict] = field(default=({}, {}, {}), compare=False)
    form_error: Share | dict[str, Share] = 0.0

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "confounders", dict(self.confounders))
        if self.places is None and self.function:
            object.__setattr__(self, "places", self._usual_places)

    @property
    def acts_on_output(self):
        """Whether it changes the measured displacement; otherwise it acts on the rotor."""
        return self.acts_on == "output"

    def is_positive(self, parameter):
        """Whether an amplitude cannot be negative."""
        return parameter.name in self.positive if isinstance(self.positive, tuple) else self.positive

    def ranges(self, structure, node=None):
        """Option -> (low, high), the search ranges of `shape` on a rotor or at a node, in the units of the options."""
        found = {}
        for name, (low, high, *scale) in self.shape.items():
            size = structure.scales.usual(scale[0], node) if scale else 1.0
            found[name] = (low * size, high * size)
        return found

    def _usual_places(self, structure, sensors):
        if "node" not in option_names(self.function):
            return [{}]
        return [{"node": node} for node in (sensors if self.acts_on_output else structure.nodes)]


@dataclass(frozen=True)
class SpectrumMethod(Plugin):
    """function(signal, time, speed, harmonics) -> amplitude, covariance

    signal     : (..., time) complex or real; time (time,) s; speed rad/s; harmonics (harmonic,) int
    amplitude  : (..., harmonic) complex, with the phase at the first sample
    covariance : (..., component, component) of the real parts, then the imaginary parts

    Claims, each checked both ways:
    any_length            : no leakage between the requested harmonics, for whole revolutions or not
    uses_marks            : function(signal, time, speed, harmonics, marks) with marks (revolution,) s on the clock of
                            `time`; the phase refers to the mark
    tolerates_wrong_speed : the stated speed may be wrong by 0.1 %
    tolerates_outliers    : a few samples may be spikes
    """

    any_length: bool = False
    uses_marks: bool = False
    tolerates_wrong_speed: bool = False
    tolerates_outliers: bool = False


@dataclass(frozen=True)
class Estimator(Plugin):
    """function(Problem) -> Estimate, see `rotorstudy.inference`

    Claims, each checked both ways:
    uses_covariance         : harmonics are weighted by their stated covariance
    fits_output             : estimates output terms (of the sensors) too
    handles_rank_deficiency : estimates the parameters that are determined even if others are not identifiable
    tolerates_outliers      : one harmonic may be wrong by far more than its standard deviation
    """

    uses_covariance: bool = False
    fits_output: bool = False
    handles_rank_deficiency: bool = False
    tolerates_outliers: bool = False


KINDS = {
    "rotor": Rotor,
    "crack": Crack,
    "depth": CrackDepth,
    "bearing": Bearing,
    "effect": Effect,
    "spectrum": SpectrumMethod,
    "estimator": Estimator,
}


def _hook(kind, gives):
    """Specification of the hook of a kind; historic: each file is called when it is registered, to blame it alone."""

    def hook():
        pass

    hook.__name__ = f"rotorstudy_{kind}"
    hook.__doc__ = f"{gives.__name__}, or a list of them: {gives.__doc__.splitlines()[0]}"
    return pluggy.HookspecMarker("rotorstudy")(historic=True)(hook)


Hooks = SimpleNamespace(**{f"rotorstudy_{kind}": _hook(kind, gives) for kind, gives in KINDS.items()})
