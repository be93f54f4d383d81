"""Steady state under nonlinear forces (rub, breathing crack) by alternating frequency and time: Cameron, Griffin 1989.

The motion is synthesised over one revolution, the force is evaluated at each sample and transformed back to harmonics.
Newton's method acts on the harmonics of the coordinates that these forces depend on; the linear part stays in the
receptances of the rotor. Of several steady states, it is the one reached from the linear response by increasing the
forces from zero (continuation).
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import NoSteadyState
from rotorstudy.model.entry_table import Columns
from rotorstudy.units import spin

SAMPLES_PER_HARMONIC = 16  # of the highest harmonic: a sudden contact has many more harmonics than are carried
TOLERANCE = 1e-11  # of the residual relative to the motion; the round-off of some hundred sums is near 1e-14
NEWTON_STEPS = 8  # it seldom takes more than six where it converges; elsewhere a smaller share of the force does
SMALLEST_GROWTH = 1e-3  # smallest continuation step, as a share of the force
DIFFERENCE = 1e-6  # step of the central differences relative to the motion: an error of 1e-12 where the force is smooth


class Tangent(NamedTuple):
    """Linearisation about the steady states at some speeds."""

    slope: np.ndarray  # (speed, component, component) derivative of the force harmonics by the motion, N/m
    reply: np.ndarray  # (speed, harmonic, dof, component) motion by a unit force
    seen: np.ndarray  # (coordinate, dof) what the forces see
    still: np.ndarray  # (real/imaginary, coordinate, speed, harmonic, seen) derivative by the static deflection, N/m

    def force_by_deflection(self, moved):
        """Change (..., speed, harmonic, dof), N, of the forces if the deflection changes by (..., speed, dof), m."""
        parts = moved @ self.seen.T
        parts = np.stack([parts.real, parts.imag])
        return np.einsum("ucshk,u...sc->...shk", self.still, parts) @ self.seen

    def response(self, change):
        """Change (speed, harmonic, dof, parameter), m per unit, with the nonlinear forces, from that without them."""
        moved = _real(self.seen @ change)
        stiff = np.eye(moved.shape[1]) - _real(self.seen @ self.reply) @ self.slope
        return change + self.reply @ (self.slope @ np.linalg.solve(stiff, moved))[:, None]


def one_revolution(harmonics):
    """Shaft angles (time,) of one revolution, equally spaced, rad, and e^{jn angle} (time, harmonic); read-only."""
    return _one_revolution(tuple(int(n) for n in harmonics))


@lru_cache(maxsize=64)
def _one_revolution(harmonics):
    count = SAMPLES_PER_HARMONIC * max(2, *(abs(n) for n in harmonics))
    angle = 2 * np.pi / count * np.arange(count)
    basis = np.exp(2j * np.pi / count * np.outer(np.arange(count), harmonics))
    for one in (angle, basis):
        one.setflags(write=False)
    return angle, basis


def _seen_in_time(matrix, amplitudes, speed, harmonics, deflection):
    """What forces on some coordinates (coordinate, dof) see over one revolution, as `NonlinearForce.at` takes it."""
    angle, basis = one_revolution(harmonics)
    rate = 1j * np.asarray(harmonics)[:, None] * np.asarray(speed, float)[:, None, None]
    seen, still = amplitudes @ matrix.T, (np.asarray(deflection) @ matrix.T)[..., None, :]
    return basis @ seen + still, basis @ (rate * seen), still, angle


def nonlinear_columns(forces, amplitudes, speed, harmonics, deflection):
    """Columns of one unit of some NonlinearForce at harmonics (..., speed, harmonic, dof), m, about a deflection."""
    (_, basis), found, alike = one_revolution(harmonics), [], {}
    for p, force in enumerate(forces):  # many of which act on the same coordinates
        alike.setdefault(force.matrix.tobytes(), []).append(p)
    for places in alike.values():
        matrix = forces[places[0]].matrix
        seen, row = _seen_in_time(matrix, amplitudes, speed, harmonics, deflection), np.flatnonzero(matrix.any(axis=0))
        in_time = np.stack([forces[p].at(*seen) for p in places], axis=-2)  # (..., time, force, coordinate)
        force = basis.conj().T @ in_time.reshape(*in_time.shape[:-2], -1) / len(basis)
        value = force.reshape(*force.shape[:-1], len(places), -1) @ matrix[:, row]
        found.append((np.tile(row, len(places)), np.repeat(places, len(row)), value.reshape(*force.shape[:-1], -1)))
    return Columns(*(np.concatenate(part, axis=-1) for part in zip(*found, strict=True)))


def _real(complex_rows):
    """(speed, harmonic, coordinate, ...) complex as (speed, component, ...) real: real parts, then imaginary parts."""
    flat = complex_rows.reshape(len(complex_rows), -1, *complex_rows.shape[3:])
    return np.concatenate([flat.real, flat.imag], axis=1)


def _complex(components, coordinates):
    real, imag = np.split(components, 2, axis=1)
    return (real + 1j * imag).reshape(len(components), -1, coordinates)


def steady_states(forces, speed, harmonics, deflection, linear, reply):
    """Harmonics (speed, harmonic, dof) under forces [(amplitude, NonlinearForce)], and the Tangent there.

    linear : motion without them, about the deflection (speed, dof), m
    reply  : (speed, harmonic, dof, component) motion by a unit force on each component of those they depend on
    """
    system = _System(forces, speed, harmonics, deflection, linear, reply)
    x, share, growth = system.start.copy(), np.zeros(len(speed)), np.ones(len(speed))
    force, slope = np.zeros_like(x), np.zeros_like(system.receptance)
    while (share < 1).any():
        at = np.flatnonzero(share < 1)
        tried = np.minimum(1.0, share[at] + growth[at])
        found, *loaded, met = system.balanced(x[at], tried, at)
        lost = at[~met][growth[at[~met]] < SMALLEST_GROWTH]
        if len(lost):
            raise NoSteadyState(
                f"no steady state at {spin(speed[lost[0]])}: the continuation from the linear response fails beyond "
                f"{share[lost[0]]:.0%} of the nonlinear forces, so the motion jumps or is not periodic; leave that "
                "speed out or integrate in time"
            )
        done = at[met]
        x[done], force[done], slope[done] = (part[met] for part in (found, *loaded))
        share[done], growth[at] = tried[met], growth[at] * np.where(met, 2.0, 0.5)
    tangent = Tangent(slope, reply, system.seen, system.slope_by_deflection(x))
    return linear + (reply @ force[:, None, :, None])[..., 0], tangent


class _System:
    """Equations x = start + share * receptance @ force(x) at all speeds, x (speed, component), m."""

    def __init__(self, forces, speed, harmonics, deflection, linear, reply):
        seen, place = seen_coordinates([force for _, force in forces]), np.asarray(harmonics)
        self.seen, self.speed, self.order = seen, speed, len(place)
        alike = {}  # those on the same coordinates share their motion
        for size, force in forces:
            alike.setdefault(force.matrix.tobytes(), []).append((size, force))
        self.forces = [((own[0][1].matrix[:, None] == seen).all(axis=-1) * 1.0, own) for own in alike.values()]
        self.takes_velocity = any(force.takes_velocity for _, force in forces)
        self.angle, self.basis = one_revolution(harmonics)
        self.rate, self.still = 1j * place * speed[:, None], (deflection @ seen.T)[:, None]
        self.start, self.receptance = _real(linear @ seen.T), _real(seen @ reply)
        # lines m - n and m + n of a spectrum over a revolution
        self.difference, self.total = ((place[:, None] + sign * place) % len(self.basis) for sign in (-1, 1))
        # (unit, coordinate, speed, time, seen)
        self.units = np.array([1, 1j])[:, None, None, None, None] * np.eye(len(seen))[:, None, None, :]

    def _in_time(self, z, v, at_rest):
        """Force (..., time, seen), N, at displacements and velocities."""
        parts = ((s, own, (z @ s.T, v @ s.T, at_rest @ s.T)) for s, own in self.forces)
        return sum(sum(size * force.at(*motion, self.angle) for size, force in own) @ s for s, own, motion in parts)

    def _force_and_slope(self, x, at):
        """Force (speed, component), N, and its slope, N/m, at some of the speeds; df = p dz + q conj(dz)."""
        a, turn, rates, still = _complex(x, len(self.seen)), self.speed[at, None, None], self.rate[at], self.still[at]
        z, v = self.basis @ a + still, self.basis @ (rates[..., None] * a)
        largest = np.swapaxes(np.abs(a).max(axis=1), 0, 1)[..., None, None]
        size = DIFFERENCE * (largest + 1e-12)  # (coordinate, speed, 1, 1): of each coordinate, in its own unit
        steps = np.stack([size * self.units, -size * self.units])
        moved = z + steps
        *some, force = self._in_time(np.concatenate([moved.reshape(-1, *z.shape), z[None]]), v, still)
        up, down = np.reshape(some, moved.shape)
        slopes = [((up - down) / size, np.ones_like(rates))]
        if self.takes_velocity:
            up, down = self._in_time(z + 0 * steps, v + turn * steps, still)  # a force need not depend on a velocity
            slopes.append(((up - down) / (size * turn), rates))
        return _real(self.basis.conj().T @ force / len(self.basis)), self._slope_of_harmonics(slopes)

    def _slope_of_harmonics(self, slopes):
        """Slope (speed, component, component), N/m, by the motion, of those by displacement and velocity in time.

        slopes : (slope (unit, coordinate, speed, time, seen), what a derivative multiplies harmonics (speed, harmonic))
        """
        direct = mirrored = 0.0
        for slope, factor in slopes:
            lines = np.fft.fft(slope / 4, axis=-2) / len(self.basis)  # (unit, coordinate, speed, line, seen)
            factor = factor[:, None, :, None]
            direct = direct + (lines[0] - 1j * lines[1])[:, :, self.difference] * factor
            mirrored = mirrored + (lines[0] + 1j * lines[1])[:, :, self.total] * factor.conj()
        parts = np.stack([direct + mirrored, 1j * (direct - mirrored)])  # (part, coordinate, speed, m, n, seen)
        return _real(parts.transpose(2, 3, 5, 0, 4, 1).reshape(len(factor), self.order, len(self.seen), -1))

    def slope_by_deflection(self, x):
        """`still` of Tangent, at the harmonics x (speed, component): a force may read the deflection by itself too."""
        a = _complex(x, len(self.seen))
        z, v = self.basis @ a + self.still, self.basis @ (self.rate[..., None] * a)
        size = DIFFERENCE * (np.abs(z).max(axis=(1, 2))[:, None, None] + 1e-12)
        up, down = (self._in_time(z + step, v, self.still + step) for step in (size * self.units, -size * self.units))
        return self.basis.conj().T @ ((up - down) / (2 * size)) / len(self.basis)

    def balanced(self, x, share, at):
        """Motion, force and slope at some of the speeds by Newton's method, and whether each has converged."""
        x, force, slope, met = x.copy(), np.zeros_like(x), np.zeros((*x.shape, x.shape[1])), np.zeros(len(x), bool)
        left = np.arange(len(x))
        for _ in range(NEWTON_STEPS):
            force[left], slope[left] = self._force_and_slope(x[left], at[left])
            flexible = share[left, None, None] * self.receptance[at[left]]
            off = x[left] - self.start[at[left]] - (flexible @ force[left][..., None])[..., 0]
            met[left] = np.linalg.norm(off, axis=1) <= TOLERANCE * np.linalg.norm(x[left], axis=1)
            stiff = np.eye(x.shape[1]) - flexible @ slope[left]
            left, stiff, off = left[~met[left]], stiff[~met[left]], off[~met[left]]
            if not len(left):
                break
            x[left] -= _solved(stiff, off)
            left = left[np.isfinite(x[left]).all(axis=1)]
        return x, force, slope, met


def _solved(matrices, right):
    """Solutions (speed, component) of systems of equations, NaN where singular."""
    try:
        return np.linalg.solve(matrices, right[..., None])[..., 0]
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.full_like(right, np.nan)
        return np.concatenate([_solved(a[None], b[None]) for a, b in zip(matrices, right, strict=True)])


def seen_coordinates(forces):
    """The coordinates (coordinate, dof) that nonlinear forces depend and act on, each once."""
    return np.unique(np.concatenate([force.matrix for force in forces]), axis=0)[::-1]
