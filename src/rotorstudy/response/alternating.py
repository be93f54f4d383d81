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

SAMPLES_PER_HARMONIC = 16  # of the highest harmonic: a sudden contact has many more harmonics than are carried
TOLERANCE = 1e-11  # of the residual relative to the motion; the round-off of some hundred sums is near 1e-14
NEWTON_STEPS = 30
SMALLEST_GROWTH = 1e-3  # smallest continuation step, as a share of the force
DIFFERENCE = 1e-6  # step of the central differences relative to the motion: an error of 1e-12 where the force is smooth


class Tangent(NamedTuple):
    """Linearisation about a steady state at one speed.

    slope : (component, component) derivative of the force harmonics with respect to the motion, N/m
    reply : (harmonic, dof, component) motion by a unit force, m/N
    seen  : (coordinate, dof) the coordinates that the forces depend on
    """

    slope: np.ndarray
    reply: np.ndarray
    seen: np.ndarray

    def response(self, change):
        """Change (harmonic, dof, parameter), m per unit, with the nonlinear forces, from that without them."""
        moved = _real(self.seen @ change)
        stiff = np.eye(len(moved)) - _real(self.seen @ self.reply) @ self.slope
        return change + self.reply @ (self.slope @ np.linalg.solve(stiff, moved))


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


def nonlinear_columns(forces, amplitudes, speed, harmonics, deflection):
    """Force harmonics of one unit of each of some nonlinear forces at given displacement harmonics.

    forces     : list of NonlinearForce
    amplitudes : (..., speed, harmonic, dof) complex, m, about the deflection (dof,) or (..., speed, dof)
    returns    : (..., speed, harmonic, dof, force) complex, N; harmonics not listed are taken as zero
    """
    (angle, basis), deflection = one_revolution(harmonics), np.asarray(deflection)
    rate = 1j * np.asarray(harmonics)[:, None] * np.asarray(speed, float)[:, None, None]
    columns, in_time = np.empty((*amplitudes.shape, len(forces)), complex), {}
    for p, force in enumerate(forces):
        which = force.matrix.tobytes()  # many forces act on the same coordinates
        if which not in in_time:
            seen, still = amplitudes @ force.matrix.T, (deflection @ force.matrix.T)[..., None, :]
            in_time[which] = basis @ seen + still, basis @ (rate * seen), still
        given = force.at(*in_time[which], angle)
        columns[..., p] = basis.conj().T @ given / len(basis) @ force.matrix
    return columns


def affine_error(force, amplitudes, speed, harmonics, deflection):
    """Share (rms) of a nonlinear force that is no affine function of its displacement, the same at all speeds.

    Arguments as for `nonlinear_columns`, of one force. Zero where a contact stays open, or closed: it is then a
    constant and a stiffness.
    """
    angle, basis = one_revolution(harmonics)
    rate = 1j * np.asarray(harmonics)[:, None] * np.asarray(speed, float)[:, None, None]
    seen, still = amplitudes @ force.matrix.T, (np.asarray(deflection) @ force.matrix.T)[..., None, :]
    moved = basis @ seen + still
    given = force.at(moved, basis @ (rate * seen), still, angle)
    moved, given = moved.reshape(-1, moved.shape[-1]), given.reshape(-1, given.shape[-1])
    columns = np.concatenate([np.ones((len(moved), 1)), moved, moved.conj()], axis=1)
    columns = columns / np.linalg.norm(columns, axis=0)
    left = given - columns @ np.linalg.lstsq(columns, given, rcond=None)[0]
    size = np.linalg.norm(given)
    return float(np.linalg.norm(left) / size) if size else 0.0


def _real(complex_rows):
    """(harmonic, coordinate, ...) complex as (component, ...) real: real parts, then imaginary parts."""
    flat = complex_rows.reshape(-1, *complex_rows.shape[2:])
    return np.concatenate([flat.real, flat.imag])


def _complex(components, coordinates):
    real, imag = np.split(components, 2)
    return (real + 1j * imag).reshape(-1, coordinates)


def steady_state(forces, speed, harmonics, deflection, linear, reply):
    """Harmonics (harmonic, dof) under nonlinear forces at one speed, and the Tangent there.

    forces : list of (amplitude, NonlinearForce);  speed : rad/s;  deflection : (dof,) m
    linear : (harmonic, dof) motion without them, m
    reply  : (harmonic, dof, component) motion by a unit force on each component of the coordinates they depend on
    raises : NoSteadyState if the continuation from the linear response fails
    """
    seen = seen_coordinates([force for _, force in forces])
    (angle, basis), rate = one_revolution(harmonics), 1j * np.asarray(harmonics) * speed
    still = seen @ deflection
    start, receptance = _real(linear @ seen.T), _real(seen @ reply)
    chosen = [_chosen(force, seen) for _, force in forces]

    def in_time(z, v):
        return sum(
            amplitude * force.at(z @ s.T, v @ s.T, still @ s.T, angle) @ s
            for (amplitude, force), s in zip(forces, chosen, strict=True)
        )

    place = np.asarray(harmonics)
    difference, total = ((place[:, None] + sign * place) % len(basis) for sign in (-1, 1))
    units = np.array([1, 1j])[:, None, None, None] * np.eye(len(seen))[:, None, :]  # (unit, coordinate, time, seen)

    def force_and_slope(x):
        """Force (component,) and its slope: df = p dz + q conj(dz), so p_{m-n} on a_n and q_{m+n} on conj(a_n)."""
        a = _complex(x, len(seen))
        z, v = basis @ a + still, basis @ (rate[:, None] * a)
        size = DIFFERENCE * (np.abs(a).max(axis=0) + 1e-12)[:, None, None]  # of each coordinate, in its own unit
        step, rest = size * units, 0 * units
        up_z, down_z, up_v, down_v = in_time(
            z + np.stack([step, -step, rest, rest]), v + speed * np.stack([rest, rest, step, -step])
        )
        direct = mirrored = 0.0
        for slope, factor in (((up_z - down_z) / size, np.ones(len(place))), ((up_v - down_v) / (size * speed), rate)):
            lines = np.fft.fft(slope / 4, axis=-2) / len(basis)  # (unit, coordinate, line, seen)
            direct = direct + (lines[0] - 1j * lines[1])[:, difference] * factor[:, None]
            mirrored = mirrored + (lines[0] + 1j * lines[1])[:, total] * factor.conj()[:, None]
        parts = np.stack([direct + mirrored, 1j * (direct - mirrored)])  # (part, coordinate, m, n, seen)
        flat = parts.transpose(2, 4, 0, 3, 1).reshape(len(place), len(seen), -1)
        return _real(basis.conj().T @ in_time(z, v) / len(basis)), _real(flat)

    def newton(x, share):
        for _ in range(NEWTON_STEPS):
            force, slope = force_and_slope(x)
            off = x - start - share * receptance @ force
            if np.linalg.norm(off) <= TOLERANCE * np.linalg.norm(x):
                return x, force, slope
            try:
                x = x - np.linalg.solve(np.eye(len(x)) - share * receptance @ slope, off)
            except np.linalg.LinAlgError:
                return None
            if not np.isfinite(x).all():
                return None
        return None

    x, share, growth = start, 0.0, 1.0
    while share < 1:
        found = newton(x, min(1.0, share + growth))
        if found is not None:
            x, share, growth = found[0], min(1.0, share + growth), 2 * growth
        elif growth < SMALLEST_GROWTH:
            raise NoSteadyState(
                f"no steady state at {speed:g} rad/s: the continuation from the linear response fails beyond "
                f"{share:.0%} of the nonlinear forces, so the motion jumps or is not periodic; leave that speed out or "
                "integrate in time"
            )
        else:
            growth /= 2
    _, force, slope = found
    return linear + reply @ force, Tangent(slope, reply, seen)


def seen_coordinates(forces):
    """The coordinates (coordinate, dof) that nonlinear forces depend and act on, each once."""
    return np.unique(np.concatenate([force.matrix for force in forces]), axis=0)[::-1]


def _chosen(force, seen):
    """Selects (coordinate of the force, coordinate seen) the coordinates of one force."""
    return (force.matrix[:, None] == seen).all(axis=-1).astype(float)
