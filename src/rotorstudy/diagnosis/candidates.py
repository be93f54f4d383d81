"""What may be the cause: every effect of the zoo at every place, and how much of a residual each explains."""

from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.fit import BEYOND, whitened
from rotorstudy.errors import RotorstudyError
from rotorstudy.plugins import registry
from rotorstudy.response import sensitivities
from rotorstudy.rig import make_term
from rotorstudy.terms import Term

SHAPES_TRIED = 5  # values of a shape option, before the best is refined


class Candidate(NamedTuple):
    """An effect at a place: plugin name, options of the place, its term without values.

    shape : options that stand inside a nonlinear force (a clearance), at one of the values tried
    fixed : unknown name -> amplitude, of an effect that is there or not and has no size to fit
    """

    effect: str
    where: dict
    term: Term
    shape: dict = {}
    fixed: dict = {}

    @property
    def cause(self):
        """What is named: the effect and its place, whatever its shape."""
        return self.effect + "".join(f", {key} {value}" for key, value in self.where.items())

    @property
    def label(self):
        return self.cause + "".join(f", {key} {value:.4g}" for key, value in self.shape.items())

    @property
    def names(self):
        return tuple(unknown.name for unknown in self.term.unknowns)


def candidate(model, effect, where, shape=None, label="cause"):
    """A candidate; raises RotorstudyError if the effect cannot act there."""
    plugin = registry().get("effect", effect, "diagnosis")
    item = {"kind": effect, **plugin.example, **where, **(shape or {}), "label": label}
    term = make_term("effect", item, model.structure, model.sensors, f"candidate {effect}")
    fixed = {unknown.name: unknown.typical for unknown in term.unknowns} if plugin.fixed else {}
    return Candidate(effect, where, term, dict(shape or {}), fixed)


def _shapes(plugin):
    """Values of the first shape option to try, all over its range; {} for an effect without."""
    if not plugin.shape:
        return [{}]
    (name, (low, high)), *_ = plugin.shape.items()
    values = np.geomspace(low, high, SHAPES_TRIED) if low > 0 else np.linspace(low, high, SHAPES_TRIED)
    return [{name: float(value)} for value in values]


def candidates(model, leave_out=()):
    """Every effect at every place it offers on this rotor; leave_out : effects not to be considered."""
    found = []
    for name, plugin in sorted(registry().plugins["effect"].items()):
        if not plugin.candidate or name in leave_out:
            continue
        for place in plugin.places(model.structure, model.sensors):
            for shape in _shapes(plugin):
                try:
                    found.append(candidate(model, name, place, shape, f"cause {len(found)}"))
                except RotorstudyError:  # it offers a place that this rig's other options rule out
                    continue
    return found


class Screened(NamedTuple):
    """What first-order columns say of a candidate.

    explained : fall of the cost if it alone is added, the base parameters moving along
    start     : (unknown,) its amplitudes there
    detection : (unknown,) amplitude whose fall of the cost is one: times sqrt(threshold), the detection limit
    """

    explained: float
    start: np.ndarray
    detection: np.ndarray


def screen(fitted, spectrum, prior, chosen):
    """Screened for each candidate of `chosen`, by the linear columns at a fit.

    The free parameters of the fit are projected out with their priors: what they can explain is not a new cause.
    """
    on_rotor = [u for c in chosen if c.term.acts_on == "rotor" for u in c.term.unknowns]
    on_output = [u for c in chosen if c.term.acts_on == "output" for u in c.term.unknowns]
    carried = int(np.abs(spectrum.harmonics).max()) + BEYOND
    columns = sensitivities(
        fitted.model, spectrum.speed, spectrum.harmonics, (on_rotor, on_output), fitted.theta, order=carried
    )
    columns = whitened(spectrum, np.moveaxis(columns, -1, 0)).T  # (component, unknown)
    order = [u.name for u in on_rotor + on_output]
    # rows of the priors below the data: a parameter that sits off its mean pulls back
    weight = np.array([1 / prior[n][1] if n in prior else 0.0 for n in fitted.names])
    mean = np.array([prior[n][0] if n in prior else 0.0 for n in fitted.names])
    known = np.vstack([fitted.jacobian, np.diag(weight)])
    residual = np.concatenate([fitted.residual, weight * (mean - fitted.free)])
    columns = np.vstack([columns, np.zeros((len(weight), columns.shape[1]))])
    length = np.linalg.norm(known, axis=0)
    basis, _ = np.linalg.qr(known[:, length > 0] / length[length > 0])
    size = np.linalg.norm(columns, axis=0)
    columns = columns - basis @ (basis.T @ columns)
    residual = residual - basis @ (basis.T @ residual)
    result = []
    for candidate in chosen:
        place = [order.index(name) for name in candidate.names]
        own, whole = columns[:, place], size[place]
        left = np.linalg.norm(own, axis=0)
        if not (left > 1e-6 * whole).any():
            result.append(Screened(0.0, np.zeros(len(place)), np.full(len(place), np.inf)))
            continue
        scale = np.where(left > 1e-6 * whole, left, np.inf)
        start = np.linalg.pinv(own / scale, rcond=1e-6) @ residual / scale
        if candidate.fixed:
            start = np.array(list(candidate.fixed.values()))
        gone = own @ start
        detection = np.full(len(place), np.inf)
        seen = np.isfinite(scale)
        detection[seen] = 1 / scale[seen]
        result.append(Screened(float(2 * gone @ residual - gone @ gone), start, detection))
    return result
