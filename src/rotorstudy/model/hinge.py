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
from numpy.polynomial.chebyshev import chebder, chebvander

from rotorstudy.errors import CannotAct, RotorstudyError
from rotorstudy.model.breathing import SHIFTS, open_compliance, series_of, shares_of, shares_of_parts
from rotorstudy.model.entries import Basis, Multiples
from rotorstudy.model.kinds import CrackDepth
from rotorstudy.model.options import option_names
from rotorstudy.model.registry import registry
from rotorstudy.model.shaft import Section
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import NonlinearForce

CLOSED = 0.05  # of the static moment, for a difference by a residual stress
POSITIONS = 256  # of which the entries are kept: as many as a crack over all its forms is tried at, and more
LAST = ContextVar("last", default=(None,) * 4)  # crack, rotation, angle, and what they impose: its forces share it


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
        return self._softer / (1 + self._softer)

    @property
    def _softer(self):
        """Kink (2,) of the open crack along xi and eta, as a share of the rotation that strains the shaft."""
        return self.section.stiffness * self.open_compliance

    @property
    def open_compliance(self) -> np.ndarray:
        """Compliance (2,) of the open crack along xi and eta, rad/(N m)."""
        return open_compliance(*self._stated)

    @cached_property
    def _stated(self):
        """The depth plugin, the depth ratio, and the options of the plugin."""
        section = self.section
        shaft = section.outer_diameter_m, section.youngs_modulus_Pa, section.poissons_ratio
        options = *zip(("diameter_m", "youngs_modulus_Pa", "poissons_ratio"), shaft, strict=True), *self.options
        return self.depth.name, float(self.depth_ratio), options

    def force(self, closing_moment: float = 0.0, along: bool = False) -> NonlinearForce:
        """The moment, N m, by which the kink acts along `row` if the moment opens it against a closing one along xi."""
        stiffness = self.section.stiffness
        scale, closing = np.divide(*self.open_compliance) if along else 1.0, closing_moment / stiffness

        def moment(rotation, velocity, deflection, shaft_angle):
            imposed, turned, kinks = self._imposed(rotation, shaft_angle)
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
        """A part of a law of breathing by the direction of the instantaneous moment; as `entries_of_forms`."""
        acting = {"lagging": "across", "skewed": "coupled"}.get(motion, motion)

        def moment(rotation, velocity, deflection, shaft_angle):
            known = self._imposed(rotation, shaft_angle)[-1]
            if "laws" not in known:
                known |= self._whole_parts(rotation, shaft_angle)
            laws = known["laws"]  # powers of the direction
            while len(laws) <= order:
                laws.append(laws[-1] * laws[1])
            law = laws[order]
            open_part = law.imag if motion in ("coupled", "lagging") else 1 - law.real if order else 2.0
            return open_part / 2 * known[acting]

        return NonlinearForce(self.row[None], moment, takes_angle=True, takes_velocity=False)

    def _whole_parts(self, rotation, shaft_angle):
        """Moments of parts of a law that are always open, and the direction of the moment that the crack carries."""
        imposed, turned, _ = self._imposed(rotation, shaft_angle)
        tangent, size = self._tangent(imposed), -self.section.stiffness * self._softer[0]
        strain = imposed - tangent(imposed)
        # along xi by the moment along xi; along eta by that along eta; each by the other
        kinks = {"across": strain.real, "along": 1j * strain.imag, "coupled": strain.imag + 1j * strain.real}
        moments = {motion: size * (kink - tangent(kink)) * turned for motion, kink in kinks.items()}
        return moments | {"laws": [1.0 + 0j, _direction(strain)]}

    def _imposed(self, rotation, shaft_angle):
        """The imposed rotation (...) in the frame of the crack, the turn of that frame, and what is known of it."""
        crack, last_rotation, last_angle, found = LAST.get()
        if not (crack is self and last_rotation is rotation and np.array_equal(last_angle, shaft_angle)):
            turned = np.exp(1j * (shaft_angle + self.angle))
            found = -(rotation + self.section.own_moment / self.section.stiffness) / turned, turned, {}
            LAST.set((self, rotation, shaft_angle, found))
        return found

    def entries(self, breathing: str, along: bool = False) -> Multiples:
        """The crack whose opening depends on the turn of the shaft alone, by one of `breathing.LAWS`."""
        (found,) = self._entries(shares_of(self._law(breathing))[None], along)
        return found

    def entries_of_forms(self, parts: tuple[tuple[str, int], ...], breathing: str) -> list[Multiples]:
        """Parts (motion, order) of other laws of breathing, beside one of `breathing.LAWS`.

        Nearly any law is a sum of these; an amplitude of 1 is what the open crack yields across by the moment that it
        carries, to first order. motion: "across" or "along" the front, with one minus the cosine of `order` times the
        angle of the crack to the side that the weight stretches; "coupled", along by a moment across and conversely, or
        "lagging", across, with its sine; "skewed", coupled, but with one minus the cosine, for a front that is not
        symmetric. order 0 is an open crack.
        """
        return self._entries(shares_of_parts(self._law(breathing), parts))

    def _law(self, breathing):
        """What `shares_of` takes."""
        section = (*self._stated, float(self.section.stiffness)) if breathing == "weight" else ()
        return breathing, tuple(self._softer.tolist()), self.side, self.sudden, section

    def _entries(self, shares, along=False):
        """Entries of kinks; shares (kink, 2, shift) of the imposed rotation and of its conjugate, at `SHIFTS`.

        along : only (g - conj g) / 2 of a kink g in the frame of the crack, as large as the flexibility across makes it
        """
        if along:
            shares = (shares - shares[:, ::-1, ::-1]) * np.divide(*self.open_compliance) / 2  # shift k, and 2 - k
        turned = np.exp(1j * SHIFTS * self.angle) * shares
        at_rest = turned.sum(axis=1, keepdims=True) * (self.section.own_moment != 0)
        factors = np.concatenate([turned, at_rest], axis=1).reshape(len(shares), 3 * len(SHIFTS))
        basis = _basis(self.row.tobytes(), float(self.section.own_moment), float(self.section.stiffness))
        return [Multiples(basis, factor) for factor in factors]

    @cached_property
    def _kink_by_rotation(self):
        """Function from the imposed rotation phi (...) to the kink g (...), rad, both in the frame of the crack."""
        if self.sudden:  # it yields along xi alone, so that phi opens it where mu does
            share = self.open_shares[0]
            return lambda imposed: share * np.maximum(imposed.real, 0)

        def kink(imposed):
            direction = _direction(imposed)
            along, across = _at(direction.real, self._series)
            return np.abs(imposed) * along + 1j * (imposed.imag * across)

        return kink

    @property
    def _series(self):
        return series_of(*self._stated, float(self.section.stiffness))

    def _tangent(self, imposed):
        """Function from a small change of an imposed rotation (...) to that of the kink; from itself to the kink."""
        if self.sudden:
            return lambda change: self.open_shares[0] * np.where(imposed.real > 0, change.real, 0.0)
        direction = _direction(imposed)
        cosine, sine = direction.real, direction.imag
        slopes = np.vstack([chebder(self._series), np.zeros(2)])
        along, across, more, wider = _at(cosine, np.hstack([self._series, slopes]))
        by_size, by_turn = along + 1j * sine * across, -sine * more + 1j * (cosine * across - sine**2 * wider)

        def tangent(change):
            change = change * direction.conj()
            return by_size * change.real + by_turn * change.imag

        return tangent


def _at(cosine, series):
    """Values (column, ...) of Chebyshev series (k, column) at cosines (...), all from the same polynomials."""
    found = chebvander(cosine.ravel(), len(series) - 1) @ series
    return found.T.reshape(-1, *cosine.shape)


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


@lru_cache(maxsize=POSITIONS)
def _basis(row, own_moment, stiffness):
    """The Basis of a crack at a position: a kink as large as the rotation imposed by a motion, and by the weight."""
    return Basis(np.frombuffer(row), stiffness, own_moment, SHIFTS)
