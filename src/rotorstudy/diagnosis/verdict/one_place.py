"""Whether one force explains the records: at one place of the rotor, free at every speed and harmonic.

Whatever a fault is, it acts by a force. If it acts at one coordinate, the motion of all measured nodes follows from
that force alone, by the receptances of the rotor. So the force is fitted freely, together with the values of the rig,
and what is left tells whether one place is enough. That needs no effect of the library, and no law of the force. Of two
faults much more than noise is left, unless the probes hardly see one of them or both push the same coordinate. So where
one force explains what several causes do, these are more likely an imitation of one fault that the library lacks.
"""

from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.explanations import Search
from rotorstudy.diagnosis.search.free_forces import DEPENDENT, free_force_columns
from rotorstudy.diagnosis.verdict.result import OnePlace
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import carried_order
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.entries import Entry
from rotorstudy.model.terms import Parameter, Term
from rotorstudy.response.neighbourhood import Neighbourhood

TRIED = 3  # places, the best by linearised receptances, at which the values of the rig are fitted too
STEPS, HALVINGS = 8, 4  # of that fit, and of a step that leaves more
CONVERGED = 1e-3  # relative decrease of the cost
EVEN = 0.5  # p-value of a force that leaves as much as causes do
INTERNAL = 2  # independent loads of an element at rest: a constant and a linear bending moment


def explaining_places(work: Search, spectrum: Spectrum) -> list[OnePlace]:
    """The places at which a force alone leaves no more than noise and the stated model error, the simplest first.

    work     : its base model and the prior of that
    spectrum : with the model error, without an error of causes
    returns  : none where the force takes more than half of the data (a force and a single orbit): too little is
               left to test
    """
    from scipy.special import fdtrc

    found = []
    for one, best in _fitted_at_places(work, spectrum, most_forces(spectrum)):
        p_value = float(fdtrc(best.freedom, spectrum.data_count, best.cost / best.freedom))
        if p_value >= work.settings.significance:
            found.append(_one_place(one, p_value))
    return sorted(found, key=lambda one: ("element" in one.where, -one.p_value))


def replacing_places(work: Search, spectrum: Spectrum) -> list[tuple[OnePlace, bool]]:
    """The nodes at which a force leaves less than the best explanation, by several causes, and whether beyond chance.

    It must leave less for each datum that it does not take, as pairs that are seen at different harmonics come near to
    it. That is beyond chance if the force, with its many amplitudes, explains more of what the causes leave than it
    would of noise.
    """
    from scipy.special import fdtrc

    causes, count = work.best.causes, spectrum.data_count
    cost, taken = work.best.fit.cost, sum(len(cause.names) + len(cause.shape) for cause in causes)
    found = []
    for one, best in _fitted_at_places(work, spectrum, min(most_forces(spectrum), 1)):
        left = best.cost / best.freedom
        p_value = float(fdtrc(best.freedom, count, left / min(1.0, cost / count)))
        if p_value >= EVEN:
            more = max(count - best.freedom - taken, 1)
            chance = fdtrc(more, best.freedom, max(cost - best.cost, 0.0) / more / left)
            found.append((_one_place(one, p_value), bool(chance < work.settings.significance)))
    return sorted(found, key=lambda one: -one[0].p_value)


def linearised_places(work: Search, spectrum: Spectrum) -> list[tuple[tuple, float]]:
    """((kind of place, its number, kind of force), cost) of one free force about the base fit, the least first.

    It acts at a node, or at what its bearing stands on.
    """
    structure = work.rig.structure
    known = {one: rows for one, rows in _places(structure) if one[2] == "force"}
    for node in structure.housings:
        known["the foundation at node", node, "force"] = structure.unit(node, "housing")[None]
    try:
        found = _trials(work, spectrum, work.base.stated_theta, known)
    except NoSteadyState:
        return []
    return sorted(((place, one.expected) for place, one in found.items()), key=lambda pair: pair[1])


def _one_place(place, p_value):
    return OnePlace(where={place[0]: place[1]}, motion=place[2], p_value=p_value)


def _fitted_at_places(work, spectrum, most):
    """(place, _Trial) of the best places of at most so many free forces each, fitted; none without a steady state."""
    known = {one: rows for one, rows in _places(work.rig.structure) if len(rows) <= most}
    try:
        starts = _trials(work, spectrum, work.base.stated_theta, known) if known else {}
    except NoSteadyState:
        return []
    near = sorted(known, key=lambda place: starts[place].expected)[:TRIED]
    return [(one, _fitted(work, spectrum, one, known[one], starts[one])) for one in near]


def most_forces(spectrum: Spectrum) -> float:
    """How many free forces take half of the data, of which enough is left to test them; of one orbit, half a force."""
    return spectrum.data_count / (4 * len(spectrum.speed) * len(spectrum.harmonics))  # orbits are two data a harmonic


def _places(structure):
    """((kind of place, its number, kind of force), rows (row, dof)) of every node and element."""
    units = np.eye(len(structure.dofs))
    kinds = {"translation": "force", "tilt": "moment"}
    for (node, motion), row in zip(structure.dofs, units, strict=True):
        if motion == "housing":
            continue
        yield ("node", node, kinds[motion]), row[None]
    for place in structure.crack_places():
        if "element" in place and structure.curvature_at is not None:
            loads = np.linalg.svd(structure.stiffness_of(place["element"]))[0][:, :INTERNAL]
            yield ("element", place["element"], "bending"), loads.T


class _Trial(NamedTuple):
    """Values of the rig and a force at a place, and the Gauss-Newton step from there.

    theta, force   : (parameter,), (row, speed, harmonic) complex, N or N m
    cost, expected : there, and after the step if the model were linear;  freedom : number of data less free forces
    """

    theta: np.ndarray
    force: np.ndarray
    cost: float
    expected: float
    freedom: int
    step: tuple[np.ndarray, np.ndarray]


def _trials(work, spectrum, theta, places, force=None):
    """{place: _Trial} at theta (parameter,) of the base model, with a force at the only place or without one."""
    now = _with_force(work, spectrum, theta, places, force)
    near = Neighbourhood(now.model, spectrum.speed, spectrum.harmonics, now.theta, order=carried_order(spectrum))
    speeds, prior = len(spectrum.speed), now.prior
    columns = np.column_stack([now.residual, now.jacobian]).reshape(speeds, -1, 1 + len(now.names))
    known = np.column_stack([prior.whitener @ (prior.mean - now.free), prior.whitener])
    return {
        place: _trial(
            columns, known, free_force_columns(near, spectrum, rows), theta, force, work.model.position(now.names)
        )
        for place, rows in places.items()
    }


def _trial(columns, known, forces, theta, force, free):
    """The _Trial at theta with a force.

    columns : (speed, component, 1 + free) residual and derivatives;  known : (free, 1 + free) of the prior
    forces  : (row, speed, component, 2 harmonic) of `free_force_columns`;  free : (free,) positions in theta
    """
    rows, speeds, _, parts = forces.shape
    joined = np.concatenate(forces, axis=-1)
    inverse = np.linalg.pinv(joined, rcond=DEPENDENT)  # (speed, row * 2 harmonic, component)
    left = np.concatenate([*(columns - joined @ (inverse @ columns)), known])
    residual, jacobian = left[:, 0], left[:, 1:]
    scale = np.linalg.norm(jacobian, axis=0)
    step = np.linalg.lstsq(jacobian / scale, residual, rcond=None)[0] / scale
    after = residual - jacobian @ step
    moved = (inverse @ (columns[..., 0] - columns[..., 1:] @ step)[..., None])[..., 0].reshape(
        speeds, rows, 2, parts // 2
    )
    whole, cost = np.zeros_like(theta), np.sum(columns[..., 0] ** 2) + np.sum(known[:, 0] ** 2)
    whole[free] = step
    change = np.moveaxis(moved[:, :, 0] + 1j * moved[:, :, 1], 1, 0)
    freedom = columns[..., 0].size - int(np.sum(np.linalg.matrix_rank(joined)))
    force = 0 * change if force is None else force
    return _Trial(theta, force, float(cost), float(after @ after), freedom, (whole, change))


def _with_force(work, spectrum, theta, places, force):
    """The base model at theta with a force at the only place, evaluated as a Fit."""
    model, values = work.model, dict(zip(work.model.names, theta, strict=True))
    if force is not None:
        (rows,) = places.values()
        entries = tuple(
            Entry(row, on="one", shift=int(n), gain=_over(spectrum.speed, own[:, h]))
            for row, own in zip(rows, force, strict=True)
            for h, n in enumerate(spectrum.harmonics)
        )
        term = Term("force", (Parameter("force at one place", "1", entries, 1.0),), {"force at one place": 1.0})
        model, values = model.plus(term), values | {"force at one place": 1.0}
    return fit(model, spectrum, work.prior, start=np.array([values[name] for name in model.names]), steps=0)


def _over(speeds, values):
    """Gain of given values (speed,) at the measured speeds."""
    return lambda speed: np.interp(speed, speeds, values)


def _fitted(work, spectrum, place, rows, start):
    """The _Trial of least cost that some steps from a first one reach, shortened where they leave more."""
    best = start
    for _ in range(STEPS):
        for halving in range(HALVINGS):
            theta, force = (at + 0.5**halving * step for at, step in zip(best[:2], best.step, strict=True))
            try:
                found = _trials(work, spectrum, theta, {place: rows}, force)[place]
            except NoSteadyState:
                continue
            if found.cost < best.cost:
                break
        else:
            return best
        before, best = best.cost, found
        if before - best.cost < CONVERGED * best.cost:
            break
    return best
