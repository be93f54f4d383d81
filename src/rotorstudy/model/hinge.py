"""A transverse crack as a hinge between the nodes of an element: a kink of the shaft that depends on its moment.

With m = E I d2z/ds2 by the nodes and the weight (`Section`), and the stiffness s of the kink against held nodes, the
crack feels m - s D, where D is its kink. A kink acts on the nodes as the force b^T D, b the moment by the nodes: it
is internal, so that it has no resultant and does not resist rigid motion. All this is the static condensation of the
two parts of the element and exact for it, wherever the crack lies.

In the turning frame, r = z e^{-ja} with a = wt + the angular position of the crack, the moment mu = -m e^{-ja} pulls
at the angle psi = arg mu. The kink is the gradient of a strain energy of degree 2, g = |mu| g(psi) (see
`CrackDepth.partly_open`). Hence, of the rotation phi = -(m / s) e^{-ja} that the nodes impose,

    phi = mu / s + g,   g = |phi| h(arg phi),   h(x) = sum of h_k e^{jkx}:

one periodic function of the direction, with real h_k as the crack is symmetric. Where the weight alone opens the crack,
psi turns with the shaft and the derivative C of g by mu is a periodic matrix: g = (1 + s C)^-1 s C phi.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import CannotAct, RotorstudyError
from rotorstudy.model.depth import compliance
from rotorstudy.model.registry import registry
from rotorstudy.model.structure import Section, Structure
from rotorstudy.model.terms import Entry, NonlinearForce

DIRECTIONS = 64  # of a full turn, of which as many coefficients follow
ORDER = 15  # of the series; the coefficients decrease with the cube of k, beyond it lies less than 1e-3 of the kink
SMOOTH_SHARE = 1e-12  # of a rotation, rad, below which the direction of the moment is undefined


class Hinge(NamedTuple):
    """A crack in a section of the shaft.

    section : where it is
    series  : (k,) h_k for k = -ORDER..ORDER, shares of the imposed rotation by which the breathing crack kinks
    by_weight : (2, k) the same by which it kinks where the weight opens it: on the rotation and on its conjugate
    open_shares : (2,) the same along xi and eta if it never closes
    angle   : of the middle of the crack edge from the phase mark, rad
    side    : 1 if the weight stretches the lower side of the shaft there, else -1
    """

    section: Section
    series: np.ndarray
    by_weight: np.ndarray
    open_shares: np.ndarray
    angle: float
    side: int

    @property
    def row(self):
        """Imposed rotation (dof,) by a unit of each coordinate, 1/m (1)."""
        return self.section.moment / self.section.stiffness

    @property
    def own_rotation(self):
        """Imposed rotation by the weight of the element, rad."""
        return self.section.own_moment / self.section.stiffness

    def force(self) -> NonlinearForce:
        """The moment by which the kink acts, opened by the moment of the same instant.

        Returns
        -------
        NonlinearForce
        """

        def moment(rotation, velocity, deflection, shaft_angle):
            turned = np.exp(1j * (shaft_angle + self.angle))
            imposed = -(rotation + self.own_rotation) / turned
            size = np.abs(imposed)
            direction = imposed / np.where(size > 0, size, 1)
            share = np.polyval(self.series[::-1], direction) * direction.conj() ** ORDER
            return -self.section.stiffness * size * share * turned

        return NonlinearForce(self.row[None], moment, turns=True)

    def entries_by_weight(self) -> tuple[Entry, ...]:
        """Table of the crack opened by the static moment, which pulls down or up in the fixed frame.

        Returns
        -------
        tuple of Entry
        """
        shares = zip(range(-ORDER, ORDER + 1), *self.by_weight, strict=True)
        return self._entries({-k: (self.side**k * direct, self.side**k * mirrored) for k, direct, mirrored in shares})

    def open_entries(self) -> tuple[Entry, ...]:
        """Table of a crack that never closes, such as a notch.

        Returns
        -------
        tuple of Entry
        """
        xi, eta = self.open_shares
        return self._entries({0: ((xi + eta) / 2, 0.0), 2: (0.0, (xi - eta) / 2)})

    def _entries(self, shares):
        """Entries of a kink {shift: (share of the imposed rotation, of its conjugate)}."""
        pattern, found = self.section.stiffness * np.outer(self.row, self.row), []
        for shift, (direct, mirrored) in shares.items():
            turn = np.exp(1j * int(shift) * self.angle)
            sources = ("z", direct * pattern), ("conj", mirrored * pattern)
            alone = (direct + mirrored) * self.section.own_moment * self.row
            found += [
                Entry(matrix * turn, on=on, shift=int(shift)) for on, matrix in (*sources, ("one", alone))
                if np.any(matrix)
            ]  # fmt: skip
        return tuple(found)


def crack_at(structure: Structure, position_m: float, depth_ratio: float, angle_rad: float, flexibility: str) -> Hinge:
    """The Hinge of a transverse crack in a solid round shaft.

    Parameters
    ----------
    structure : Structure
    position_m : float
        From node 1, m.
    depth_ratio : float
        Depth over the diameter.
    angle_rad : float
        Of the middle of the crack edge from the phase mark, rad.
    flexibility : str
        Name of the depth plugin.

    Returns
    -------
    Hinge

    Raises
    ------
    CannotAct
        If the sections of the rotor are not known, or the shaft is hollow there.
    RotorstudyError
        For a position outside the shaft, or a depth out of range.
    """
    if structure.section_at is None:
        raise CannotAct("a transverse crack needs a rotor that knows its cross sections, such as finite_element")
    section = structure.section_at(position_m)
    if section.inner_diameter_m > 0:
        raise CannotAct(
            f"position_m = {position_m:g}: the shaft is hollow there (inner diameter {section.inner_diameter_m:g} m); "
            "the flexibility of a transverse crack is known for solid shafts"
        )
    depth = registry().get("depth", flexibility, "transverse crack")
    if depth.partly_open is None:
        raise RotorstudyError(f"flexibility = {flexibility!r}: that depth plugin does not say how a crack closes")
    shaft = section.outer_diameter_m, section.youngs_modulus_Pa, section.poissons_ratio
    opened = section.stiffness * compliance(depth, depth_ratio, "transverse crack", **_options(shaft))
    series = _series(depth.name, float(depth_ratio), *map(float, shaft), float(section.stiffness))
    side = structure.tension_side_at(section)
    return Hinge(section, *series, opened / (1 + opened), angle_rad, side)


def _options(shaft):
    return dict(zip(("diameter_m", "youngs_modulus_Pa", "poissons_ratio"), shaft, strict=True))


@lru_cache(maxsize=256)  # a search turns the same crack, and a model is built anew for each of its causes
def _series(name, depth_ratio, diameter, modulus, ratio, stiffness):
    """`Hinge.series` and `Hinge.by_weight` of a crack whose kink is held back by a stiffness."""
    from scipy.interpolate import CubicSpline

    depth = registry().get("depth", name, "transverse crack")
    half = 2 * np.pi / DIRECTIONS * np.arange(DIRECTIONS // 2)
    kink = stiffness * depth.partly_open(depth_ratio, half, **_options((diameter, modulus, ratio)))
    pull = np.concatenate([half, np.pi + half])
    kink = np.concatenate([kink, [0], kink[:0:-1].conj()])  # in pure compression it is closed
    imposed = np.exp(1j * pull) + kink
    angle, share = np.unwrap(np.angle(imposed)), kink / np.abs(imposed)
    periodic = CubicSpline(np.append(angle, angle[0] + 2 * np.pi), np.append(share, share[0]), bc_type="periodic")
    return _coefficients(periodic(pull)), _expanded(pull, kink)


def _expanded(pull, kink):
    """Coefficients (2, k) of the share of the imposed rotation, where its small changes do not move the opening.

    The derivative of |mu| g(psi) is g along mu and dg/dpsi across it. The share of the conjugate is that in the fixed
    frame, where the static moment keeps its direction.
    """
    orders = np.fft.fftfreq(DIRECTIONS, 1 / DIRECTIONS)
    across = np.fft.ifft(1j * orders * np.fft.fft(kink))
    along, sideways = kink * np.exp(-1j * pull), across * np.exp(-1j * pull)  # of mu in its own direction
    compliance = np.stack([np.stack([along.real, sideways.real]), np.stack([along.imag, sideways.imag])])
    compliance = np.moveaxis(compliance, -1, 0)
    (rr, rs), (sr, ss) = np.moveaxis(np.linalg.solve(np.eye(2) + compliance, compliance), 0, -1)
    direct, mirrored = (rr + ss + 1j * (sr - rs)) / 2, (rr - ss + 1j * (sr + rs)) / 2
    return np.stack([_coefficients(direct), _coefficients(mirrored)])


def _coefficients(values):
    """Fourier coefficients (k,), k = -ORDER..ORDER, of a function of the direction; real, as the crack is symmetric."""
    return (np.fft.fft(values).real / DIRECTIONS)[np.arange(-ORDER, ORDER + 1)]
