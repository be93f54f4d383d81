"""The dynamic stiffness of all harmonics that are solved together, and the motion that a force on them gives."""

from functools import lru_cache, partial

import numpy as np

from rotorstudy.errors import NoSteadyState
from rotorstudy.model.entries import Entry
from rotorstudy.response.coupling import gather, layout_without_turning, linked_members, mirrored_unknown, own_harmonic
from rotorstudy.response.factorised import FEWEST, factorised, factorised_bands, has_narrow_band, stored_by_band
from rotorstudy.response.turning import turning

FEWER_BY = 2  # harmonics are coupled on the coordinates that turn if that takes less than a half of the operations
FACTORS_KEPT = 512  # of kinds of entries at some speeds
LARGEST_LOOP = 1e4  # of receptance times stiffness; above it four of sixteen digits would be lost
FEWER_TOUCHED_BY = 3  # times as many coordinates as those touched: with more of these, the whole is solved as fast


def operator(model, theta, speed, blocks, *, turning=True, adjoint=False):
    """Dynamic stiffness (..., speed, block, n, n), n = member * dof, of groups."""
    dof = len(model.structure.dofs)
    patterns = [*model.table.patterns, *(model.table.turning_patterns if turning else ())]
    added = _of_entries(patterns, model, theta, speed, blocks, np.arange(dof), adjoint)
    for full, base in zip(added, _of_rotor(model, theta, speed, blocks), strict=True):
        for m in range(base.shape[-3]):
            own = slice(m * dof, (m + 1) * dof)
            full[..., own, own] += base[..., m, :, :]
    return added


def _of_rotor(model, theta, speed, blocks, band=None):
    """Dynamic stiffness (..., speed, block, member, dof, dof), real, symmetric, of the rotor; or its band."""
    matrices, speed = model.matrices(theta), np.asarray(speed, float)[:, None, None]
    if band is not None:
        parts = ("mass", "stiffness", "gyroscopic")
        matrices = matrices._replace(**{name: stored_by_band(getattr(matrices, name), band) for name in parts})
    mass, stiffness, gyroscopic = (one[..., None, None, None, :, :] for one in matrices[:3])
    found = []
    for group in blocks.groups:
        nw = own_harmonic(group, blocks.harmonics) * speed  # of the equation: n for q_n, -n for w_n
        base = stiffness - (nw**2)[..., None, None] * mass
        found.append(base + (nw * speed)[..., None, None] * gyroscopic)
    return found


def _of_entries(patterns, model, theta, speed, blocks, touched, adjoint, band=None):
    """What entries of some patterns, on coordinates `touched`, add to the dynamic stiffness; by its band if given."""
    count, speed = len(touched), np.asarray(speed, float)
    at = np.zeros(len(model.structure.dofs), int)
    at[touched] = np.arange(count)
    places = [(2 * band + 1,) if band is not None else (count, group.shape[1]) for group in blocks.groups]
    lead = (*theta.shape[:-1], len(speed))
    shapes = ((*lead, *group.shape, *place, count) for group, place in zip(blocks.groups, places, strict=True))
    result = [np.zeros(shape, complex) for shape in shapes]
    own = theta[..., [p for p, _ in model.acting]]
    for pattern in patterns:
        entry, i, j = pattern.entry, at[pattern.row], at[pattern.column]
        value = pattern.values(own)[..., None, None, :]  # (..., speed, link, place)
        if not value.any():
            continue
        i, j = (j, i) if adjoint else (i, j)
        linked = linked_members(blocks, entry.is_conjugate, entry.shift)
        factors = _factors(entry.kind, tuple(speed.tolist()), blocks)
        for full, (n, is_w, block, row, column), factor in zip(result, linked, factors, strict=True):
            if not len(n):
                continue
            both, (row, column) = factor[..., None] * value, (column, row) if adjoint else (row, column)
            both = np.where(is_w[:, None] != adjoint, both.conj(), both)
            full[(..., block, row, *((i, column, j) if band is None else (band + i - j, j)))] -= both
    if band is not None:
        return result
    return [full.reshape(*full.shape[:-4], full.shape[-4] * count, full.shape[-4] * count) for full in result]


@lru_cache(maxsize=FACTORS_KEPT)  # most models of a search have the same bearings
def _factors(kind, speed, blocks):
    """Factors (speed, link) of the matrix of entries of a kind, for each group; None for a group without links."""
    entry, speed = Entry(np.zeros(0), *kind), np.array(speed)[:, None]
    return [
        entry.gain_at(speed, n) * (1j * (n - entry.shift) * speed) ** entry.order if len(n) else None
        for n, *_ in linked_members(blocks, entry.is_conjugate, entry.shift)
    ]


def solver(model, theta, speed, blocks, *, adjoint=False):
    """Function from force to motion, both (..., speed, harmonic, dof, column)."""
    dof, touched = len(model.structure.dofs), model.table.turned
    whole = sum(len(group) * (group.shape[1] * dof) ** 3 for group in blocks.groups)
    # complex numbers take four times as long as the real ones of the coordinates touched
    few = len(touched) and FEWER_BY * (2 * len(blocks.harmonics) * len(touched)) ** 3 < 4 * whole
    own = layout_without_turning(model, blocks) if few else blocks
    systems = _systems(model, theta, speed, own, turning=not few, adjoint=adjoint)

    def solved(force):
        return _checked_motion(systems(force), speed)

    if not few:
        return solved
    coupled = turning(model, theta, speed, blocks.harmonics, solved, adjoint)

    def solved_with_turning(force):
        try:
            found = coupled(solved(force))
        except np.linalg.LinAlgError:
            found = np.array(np.nan)
        return _checked_motion(found, speed)

    return solved_with_turning


def _systems(model, theta, speed, blocks, *, turning, adjoint):
    """Function from force to motion, both (..., speed, harmonic, dof, column); NaN where the rotor resonates."""
    turns = turning and model.table.turning_patterns
    groups = None if turns else _on_bearings(model, theta, speed, blocks, adjoint)
    if groups is None:
        matrices = operator(model, theta, speed, blocks, turning=turning, adjoint=adjoint)
        groups, every = [], np.arange(len(model.structure.dofs))
        for matrix, group in zip(matrices, blocks.groups, strict=True):  # a harmonic and its neighbours lie together
            members = np.argsort(group[0] % len(blocks.harmonics), kind="stable")
            groups.append(_motion_by(matrix, (members[:, None] * len(every) + every).ravel()))

    def solved(force):
        try:
            with np.errstate(divide="ignore", invalid="ignore"):
                return _solve_groups(groups, force, blocks)
        except np.linalg.LinAlgError:
            return np.array(np.nan)

    return solved


def _on_bearings(model, theta, speed, blocks, adjoint):
    """For each group the motion by a force, from the receptances of the rotor; None if that saves or gives nothing."""
    patterns, support, own, dof = model.table.patterns, model.structure.support, [], len(model.structure.dofs)
    members = max(group.shape[1] for group in blocks.groups)
    if not are_few(touched_by(patterns), dof, members):
        own = [pattern for pattern in patterns if not pattern.entry.is_conjugate]
        patterns, support = [pattern for pattern in patterns if pattern.entry.is_conjugate], None
    touched, band = touched_by(patterns), _band(model, own)
    by_band_alone = band is not None and not patterns
    if not by_band_alone and not are_few(touched, dof, members):
        return None
    alone = _of_rotor(model, theta, speed, blocks, band)
    if own:
        more = _of_entries(own, model, theta, speed, blocks, np.arange(dof), adjoint, band)
        more = more if band is not None else [diagonal_blocks(one, dof) for one in more]
        alone = [base + one for base, one in zip(alone, more, strict=True)]
    if by_band_alone:
        return [factorised_bands(one) for one in alone]
    springs = np.zeros(len(touched)) if support is None else np.real(np.diag(support))[touched]
    added = _of_entries(patterns, model, theta, speed, blocks, touched, adjoint)
    try:
        return [on_bearings(*pair, touched, springs, band) for pair in zip(alone, added, strict=True)]
    except np.linalg.LinAlgError:
        return None


def touched_by(patterns):
    """Positions (coordinate,) of the coordinates that entries depend or act on; patterns : list of Pattern."""
    return np.unique(np.concatenate([[], *((one.row, one.column) for one in patterns)], axis=None)).astype(int)


def are_few(touched, dof, members):
    """Whether bearings touch so few coordinates, all harmonics together, that the rotor is inverted without them."""
    return 0 < FEWER_TOUCHED_BY * len(touched) <= dof and (members > 1 or dof < FEWEST)


def diagonal_blocks(matrix, size):
    """(..., member, size, size) of matrices (..., member * size, member * size)."""
    parts = [slice(first, first + size) for first in range(0, matrix.shape[-1], size)]
    return np.stack([matrix[..., own, own] for own in parts], axis=-3)


def on_bearings(alone, added, touched, springs, band=None):
    """Function from force to motion of a group, both (..., member, dof, column), by the receptances of the rotor.

    Bearings couple harmonics n and -n, but touch few coordinates. Without them each harmonic of the rotor is on its
    own, and its matrices are small, and real unless it is damped. With its receptances G, q = G (f - E q), where E are
    the bearings less `springs` (coordinate,), N/m, that hold a free rotor. LinAlgError if the rotor resonates alone.

    alone : (..., speed, block, member, dof, dof) dynamic stiffness of the rotor, `stored_by_band` if that is given
    added : (..., speed, block, member * coordinate, ...) of the bearings
    """
    members, count = alone.shape[-3], len(touched)
    held = alone.copy()
    held[..., touched if band is None else band, touched] += springs
    if band is None:
        inverse = np.linalg.inv(held)
        by_force, columns = partial(_times, inverse), inverse[..., touched]
    else:
        by_force = factorised_bands(held)
        columns = by_force(np.eye(held.shape[-1])[:, touched])
    taken = added - np.diag(np.tile(springs, members))
    between = columns[..., touched, :]  # (..., member, coordinate, coordinate)
    by_member = np.swapaxes(taken.reshape(*taken.shape[:-1], members, count), -3, -2)
    loop = np.swapaxes(by_member @ between, -3, -2).reshape(taken.shape)
    if not np.all(np.abs(loop) < LARGEST_LOOP):
        raise np.linalg.LinAlgError
    reaction = np.linalg.solve(np.eye(members * count) + loop, taken)

    def motion(force):
        own = by_force(force)
        at = own[..., touched, :]
        pulled = reaction @ at.reshape(*at.shape[:-3], -1, at.shape[-1])
        return own - _times(columns, pulled.reshape(at.shape))

    return motion


def _times(matrix, columns):
    """Matrices (..., row, dof), real or complex, times complex columns (..., dof, column)."""
    if np.iscomplexobj(matrix):
        return matrix @ columns
    columns = np.ascontiguousarray(columns)
    return (matrix @ columns.view(float)).view(complex)


def _band(model, patterns=()):
    """Bandwidth of the matrices of a slender shaft, and of some patterns; None if it is not slender."""
    count = len(model.structure.dofs)
    band = max([model.structure.bandwidth, *(int(np.abs(one.row - one.column).max(initial=0)) for one in patterns)])
    return band if has_narrow_band(band, count) else None


def _motion_by(matrix, order):
    """Function from force to motion of a group, both (..., speed, block, member, dof, column)."""
    systems = (lambda right: right / matrix) if matrix.shape[-1] == 1 else factorised(matrix, order)

    def motion(force):
        return systems(force.reshape(*force.shape[:-3], -1, force.shape[-1])).reshape(force.shape)

    return motion


def _checked_motion(found, speed):
    """The motion, or NoSteadyState unless it is finite."""
    if not np.isfinite(found).all():
        some = ", ".join(f"{w:g}" for w in speed[:5]) + (" ..." if len(speed) > 5 else "")
        raise NoSteadyState(
            f"no steady state at one of {some} rad/s: a harmonic coincides with an undamped natural "
            "frequency, or a parameter is not finite; add damping or leave that speed out"
        )
    return found


def _solve_groups(groups, force, blocks):
    count, dof = len(blocks.harmonics), force.shape[-2]
    if not blocks.doubled and len(blocks.groups) == 1 and blocks.groups[0].shape == (count, 1):
        return groups[0](force[..., None, :, :])[..., 0, :, :]
    result = np.zeros_like(force)
    columns = np.moveaxis(force, -1, 0)
    for motion, group, mirror in zip(groups, blocks.groups, blocks.mirrors, strict=True):
        right = np.moveaxis(gather(columns, group, count, blocks.harmonics), 0, -1)
        solved = motion(right.reshape(*right.shape[:-2], group.shape[1], dof, right.shape[-1]))
        direct = group < count
        result[..., group[direct], :, :] = solved[..., direct, :, :]
        if mirror:
            result[..., mirrored_unknown(group[~direct], blocks.harmonics), :, :] = solved[..., ~direct, :, :].conj()
    return result
