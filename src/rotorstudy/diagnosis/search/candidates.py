"""The hypotheses: every effect of the library at every place."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import CannotAct
from rotorstudy.inference.prior import Prior
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import blamed, registry
from rotorstudy.model.rig_items import make_term, with_options
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import Term, share_of

SHAPES_TRIED = 9  # values of a shape option, before the best is refined
ANGLES_TRIED = 16  # of the angles of a full turn: 11 degrees off at most, which even a fifth harmonic tells from noise
ROUND_OFF = 1e-9
DIFFERENCE = 1e-4  # of the range of a shape option, for a derivative by it
SCALES = 10.0 ** (-0.5 * np.arange(7))  # widths of a prior over the widest one, equally likely by order of magnitude
# distances of the law of a real fault from the nearest one of the library over those in `Effect.any_form`, equally
# likely: the law of the library itself, one near it, one as far as published ones, which differ tenfold, one farther
SPREADS = (0.01, 0.3, 1.0, 2.0)
FIXED = 0.02  # standard deviation of an amplitude that is 0 or 1: what the uncertainty of the probe calibration


class Freedom(NamedTuple):
    """A freedom of the form of an effect; see `Effect.any_form`."""

    options: dict
    amplitudes: dict  # parameter -> (mean, std), in typical sizes
    spreads: tuple[float, ...] = (1.0,)  # over these standard deviations, equally likely


class Candidate(NamedTuple):
    """An effect at a place: plugin name, options of the place, its term without values."""

    effect: str
    where: dict
    term: Term
    prior: dict  # unknown name -> (mean, std) of its amplitude before anything is measured
    # unknown name -> {parameter of the base or other power of its law: factor}: it cannot be negative together with
    # these; where there are none, the prior is the upper half of that normal distribution
    positive: dict = {}
    fixed: bool = False  # its amplitude is known where the effect is present; the width of its prior is not varied
    shape: dict = {}  # options that enter nonlinearly (a clearance, an angle), at one of the values tried
    variant: dict = {}  # the alternatives of the effect that it has (the breathing function of a crack)
    shape_std: dict = {}  # standard deviations of its shape, once that is fitted
    options: dict = {}  # other options, the same for all candidates of the effect
    freedoms: tuple[Freedom, ...] = ()  # of its form
    fixed_std: float = FIXED  # standard deviation of an amplitude that is fixed
    held: tuple[str, ...] = ()  # options of its shape that are held at a value among the `options`
    half_turn: bool = False  # whether it acts alike when its angles are turned by half

    @property
    def cause(self):
        """Name in a verdict: the effect and its place, without the shape."""
        return self.effect + "".join(f", {key} {value}" for key, value in self.where.items())

    @property
    def fault(self):
        """Name of the fault that it is a part of: the cause without the options that number the parts."""
        parts = registry().get("effect", self.effect).parts
        return self.effect + "".join(f", {key} {value}" for key, value in self.where.items() if key not in parts)

    @property
    def label(self):
        """The cause with its alternatives and its shape: unique among the candidates."""
        told = {**self.variant, **{key: f"{value:.4g}" for key, value in self.shape.items()}}
        return self.cause + "".join(f", {key} {value}" for key, value in told.items())

    @property
    def names(self):
        """(unknown,) names of its amplitudes."""
        return tuple(unknown.name for unknown in self.term.unknowns)

    @property
    def parameter(self):
        """(unknown,) position of the parameter of each amplitude: real and imaginary part have the same one."""
        return np.array([i for i, p in enumerate(self.term.parameters) for _ in range(2 if p.is_complex else 1)])

    @property
    def widths(self):
        """(amplitudes, parameter of each, widths) of amplitudes whose prior may also be narrower by unknown factors.

        The amplitudes of one parameter have one width, and so do all those of a freedom of a fixed cause.
        """
        if not self.fixed:
            return [(np.arange(len(self.names)), self.parameter, SCALES)]
        names = [self.term.parameters[i].name for i in self.parameter]
        every = [(np.flatnonzero([n in one.amplitudes for n in names]), one.spreads) for one in self.freedoms]
        return [(own, np.zeros(len(own), int), np.array(x)) for own, x in every if len(own) and len(x) > 1]


def candidate(
    model: Model,
    effect: str,
    where: dict,
    shape: dict | None = None,
    label: str = "cause",
    prior_width: float = 10.0,
    variant: dict | None = None,
    freedoms: tuple[Freedom, ...] = (),
) -> Candidate:
    """An effect at a place, with the prior of its amplitudes.

    effect : name of the plugin;  where, shape, variant : options of the place, of the shape, those with alternatives
    label : of its term;  prior_width : standard deviation of its amplitude, in typical sizes;  freedoms : of its form
    raises : CannotAct if the effect cannot act there
    """
    plugin = registry().get("effect", effect, "diagnosis")
    options, shape, variant = {**plugin.example, **plugin.hypothesis}, dict(shape or {}), dict(variant or {})
    for one in freedoms:
        options |= one.options
    item = {"kind": effect, **options, **where, **shape, **variant, "label": label}
    term = make_term("effect", item, model.structure, model.sensors, f"candidate {effect}")
    known = Candidate(effect, where, term, {}, {}, plugin.fixed, shape, variant, {}, options, freedoms)
    return _with_prior(model, known._replace(half_turn=_acts_alike_turned(known, model)), prior_width)


def _acts_alike_turned(cause, model):
    """Whether a cause acts alike when its angles are turned by half: an open crack looks the same from both sides."""
    angles = [name for name in registry().get("effect", cause.effect).shape if name.endswith("_rad")]
    if not angles or any(u.force or any(shift % 2 for _, _, shift in u.kinds) for u in cause.term.unknowns):
        return False  # what turns with an odd multiple of the speed is the opposite half a turn later
    turned = (cause.shape | dict.fromkeys(angles, angle) for angle in (0.0, np.pi))
    here, there = (with_options(cause.term, shape, model.structure, model.sensors).unknowns for shape in turned)
    return all(abs(share_of(one, other) - 1) < ROUND_OFF for one, other in zip(here, there, strict=True))


def place_key(cause: Candidate) -> tuple:
    """Effect, alternatives and place, whatever the shape."""
    return cause.effect, *cause.variant.values(), frozenset(cause.where.items())


def with_priors(prior: Prior, causes: Sequence[Candidate]) -> Prior:
    """The Prior of a rig with those of the amplitudes of causes."""
    return prior.plus(Prior.independent({name: known for c in causes for name, known in c.prior.items()}))


def _with_prior(model, cause, width):
    """A candidate with the prior of the amplitudes of its term."""
    term, plugin = cause.term, registry().get("effect", cause.effect)
    mean, std = (1.0, cause.fixed_std) if plugin.fixed else (0.0, width)
    prior = {unknown.name: (mean * unknown.typical, std * unknown.typical) for unknown in term.unknowns}
    known = {name: prior for one in cause.freedoms for name, prior in one.amplitudes.items()}
    for p in (p for p in term.parameters if p.name in known):
        mean, std = known[p.name]
        prior[term.full_name(p)] = mean * p.typical, std * p.typical
    limited = [unknown for unknown in term.unknowns if unknown.positive]
    together = limited if isinstance(plugin.positive, tuple) else []
    positive = {u.name: model.acting_alike(u, term.acts_on_output) | _powers(u, together) for u in limited}
    return cause._replace(prior=prior, positive=positive)


def freedoms_of(effect: str, *, any_form: bool) -> tuple[Freedom, ...]:
    """Freedoms by which an effect may have any form near its own, or one of those searched.

    What `Effect.form` has too is of the fault itself, as the shape of a front is; the rest is of its law. How far each
    of the two is from those of the library is not known; see `SPREADS`.

    any_form : as `Effect.any_form` says, instead of `Effect.form`
    """
    plugin = registry().get("effect", effect, "diagnosis")
    if not any_form:
        return (Freedom(*plugin.form[1:]),)
    options, every, _ = plugin.any_form
    widest = {name: (mean, SPREADS[-1] * std) for name, (mean, std) in every.items()}
    own = {name: known for name, known in widest.items() if name in plugin.form[2]}
    law = {name: known for name, known in widest.items() if name not in own}
    spreads = tuple(x / SPREADS[-1] for x in SPREADS)
    return Freedom(options, own, spreads), Freedom({}, law, spreads)


def _powers(unknown, limited):
    """{other amplitude: factor} of the nonlinear forces of a term, powers of one law that is positive as a whole."""
    return {one.name: unknown.typical / one.typical for one in limited if unknown.force and one is not unknown}


def with_shape(model: Model, cause: Candidate, shape: dict, prior_width: float) -> Candidate:
    """The same cause with another shape, within its ranges; see `candidate`."""
    term = with_options(cause.term, shape, model.structure, model.sensors)
    return _with_prior(model, cause._replace(term=term, shape=dict(shape), shape_std={}), prior_width)


class ShapeRange(NamedTuple):
    """Search range of a shape option, logarithmic if it begins above zero."""

    low: float
    high: float
    goes_around: bool = False  # whether both ends are alike
    breaks: tuple[float, ...] = ()  # values, ascending, at which the effect may jump (the nodes)
    mirrored: bool = False  # whether fractions beyond an end are mirrored there instead of being at the end

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest fraction of a fit."""
        return (-np.inf, np.inf) if self.goes_around or self.mirrored else (0.0, 1.0)

    def between_breaks(self, fraction: float) -> tuple[float, float]:
        """Ends of the stretch between two breaks in which a fraction lies."""
        low, high = self.ends
        breaks = [self.fraction(value) for value in self.breaks]
        low = max((x + DIFFERENCE for x in breaks if 0 < x < 1 and x <= fraction), default=low)
        return low, min((x - DIFFERENCE for x in breaks if fraction < x < 1), default=high)

    def beyond(self, fraction: float) -> float | None:
        """The fraction on the other side of the break at which a fit ended, None if it ended at none."""
        for end, way in zip(self.between_breaks(fraction), (-1, 1), strict=True):
            if abs(fraction - end) < DIFFERENCE / 2 and 0 < end < 1:
                return end + 2 * way * DIFFERENCE
        return None

    def fraction(self, value: float) -> float:
        """Where a value lies in the range, 0 to 1."""
        if self.low > 0:
            return float(np.log(value / self.low) / np.log(self.high / self.low))
        return (value - self.low) / (self.high - self.low)

    def value(self, fraction: float) -> float:
        """The value at a fraction of the range; fractions below 0 or above 1 are at its end, mirrored, or go around."""
        if self.mirrored:
            fraction = abs((fraction + 1) % 2 - 1)
        fraction = fraction % 1 if self.goes_around else min(max(fraction, 0.0), 1.0)
        if self.low > 0:
            return float(self.low * (self.high / self.low) ** fraction)
        return float(self.low + fraction * (self.high - self.low))

    def slope(self, value: float) -> float:
        """Change of the value per change of the fraction."""
        return float(value * np.log(self.high / self.low)) if self.low > 0 else self.high - self.low

    def step(self, fraction: float) -> float:
        """Small change of the fraction for a derivative, within the range, to no break (a disc) and beyond none."""
        step = DIFFERENCE if fraction < 0.5 else -DIFFERENCE
        ends = [self.value(fraction), self.value(fraction + 1.5 * step)]
        here, there = np.searchsorted(self.breaks, ends, side="right")
        return -step if here != there and 0 <= fraction - step <= 1 else step

    def tried(self) -> list[float]:
        """Values over the range, of which the best is refined."""
        if self.goes_around:
            count = round(ANGLES_TRIED * (self.high - self.low) / (2 * np.pi))
            return [self.value(fraction) for fraction in np.arange(count) / count]
        return [self.value(fraction) for fraction in np.linspace(0, 1, SHAPES_TRIED)]


def shape_ranges(
    effect: str, structure: Structure, node: int | None = None, *, half_turn: bool = False
) -> dict[str, ShapeRange]:
    """Shape options of an effect on a rotor, or at a node, -> ShapeRange; angles go around, once or by half a turn."""
    plugin = registry().get("effect", effect, "diagnosis")
    ranges = plugin.ranges(structure, node)
    if half_turn:
        around = {name: ends for name, ends in ranges.items() if name.endswith("_rad") and np.ptp(ends) > np.pi}
        ranges |= {name: (low / 2, high / 2) for name, (low, high) in around.items()}
    nodes = tuple(sorted(structure.node_positions.values()))
    along = {name for name, (_, _, *scale) in plugin.shape.items() if scale == ["shaft"]}
    return {n: ShapeRange(*ends, n.endswith("_rad"), nodes if n in along else ()) for n, ends in ranges.items()}


def form_ranges(effect: str) -> dict[str, ShapeRange]:
    """Options of the form of an effect -> ShapeRange."""
    form, *_ = registry().get("effect", effect, "diagnosis").form
    return {name: ShapeRange(*ends, mirrored=True) for name, ends in form.items()}


def _shapes(plugin, structure, place):
    """Values of the first shape option over its range at a place; [{}] for an effect without one."""
    for name, ends in shape_ranges(plugin.name, structure, place.get("node")).items():
        return [{name: value} for value in ends.tried()]
    return [{}]


def variants_of(alternatives: dict) -> list[dict]:
    """Every combination of the alternatives of an effect, option -> function() -> values; [{}] without any."""
    values = product(*(known() for known in alternatives.values()))
    return [dict(zip(alternatives, chosen, strict=True)) for chosen in values]


def formulas_of(effect: str) -> list[dict]:
    """The variants of an effect that are tried where the others do not explain the records."""
    formulas = registry().get("effect", effect, "diagnosis").formulas
    return variants_of(formulas) if formulas else []


def with_vibration(model: Model, spectrum: Spectrum) -> Model:
    """The model whose usual sizes fit the records: the vibration of the median speed, all harmonics and sensors."""
    moving = spectrum.amplitude[..., spectrum.harmonics != 0, :]
    size = np.sqrt(np.mean(np.sum(np.abs(moving) ** 2, axis=-2), axis=-1))
    return replace(model, structure=replace(model.structure, vibration=float(np.median(size))))


def candidates(model: Model, settings: Settings) -> tuple[list[Candidate], dict[str, str]]:
    """Every effect at every place it offers on this rotor, as `settings` allow.

    returns : the candidates, and {effect: one line with file and place} of those whose plugin is broken
    """
    found, broken = [], {}
    for name, plugin in sorted(registry().plugins["effect"].items()):
        if not plugin.candidate or name in settings.leave_out:
            continue
        try:
            found += _candidates_of(plugin, model, settings, len(found))
        except Exception as error:  # of the plugin; the rest of the library is still searched
            broken[name] = blamed(error) or f"effect '{name}' ({plugin.file}): {type(error).__name__}: {error}"
    return found, broken


def _candidates_of(plugin, model, settings, first):
    """Candidates of one effect; their terms are labelled by number, from `first` on."""
    found = []
    variants = variants_of(plugin.any_form[2] or plugin.alternatives)
    freedoms = freedoms_of(plugin.name, any_form=True)
    for place in plugin.places(model.structure, model.sensors):
        for variant, shape in product(variants, _shapes(plugin, model.structure, place)):
            label = f"cause {first + len(found)}"
            with suppress(CannotAct):  # a place that other options of this rig exclude
                cause = plugin.name, place, shape, label, settings.prior_width, variant
                found.append(candidate(model, *cause, freedoms))
    return found
