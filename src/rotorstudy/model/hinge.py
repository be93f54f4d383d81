"""A transverse crack as a hinge between the nodes of an element: a kink of the shaft that depends on its moment.

The kink D is the change of the slope dz/ds across the crack. Let m0 = E I d2z/ds2 be the moment at the section by the
displacements of the nodes q and by the weight between them (`Section.moment`, `Section.own_moment`), and s the moment
by a unit kink while the nodes are held (`Section.stiffness`). The moment that the crack carries is m = m0 - s D. On the
nodes a kink acts as the force b D, with b = `Section.moment`: it is internal, so it has no resultant, and a rigid
motion causes no kink. This is the static condensation of the two parts of the element, exact wherever the crack lies.

In the frame that rotates with the crack by a = wt + its angle, the moment is mu = -m e^{-ja}, which pulls most on the
side at the angle psi = arg mu from xi, and the kink is g = -D e^{-ja}. It is the gradient of a strain energy of degree
two, so g = |mu| c(psi), with c from `CrackDepth.partly_open`, or from a hinge along xi that opens while Re mu > 0. Of
the rotation imposed by the nodes, phi = -(m0 / s) e^{-ja}, a part strains the shaft and the rest is the kink:

    phi = mu / s + g,   hence   g = |phi| h(arg phi),   h(x) = sum of h_k e^{jkx},

with real h_k, as the crack is symmetric. Where the weight alone opens the crack, psi rotates with the shaft; the
derivative C of g with respect to mu is then a periodic matrix, and g = (1 + s C)^-1 s C phi.

Where a residual stress closes the crack like a moment n along xi, its faces feel mu - n. With mu - n instead of mu and
phi - n / s instead of phi the equations are the same.
"""

from contextvars import ContextVar
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.polynomial.chebyshev import chebval

from rotorstudy.errors import CannotAct, RotorstudyError
from rotorstudy.model.cracks import compliance
from rotorstudy.model.entries import Basis, Entry, LocalMatrix, Multiples, local_outer
from rotorstudy.model.kinds import CrackDepth
from rotorstudy.model.options import option_names
from rotorstudy.model.registry import registry
from rotorstudy.model.shaft import Section
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import NonlinearForce

DIRECTIONS = 128  # of the moment, over 360 degrees; interpolation between them is wrong by 2e-4 of the kink
ACROSS = 0.5  # of the flexibility across, in the formulas by the angle: they count only the half in tension
CLOSED = 0.05  # of the static moment, for a difference by a residual stress
ROUND_OFF = 1e-9  # of a cosine, and of the coefficients of shares, relative to the largest
KEPT = 2048  # depths: a search tries the same one at many angles, and every search on a shaft begins with the same ones
POSITIONS = 256  # of which the entries are kept: as many as a crack over all its forms is tried at, and more
LAST = ContextVar("last", default=(None,) * 4)  # crack, rotation, angle, and what they impose: its forces share it
ORDER = 15  # highest k of h_k, which decrease with the cube of k; those left out are less than 1e-3 of the kink
SHIFTS = np.arange(-ORDER, ORDER + 3)  # of entries: the conjugate turns by two more


@dataclass(frozen=True)
class Hinge:
    """A crack in a section of the shaft; its force and its tables of entries are of a flexibility factor of 1.

    along  : option of its tables and force: only the kink along the front, see `_entries`
    """

    section: Section
    depth: CrackDepth
    depth_ratio: float
    angle: float  # of the middle of the crack edge from the shaft's reference line, rad
    sudden: bool  # whether it opens as a whole while the moment pulls on its edge's middle, and bends along xi alone
    static_moment: float  # by the weight, N m; positive where it stretches the upper side of the shaft
    options: tuple[tuple[str, float], ...] = ()

    @property
    def side(self) -> int:
        """1 if the weight stretches the lower side of the shaft there, else -1."""
        return -1 if self.static_moment > 0 else 1

    @cached_property
    def row(self) -> np.ndarray:
        """Rotation (dof,) that a unit of each coordinate imposes on the section, rad/m (rad/rad of a tilt)."""
        return self.section.moment / self.section.stiffness

    @cached_property
    def open_shares(self) -> np.ndarray:
        """Kink (2,) of an open crack along xi and eta, as a share of the imposed rotation."""
        softer = self.section.stiffness * self._open_compliance
        return softer / (1 + softer)

    @property
    def _open_compliance(self):
        return _open_compliance(self.depth.name, float(self.depth_ratio), self._of_shaft)

    @cached_property
    def _of_shaft(self):
        """Options of the depth plugin."""
        section = self.section
        shaft = section.outer_diameter_m, section.youngs_modulus_Pa, section.poissons_ratio
        return (*zip(("diameter_m", "youngs_modulus_Pa", "poissons_ratio"), shaft, strict=True), *self.options)

    @cached_property
    def _kink(self):
        """s c (direction,), rad: the kink by a moment of magnitude s, that of an imposed rotation of 1 rad."""
        if self.sudden:
            return self.section.stiffness * self._open_compliance[0] * np.maximum(np.cos(_pull()), 0) + 0j
        return self.section.stiffness * _partly_open(self.depth.name, float(self.depth_ratio), self._of_shaft)

    def force(self, closing_moment: float = 0.0, along: bool = False) -> NonlinearForce:
        """The moment, N m, by which the kink acts along `row` if the moment opens it against a closing one along xi."""
        stiffness = self.section.stiffness
        scale, closing = np.divide(*self._open_compliance) if along else 1.0, closing_moment / stiffness

        def moment(rotation, velocity, deflection, shaft_angle):
            imposed, _, turned, kinks = self._imposed(rotation, shaft_angle)
            if closing not in kinks:
                kinks[closing] = self._kink_by_rotation(imposed - closing)
            found = kinks[closing]
            return -stiffness * (1j * found.imag * scale if along else found) * turned

        return NonlinearForce(self.row[None], moment, takes_angle=True, takes_velocity=False)

    def force_of_closing(self) -> NonlinearForce:
        """What a residual stress changes, linear; an amplitude of 1 closes the crack by all of the static moment."""
        more, less = (self.force(way * CLOSED * abs(self.static_moment)) for way in (1, -1))
        return replace(more, function=lambda *at: (more.function(*at) - less.function(*at)) / (2 * CLOSED))

    def force_of_form(self, motion: str, order: int) -> NonlinearForce:
        """A part of a law of breathing by the direction of the instantaneous moment; as `entries_of_form`."""
        size, is_odd = -self.section.stiffness * self.open_shares[0], motion in ("coupled", "lagging")
        yields = {  # along xi by the rotation imposed along xi; along eta by that along eta; each by the other
            "across": lambda imposed: imposed.real,
            "along": lambda imposed: 1j * imposed.imag,
            "coupled": lambda imposed: imposed.imag + 1j * imposed.real,
        }[{"lagging": "across", "skewed": "coupled"}.get(motion, motion)]

        def moment(rotation, velocity, deflection, shaft_angle):
            imposed, direction, turned, _ = self._imposed(rotation, shaft_angle)
            law = direction**order if order else 1.0 + 0j
            law = law.imag / 2 if is_odd else (1 - law.real) / 2 if order else 1.0
            return size * law * yields(imposed) * turned

        return NonlinearForce(self.row[None], moment, takes_angle=True, takes_velocity=False)

    def _imposed(self, rotation, shaft_angle):
        """The imposed rotation (...) in the frame of the crack, its direction, the turn of that frame, and kinks."""
        crack, last_rotation, last_angle, found = LAST.get()
        if not (crack is self and last_rotation is rotation and np.array_equal(last_angle, shaft_angle)):
            turned = np.exp(1j * (shaft_angle + self.angle))
            imposed = -(rotation + self.section.own_moment / self.section.stiffness) / turned
            found = imposed, _direction(imposed), turned, {}
            LAST.set((self, rotation, shaft_angle, found))
        return found

    def entries_by_weight(self, along: bool = False) -> Multiples:
        """The crack opened by the static moment, which stretches the lower or the upper side of the shaft."""
        return self._entries(self._shares_by_weight, along)

    def open_entries(self, along: bool = False) -> Multiples:
        """The crack that never closes, such as a notch."""
        return self._entries(_turning_shares(*self.open_shares), along)

    def entries_by_turning(self, along: bool = False) -> Multiples:
        """The crack whose flexibility opens as (1 + cos) / 2 by its angle to the side that the weight stretches."""
        softer = self.section.stiffness * self._open_compliance
        return self._entries(_shares_by_turning(*softer.tolist(), self.side), along)

    def entries_by_angle(self, switching: bool = False, along: bool = False) -> Multiples:
        """The crack of the formulas of Mayes and Gasch, which opens by its angle to the side that the weight stretches.

        A share of what the open crack takes from the stiffness of the element is missing: (1 + cos) / 2, or if it is
        switching all of it while the cosine is positive. Unlike others, the first depends on the length of the element.
        """
        cosine = self.side * np.cos(_pull())
        share = np.where(np.abs(cosine) > ROUND_OFF, cosine > 0, 0.5) if switching else (1 + cosine) / 2
        softer = self.section.stiffness * self._open_compliance * [1, ACROSS]
        return self._entries(_turning_shares(*np.multiply.outer(softer / (1 + softer), share)), along)

    def entries_of_form(self, motion: str, order: int) -> Multiples:
        """A part of a law of breathing by the turn of the crack against the side that the weight stretches.

        Nearly any such law is a sum of these; an amplitude of 1 is what the open crack yields across. motion:
        "across" or "along" the front, with one minus the cosine of `order` times the angle; "coupled", along by a
        rotation across and conversely, or "lagging", across, with its sine; "skewed", coupled, but with one minus the
        cosine, for a front that is not symmetric. order 0 is an open crack.
        """
        return self._entries(self.open_shares[0] * _shares_of_form(motion, order, self.side), False)

    def _entries(self, shares, along):
        """Entries of a kink; shares (2, shift) of the imposed rotation and of its conjugate, at `SHIFTS`.

        along : only (g - conj g) / 2 of a kink g in the frame of the crack, as large as the flexibility across makes it
        """
        if along:
            shares = (shares - shares[::-1, ::-1]) * np.divide(*self._open_compliance) / 2  # shift k, and 2 - k
        turned = np.exp(1j * SHIFTS * self.angle) * shares
        at_rest = turned.sum(axis=0) if self.section.own_moment else 0.0 * turned[0]
        basis = _basis(self.row.tobytes(), float(self.section.own_moment), float(self.section.stiffness))
        return Multiples(basis, np.concatenate([*turned, at_rest]))

    @cached_property
    def _kink_by_rotation(self):
        """Function from the imposed rotation phi (...) to the kink g (...), rad, both in the frame of the crack."""
        if self.sudden:  # it yields along xi alone, so that phi opens it where mu does
            share = self.open_shares[0]
            return lambda imposed: share * np.maximum(imposed.real, 0)
        series = _series_of(self.depth.name, float(self.depth_ratio), self._of_shaft, float(self.section.stiffness))

        def kink(imposed):
            direction = _direction(imposed)
            along, across = chebval(direction.real, series)
            return np.abs(imposed) * along + 1j * (imposed.imag * across)

        return kink

    @cached_property
    def _shares_by_weight(self):
        """Shares for `_entries`: Fourier coefficients of those of the imposed rotation and of its conjugate.

        The derivative of |mu| c(psi) is c along mu and dc/dpsi across it, in the fixed frame.
        """
        orders = np.fft.fftfreq(DIRECTIONS, 1 / DIRECTIONS)
        across = np.fft.ifft(1j * orders * np.fft.fft(self._kink))
        along, sideways = (one * np.exp(-1j * _pull()) for one in (self._kink, across))  # of mu in its own direction
        softer = np.array([[along.real, sideways.real], [along.imag, sideways.imag]])
        softer = np.moveaxis(softer, -1, 0)
        (rr, rs), (sr, ss) = np.moveaxis(np.linalg.solve(np.eye(2) + softer, softer), 0, -1)
        found, side = np.zeros((2, len(SHIFTS))), float(self.side) ** np.arange(-ORDER, ORDER + 1)
        for i, way in enumerate((1, -1)):
            series = _coefficients((rr + way * ss + 1j * (sr - way * rs)) / 2)
            found[i, : len(series)] = (side * series)[::-1]  # the moment turns backwards
        return found


def _direction(rotation):
    """Unit complex numbers (...) in the direction of a rotation, zero of none."""
    size = np.abs(rotation)
    return rotation / np.where(size > 0, size, 1)


def crack_at(
    structure: Structure,
    position_m: float,
    depth_ratio: float,
    angle_rad: float,
    flexibility: str,
    sudden: bool = False,
    front_aspect_ratio: float = 0.0,
) -> Hinge:
    """The Hinge of a transverse crack in a solid round shaft; CannotAct where there is no solid section or a disc."""
    if structure.section_at is None:
        raise CannotAct("a transverse crack needs a rotor that knows its cross sections, such as finite_element")
    section = structure.section_at(position_m)
    if section.inner_diameter_m > 0:
        raise CannotAct(
            f"position_m = {position_m:g}: the shaft is hollow there (inner diameter {section.inner_diameter_m:g} m); "
            "the flexibility of a transverse crack is known for solid shafts"
        )
    if section.sleeve_diameter_m:
        raise CannotAct(f"position_m = {position_m:g}: the shaft has layers there; a crack needs a shaft without them")
    depth = registry().get("depth", flexibility, "the transverse crack")
    if depth.partly_open is None:
        raise RotorstudyError(f"flexibility = {flexibility!r}: that depth plugin does not say how a crack closes")
    curved = "front_aspect_ratio" in option_names(depth.function)
    if front_aspect_ratio and not curved:
        raise RotorstudyError(f"front_aspect_ratio = {front_aspect_ratio:g}: '{flexibility}' has only straight fronts")
    options = (("front_aspect_ratio", float(front_aspect_ratio)),) if curved else ()
    return Hinge(section, depth, depth_ratio, angle_rad, sudden, structure.static_moment_at(section), options)


def _turning_shares(xi, eta, both=0.0):
    """Shares for `Hinge._entries` of kinks (direction,) along xi and eta, and along one by rotation along the other."""
    found, least = np.zeros((2, len(SHIFTS)), complex), ROUND_OFF * max(np.abs(one).max() for one in (xi, eta, both))
    for i, share in enumerate(((xi + eta) / 2, (xi - eta) / 2 + 1j * both)):  # the conjugate turns by twice its angle
        series = np.fft.fft(np.broadcast_to(share, DIRECTIONS))[np.arange(-ORDER, ORDER + 1)] / DIRECTIONS
        series = np.where(np.abs(series.imag) > least, series, series.real)
        found[i, 2 * i : 2 * i + len(series)] = np.where(np.abs(series) > least, series, 0.0)
    return found


@lru_cache(maxsize=POSITIONS)
def _basis(row, own_moment, stiffness):
    """The Basis of a crack at a position: a kink as large as the rotation imposed by a motion, and by the weight."""
    row = np.frombuffer(row)
    (here,) = row.nonzero()
    pattern, own = stiffness * local_outer(row), LocalMatrix(row.shape, (here, 0 * here, own_moment * row[here]))
    kinds = ("z", pattern), ("conj", pattern), ("one", own)
    return Basis(tuple(Entry(matrix, on=on, shift=int(shift)) for on, matrix in kinds for shift in SHIFTS))


@lru_cache(maxsize=KEPT)
def _shares_by_turning(xi, eta, side):
    """Shares of a crack whose softness along xi and eta, in kinks by the moment of a unit kink, opens by its angle."""
    softer = np.multiply.outer([xi, eta], (1 + side * np.cos(_pull())) / 2)
    return _turning_shares(*softer / (1 + softer))


@lru_cache(maxsize=KEPT)
def _shares_of_form(motion, order, side):
    """Shares of a part of a law of breathing, of an open crack that yields across as the shaft does."""
    law = side**order * np.exp(-1j * order * _pull())  # the moment turns backwards
    even = (1 - law.real) / 2 if order else law.real
    xi = {"across": even, "lagging": law.imag / 2}.get(motion, 0.0)
    both = {"coupled": law.imag / 2, "skewed": even}.get(motion, 0.0)
    return _turning_shares(xi, even if motion == "along" else 0.0, both)


@lru_cache
def _pull():
    """Directions (direction,) in which the moment pulls, rad from xi."""
    return 2 * np.pi / DIRECTIONS * np.arange(DIRECTIONS)


@lru_cache(maxsize=KEPT)
def _open_compliance(name, depth_ratio, shaft):
    """Compliance (2,) of the open crack along xi and eta, rad/(N m); not to be changed."""
    depth = registry().get("depth", name, "the transverse crack")
    return compliance(depth, depth_ratio, "the transverse crack", **dict(shaft))


@lru_cache(maxsize=KEPT)
def _partly_open(name, depth_ratio, shaft):
    """Kink c (direction,) by a unit moment in all directions, rad/(N m)."""
    half = _pull()[: DIRECTIONS // 2]
    found = registry().get("depth", name, "the transverse crack").partly_open(depth_ratio, half, **dict(shaft))
    return np.concatenate([found, [0], found[:0:-1].conj()])  # closed in pure compression, and symmetric


@lru_cache(maxsize=KEPT)
def _series_of(name, depth_ratio, shaft, stiffness):
    """Chebyshev coefficients (k, 2) in cos x of Re h(x) and of Im h(x) / sin x, of a crack at any angle."""
    kink = stiffness * _partly_open(name, depth_ratio, shaft)
    turned = 1 + kink * np.exp(-1j * _pull())  # the imposed rotation in the direction of the moment
    h = _coefficients(np.interp(_pull(), _pull() + np.angle(turned), kink / np.abs(turned), period=2 * np.pi))
    along, odd = h[ORDER:] + h[ORDER::-1], h[ORDER + 1 :] - h[ORDER - 1 :: -1]
    across = np.array([2 * odd[k::2].sum() for k in range(ORDER + 1)])  # sin kx / sin x = 2 cos (k-1)x + ...
    return np.stack([along, across], axis=-1) / np.where(np.arange(ORDER + 1) > 0, 1, 2)[:, None]


def _coefficients(values):
    """Fourier coefficients (k,), k = -ORDER..ORDER, of a function of the direction; real, as the crack is symmetric."""
    return (np.fft.fft(values).real / DIRECTIONS)[np.arange(-ORDER, ORDER + 1)]
