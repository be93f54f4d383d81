"""What may be the cause: every effect of the zoo at every place, and how much of a residual each explains."""

from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.fit import whitened
from rotorstudy.errors import RotorstudyError
from rotorstudy.plugins import registry
from rotorstudy.response import sensitivities
from rotorstudy.rig import make_term
from rotorstudy.terms import Term


class Candidate(NamedTuple):
    """An effect at a place: plugin name, options of the place, and its term without values."""

    effect: str
    where: dict
    term: Term

    @property
    def label(self):
        return self.effect + "".join(f", {key} {value}" for key, value in self.where.items())

    @property
    def names(self):
        return tuple(unknown.name for unknown in self.term.unknowns)


def candidates(model, leave_out=()):
    """Every effect at every place it offers on this rotor; leave_out : effects not to be considered."""
    found = []
    for name, plugin in sorted(registry().plugins["effect"].items()):
        if not plugin.candidate or name in leave_out:
            continue
        for place in plugin.places(model.structure, model.sensors):
            item = {"kind": name, **plugin.example, **place, "label": f"cause {len(found)}"}
            try:
                term = make_term("effect", item, model.structure, model.sensors, f"candidate {name}")
            except RotorstudyError:  # it offers a place that this rig's other options rule out
                continue
            found.append(Candidate(name, place, term))
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
    columns = sensitivities(fitted.model, spectrum.speed, spectrum.harmonics, (on_rotor, on_output), fitted.theta)
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
        gone = own @ start
        detection = np.full(len(place), np.inf)
        seen = np.isfinite(scale)
        detection[seen] = 1 / scale[seen]
        result.append(Screened(float(gone @ gone), start, detection))
    return result
