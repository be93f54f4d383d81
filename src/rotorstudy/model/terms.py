"""An effect is a table of entries, linear in its amplitudes, from which everything else is derived.

With complex nodal coordinates q (z = u_x + j u_y, tilt dz/ds), spin speed w and harmonics q_n of e^{jnwt}
(n > 0 forward, n < 0 backward), a parameter theta adds to the right-hand side of the equations of motion

    theta * sum over entries of   e^{j*shift*w*t} * gain(w) * matrix @ (d/dt)^order x,

x = q, conj(q), 1, or the static deflection or its conjugate.

A force that is nonlinear in the motion (rub) is a function of time instead, see NonlinearForce.

The response, the regression columns, the Jacobian and the force in time all follow from that table.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from rotorstudy.errors import PluginError

if TYPE_CHECKING:
    from rotorstudy.model.variation import Variation

SPEEDS_COMPARED = np.array([1.0, 31.0, 470.0])  # rad/s; gains that agree there are taken as the same function


@dataclass(frozen=True)
class Entry:
    """One product e^{j*shift*w*t} * gain(w) * matrix @ (d/dt)^order x.

    matrix : (dof, dof) acting on the coordinates, or (dof,) where `on` is "one"
    on     : "z" the coordinates, "conj" their complex conjugates, "one" the constant 1, "static" the static deflection,
             "static conj" its complex conjugate (weight-dominant effects)
    gain   : function of the spin speed in rad/s (array in, array out); of (speed, harmonic) if `frequency_only`
    frequency_only : True if the effect has no time-domain form (hysteretic damping, a measured receptance)
    """

    matrix: np.ndarray
    on: Literal["z", "conj", "one", "static", "static conj"] = "z"
    order: int = 0
    shift: int = 0
    gain: Callable | None = None
    frequency_only: bool = False

    @property
    def reads_motion(self) -> bool:
        """Whether the force depends on the motion."""
        return self.on in ("z", "conj")

    @property
    def is_constant(self) -> bool:
        """Whether the force depends neither on the motion nor on the static deflection."""
        return self.on == "one"

    @property
    def is_conjugate(self) -> bool:
        """Whether it acts on the conjugate, of the motion or of the static deflection."""
        return self.on.endswith("conj")

    def seen_by(self, harmonic: int) -> int:
        """Harmonic of the motion on which a harmonic of the force depends.

        Parameters
        ----------
        harmonic : int
            Of the force.

        Returns
        -------
        int
        """
        return (harmonic - self.shift) * (-1 if self.is_conjugate else 1)

    @cached_property
    def kind(self) -> tuple:
        """All but its matrix; equal for entries whose matrices may be added."""
        return self.on, self.order, self.shift, self.gain, self.frequency_only

    @cached_property
    def nonzero(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows (element,), columns (element,) and values (element,), in the unit of the matrix, that are not zero.

        The column of a vector is 0.
        """
        matrix = np.asarray(self.matrix).reshape(len(self.matrix), -1)
        row, column = np.nonzero(matrix)
        return row, column, matrix[row, column]

    def gain_at(self, speed: ArrayLike, harmonic: ArrayLike) -> np.ndarray:
        """Gain at speeds and harmonics.

        Parameters
        ----------
        speed : array (...)
            Spin speeds in rad/s.
        harmonic : array (...)
            Harmonics, int, broadcast with the speeds.

        Returns
        -------
        array (...)
            Factor of the matrix, in the unit that completes that of the force.

        Raises
        ------
        PluginError
            If the gain has another shape than the speeds, or is not finite.
        """
        if self.gain is None:
            return np.ones(np.broadcast_shapes(np.shape(speed), np.shape(harmonic)))
        speed, harmonic = np.broadcast_arrays(np.asarray(speed, float), np.asarray(harmonic))
        found = (self.gain(speed, harmonic) if self.frequency_only else self.gain(speed)) + 0 * speed
        if np.shape(found) != speed.shape or not np.isfinite(found).all():
            self._refuse_gain(found, speed)
        return found

    def _refuse_gain(self, found, speed):
        """Raise for a gain of a wrong shape or that is not finite, with the file and line of its function."""
        code = getattr(self.gain, "__code__", None)
        who = f"the gain of an entry ({code.co_filename}:{code.co_firstlineno})" if code else f"the gain {self.gain!r}"
        if np.shape(found) != speed.shape:
            raise PluginError(
                f"{who} has shape {np.shape(found)} for speeds of shape {speed.shape}; it must be that shape"
            )
        at = ", ".join(f"{w:g}" for w in np.unique(speed[~np.isfinite(found)])[:3])
        raise PluginError(f"{who} is not finite at {at} rad/s")

    def times(self, factor: complex) -> "Entry":
        """The same entry with its matrix multiplied by `factor`.

        Parameters
        ----------
        factor : complex
            Of unit 1.

        Returns
        -------
        Entry
        """
        return replace(self, matrix=factor * np.asarray(self.matrix))


@dataclass(frozen=True)
class NonlinearForce:
    """A nonlinear force that depends on the motion of some coordinates at the same instant.

    matrix   : (coordinate, dof) the coordinates it depends and acts on: a node, or a deformation of an element
    function : (displacement (..., time, coordinate), velocity, deflection) -> force of that shape, N; the displacement
               includes the static deflection, which is also passed by itself, constant in time
    takes_angle : whether the function takes the shaft angle too, (time, 1) rad, as its fourth argument
    jumps    : whether it changes its law at once, so that its harmonics decrease slowly and more of them are carried
    """

    matrix: np.ndarray
    function: Callable
    takes_angle: bool = False
    jumps: bool = False

    def at(
        self, displacement: ArrayLike, velocity: ArrayLike, deflection: ArrayLike, shaft_angle: ArrayLike
    ) -> np.ndarray:
        """The force at a motion.

        Parameters
        ----------
        displacement : array (..., time, coordinate)
            From the bearing line, static deflection included, m.
        velocity : array (..., time, coordinate)
            In m/s.
        deflection : array (..., 1, coordinate)
            Static deflection, m.
        shaft_angle : array (time,)
            In rad.

        Returns
        -------
        array (..., time, coordinate)
            In N.

        Raises
        ------
        PluginError
            If the plugin returns another shape, or NaN for a finite motion.
        """
        angle = (np.asarray(shaft_angle, float)[:, None],) if self.takes_angle else ()
        found = self.function(displacement, velocity, deflection, *angle)
        shape = np.shape(displacement)
        if np.shape(found) == shape and not (np.isnan(found).any() and np.isfinite(displacement).all()):
            return found
        code = getattr(self.function, "__code__", None)
        who = f"the force in time ({code.co_filename}:{code.co_firstlineno})" if code else repr(self.function)
        if np.shape(found) == shape:
            raise PluginError(f"{who} is NaN for a finite motion")
        raise PluginError(f"{who} has shape {np.shape(found)}; it must be that of the displacement, {shape}")


@dataclass(frozen=True)
class Parameter:
    """One amplitude of an effect, real or complex (with a magnitude and a phase).

    name    : a standard term ("internal_damping")
    unit    : SI, written "N s/m"
    entries : its table
    typical : a typical size in that unit, the scale of priors and checks
    force   : NonlinearForce multiplied by the (real) parameter, whose table of entries is then empty
    exact   : function(real amplitude) -> table of entries of an effect on the output that is not linear in its
              amplitude, and acts on what the others show; `entries` are then its derivative at zero
    default : its value where the rig states none; None: it has none, and is unknown
    also    : another name of its value -> (SI unit, factor from it): {"unbalance": ("kg m", 1 / mass)}
    """

    name: str
    unit: str
    entries: tuple[Entry, ...]
    typical: float
    is_complex: bool = False
    force: NonlinearForce | None = None
    exact: Callable | None = None
    default: float | None = None
    also: dict = field(default_factory=dict)

    @property
    def key(self) -> str:
        """Its configuration key, with the unit if it has one: `internal_damping_N_s_per_m`."""
        return self.name if self.unit == "1" else f"{self.name}_{unit_suffix(self.unit)}"

    @property
    def phase_key(self) -> str:
        """Configuration key of the phase of a complex parameter, rad."""
        return f"{self.name}_phase_rad"


@dataclass(frozen=True, eq=False)
class Unknown:
    """A real amplitude with its table: a real parameter, or the real or imaginary part of a complex one."""

    name: str
    unit: str
    entries: tuple[Entry, ...]
    typical: float
    carries: bool = False
    force: NonlinearForce | None = None
    exact: Callable | None = None


@dataclass(frozen=True)
class Term:
    """An effect at a place: its plugin, its parameters, and their values where known.

    values  : parameter name -> float or complex
    acts_on : "rotor" (right-hand side of the equations of motion) or "output" (the measured displacement)
    carries : whether it carries the static load (a bearing), so that it does not act on the static deflection
    label   : distinguishes terms of the same kind; it becomes part of the names, "eccentricity[left]"
    variation : of the numbers of the rotor, its matrices at any change of them; the entries are their derivatives
    options : of its plugin, in SI
    """

    kind: str
    parameters: tuple[Parameter, ...]
    values: dict = field(default_factory=dict)
    acts_on: Literal["rotor", "output"] = "rotor"
    label: str = ""
    carries: bool = False
    variation: "Variation | None" = None
    options: dict = field(default_factory=dict)

    @property
    def acts_on_output(self) -> bool:
        """Whether it changes the measured displacement instead of acting on the rotor."""
        return self.acts_on == "output"

    def full_name(self, parameter: Parameter) -> str:
        """Name of a parameter with the label of the term, if it has one: `eccentricity[left]`.

        Parameters
        ----------
        parameter : Parameter
            One of the term's.

        Returns
        -------
        str
        """
        return f"{parameter.name}[{self.label}]" if self.label else parameter.name

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """The real amplitudes of this term; a complex parameter has two."""
        found = []
        for p in self.parameters:
            name = self.full_name(p)
            if p.is_complex:
                imaginary = tuple(e.times(1j) for e in p.entries)
                found.append(Unknown(f"{name}_real", p.unit, p.entries, p.typical, self.carries))
                found.append(Unknown(f"{name}_imag", p.unit, imaginary, p.typical, self.carries))
            else:
                found.append(Unknown(name, p.unit, p.entries, p.typical, self.carries, p.force, p.exact))
        return tuple(found)

    @property
    def theta(self) -> np.ndarray:
        """Values (unknown,) of the unknowns in the units of the parameters, NaN where not given."""
        found = []
        for parameter in self.parameters:
            value = self.values.get(parameter.name, complex(np.nan, np.nan) if parameter.is_complex else np.nan)
            found += [np.real(value), np.imag(value)] if parameter.is_complex else [value]
        return np.array(found, float)


def share_of(unknown: Unknown, other: Unknown) -> float:
    """How much of one unknown acts with every unit of another: 1 for the same damping at the same node, else often 0.

    Parameters
    ----------
    unknown, other : Unknown
        A force in time, which cannot be compared, shares nothing.

    Returns
    -------
    float
        The smallest factor over the entries of `unknown`; other entries of `other` are left aside.
    """
    if unknown.force or other.force or not unknown.entries:
        return 0.0
    return min(sum(_entry_share(mine, its) for its in other.entries) for mine in unknown.entries)


def _entry_share(mine, its):
    """Factor between the matrices of two entries that are otherwise equal; 0 if they are not."""
    if mine.kind[:3] != its.kind[:3] or mine.frequency_only != its.frequency_only:
        return 0.0
    if np.shape(mine.matrix) != np.shape(its.matrix):
        return 0.0
    size = np.vdot(mine.matrix, mine.matrix)
    factor = np.vdot(mine.matrix, its.matrix) / size if size else 0.0
    if not abs(np.imag(factor)) < 1e-12 * abs(factor):  # zero, above all: other coordinates
        return 0.0
    off = np.abs(its.matrix - factor * np.asarray(mine.matrix)).max()
    gains = [e.gain_at(SPEEDS_COMPARED, 1) for e in (mine, its)]
    alike = off <= 1e-9 * np.abs(its.matrix).max() and np.all(np.abs(gains[0] - gains[1]) <= 1e-9 * np.abs(gains[1]))
    return float(np.real(factor)) if alike else 0.0


def planar_entries(direction, matrix, order=0, gain=None, *, frequency_only=False):
    """Entries of the force along a due to the motion along b, for direction "ab": "xx", "xy", "yx" or "yy".

    They follow from x = (z + conj z) / 2 and y = (z - conj z) / 2j; the matrix (dof, dof) is real. A complex gain of
    (speed, harmonic) must be conjugate at -harmonic, so that the force is real.
    """
    on_z, on_conj = {"xx": (0.5, 0.5), "xy": (-0.5j, 0.5j), "yx": (0.5j, 0.5j), "yy": (0.5, -0.5)}[direction]
    return (
        Entry(on_z * matrix, order=order, gain=gain, frequency_only=frequency_only),
        Entry(on_conj * matrix, on="conj", order=order, gain=gain, frequency_only=frequency_only),
    )


def unit_suffix(unit):
    """A unit as in configuration keys: 'N s/m' -> 'N_s_per_m'."""
    return unit.replace("/", " per ").replace("^", "").replace("*", " ").replace("  ", " ").replace(" ", "_")


def apply_entries(entries, amplitudes, speed, harmonics, reference=None):
    """Force harmonics of the entries of an effect at given displacement harmonics.

    amplitudes : (..., speed, harmonic, dof) complex harmonics of q, m; those not listed are taken as zero
    speed      : (speed,) rad/s
    harmonics  : (harmonic,) int
    reference  : (dof,) or (..., speed, dof) static deflection, not included in `amplitudes`; None if it has no force
    returns    : (..., speed, harmonic, row) complex, N per unit of the amplitude
    """
    rows = np.shape(entries[0].matrix)[0] if entries else amplitudes.shape[-1]
    force = np.zeros((*_lead(amplitudes, reference), rows), complex)
    for entry in entries:
        source = _source(entry, amplitudes, speed, harmonics, reference)
        force += source * entry.matrix if entry.is_constant else source @ np.asarray(entry.matrix).T
    return force


def _lead(amplitudes, reference):
    """Shape (..., speed, harmonic) of a force."""
    lead = amplitudes.shape[:-1]
    if np.ndim(reference) > 1:
        lead = (*np.broadcast_shapes(lead[:-2], np.shape(reference)[:-2]), *lead[-2:])
    return lead


def _source(entry, amplitudes, speed, harmonics, reference):
    """What the matrix of an entry acts on, times its gain: (..., speed, harmonic, dof), or (speed, harmonic, 1)."""
    speed, order = np.asarray(speed, float)[:, None], tuple(np.asarray(harmonics).tolist())
    if entry.is_constant:
        source = np.zeros((len(speed), len(order), 1), complex)
        if entry.shift in order:
            source[:, order.index(entry.shift)] = _gain(entry, speed, entry.shift)
        return source
    source = np.zeros((*_lead(amplitudes, reference), amplitudes.shape[-1]), complex)
    if entry.reads_motion:
        row, column, source_harmonic = _seen_by(entry.shift, entry.is_conjugate, order)
        seen = amplitudes[..., column, :]
        seen = seen.conj() if entry.is_conjugate else seen
        if entry.order:
            seen = (1j * source_harmonic * speed)[..., None] ** entry.order * seen
        if entry.gain is not None:
            seen = entry.gain_at(speed, np.array(order)[row])[..., None] * seen
        source[..., row, :] = seen
    if reference is not None and entry.order == 0 and entry.shift in order:
        still = np.conj(reference) if entry.is_conjugate else reference
        source[..., order.index(entry.shift), :] += _gain(entry, speed, entry.shift) * still
    return source


def _gain(entry, speed, harmonic):
    return 1.0 if entry.gain is None else entry.gain_at(speed, harmonic)


@lru_cache(maxsize=4096)
def _seen_by(shift, mirrored, harmonics):
    """Positions (slice or array) of force harmonics and of the motion harmonics they depend on, and the latter.

    Harmonic n of the force depends on harmonic n - shift of q, or of conj(q) if mirrored.
    """
    source = np.array(harmonics) - shift
    where = {n: i for i, n in enumerate(harmonics)}
    pairs = [(i, where[n]) for i, n in enumerate((-source if mirrored else source).tolist()) if n in where]
    row, column = np.array(pairs, int).reshape(-1, 2).T
    every = slice(0, len(harmonics))
    if len(row) == len(harmonics) and (row == column).all():
        return every, every, source
    return row, column, source[row]
