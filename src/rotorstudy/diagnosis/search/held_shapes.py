"""A cause in many shapes of which some options are held and the rest is fitted, at a motion that is known.

Whatever explains the same records has the same motion, at which a cause is linear in its amplitudes: its columns are
found for all shapes at once, without a fit of the rotor's response for each.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rotorstudy.diagnosis.search.candidates import Candidate
from rotorstudy.diagnosis.search.screening import Projection, inverted, screen_each
from rotorstudy.diagnosis.search.shape_fit import Work, as_one, at_numbers, point_of, ranges_of, reshaped
from rotorstudy.errors import CannotAct
from rotorstudy.inference.fit import Fit

CLOSER = 4  # rounds of values halfway between two held, where the misfit changes by much
STEEP = 4.0  # change of the misfit from one value to the next, that is much
SAME = 1e-5  # of a range: values that are closer are one
TRIED = 9  # values of an option that is no angle, from the best of which steps are made
STEPS = 6  # at most
CLOSE = 0.01  # step, of the range, that is the last one
LONGEST = 0.1  # step, of the range
UNLIKELY = 16.0  # misfit above that of the best, beyond which a shape has no weight
AT_ONCE = 16  # shapes whose columns are formed at a time, and whose tables are kept for a while


class Shapes(NamedTuple):
    """A law of the cause in some shapes (row,), the rest of the shape fitted to the form and the position."""

    points: np.ndarray  # (row, option) fractions of the ranges
    amplitudes: np.ndarray  # (row, unknown)
    covariance: np.ndarray  # (row, option + unknown, option + unknown) of both, zero of options that are held
    cost: np.ndarray  # (row,) misfit and penalty
    log_volume: np.ndarray  # (row,) of the posterior of the rest beside that of the prior

    def part(self, rows) -> "Shapes":
        """Some of the rows."""
        return Shapes(*(values[rows] for values in self))

    def with_more(self, other: "Shapes") -> "Shapes":
        """These and others."""
        return Shapes(*(np.concatenate(both) for both in zip(self, other, strict=True)))


def halfway(held, cost, other=np.inf):
    """Values halfway between neighbours (row,) of which one is likely and the misfit differs by much.

    other   : misfit of another law, beside which one must be likely, too
    returns : them, and the row of the likelier one of both
    """
    order = np.argsort(held)
    held, cost = held[order], np.nan_to_num(cost[order], posinf=1e300)
    cost = cost - cost.min(initial=other)
    first = np.flatnonzero((np.minimum(cost[:-1], cost[1:]) < UNLIKELY) & (np.abs(np.diff(cost)) > STEEP))
    first = first[np.diff(held)[first] > SAME]
    likelier = np.where(cost[first] < cost[first + 1], first, first + 1)
    return (held[first] + held[first + 1]) / 2, order[likelier]


class HeldShapes(NamedTuple):
    """The fit of a law in many shapes of which some options are `held`, at a motion that is known."""

    work: Work
    projection: Projection  # Projection, or what else has its `residual` and its method `of` of causes
    law: Candidate
    ranges: dict
    held: tuple[int, ...]
    other: float = np.inf  # misfit of another law: shapes that are unlikely beside it need not be fitted to the end

    @property
    def free(self) -> list[int]:
        """Options that are not held."""
        return [i for i in range(len(self.ranges)) if i not in self.held]

    @property
    def around(self) -> np.ndarray:
        """(option,) whether one that is not held is an angle."""
        return np.array([ends.goes_around for ends in self.ranges.values()])[self.free]

    def over_places(self, points, amplitudes=None):
        """Shapes from points (row, option), and at positions between them, all that are inside their ranges.

        amplitudes : as of `fitted`
        """
        along, found = self.held[1], self.fitted(points, amplitudes)
        for _ in range(CLOSER):
            x, near = halfway(found.points[:, along], found.cost, self.other)
            if not len(x):
                break
            between = found.points[near]
            between[:, along] = x
            found = found.with_more(self.fitted(between, found.amplitudes[near]))
        free = np.array(self.free)[~self.around]
        return found.part(np.all((found.points[:, free] > 0) & (found.points[:, free] < 1), axis=1))

    def searched(self, points):
        """Points with each option that is not held and no angle at the best of values over its range and its own."""
        over = (np.arange(TRIED) + 0.5) / TRIED
        for i in np.array(self.free)[~self.around]:
            tried = np.repeat(points, TRIED + 1, axis=0)
            tried[:, i] = np.concatenate([[*over, own] for own in points[:, i]])
            causes, kept = self.reshaped(tried)
            best = {}
            for row, one in zip(kept, screen_each(self.projection.of(causes), causes), strict=True):
                best.setdefault(row // (TRIED + 1), []).append((one.evidence, row))
            points = np.array([tried[max(rows)[1]] for rows in best.values()])
        return points

    def fitted(self, points, amplitudes=None, reach=2 * UNLIKELY):
        """Shapes from points (row, option), without those in which the cause cannot act.

        amplitudes : (row, unknown) of the starts, by default their usual ones
        reach      : a shape is given up whose next step would leave the misfit larger than the best by more
        """
        free, around, rows, points = self.free, self.around, len(points), points.copy()
        usual = self._prior[0]
        amplitudes = np.tile(usual, (rows, 1)) if amplitudes is None else amplitudes.copy()
        size, nowhere = points.shape[1] + len(usual), np.full(rows, np.inf)
        given = points.copy(), amplitudes.copy(), np.zeros((rows, size, size))
        found, active = Shapes(*given, nowhere, -nowhere), np.arange(rows)
        for _ in range(STEPS):
            causes, usable = self.reshaped(points[active])
            active = active[usable]
            if not len(active):
                break
            at = points[active], amplitudes[active]
            here, step, least = self._solved(points[active], *self.columns(causes, *at))
            is_better = here.cost < found.cost[active]
            for best, new in zip(found, here, strict=True):
                best[active[is_better]] = new[is_better]
            before, is_taken = points[np.ix_(active, free)], is_better[:, None]
            back = found.points[np.ix_(active, free)] - before  # of which a quarter of the step is left
            moved = before + np.where(is_taken, np.clip(step, -LONGEST, LONGEST), 0.75 * back)
            moved = np.where(around, moved, np.clip(moved, 0, 1))
            points[np.ix_(active, free)] = moved
            amplitudes[active] = np.where(is_taken, here.amplitudes, amplitudes[active])
            is_last = (np.abs(step).max(axis=1) < CLOSE) | (np.abs(moved - before).max(axis=1) < SAME)
            active = active[~is_last & (least < found.cost.min(initial=self.other) + reach)]
        return found.part(np.isfinite(found.cost))

    @property
    def _prior(self):
        """Means and standard deviations (2, unknown) of the amplitudes before anything is measured."""
        return np.array([self.law.prior[name] for name in self.law.names]).T

    def _solved(self, points, columns, slopes):
        """Shapes with the best amplitudes at points (row, option), and what follows.

        A step that is short is the last one, which the Shapes include.

        returns : them; step (row, option) of what is not held; misfit (row,) after it to first order
        """
        (mean, std), count, size = self._prior, columns.shape[1], points.shape[1] + columns.shape[1]
        # from the middle of the prior, whose standard deviation is the range
        off = np.where(self.around, 0.0, 0.5 - points[:, self.free])
        left = self.projection.residual - np.einsum("i,rij->rj", mean, columns)
        known = np.concatenate([columns * std[:, None], slopes], axis=1)
        precision = np.eye(known.shape[1]) + known @ np.swapaxes(known, 1, 2)
        right = (known @ left[..., None])[..., 0]
        right[:, count:] += off
        (covariance, narrowed), (unmoved, _) = inverted(precision), inverted(precision[:, :count, :count])
        best, unmoved = ((one @ right[:, : one.shape[1], None])[..., 0] for one in (covariance, unmoved))
        whole = np.sum(left**2, axis=1) + np.sum(off**2, axis=1)
        cost, least = (whole - np.sum(one * right[:, : one.shape[1]], axis=1) for one in (unmoved, best))
        step = best[:, count:]
        is_last = np.abs(step).max(axis=1) < CLOSE
        moved, spread = points.copy(), np.zeros((len(points), size, size))
        moved[:, self.free] += np.where(is_last[:, None], step, 0.0)
        place, sizes = [*range(points.shape[1], size), *self.free], np.concatenate([std, np.ones(slopes.shape[1])])
        spread[np.ix_(range(len(points)), place, place)] = covariance * np.outer(sizes, sizes)
        amplitudes, log_volume = mean + std * best[:, :count], -0.5 * narrowed
        cost = np.where(is_last, least, cost)
        return Shapes(moved, amplitudes, spread, cost, log_volume), step, least

    def reshaped(self, points, label="shape"):
        """The law at points (row, option), and the rows where it can act."""
        causes, kept = [], []
        for row, point in enumerate(points):
            try:
                causes.append(reshaped(self.work, self.law, point, f"{label} {row}", self.ranges))
            except CannotAct:  # such as a crack at a disc
                continue
            kept.append(row)
        return causes, np.array(kept, int)

    def columns(self, causes, points, amplitudes):
        """Columns (row, unknown, component) of causes at points (row, option), and slopes (row, option, component)."""
        columns, slopes = [], []
        for first in range(0, len(causes), AT_ONCE):
            part = slice(first, first + AT_ONCE)
            here, beside, weights, offs = causes[part], [], [], []
            for i in self.free:
                there, ends = points[part].copy(), list(self.ranges.values())[i]
                offs.append(np.array([ends.step(x) for x in there[:, i]]))
                there[:, i] += offs[-1]
                for one, own in zip(self.reshaped(there, f"beside {i}")[0], amplitudes[part], strict=True):
                    term, weight = as_one(one.term, own)
                    beside.append(one._replace(term=term))
                    weights.append(weight)
            known = self.projection.of([*here, *beside]).columns
            columns.append(np.array([[known[name] for name in one.names] for one in here]))
            own = np.einsum("ru,ruc->rc", amplitudes[part], columns[-1])
            moved = [w @ [known[name] for name in one.names] for w, one in zip(weights, beside, strict=True)]
            moved = np.reshape(moved, (len(offs), *own.shape))
            slopes.append(np.stack([(one - own) / off[:, None] for one, off in zip(moved, offs, strict=True)], axis=1))
        return np.concatenate(columns), np.concatenate(slopes)


def slopes_of(work: Work, fitted: Fit, causes: Sequence[Candidate], without: tuple[str, ...] = ()) -> list[np.ndarray]:
    """Columns (component + parameter,) of small changes of the shapes of causes of a fit, for a `Projection` of it.

    without : as of that
    """
    shaped, found = [one for one in causes if one.shape], []
    projection = Projection(fitted, work.spectrum, without) if shaped else None
    work = at_numbers(work, fitted.free) if shaped else work
    for cause in shaped:
        shapes = HeldShapes(work, projection, cause, ranges_of(work, cause), ())
        values, point = np.array([[fitted.values[name] for name in cause.names]]), point_of(work, cause)[None]
        found += [*shapes.columns(shapes.reshaped(point)[0], point, values)[1][0]]
    return found
