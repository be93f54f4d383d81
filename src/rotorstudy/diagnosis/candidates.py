"""The hypotheses: every effect of the library at every place."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import CannotAct
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.registry import blamed, registry
from rotorstudy.model.rig import make_term
from rotorstudy.model.terms import Term, share_of

SHAPES_TRIED = 9  # values of a shape option, before the best is refined
FIXED = 0.02  # standard deviation of an amplitude that is 0 or 1: what the uncertainty of the probe calibration


class Candidate(NamedTuple):
    """An effect at a place: plugin name, options of the place, its term without values.

    prior    : unknown name -> (mean, std) of its amplitude before anything is measured
    positive : unknown name -> {parameter of the base: factor}: it cannot be negative together with these, which act
               alike; where there are none, the prior is the upper half of that normal distribution
    fixed    : its amplitude is known where the effect is present; the width of its prior is not varied
    options  : other options, the same for all candidates of the effect
    shape    : options inside a nonlinear force (a clearance), at one of the values tried
    """

    effect: str
    where: dict
    term: Term
    prior: dict
    positive: dict = {}
    fixed: bool = False
    shape: dict = {}
    options: dict = {}

    @property
    def cause(self):
        """Name in a verdict: the effect and its place, without the shape."""
        return self.effect + "".join(f", {key} {value}" for key, value in self.where.items())

    @property
    def fault(self):
        """Name of the fault that it is a part of: the cause without the option that numbers the parts."""
        parts = registry().get("effect", self.effect).parts
        return self.effect + "".join(f", {key} {value}" for key, value in self.where.items() if key != parts)

    @property
    def label(self):
        """The cause with its shape: unique among the candidates."""
        return self.cause + "".join(f", {key} {value:.4g}" for key, value in self.shape.items())

    @property
    def names(self):
        """(unknown,) names of its amplitudes."""
        return tuple(unknown.name for unknown in self.term.unknowns)

    @property
    def parameter(self):
        """(unknown,) position of the parameter of each amplitude: real and imaginary part have the same one."""
        return np.array([i for i, p in enumerate(self.term.parameters) for _ in range(2 if p.is_complex else 1)])


def candidate(
    model: Model,
    effect: str,
    where: dict,
    shape: dict | None = None,
    label: str = "cause",
    prior_width: float = 10.0,
) -> Candidate:
    """An effect at a place, with the prior of its amplitudes.

    Parameters
    ----------
    model : Model
    effect : str
        Name of the plugin.
    where, shape : dict
        Options of the place, and of the shape.
    label : str
        Of its term.
    prior_width : float
        Standard deviation of its amplitude, in typical sizes.

    Returns
    -------
    Candidate

    Raises
    ------
    CannotAct
        If the effect cannot act there.
    """
    plugin = registry().get("effect", effect, "diagnosis")
    options = {**plugin.example, **plugin.hypothesis}
    item = {"kind": effect, **options, **where, **(shape or {}), "label": label}
    term = make_term("effect", item, model.structure, model.sensors, f"candidate {effect}")
    mean, std = (1.0, FIXED) if plugin.fixed else (0.0, prior_width)
    prior = {unknown.name: (mean * unknown.typical, std * unknown.typical) for unknown in term.unknowns}
    positive = {unknown.name: _same(unknown, term, model) for unknown in term.unknowns if plugin.positive}
    return Candidate(effect, where, term, prior, positive, plugin.fixed, dict(shape or {}), options)


def _same(unknown, term, model):
    """{parameter of the model: factor} of those that act as an unknown of a term does, so that the two add up."""
    there = model.output_unknowns if term.acts_on_output else model.rotor_unknowns
    shares = {known.name: share_of(unknown, known) for known in there}
    return {name: share for name, share in shares.items() if share > 0}


def _shapes(ranges):
    """Values of the first shape option over its range; [{}] for an effect without one."""
    if not ranges:
        return [{}]
    (name, (low, high)), *_ = ranges.items()
    values = np.geomspace(low, high, SHAPES_TRIED) if low > 0 else np.linspace(low, high, SHAPES_TRIED)
    return [{name: float(value)} for value in values]


def with_vibration(model: Model, spectrum: Spectrum) -> Model:
    """The model whose usual sizes fit the records: the vibration of the median speed, all harmonics and sensors.

    Parameters
    ----------
    model : Model
    spectrum : Spectrum

    Returns
    -------
    Model
    """
    moving = spectrum.amplitude[..., spectrum.harmonics != 0, :]
    size = np.sqrt(np.mean(np.sum(np.abs(moving) ** 2, axis=-2), axis=-1))
    return replace(model, structure=replace(model.structure, vibration=float(np.median(size))))


def candidates(model: Model, settings: Settings) -> tuple[list[Candidate], dict[str, str]]:
    """Every effect at every place it offers on this rotor, as `settings` allow.

    Parameters
    ----------
    model : Model
    settings : Settings

    Returns
    -------
    list of Candidate
    dict of str
        Effect -> one line with file and place, for those whose plugin is broken.
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
    for place in plugin.places(model.structure, model.sensors):
        for shape in _shapes(plugin.ranges(model.structure)):
            label = f"cause {first + len(found)}"
            try:
                found.append(candidate(model, plugin.name, place, shape, label, settings.prior_width))
            except CannotAct:  # a place that other options of this rig exclude
                continue
    return found
