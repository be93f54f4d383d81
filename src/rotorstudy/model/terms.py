"""Effects and their amplitudes: each is a table of entries, linear in its amplitudes, from which all else is derived.

The response, the regression columns, the Jacobian and the force in time all follow from that table, see
`rotorstudy.model.entries`. A force that is nonlinear in the motion (rub) is a function of time instead, see
NonlinearForce.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from rotorstudy.errors import PluginError
from rotorstudy.model.entries import Entry, Multiples, unscaled
from rotorstudy.model.variation import Variation

SPEEDS_COMPARED = np.array([1.0, 31.0, 470.0])  # rad/s; gains that agree there are taken as the same function

CALLABLE = set()  # code of functions that take the arguments of a force: a signature takes longer than to make a force


class InTime:
    """What follows from the fields of a NonlinearForce."""

    @property
    def takes_its_arguments(self) -> bool:
        """Whether its function can be called with the arguments that it is called with."""
        import inspect

        code = getattr(self.function, "__code__", None)  # of many closures: those of a search for shapes
        alike = code, hasattr(self.function, "__self__"), self.takes_angle
        if code is None or alike not in CALLABLE:
            try:
                inspect.signature(self.function).bind(*range(3 + self.takes_angle))
            except TypeError:
                return False
            CALLABLE.add(alike)
        return True

    def at(self, displacement, velocity, deflection, shaft_angle) -> np.ndarray:
        """The force (..., time, coordinate), N, at a motion of that shape; PluginError for another shape, or NaN."""
        angle = (np.asarray(shaft_angle, float)[:, None],) if self.takes_angle else ()
        found = self.function(displacement, velocity, deflection, *angle)
        shape = np.shape(displacement)
        if np.shape(found) == np.shape(velocity) != shape:
            found = np.broadcast_to(found, shape)  # whose derivatives by the displacement are taken together
        if np.shape(found) == shape and not (np.isnan(found).any() and np.isfinite(displacement).all()):
            return found
        code = getattr(self.function, "__code__", None)
        who = f"the force in time ({code.co_filename}:{code.co_firstlineno})" if code else repr(self.function)
        if np.shape(found) == shape:
            raise PluginError(f"{who} is NaN for a finite motion")
        raise PluginError(f"{who} has shape {np.shape(found)}; it must be that of the displacement, {shape}")


@dataclass(frozen=True)
class NonlinearForce(InTime):
    """A nonlinear force that depends on the motion of some coordinates at the same instant.

    matrix   : (coordinate, dof) the coordinates it depends and acts on: a node, or a deformation of an element
    function : (displacement (..., time, coordinate), velocity, deflection) -> force of that shape, N; the displacement
               includes the static deflection, which is also passed by itself, constant in time
    takes_angle : whether the function takes the shaft angle too, (time, 1) rad, as its fourth argument
    takes_velocity : False if the force does not depend on the velocity, whose derivatives are then left out
    """

    matrix: np.ndarray
    function: Callable
    takes_angle: bool = False
    takes_velocity: bool = True


def mean_overlap(depth: np.ndarray, spread: float | None) -> np.ndarray:
    """Mean of max(depth + e, 0) of a contact whose gap varies by e, normal with a standard deviation `spread`.

    A real contact closes gradually, as the heights of its surfaces, seats and threads are scattered.

    depth, spread : m, depth (...); None for a contact that closes at once
    returns       : (...) m
    source        : Greenwood and Williamson 1966, Proc. R. Soc. A 295, 300-319, for elastic seats
    """
    from scipy.special import ndtr

    if not spread:
        return np.maximum(depth, 0.0)
    x = depth / spread
    return spread * (x * ndtr(x) + np.exp(-(x**2) / 2) / np.sqrt(2 * np.pi))


@dataclass(frozen=True, eq=False)
class Parameter:
    """One amplitude of an effect, real or complex (with a magnitude and a phase); a complex one is two `unknowns`.

    name    : a standard term ("internal_damping")
    unit    : SI, written "N s/m"
    entries : its table
    typical : a typical size in that unit, the scale of priors and checks
    force   : NonlinearForce multiplied by the (real) parameter, whose table of entries is then empty
    exact   : function(real amplitude) -> table of entries of an effect on the output that is not linear in its
              amplitude, and acts on what the others show; `entries` are then its derivative at zero
    default : its value where the rig states none; None: it has none, and is unknown
    also    : another name of its value -> (SI unit, factor from it): {"unbalance": ("kg m", 1 / mass)}
    jumps   : whether its force or its entries change at once, so that their harmonics decrease slowly and more of them
              are carried
    films   : entries of the oil films that it loads, by its real and by its imaginary part, see
              `rotorstudy.model.rig_numbers.loading_films`
    carries : whether it carries the static load, set where it is an unknown of a Term
    positive : whether it cannot be negative, together with what acts alike, set where a rig is built
    """

    name: str
    unit: str
    entries: Sequence[Entry]
    typical: float
    is_complex: bool = False
    force: NonlinearForce | None = None
    exact: Callable | None = None
    default: float | None = None
    also: dict = field(default_factory=dict)
    jumps: bool = False
    films: tuple[tuple[Entry, ...], tuple[Entry, ...]] = ((), ())
    carries: bool = False
    positive: bool = False

    @property
    def key(self) -> str:
        """Its configuration key, with the unit if it has one: `internal_damping_N_s_per_m`."""
        return self.name if self.unit == "1" else f"{self.name}_{unit_suffix(self.unit)}"

    @property
    def loads_films(self) -> bool:
        """Whether it is a constant force that changes the load of oil films."""
        return bool(self.films[0])

    @property
    def phase_key(self) -> str:
        """Configuration key of the phase of a complex parameter, rad."""
        return f"{self.name}_phase_rad"

    @property
    def unscaled(self) -> Sequence[Entry]:
        """Its entries, but for factors of their matrices."""
        return unscaled(self.entries)

    @cached_property
    def springs(self) -> tuple[Entry, ...]:
        """Its entries that are a stiffness at rest."""
        return tuple(e for e in self.entries if e.reads_motion and e.order == 0 and e.shift == 0)

    @cached_property
    def kinds(self) -> frozenset[tuple]:
        """What its entries act on, their order and shift."""
        table = self.entries
        return frozenset(table.kinds if isinstance(table, Multiples) else (entry.kind[:3] for entry in table))

    @cached_property
    def rows(self) -> frozenset[int]:
        """Coordinates that its entries act on."""
        return frozenset(row for entry in self.unscaled for row in entry.nonzero[0].tolist())


@dataclass(frozen=True, eq=False)  # hashed by identity, so that what follows from terms can be kept
class Term:
    """An effect at a place: its plugin, its parameters, and their values where known.

    values  : parameter name -> float or complex
    acts_on : "rotor" (right-hand side of the equations of motion) or "output" (the measured displacement)
    carries : whether it carries the static load (a bearing), so that it does not act on the static deflection
    label   : distinguishes terms of the same kind; it becomes part of the names, "eccentricity[left]"
    variation : of the numbers of the rotor, its matrices at any change of them; the entries are their derivatives
    is_bearing_number : whether it is a number of bearings, or a constant force that loads them: its entries are
                        derivatives of theirs, see `Model.at`
    options : of its plugin, in SI
    is_foundation : whether it acts between the housing of a bearing and the ground
    """

    kind: str
    parameters: tuple[Parameter, ...]
    values: dict = field(default_factory=dict)
    acts_on: Literal["rotor", "output"] = "rotor"
    label: str = ""
    carries: bool = False
    variation: Variation | None = None
    is_bearing_number: bool = False
    options: dict = field(default_factory=dict)
    is_foundation: bool = False

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
    def unknowns(self) -> tuple[Parameter, ...]:
        """The real amplitudes of this term; a complex parameter has two."""
        found = []
        for p in self.parameters:
            name, common = self.full_name(p), {"carries": self.carries or p.loads_films, "films": ((), ())}
            real = replace(p, name=name, entries=p.entries + p.films[0], is_complex=False, **common)
            if p.is_complex:
                imaginary = (*(e.times(1j) for e in p.entries), *p.films[1])
                found.append(replace(real, name=f"{name}_real", exact=None))
                found.append(replace(real, name=f"{name}_imag", exact=None, entries=imaginary))
            else:
                found.append(real)
        return tuple(found)

    @property
    def theta(self) -> np.ndarray:
        """Values (unknown,) of the unknowns in the units of the parameters, NaN where not given."""
        found = []
        for parameter in self.parameters:
            value = self.values.get(parameter.name, complex(np.nan, np.nan) if parameter.is_complex else np.nan)
            found += [np.real(value), np.imag(value)] if parameter.is_complex else [value]
        return np.array(found, float)


def with_entries(term: Term, change: Callable) -> Term:
    """The term with each entry of its parameters replaced by those of a function of it."""
    parameters = (replace(p, entries=tuple(one for e in p.entries for one in change(e))) for p in term.parameters)
    return replace(term, parameters=tuple(parameters))


def share_of(unknown: Parameter, other: Parameter) -> float:
    """How much of one unknown acts with each unit of another, by the least factor of entries; 0 of forces in time."""
    if unknown.force or other.force or not unknown.entries:
        return 0.0
    if not (unknown.kinds <= other.kinds and unknown.rows <= other.rows):
        return 0.0  # before any matrices are compared
    return min(sum(_entry_share(mine, its) for its in other.entries) for mine in unknown.entries)


def _entry_share(mine, its):
    """Factor between the matrices of two entries that are otherwise equal; 0 if they are not."""
    if mine.kind[:3] != its.kind[:3] or mine.frequency_only != its.frequency_only:
        return 0.0
    if np.shape(mine.matrix) != np.shape(its.matrix):
        return 0.0
    elements = mine.nonzero, its.nonzero
    (row, column, one), (its_row, its_column, other) = elements
    if not (np.array_equal(row, its_row) and np.array_equal(column, its_column)):
        if not np.isin(its_row, row[np.abs(one) == np.abs(one).max(initial=0.0)]).any():
            return 0.0  # nothing of its where mine is largest
        places, at = np.unique(np.concatenate([row + 1j * column for row, column, _ in elements]), return_inverse=True)
        one, other = np.zeros((2, len(places)), complex)
        one[at[: len(row)]], other[at[len(row) :]] = elements[0][2], elements[1][2]
    size = np.vdot(one, one)
    factor = np.vdot(one, other) / size if size else 0.0
    if not abs(np.imag(factor)) < 1e-12 * abs(factor):  # zero, above all: other coordinates
        return 0.0
    if np.abs(other - factor * one).max() > 1e-9 * np.abs(other).max():
        return 0.0
    gains = [] if mine.gain is its.gain else [e.gain_at(SPEEDS_COMPARED, 1) for e in (mine, its)]
    alike = not gains or np.all(np.abs(gains[0] - gains[1]) <= 1e-9 * np.abs(gains[1]))
    return float(np.real(factor)) if alike else 0.0


def unit_suffix(unit):
    """A unit as in configuration keys: 'N s/m' -> 'N_s_per_m'."""
    return unit.replace("/", " per ").replace("^", "").replace("*", " ").replace("  ", " ").replace(" ", "_")
