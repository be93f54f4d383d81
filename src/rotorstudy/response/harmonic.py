"""Steady-state harmonic response of a model and its derivatives by the amplitudes.

Without entries on conj(z) or with a shift, harmonics do not see each other and are solved one by one. Otherwise
R_n is coupled with R_{n-k} and conj(R_{-n}); then q_n and w_n = conj(q_{-n}) are unknowns side by side, and the
blocks that really are connected are solved together. All speeds, harmonics and trials go through one batched solve.
nonlinear forces, which are not linear, are then added speed by speed (see `alternating`).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.errors import NoSteadyState, RotorstudyError
from rotorstudy.model.model import Model
from rotorstudy.model.terms import apply_entries
from rotorstudy.response.alternating import nonlinear_column, seen_coordinates, steady_state
from rotorstudy.response.statics import static_deflection

NUMBERS_AT_ONCE = 5e7  # complex numbers in the matrices of one solve, 0.8 GB; beyond, speeds are taken in parts
CONDENSED_AT_MOST = 1e4  # of the stiffness, passed on by condensed coordinates: four of sixteen digits are lost there
COUPLED_ORDER = 15  # harmonics -15..15 are carried when harmonics are coupled; a caller may ask for more


@dataclass(frozen=True, eq=False)
class Layout:
    """Which unknowns are solved together.

    harmonics : (harmonic,) all harmonics carried; unknown i is q of harmonic i, unknown i + H is w of harmonic i
    groups    : arrays (block, member) of unknowns; every block of a group has the same size
    doubled   : True if the w_n are carried
    mirrors   : for each group, whether its w_n stand for the q_{-n} of mirrored blocks that are left out
    """

    harmonics: np.ndarray
    groups: tuple[np.ndarray, ...]
    doubled: bool
    mirrors: tuple[bool, ...]


def check_speed(speed):
    """Speeds as a (speed,) array, or an error: harmonics of a rotor that does not turn do not exist."""
    speed = np.atleast_1d(np.asarray(speed, float))
    if not np.all(np.isfinite(speed)) or np.any(speed <= 0):
        bad = speed[~(np.isfinite(speed) & (speed > 0))][0]
        raise RotorstudyError(f"speed {bad:g} rad/s: harmonics need a rotor that turns; give speeds > 0 rad/s")
    return speed


def check_harmonics(harmonics):
    """Harmonics as a (harmonic,) integer array, or an error: whole numbers, each once, at least one."""
    given = list(harmonics)
    whole = [n for n in given if isinstance(n, (int, np.integer)) and not isinstance(n, bool)]
    if not given or len(whole) < len(given) or len(set(given)) < len(given):
        raise RotorstudyError(f"harmonics {given}: give whole numbers, each once, such as 0, 1, 2, -1")
    return np.array(given, int)


def layout(model, harmonics, order=COUPLED_ORDER):
    """Find the blocks of harmonics that the model couples."""
    links = [
        frozenset((e.is_conjugate, e.shift) for u in unknowns for e in u.entries if e.reads_motion)
        for unknowns in (model.rotor_unknowns, model.output_unknowns)
    ]
    return _layout(*links, bool(model.nonlinear_forces), tuple(int(n) for n in harmonics), order)


@lru_cache(maxsize=256)
def _layout(rotor, output, has_local_forces, harmonics, order):
    """The layout of entries of the rotor and of the output, each (conjugate, shift)."""
    harmonics = np.asarray(harmonics, int)
    doubled = any(mirrored for mirrored, _ in rotor)
    read = [(harmonics - shift) * (-1 if mirrored else 1) for mirrored, shift in output]  # harmonics the sensors mix in
    needed = np.unique(np.concatenate([harmonics, *read]))
    if has_local_forces:
        reach = max(order, np.abs(needed).max())
        needed = np.arange(-reach, reach + 1)
    if any(shift for _, shift in rotor):
        reach = max(order, np.abs(needed).max())
        carried = np.arange(-reach, reach + 1)
    elif doubled:
        carried = np.unique(np.concatenate([needed, -needed]))
    else:
        carried = needed
    if not any(shift or mirrored for mirrored, shift in rotor):
        return Layout(carried, (np.arange(len(carried))[:, None],), False, (False,))

    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    size = len(carried) * (2 if doubled else 1)
    linked = [_links(*link, tuple(carried.tolist()), doubled)[:2] for link in sorted(rotor)]
    row, column = np.concatenate(linked, axis=1)
    _, block = connected_components(coo_array((np.ones(len(row)), (row, column)), (size, size)), directed=False)
    wanted = np.isin(carried, needed)
    groups, solved = {}, set()
    for b in np.unique(block[: len(carried)][wanted]):
        members = np.flatnonzero(block == b)
        mirror = block[mirrored_unknown(members[0], carried)] if doubled else b
        if mirror in solved:
            continue  # the conjugates of a block that is solved already
        solved.add(b)
        # members are grouped by what they are made of, so that a group shares its measured pattern
        kind = tuple((m >= len(carried), bool(np.isin(own_harmonic(m, carried), harmonics))) for m in members)
        groups.setdefault((mirror != b, kind), []).append(members)
    mirrors = tuple(mirror for mirror, _ in groups)
    return Layout(carried, tuple(np.array(members) for members in groups.values()), doubled, mirrors)


def mirrored_unknown(unknown, carried):
    """The unknown that is the conjugate of another: w_{-n} of q_n, q_{-n} of w_n; carried harmonics come with -n."""
    count = len(carried)
    opposite = np.searchsorted(carried, -carried[unknown % count])
    return np.where(np.asarray(unknown) < count, count, 0) + opposite


def own_harmonic(unknown, carried):
    """Harmonic of q that an unknown (or array of unknowns) stands for: n of q_n itself, -n of w_n = conj(q_{-n})."""
    count = len(carried)
    return np.where(np.asarray(unknown) < count, 1, -1) * carried[np.asarray(unknown) % count]


@lru_cache(maxsize=4096)
def _links(mirrored, shift, carried, doubled):
    """Unknowns (row, column) an entry connects, and the harmonic of the equation each pair belongs to."""
    count = len(carried)
    index = {n: i for i, n in enumerate(carried)}
    links = []
    for copy in (0, 1) if doubled else (0,):
        sign = 1 if copy == 0 else -1
        other = 1 - copy if mirrored else copy
        for i, n in enumerate(carried):
            source = n - sign * shift
            if source in index:
                links.append((copy * count + i, other * count + index[source], sign * n))
    found = np.array(links, int).reshape(-1, 3).T
    found.setflags(write=False)
    return found


def forced_harmonics(model, order=COUPLED_ORDER):
    """(harmonic,) every harmonic the sensors show: of the forces (-order..order if coupled), moved by the sensors."""
    entries = [e for u in model.rotor_unknowns for e in u.entries]
    if model.nonlinear_forces or any(e.shift and e.reads_motion for e in entries):
        vibrating = set(range(-order, order + 1))
    else:
        vibrating = {0} | {e.shift for e in entries}
        vibrating |= {-n for n in vibrating} if any(e.reads_motion and e.is_conjugate for e in entries) else set()
    shown = set(vibrating)
    for entry in (e for u in model.output_unknowns for e in u.entries):
        if not entry.reads_motion:
            shown.add(entry.shift)
        else:
            shown |= {entry.shift + (-n if entry.is_conjugate else n) for n in vibrating}
    return np.array(sorted(shown))


def operator(model, theta, speed, blocks, kept=None):
    """Dynamic stiffness D of each group, D q = force.

    theta   : (..., rotor parameter)
    speed   : (speed,) rad/s
    kept    : (dof,) coordinates to which the others, where no force acts, are condensed; all by default
    returns : list of (..., speed, block, member * dof, member * dof) complex
    raises  : LinAlgError where the others resonate on their own, so that condensing would lose digits
    """
    structure, carried = model.structure, blocks.harmonics
    kept = np.arange(len(structure.dofs)) if kept is None else kept
    count, dof = len(carried), len(kept)
    speed = np.asarray(speed, float)
    result = []
    for group in blocks.groups:
        n = np.where(group < count, carried[group % count], -carried[group % count])  # harmonic of the equation
        nw = n * speed[:, None, None]
        base = structure.stiffness - (nw**2)[..., None, None] * structure.mass
        base = base + (nw * speed[:, None, None])[..., None, None] * structure.gyroscopic
        base = _condensed(base, kept, np.diag(structure.stiffness))
        base = np.where((group < count)[..., None, None], base, base.conj())
        full = np.zeros((*theta.shape[:-1], len(speed), *group.shape, dof, group.shape[1], dof), complex)
        for m in range(group.shape[1]):
            full[..., m, :, m, :] = base[:, :, m]
        result.append(full)
    at = {int(coordinate): i for i, coordinate in enumerate(kept)}
    for p, unknown in enumerate(model.rotor_unknowns):
        for entry in (e for e in unknown.entries if e.reads_motion and e.places):
            i, j, value = (np.array(part) for part in zip(*entry.places, strict=True))
            i, j = ([at[k] for k in part.tolist()] for part in (i, j))
            for full, (n, is_w, block, row, column) in zip(
                result, _linked_members(blocks, entry.is_conjugate, entry.shift), strict=True
            ):
                if not len(n):
                    continue
                factor = entry.gain_at(speed[:, None], n) * (1j * (n - entry.shift) * speed[:, None]) ** entry.order
                both = factor[..., None] * value  # (speed, link, place)
                both = np.where(is_w[:, None], both.conj(), both)
                full[..., block, row, i, column, j] -= theta[..., p, None, None, None] * both
    return [full.reshape(*full.shape[:-4], full.shape[-4] * dof, full.shape[-4] * dof) for full in result]


@lru_cache(maxsize=4096)
def _linked_members(blocks, mirrored, shift):
    """For each group, what an entry links: harmonic of the equation, whether it is of w, block, row and column member.

    The last three are columns, to be set against the places in the matrix.
    """
    count = len(blocks.harmonics)
    row, column, n = _links(mirrored, shift, tuple(blocks.harmonics.tolist()), blocks.doubled)
    found = []
    for group in blocks.groups:
        block, member = np.full(2 * count, -1), np.zeros(2 * count, int)
        block[group], member[group] = np.arange(len(group))[:, None], np.arange(group.shape[1])
        here = block[row] >= 0
        r, c = row[here], column[here]
        found.append((n[here], r >= count, block[r][:, None], member[r][:, None], member[c][:, None]))
    return found


def _condensed(matrix, kept, stiffness):
    """(..., kept, kept) of a dynamic stiffness (..., dof, dof), the other coordinates condensed; stiffness (dof,)."""
    if len(kept) == matrix.shape[-1]:
        return matrix
    gone = np.setdiff1d(np.arange(matrix.shape[-1]), kept)
    rows, columns = matrix[..., kept, :], matrix[..., gone, :]
    passed = rows[..., gone] @ np.linalg.solve(columns[..., gone], columns[..., kept])
    size = np.abs(np.diagonal(passed, axis1=-2, axis2=-1)) / stiffness[kept]
    if not np.all(size < CONDENSED_AT_MOST):
        raise np.linalg.LinAlgError
    return rows[..., kept] - passed


def resting(unknown, deflection):
    """The deflection an amplitude acts on; the springs that carry the static load are balanced by it."""
    return None if unknown.carries else deflection


def force_at_rest(model, theta, speed, carried, deflection):
    """Force harmonics (..., speed, harmonic, dof) on a rotor at a static deflection (dof,) or (..., speed, dof)."""
    rest = np.zeros((len(speed), len(carried), len(model.structure.dofs)), complex)
    force = np.zeros((*theta.shape[:-1], *rest.shape), complex)
    for p, unknown in enumerate(model.rotor_unknowns):
        given = tuple(e for e in unknown.entries if e.order == 0)
        if given:
            column = apply_entries(given, rest, speed, carried, resting(unknown, deflection))
            force = force + theta[..., p, None, None, None] * column
    return force


def gather(amplitudes, group, count, harmonics):
    """Harmonics (..., speed, harmonic, dof) as the unknowns of a group, (..., speed, block, member * dof)."""
    if group.shape == (count, 1):
        return amplitudes  # every harmonic on its own, in order
    direct = group[0] < count  # the same for every block of a group
    taken = np.empty((*amplitudes.shape[:-2], *group.shape, amplitudes.shape[-1]), complex)
    taken[..., direct, :] = amplitudes[..., group[:, direct], :]
    if not direct.all():
        negative = mirrored_unknown(group[:, ~direct], harmonics)
        taken[..., ~direct, :] = np.conj(amplitudes[..., negative, :])
    return taken.reshape(*taken.shape[:-2], -1)


def _solve(matrices, force, blocks, speed):
    """Solve every group; force and result (..., speed, harmonic, dof, column)."""
    try:
        with np.errstate(divide="ignore", invalid="ignore"):
            found = _solve_groups(matrices, force, blocks)
    except np.linalg.LinAlgError:
        found = np.array(np.nan)
    if not np.isfinite(found).all():
        raise NoSteadyState(
            f"no steady state at one of {_some(speed)} rad/s: a harmonic meets an undamped natural frequency, or a "
            "parameter is not finite; add damping or leave that speed out"
        )
    return found


def _some(speed):
    return ", ".join(f"{w:g}" for w in speed[:5]) + (" ..." if len(speed) > 5 else "")


def _solve_groups(matrices, force, blocks):
    count, dof = len(blocks.harmonics), force.shape[-2]
    if not blocks.doubled and len(blocks.groups) == 1 and blocks.groups[0].shape == (count, 1):
        return force / matrices[0] if dof == 1 else np.linalg.solve(matrices[0], force)
    result = np.zeros_like(force)
    columns = np.moveaxis(force, -1, 0)
    for matrix, group, mirror in zip(matrices, blocks.groups, blocks.mirrors, strict=True):
        right = np.moveaxis(gather(columns, group, count, blocks.harmonics), 0, -1)
        solved = np.linalg.solve(matrix, right)
        solved = solved.reshape(*solved.shape[:-2], group.shape[1], dof, solved.shape[-1])
        direct = group < count
        result[..., group[direct], :, :] = solved[..., direct, :, :]
        if mirror:
            result[..., mirrored_unknown(group[~direct], blocks.harmonics), :, :] = solved[..., ~direct, :, :].conj()
    return result


class Linearised(NamedTuple):
    """A response and its derivatives by the amplitudes.

    response : (..., speed, harmonic, dof or sensor) complex, m (rad for tilts)
    jacobian : (..., speed, harmonic, dof or sensor, parameter) complex, m per unit of each amplitude
    """

    response: np.ndarray
    jacobian: np.ndarray


def harmonic_response(
    model: Model,
    speed: ArrayLike,
    harmonics: Iterable[int],
    theta: ArrayLike | None = None,
    *,
    order: int = COUPLED_ORDER,
) -> np.ndarray:
    """Displacement harmonics of the coordinates, from the static deflection.

    Parameters
    ----------
    model : Model
        Rotor with its terms.
    speed : array (speed,)
        Spin speeds in rad/s.
    harmonics : ints (harmonic,)
        Harmonics n of e^{jnwt}, n > 0 forward, n < 0 backward.
    theta : array (..., parameter), optional
        Amplitudes in the units of `model.units`, in the order of `model.names`; the model's own by default.
    order : int, optional
        Harmonics -order..order are carried where the model couples harmonics.

    Returns
    -------
    array (..., speed, harmonic, dof)
        Complex, m for translations, rad for tilts.

    Raises
    ------
    RotorstudyError
        For a speed that is not positive, harmonics that are not whole numbers, or an amplitude without a value.
    NoSteadyState
        If there is no steady state at a speed.
    """
    speed, harmonics, theta, blocks = _asked(model, speed, harmonics, theta, order)
    found, _ = _carried_response(model, speed, theta, blocks, False)
    return found[..., _places(harmonics, blocks), :]


def harmonic_response_and_jacobian(
    model: Model,
    speed: ArrayLike,
    harmonics: Iterable[int],
    theta: ArrayLike | None = None,
    *,
    order: int = COUPLED_ORDER,
) -> Linearised:
    """Displacement harmonics of the coordinates, and their derivatives by the amplitudes.

    Parameters
    ----------
    model : Model
        Rotor with its terms.
    speed : array (speed,)
        Spin speeds in rad/s.
    harmonics : ints (harmonic,)
        Harmonics n of e^{jnwt}, n > 0 forward, n < 0 backward.
    theta : array (..., parameter), optional
        Amplitudes in the units of `model.units`, in the order of `model.names`; the model's own by default.
    order : int, optional
        Harmonics -order..order are carried where the model couples harmonics.

    Returns
    -------
    Linearised
        Response (..., speed, harmonic, dof) in m or rad and its derivatives (..., speed, harmonic, dof, parameter) per
        unit of each amplitude.

    Raises
    ------
    RotorstudyError
        For a speed that is not positive, harmonics that are not whole numbers, or an amplitude without a value.
    NoSteadyState
        If there is no steady state at a speed.
    """
    speed, harmonics, theta, blocks = _asked(model, speed, harmonics, theta, order)
    found, derivatives = _carried_response(model, speed, theta, blocks, True)
    chosen = _places(harmonics, blocks)
    return Linearised(found[..., chosen, :], derivatives[..., chosen, :, :])


def _asked(model, speed, harmonics, theta, order):
    """Speeds, harmonics and amplitudes as arrays, and the Layout that they need."""
    speed, harmonics = check_speed(speed), check_harmonics(harmonics)
    theta = np.asarray(model.theta if theta is None else theta, float)
    return speed, harmonics, theta, layout(model, harmonics, order)


def _places(harmonics, blocks):
    return [int(np.flatnonzero(blocks.harmonics == n)[0]) for n in harmonics]


def _carried_response(model, speed, theta, blocks, jacobian, kept=None):
    """Harmonics (..., speed, harmonic, dof) and derivatives, at the coordinates `kept`; zero at the others."""
    dof = len(model.structure.dofs)
    kept = np.arange(dof) if kept is None or model.nonlinear_forces else kept
    trials, links = np.prod(theta.shape[:-1]), sum(g.size * g.shape[1] for g in blocks.groups)
    numbers = len(speed) * links * max(trials * len(kept) ** 2, dof**2)
    if numbers > NUMBERS_AT_ONCE and len(speed) > 1 and np.ndim(model.held_deflection) < 2:
        half = len(speed) // 2
        parts = [_carried_response(model, part, theta, blocks, jacobian, kept) for part in (speed[:half], speed[half:])]
        found, derivatives = zip(*parts, strict=True)
        return np.concatenate(found, axis=-3), np.concatenate(derivatives, axis=-4) if jacobian else None
    rotor = theta[..., : len(model.rotor_unknowns)]
    try:
        matrices = operator(model, rotor, speed, blocks, kept)
    except np.linalg.LinAlgError:
        kept = np.arange(dof)
        matrices = operator(model, rotor, speed, blocks)

    def solve(force):  # (..., speed, harmonic, dof, column)
        if len(kept) == dof:
            return _solve(matrices, force, blocks, speed)
        found = np.zeros(force.shape, complex)
        found[..., kept, :] = _solve(matrices, force[..., kept, :], blocks, speed)
        return found

    deflection, moved = static_deflection(model, speed, rotor, jacobian=jacobian)
    force = force_at_rest(model, rotor, speed, blocks.harmonics, deflection)
    force[..., blocks.harmonics == 0, :] += model.static_residual
    found = solve(force[..., None])[..., 0]
    tangents = None
    if model.nonlinear_forces:
        found, tangents = _with_nonlinear_forces(model, rotor, speed, blocks, matrices, deflection, found)
    if not jacobian:
        return found, None
    columns = [
        apply_entries(u.entries, found, speed, blocks.harmonics, resting(u, deflection)) for u in model.rotor_unknowns
    ]
    for p, local in model.nonlinear_forces:
        columns[p] = nonlinear_column(local, found, speed, blocks.harmonics, deflection)
    if moved:
        forces = _moved_force(model, rotor, speed, blocks.harmonics, np.stack(list(moved.values())))
        for p, force in zip(moved, np.broadcast_to(forces, (len(moved), *found.shape)), strict=True):
            columns[p] = columns[p] + force
    columns = np.stack(columns, axis=-1) if columns else np.zeros((*found.shape, 0))
    derivatives = np.zeros((*found.shape, theta.shape[-1]), complex)
    changes = solve(columns)
    if tangents is not None:
        for place, tangent in np.ndenumerate(tangents):
            changes[place] = tangent.response(changes[place])
    derivatives[..., : columns.shape[-1]] = changes
    return found, derivatives


def _with_nonlinear_forces(model, theta, speed, blocks, matrices, deflection, linear):
    """Harmonics (..., speed, harmonic, dof) with the forces that are not linear, and Tangents (..., speed)."""
    carried, dof = blocks.harmonics, len(model.structure.dofs)
    seen = seen_coordinates([force for _, force in model.nonlinear_forces])
    unit = np.zeros((len(carried), len(seen), len(carried), dof), complex)
    row, column = np.ix_(range(len(carried)), range(len(seen)))
    unit[row, column, row, seen[column]] = 1
    unit = np.moveaxis(unit.reshape(-1, len(carried), dof), 0, -1)
    unit = np.broadcast_to(np.concatenate([unit, 1j * unit], axis=-1), (*linear.shape, 2 * unit.shape[-1]))
    reply = _solve(matrices, unit, blocks, speed)
    deflection = np.broadcast_to(deflection, (*linear.shape[:-2], dof))
    found, tangents = np.empty_like(linear), np.empty(linear.shape[:-2], object)
    for place in np.ndindex(tangents.shape):
        forces = [(theta[(*place[:-1], p)], force) for p, force in model.nonlinear_forces]
        found[place], tangents[place] = steady_state(
            forces, speed[place[-1]], carried, deflection[place], linear[place], reply[place]
        )
    return found, tangents


def _moved_force(model, theta, speed, carried, change):
    """Change of the force at rest by changes (change, ..., speed, dof) of the static deflection."""
    rest = np.zeros((len(speed), len(carried), len(model.structure.dofs)), complex)
    force = np.zeros((), complex)
    for p, unknown in enumerate(model.rotor_unknowns):
        acting = tuple(e for e in unknown.entries if e.order == 0 and not e.is_constant)
        if acting and not unknown.carries:
            force = force + theta[..., p, None, None, None] * apply_entries(acting, rest, speed, carried, change)
    return force


def measured_response(
    model: Model,
    speed: ArrayLike,
    harmonics: Iterable[int],
    theta: ArrayLike | None = None,
    *,
    order: int = COUPLED_ORDER,
) -> np.ndarray:
    """What the sensors show: the translations at `model.sensors` changed by the output terms.

    Parameters
    ----------
    model : Model
        Rotor with its terms.
    speed : array (speed,)
        Spin speeds in rad/s.
    harmonics : ints (harmonic,)
        Harmonics n of e^{jnwt}, n > 0 forward, n < 0 backward.
    theta : array (..., parameter), optional
        Amplitudes in the units of `model.units`, in the order of `model.names`; the model's own by default.
    order : int, optional
        Harmonics -order..order are carried where the model couples harmonics.

    Returns
    -------
    array (..., speed, harmonic, sensor)
        Complex, m.

    Raises
    ------
    RotorstudyError
        For a speed that is not positive, harmonics that are not whole numbers, or an amplitude without a value.
    NoSteadyState
        If there is no steady state at a speed.
    """
    speed, harmonics, theta, blocks = _asked(model, speed, harmonics, theta, order)
    found, _ = _carried_response(model, speed, theta, blocks, False, model.involved)
    true = found[..., model.measured]
    shown = true.copy()
    for p, unknown in enumerate(model.output_unknowns, start=len(model.rotor_unknowns)):
        shown += theta[..., p, None, None, None] * apply_entries(unknown.entries, true, speed, blocks.harmonics)
    return shown[..., _places(harmonics, blocks), :]


def measured_response_and_jacobian(
    model: Model,
    speed: ArrayLike,
    harmonics: Iterable[int],
    theta: ArrayLike | None = None,
    *,
    order: int = COUPLED_ORDER,
) -> Linearised:
    """What the sensors show, and its derivatives by the amplitudes.

    Parameters
    ----------
    model : Model
        Rotor with its terms.
    speed : array (speed,)
        Spin speeds in rad/s.
    harmonics : ints (harmonic,)
        Harmonics n of e^{jnwt}, n > 0 forward, n < 0 backward.
    theta : array (..., parameter), optional
        Amplitudes in the units of `model.units`, in the order of `model.names`; the model's own by default.
    order : int, optional
        Harmonics -order..order are carried where the model couples harmonics.

    Returns
    -------
    Linearised
        Response (..., speed, harmonic, sensor) in m and its derivatives (..., speed, harmonic, sensor, parameter) per
        unit of each amplitude.

    Raises
    ------
    RotorstudyError
        For a speed that is not positive, harmonics that are not whole numbers, or an amplitude without a value.
    NoSteadyState
        If there is no steady state at a speed.
    """
    speed, harmonics, theta, blocks = _asked(model, speed, harmonics, theta, order)
    found, derivatives = _carried_response(model, speed, theta, blocks, True, model.involved)
    true, derivatives = found[..., model.measured], derivatives[..., model.measured, :]
    shown, change, first = true.copy(), derivatives.copy(), len(model.rotor_unknowns)
    for p, unknown in enumerate(model.output_unknowns, start=first):
        amplitude = theta[..., p, None, None, None]
        column = apply_entries(unknown.entries, true, speed, blocks.harmonics)
        shown += amplitude * column
        moving = tuple(e for e in unknown.entries if e.reads_motion)
        if moving and first:
            each = np.moveaxis(derivatives[..., :first], -1, 0)
            through = apply_entries(moving, each, speed, blocks.harmonics)
            change[..., :first] += np.moveaxis(amplitude * through, 0, -1)
        change[..., p] += column
    chosen = _places(harmonics, blocks)
    return Linearised(shown[..., chosen, :], change[..., chosen, :, :])


def sensitivities(model, speed, harmonics, unknowns, theta=None, *, order=COUPLED_ORDER):
    """What the sensors would show more for one unit of amplitudes the model does not have, to first order.

    unknowns : two lists of Unknown of further terms, those that act on the rotor and those that act on the output
    theta    : (parameter,) of the model;  harmonics -order..order are carried
    returns  : (speed, harmonic, sensor, unknown) complex, m per unit
    """
    rotor, output = unknowns
    speed, harmonics = check_speed(speed), check_harmonics(harmonics)
    theta = np.asarray(model.theta if theta is None else theta, float)
    carried = np.union1d(np.arange(-order, order + 1), harmonics)
    blocks = layout(model, carried, order)
    own = theta[: len(model.rotor_unknowns)]
    deflection = static_deflection(model, speed, own).value
    found, _ = _carried_response(model, speed, theta, blocks, False)
    shown = np.zeros((len(speed), len(blocks.harmonics), len(model.sensors), len(rotor) + len(output)), complex)
    if rotor:
        forces = [
            apply_entries(u.entries, found, speed, blocks.harmonics, resting(u, deflection))
            if u.force is None
            else nonlinear_column(u.force, found, speed, blocks.harmonics, deflection)
            for u in rotor
        ]
        moved = _solve(operator(model, own, speed, blocks), np.stack(forces, axis=-1), blocks, speed)
        shown[..., : len(rotor)] = moved[..., model.measured, :]
    true = found[..., model.measured]
    for p, unknown in enumerate(output, start=len(rotor)):
        shown[..., p] = apply_entries(unknown.entries, true, speed, blocks.harmonics)
    return shown[:, _places(harmonics, blocks)]
