"""The machine: matrices of a rotor on its bearings, and the forces on it, to which effects add.

M u'' + (C + W G) u' + (K + W H) u = constant + rotating + local forces, W the speed in rad/s. Source of the equations:
Genta, Dynamics of Rotating Systems (2005), chapters 4 to 6; internal damping: Genta section 4.4 and Kramer, Dynamics of
Rotors (1993).
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from rotorstudy.blind.machines.beam import both_planes, by_plane, gyroscopic_planes, plane_matrices

GRAVITY = 9.80665  # m/s²


@dataclass(frozen=True)
class Disc:
    """A rigid disc: mass (kg), polar and diametral moment of inertia (kg m²)."""

    node: int
    mass: float
    polar_moment: float
    diametral_moment: float


@dataclass(frozen=True)
class Bearing:
    """A linear bearing: stiffness (N/m) and damping (N s/m), each 2x2 in x and y."""

    node: int
    stiffness: np.ndarray
    damping: np.ndarray


@dataclass(frozen=True)
class Rotor:
    """Elements in a row, discs, bearings, external damping (N s/m) of each node; films act beyond linear bearings."""

    elements: tuple
    discs: tuple
    bearings: tuple
    external_damping: tuple = ()
    films: tuple = ()

    @property
    def nodes(self):
        return len(self.elements) + 1

    @property
    def positions(self):
        """Of the nodes along the shaft, m."""
        return np.concatenate([[0.0], np.cumsum([element.length for element in self.elements])])

    @property
    def length(self):
        """In m."""
        return float(self.positions[-1])

    @property
    def diameter(self):
        """Of its first element, m."""
        return self.elements[0].outer_diameter

    @property
    def youngs_modulus(self):
        """In Pa."""
        return self.elements[0].youngs_modulus

    @property
    def mass(self):
        """Of shaft and discs, kg."""
        return sum(element.mass for element in self.elements) + sum(disc.mass for disc in self.discs)


@dataclass(frozen=True)
class PointRotor:
    """One disc on a massless shaft between rigid bearings, at `first` m from one and `second` m from the other.

    A disc in the middle does not tilt: the rotor of Jeffcott (1919). Dampings (N s/m) act on x and y of the disc.
    """

    first: float
    second: float
    diameter: float
    youngs_modulus: float
    disc: Disc
    external: float
    internal: float
    poissons_ratio: float = 0.3

    nodes, elements, bearings, films = 1, (), (), ()

    @property
    def discs(self):
        return (self.disc,)

    @property
    def positions(self):
        return np.array([self.first])

    @property
    def length(self):
        return self.first + self.second

    @property
    def mass(self):
        return self.disc.mass

    @property
    def plane_stiffness(self):
        """Stiffness 2x2 of deflection and slope in one plane, by the beam of Euler and Bernoulli."""
        a, b = self.first, self.second
        rigidity = 3 * self.youngs_modulus * np.pi / 64 * self.diameter**4
        cross = rigidity * (a**2 - b**2) / (a * b) ** 2
        return np.array([[rigidity * (a**3 + b**3) / (a * b) ** 3, cross], [cross, rigidity * (a + b) / (a * b)]])

    def hinge(self, position):
        """Selection (4, 2) of the moments at a kink of the shaft at a position (m), and its stiffness, N m/rad."""
        length, a = self.length, self.first
        kink = np.array([-(length - position) * a, -(length - position)]) / length
        if position < a:
            kink = np.array([-position * (length - a), position]) / length
        if position == a:  # at the disc, which tilts by the mean of both sides
            kink = np.array([-a * self.second, (a - self.second) / 2]) / length
        moment = self.plane_stiffness @ kink
        return by_plane(moment[:, None]), float(kink @ moment)

    def build(self, gravity):
        """Its machine."""
        machine = Machine(self, *np.zeros((5, 4, 4)), gravity)
        add_disc(machine, self.disc, gravity)
        machine.stiffness += both_planes(self.plane_stiffness)
        machine.at_node(0, (self.external + self.internal) * np.eye(2), "damping")
        machine.at_node(0, self.internal * np.array([[0.0, 1.0], [-1.0, 0.0]]), "circulatory")
        tilt = 0.01 * np.sqrt(self.plane_stiffness[1, 1] * self.disc.diametral_moment)  # in the middle it never moves
        machine.damping[2:, 2:] += tilt * np.eye(2) * (self.first == self.second)
        return machine


@dataclass(frozen=True)
class LocalForce:
    """A force on few coordinates y = selection.T u; `law(angle, y, v, speed)`, y and v = dy/dt (speeds, p).

    The law gives the force (speeds, p) and its derivatives by y and by v (speeds, p, p).
    """

    selection: np.ndarray
    law: Callable
    name: str


def linear_law(matrix_of, zero_of=None):
    """Law of the force matrix_of(angle) @ (y - zero_of(angle)), which is linear in y."""

    def law(angle, y, v, speed):
        matrix = matrix_of(angle)
        by_y = np.broadcast_to(matrix, (len(y), *matrix.shape))
        return (y if zero_of is None else y - zero_of(angle)) @ matrix.T, by_y, np.zeros_like(by_y)

    return law


@dataclass
class Machine:
    """Matrices and forces; harmonic[(k, power)] is the vector F of a force Re(F exp(j k angle)) speed**power."""

    rotor: Rotor
    mass: np.ndarray
    damping: np.ndarray
    gyroscopic: np.ndarray
    stiffness: np.ndarray
    circulatory: np.ndarray
    gravity: float = GRAVITY
    harmonic: dict = field(default_factory=dict)
    local: list = field(default_factory=list)

    @property
    def size(self):
        return len(self.mass)

    def add_harmonic(self, k, power, vector):
        """Add a force Re(vector exp(j k angle)) speed**power."""
        zero = np.zeros(self.size, complex)
        self.harmonic[k, power] = self.harmonic.get((k, power), zero) + vector

    def plane(self, node, slopes=False):
        """Selection (coordinates, 2) of the displacements of a node along x and y, or of its slopes b and -a there."""
        selection = np.zeros((self.size, 2))
        selection[[4 * node + 3, 4 * node + 2] if slopes else [4 * node, 4 * node + 1], [0, 1]] = 1.0
        return selection * ([1.0, -1.0] if slopes else 1.0)

    def add_rotating(self, node, value, power=0, slopes=False):
        """Add a force fx + j fy, N/(rad/s)^power, or a moment on the slopes, that turns with the shaft."""
        self.add_harmonic(1, power, self.plane(node, slopes) @ [value, -1j * value])

    def add_dofs(self, count):
        """Append coordinates without mass or stiffness; returns the first one's number."""
        first = self.size
        for name in ("mass", "damping", "gyroscopic", "stiffness", "circulatory"):
            setattr(self, name, np.pad(getattr(self, name), (0, count)))
        self.harmonic = {key: np.pad(value, (0, count)) for key, value in self.harmonic.items()}
        self.local = [LocalForce(np.pad(one.selection, ((0, count), (0, 0))), one.law, one.name) for one in self.local]
        return first

    def at_node(self, node, matrix, name="stiffness"):
        """Add a 2x2 matrix of x and y at a node to `stiffness`, `damping`, `mass` or `circulatory`."""
        block = slice(4 * node, 4 * node + 2)
        getattr(self, name)[block, block] += matrix

    def sag(self):
        """Static coordinates (degrees of freedom,) at rest under the constant forces, m and rad."""
        return np.linalg.solve(self.stiffness, self.harmonic[0, 0].real)

    def linear(self, speed):
        """M, C + W G and K + W H at a speed in rad/s."""
        return self.mass, self.damping + speed * self.gyroscopic, self.stiffness + speed * self.circulatory


def shaft_stiffness(rotor, weights=None, size=None):
    """Stiffness of the shaft alone, each element's times its weight (default 1)."""
    total = np.zeros((size or 4 * rotor.nodes,) * 2)
    for number, element in enumerate(rotor.elements):
        part = slice(4 * number, 4 * number + 8)
        weight = 1.0 if weights is None else weights[number]
        total[part, part] += weight * both_planes(plane_matrices(element)[0])
    return total


def add_internal_damping(machine, weights):
    """Damping of the material, W_i K_i (u' - W J u) of every element i (weights, s): viscous in the rotating frame.

    J turns every (x, y) and (a, b) by 90 degrees in the sense of the spin.
    """
    count, matrix = 4 * machine.rotor.nodes, shaft_stiffness(machine.rotor, weights)
    machine.damping[:count, :count] += matrix
    machine.circulatory[:count, :count] -= matrix @ np.kron(np.eye(count // 2), [[0.0, -1.0], [1.0, 0.0]])


def build(rotor, gravity=GRAVITY):
    """The machine of a rotor on its bearings, with internal and external damping and its weight along x."""
    if isinstance(rotor, PointRotor):
        return rotor.build(gravity)
    size = 4 * rotor.nodes
    machine = Machine(rotor, *np.zeros((5, size, size)), gravity)
    weight = np.zeros(size, complex)
    for number, element in enumerate(rotor.elements):
        part = slice(4 * number, 4 * number + 8)
        stiffness, translation, rotation, load = plane_matrices(element)
        machine.stiffness[part, part] += both_planes(stiffness)
        machine.mass[part, part] += both_planes(translation + rotation)
        machine.gyroscopic[part, part] += gyroscopic_planes(2 * rotation)
        weight[4 * number + np.array([0, 3, 4, 7])] += load * element.density * element.area * gravity
    machine.add_harmonic(0, 0, weight)
    add_internal_damping(machine, [element.internal_damping for element in rotor.elements])
    for disc in rotor.discs:
        add_disc(machine, disc, gravity)
    for bearing in rotor.bearings:
        machine.at_node(bearing.node, bearing.stiffness)
        machine.at_node(bearing.node, bearing.damping, "damping")
    for node, value in enumerate(rotor.external_damping):
        machine.at_node(node, value * np.eye(2), "damping")
    return machine


def add_disc(machine, disc, gravity=GRAVITY):
    """Add a disc: I_d a'' + I_p W b' = M_x about x, I_d b'' - I_p W a' = M_y about y, and its weight."""
    first = 4 * disc.node
    machine.mass[range(first, first + 4), range(first, first + 4)] += [disc.mass] * 2 + [disc.diametral_moment] * 2
    machine.gyroscopic[first + 2, first + 3] += disc.polar_moment
    machine.gyroscopic[first + 3, first + 2] -= disc.polar_moment
    machine.add_harmonic(0, 0, machine.plane(disc.node) @ [disc.mass * gravity, 0.0])
