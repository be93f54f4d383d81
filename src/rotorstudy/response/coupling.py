"""Which harmonics a model couples, and how they are arranged in blocks that are solved together.

Without entries on conj(z) or with a shift, every harmonic is a block of its own. Otherwise R_n is coupled with R_{n-k}
and conj(R_{-n}): then q_n and w_n = conj(q_{-n}) are separate unknowns, and connected unknowns form a block.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rotorstudy.errors import RotorstudyError

COUPLED_ORDER = 15  # harmonics -15..15 are carried where harmonics are coupled; a caller may ask for more
HIGHEST = 1000  # of all harmonics


def check_speed(speed, *, may_rest=False):
    """Speeds in rad/s as an array (speed,), or an error unless all are finite, and positive or, if allowed, zero."""
    try:
        speed = np.atleast_1d(np.asarray(speed, float))
    except (TypeError, ValueError, OverflowError):
        speed = np.empty(0)
    if not speed.size:
        raise RotorstudyError("speeds: give at least one number, in rad/s")
    if (bad := speed[~(np.isfinite(speed) & ((speed > 0) | ((speed == 0) & may_rest)))]).size:
        told = "give speeds from 0 rad/s" if may_rest else "only a rotating shaft has harmonics; give speeds > 0 rad/s"
        raise RotorstudyError(f"speed {bad[0]:g} rad/s: {told}")
    return speed


def check_harmonics(harmonics, where="harmonics"):
    """Harmonics as an int array (harmonic,), or an error unless they are whole numbers, each once, at least one."""
    given = list(harmonics)
    whole = [n for n in given if isinstance(n, (int, np.integer)) and not isinstance(n, bool)]
    if any(abs(n) > HIGHEST for n in whole):
        raise RotorstudyError(f"{where}: give whole numbers from {-HIGHEST} to {HIGHEST}")
    if not given or len(whole) < len(given) or len(set(given)) < len(given):
        raise RotorstudyError(f"{where} {given}: give whole numbers, each once, such as 0, 1, 2, -1")
    return np.array(given, int)


@dataclass(frozen=True, eq=False)
class Layout:
    """Which unknowns are solved together: i is q of harmonic i, i + H is w = conj(q_-n) of harmonic i."""

    harmonics: np.ndarray
    groups: tuple[np.ndarray, ...]  # arrays (block, member) of unknowns
    doubled: bool  # whether the w are carried
    mirrors: tuple[bool, ...]  # whether the w of a group replace the q_-n of conjugate blocks, not solved again


def layout(model, harmonics, order=COUPLED_ORDER):
    """The Layout of a model for harmonics (harmonic,); -order..order are carried where it couples harmonics."""
    shown = frozenset((e.is_conjugate, e.shift) for u in model.output_unknowns for e in u.unscaled if e.reads_motion)
    return _layout(model.couplings, shown, bool(model.nonlinear_forces), tuple(int(n) for n in harmonics), order)


def layout_without_turning(model, blocks):
    """The Layout of the same harmonics if no coefficient turned with the shaft."""
    rotor = frozenset(link for link in model.couplings if not link[1])
    return _layout(rotor, frozenset(), False, tuple(blocks.harmonics.tolist()), 0)


def layout_of_forced(model, blocks):
    """The Layout of the harmonics on which a force can act, the motion at others being zero; of all if all couple."""
    vibrating = _vibrating(model)
    forced = tuple(n for n in blocks.harmonics.tolist() if vibrating is None or n in vibrating)
    all_or_none = len(forced) in (0, len(blocks.harmonics))
    return blocks if all_or_none else _layout(model.couplings, frozenset(), False, forced, 0)


def _vibrating(model):
    """Harmonics on which a force acts, and those that these are coupled with; None if they are coupled with all."""
    if model.nonlinear_forces or any(shift for _, shift in model.couplings):
        return None
    forced = {0}.union(e.shift for u in model.rotor_unknowns for e in u.unscaled)
    return forced | {-n for n in forced} if any(mirrored for mirrored, _ in model.couplings) else forced


@lru_cache(maxsize=256)
def _layout(rotor, output, has_local_forces, harmonics, order):
    """The Layout for the entries of the rotor and of the output, each given as (conjugate, shift)."""
    harmonics = np.asarray(harmonics, int)
    doubled = any(mirrored for mirrored, _ in rotor)
    read = [(harmonics - shift) * (-1 if mirrored else 1) for mirrored, shift in output]  # mixed in by the sensors
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
            continue  # conjugate of a block that is already solved
        solved.add(b)
        # blocks are grouped by the composition of their members, so that a group shares its pattern of measured ones
        kind = tuple((m >= len(carried), bool(np.isin(own_harmonic(m, carried), harmonics))) for m in members)
        groups.setdefault((mirror != b, kind), []).append(members)
    mirrors = tuple(mirror for mirror, _ in groups)
    return Layout(carried, tuple(np.array(members) for members in groups.values()), doubled, mirrors)


def mirrored_unknown(unknown, carried):
    """Positions of the conjugate unknowns: w_{-n} for q_n, q_{-n} for w_n; `carried` contains -n with every n."""
    count = len(carried)
    opposite = np.searchsorted(carried, -carried[unknown % count])
    return np.where(np.asarray(unknown) < count, count, 0) + opposite


def own_harmonic(unknown, carried):
    """Harmonic of q that each unknown stands for: n for q_n, -n for w_n = conj(q_{-n})."""
    count = len(carried)
    return np.where(np.asarray(unknown) < count, 1, -1) * carried[np.asarray(unknown) % count]


@lru_cache(maxsize=4096)
def _links(mirrored, shift, carried, doubled):
    """Unknowns (row, column) that an entry couples, and the harmonic of the equation of each pair: int (3, link)."""
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


@lru_cache(maxsize=4096)
def linked_members(blocks, mirrored, shift):
    """For each group, the couplings of an entry: harmonic of the equation, whether it is of w, block, row, column."""
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


def gather(amplitudes, group, count, harmonics):
    """Harmonics (..., speed, harmonic, dof) arranged as the unknowns of a group, (..., speed, block, member * dof)."""
    if group.shape == (count, 1):
        return amplitudes  # uncoupled harmonics, in order
    direct = group[0] < count  # the same for every block of a group
    taken = np.empty((*amplitudes.shape[:-2], *group.shape, amplitudes.shape[-1]), complex)
    taken[..., direct, :] = amplitudes[..., group[:, direct], :]
    if not direct.all():
        negative = mirrored_unknown(group[:, ~direct], harmonics)
        taken[..., ~direct, :] = np.conj(amplitudes[..., negative, :])
    return taken.reshape(*taken.shape[:-2], -1)


def forced_harmonics(model):
    """Harmonics (harmonic,) that the sensors show: of the forces (all carried if coupled), shifted by the sensors."""
    vibrating = _vibrating(model) or range(-COUPLED_ORDER, COUPLED_ORDER + 1)
    shown = set(vibrating)
    for entry in (e for u in model.output_unknowns for e in u.unscaled):
        if not entry.reads_motion:
            shown.add(entry.shift)
        else:
            shown |= {entry.shift + (-n if entry.is_conjugate else n) for n in vibrating}
    return np.array(sorted(shown))
