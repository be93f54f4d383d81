"""Steady state under nonlinear forces (rub, looseness) by alternating frequency and time: Cameron and Griffin 1989.

The motion is synthesised over one revolution, the force is evaluated at each sample and transformed back to harmonics.
Newton's method acts on the harmonics of the coordinates that these forces depend on; the linear part stays in the
receptances of the rotor. Of several steady states, it is the one reached from the linear response by increasing the
forces from zero (continuation).
"""

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
    seen  : (coordinate,) positions of the coordinates that the forces depend on
    """

    slope: np.ndarray
    reply: np.ndarray
    seen: np.ndarray

    def response(self, change):
        """Change (harmonic, dof, parameter), m per unit, with the nonlinear forces, from that without them."""
        moved = _real(change[:, self.seen])
        stiff = np.eye(len(moved)) - _real(self.reply[:, self.seen]) @ self.slope
        return change + self.reply @ (self.slope @ np.linalg.solve(stiff, moved))


def one_revolution(harmonics):
    """e^{jn phi} (time, harmonic) at equally spaced angles of one revolution."""
    count = SAMPLES_PER_HARMONIC * max(2, max(abs(int(n)) for n in harmonics))
    return np.exp(2j * np.pi / count * np.outer(np.arange(count), harmonics))


def nonlinear_column(force, amplitudes, speed, harmonics, deflection):
    """Force harmonics of one unit of a nonlinear force at given displacement harmonics.

    amplitudes : (..., speed, harmonic, dof) complex, m, about the deflection (dof,) or (..., speed, dof)
    returns    : (..., speed, harmonic, dof) complex, N; harmonics not listed are taken as zero
    """
    basis = one_revolution(harmonics)
    rate = 1j * np.asarray(harmonics)[:, None] * np.asarray(speed, float)[:, None, None]
    seen, still = amplitudes @ force.matrix.T, (np.asarray(deflection) @ force.matrix.T)[..., None, :]
    given = force.at(basis @ seen + still, basis @ (rate * seen), still)
    return basis.conj().T @ given / len(basis) @ force.matrix


def affine_error(force, amplitudes, speed, harmonics, deflection):
    """Share (rms) of a nonlinear force that is no affine function of its displacement, the same at all speeds.

    Arguments as for `nonlinear_column`. Zero where a contact stays open, or closed: it is then a constant and a
    stiffness.
    """
    basis = one_revolution(harmonics)
    rate = 1j * np.asarray(harmonics)[:, None] * np.asarray(speed, float)[:, None, None]
    seen, still = amplitudes @ force.matrix.T, (np.asarray(deflection) @ force.matrix.T)[..., None, :]
    moved = basis @ seen + still
    given = force.at(moved, basis @ (rate * seen), still)
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
    basis, rate = one_revolution(harmonics), 1j * np.asarray(harmonics) * speed
    still = deflection[seen]
    start, receptance = _real(linear[:, seen]), _real(reply[:, seen])

    def in_time(z, v):
        return sum(
            amplitude * force.at(z @ s.T, v @ s.T, still @ s.T) @ s
            for amplitude, force in forces
            for s in [force.matrix[:, seen]]
        )

    place = np.asarray(harmonics)
    difference, total = ((place[:, None] + sign * place) % len(basis) for sign in (-1, 1))
    units = np.array([1, 1j])[:, None, None, None] * np.eye(len(seen))[:, None, :]  # (unit, coordinate, time, seen)

    def force_and_slope(x):
        """Force (component,) and its slope: df = p dz + q conj(dz), so p_{m-n} on a_n and q_{m+n} on conj(a_n)."""
        a = _complex(x, len(seen))
        z, v = basis @ a + still, basis @ (rate[:, None] * a)
        size = DIFFERENCE * (np.abs(a).max() + 1e-12)
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
    """Positions (coordinate,) of the coordinates that nonlinear forces depend and act on."""
    return np.flatnonzero(np.any([np.any(force.matrix, axis=0) for force in forces], axis=0))
