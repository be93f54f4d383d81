"""The simulated rotor of a blind test, in real coordinates: x of all degrees of freedom, then y of all.

It is independent of the diagnosis, which solves for complex harmonics from tables of effects: it has mass, damping and
stiffness of a finer mesh, forces along x and y, and time integration of nonlinear and time-varying forces. Positions
are relative to the line of the unloaded shaft; `Plant.rest` is the static position under weight.
"""

from dataclasses import dataclass, field

import numpy as np

from rotorstudy.errors import RotorstudyError

STEPS = 128  # per revolution in time integration: harmonics up to 5 are then accurate to 1e-3 of the effect
MOST_REVOLUTIONS = 60  # integrated at most to find the periodic motion
REPEATS = 1e-7  # convergence tolerance: relative change from one revolution to the next


@dataclass
class Plant:
    """Equations of motion at some speeds: M X'' + C X' + K X = Re sum F_n e^{jnwt} + moving forces.

    speed     : (speed,) rad/s
    mass, damping, stiffness : (speed, 2 dof, 2 dof)
    forces    : n >= 0 -> (speed, 2 dof) complex
    stiffness_of_harmonic : functions n -> ([speed,] 2 dof, 2 dof) complex, defined in frequency only
    moving    : functions (angle, middle of the step, position (speed, 2 dof), velocity) -> force (speed, 2 dof)
    structure : of the mesh;  place : node of the nominal mesh -> node of this mesh
    """

    speed: np.ndarray
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    structure: object
    nominal: object
    place: object
    forces: dict = field(default_factory=dict)
    stiffness_of_harmonic: list = field(default_factory=list)
    moving: list = field(default_factory=list)
    rest: np.ndarray = None

    @property
    def dof(self):
        """Number of degrees of freedom in one direction."""
        return len(self.structure.dofs)

    def index(self, node, motion="translation"):
        """Position of a coordinate of a nominal node among the degrees of freedom of one direction."""
        return self.structure.index(self.place(node), motion)

    def push(self, shape, harmonic, amplitude):
        """Add the force shape * Re/Im of amplitude e^{jnwt} along x and y; shape (dof,), amplitude (speed,) complex."""
        amplitude = np.broadcast_to(np.asarray(amplitude, complex), self.speed.shape)
        if harmonic < 0:  # a backward force, written as cosines of a positive frequency
            x, y = amplitude.conj(), 1j * amplitude.conj()
        elif harmonic == 0:
            x, y = amplitude.real + 0j, amplitude.imag + 0j
        else:
            x, y = amplitude, -1j * amplitude
        force = np.concatenate([x[:, None] * shape, y[:, None] * shape], axis=1)
        n = abs(harmonic)
        self.forces[n] = self.forces.get(n, 0) + force

    def couple(self, target, matrix, xx=0.0, yy=0.0, xy=0.0, yx=0.0):
        """Add matrix (dof, dof) times a factor, a number or (speed,), to blocks of damping or stiffness."""
        n, block = self.dof, np.asarray(matrix)
        for row, column, factor in ((0, 0, xx), (n, n, yy), (0, n, xy), (n, 0, yx)):
            if np.any(factor):
                factor = np.broadcast_to(factor, self.speed.shape)[:, None, None]
                target[:, row : row + n, column : column + n] += factor * block

    def point(self, node, motion="translation"):
        """(dof, dof) with a one at a coordinate."""
        found = np.zeros((self.dof, self.dof))
        found[self.index(node, motion), self.index(node, motion)] = 1.0
        return found


def build_plant(structure, nominal, place, speed):
    """The bare rotor under its weight, a Plant.

    structure : Structure of the mesh;  nominal : Structure that the diagnosis is given;  place : nominal node -> node
    speed     : (speed,) rad/s
    """
    speed = np.asarray(speed, float)
    zero = np.zeros_like(structure.mass)
    both = [np.block([[part, zero], [zero, part]]) for part in (structure.mass, structure.stiffness)]
    mass, stiffness = (np.repeat(part[None], len(speed), axis=0) for part in both)
    plant = Plant(speed, mass, np.zeros_like(mass), stiffness, structure, nominal, place)
    # a disc that rotates at w answers a tilt rate along x by a moment along y
    plant.couple(plant.damping, structure.gyroscopic, xy=speed, yx=-speed)
    plant.push(structure.static_load, 0, 1.0)
    return plant


def settle(plant):
    """Set `plant.rest`, the static position (m); call it after adding bearings and before any other effect."""
    plant.rest = np.linalg.solve(plant.stiffness[0], plant.forces[0][0].real)


def state_matrix(plant):
    """State matrix (speed, 4 dof, 4 dof) of positions and velocities."""
    size = plant.mass.shape[-1]
    lower = -np.linalg.solve(plant.mass, np.concatenate([plant.stiffness, plant.damping], axis=-1))
    upper = np.concatenate([np.zeros((size, size)), np.eye(size)], axis=-1)
    return np.concatenate([np.broadcast_to(upper, lower.shape), lower], axis=-2)


def growth(plant):
    """(speed,) largest real part of the eigenvalues of the linear, constant part, 1/s."""
    return np.linalg.eigvals(state_matrix(plant)).real.max(axis=-1)


def critical_speeds(plant):
    """(mode,) undamped natural frequencies at standstill, rad/s."""
    size = plant.dof
    stiffness, mass = plant.stiffness[0][:size, :size], plant.mass[0][:size, :size]
    return np.sqrt(np.sort(np.abs(np.linalg.eigvals(np.linalg.solve(mass, stiffness)))))


def steady_motion(plant, harmonics):
    """Harmonics of z = x + j y relative to the static position: (speed, harmonic, dof) complex, m.

    raises : RotorstudyError if the machine is unstable or finds no periodic motion
    """
    if growth(plant).max() >= 0:
        raise RotorstudyError("the machine is unstable at one of the speeds")
    size, most = plant.dof, max(abs(int(n)) for n in harmonics)
    orders = sorted(n for n in plant.forces if plant.moving or n <= most)
    linear = {n: _forced(plant, n) for n in orders}
    found = np.zeros((len(plant.speed), len(harmonics), size), complex)
    for i, n in enumerate(harmonics):
        if abs(n) in linear:
            x, y = linear[abs(n)][:, :size], linear[abs(n)][:, size:]
            if n == 0:
                found[:, i] = x.real + 1j * y.real
            else:
                found[:, i] = (x + 1j * y) / 2 if n > 0 else (x.conj() + 1j * y.conj()) / 2
    if plant.moving:
        extra = np.fft.fft(_march(plant, linear), axis=0) / STEPS
        found += np.moveaxis(extra[list(harmonics)], 0, 1)
    found[:, [i for i, n in enumerate(harmonics) if n == 0]] -= plant.rest[:size] + 1j * plant.rest[size:]
    return found


def _forced(plant, n):
    """(speed, 2 dof) complex amplitudes of X at n >= 0."""
    w = n * plant.speed[:, None, None]
    dynamic = plant.stiffness - w**2 * plant.mass + 1j * w * plant.damping
    for stiffness in plant.stiffness_of_harmonic:
        dynamic = dynamic + stiffness(n)
    return np.linalg.solve(dynamic, plant.forces[n][..., None])[..., 0]


def _march(plant, linear):
    """(step, speed, dof) complex periodic motion that the moving forces add over one revolution.

    The linear part is integrated exactly, with forces interpolated linearly between steps. The initial state is
    corrected by the periodicity condition of the linear machine, with Anderson acceleration.
    """
    from scipy.linalg import expm

    size, speeds = plant.mass.shape[-1], len(plant.speed)
    angles = 2 * np.pi * np.arange(STEPS + 1) / STEPS
    turning = {n: np.exp(1j * n * angles) for n in linear}
    given = sum((np.multiply.outer(turning[n], value)).real for n, value in linear.items())
    moving = sum(
        (np.multiply.outer(turning[n], 1j * n * plant.speed[:, None] * value)).real for n, value in linear.items()
    )
    matrix = state_matrix(plant)
    step = (2 * np.pi / STEPS / plant.speed)[:, None, None]
    whole = expm(matrix * step)
    push = np.concatenate([np.zeros((speeds, size, size)), np.linalg.inv(plant.mass)], axis=-2)
    held = np.linalg.solve(matrix, (whole - np.eye(2 * size)) @ push)
    rising = np.linalg.solve(matrix, held / step - push)
    falling = held - rising
    closing = np.linalg.inv(np.eye(2 * size) - np.linalg.matrix_power(whole, STEPS))

    def force(k, middle, state):
        position, velocity = given[k] + state[:, :size], moving[k] + state[:, size:]
        return sum(one(angles[k], middle, position, velocity) for one in plant.moving)

    def revolution(state):
        track = [state]
        for k in range(STEPS):
            middle = angles[k] + np.pi / STEPS
            here = force(k, middle, state)
            free = (whole @ state[..., None])[..., 0]
            ahead = force(k + 1, middle, free + (held @ here[..., None])[..., 0])
            state = free + (falling @ here[..., None])[..., 0] + (rising @ ahead[..., None])[..., 0]
            track.append(state)
        return state, track

    scale = np.concatenate([np.ones((speeds, size)), np.ones((speeds, size)) / plant.speed[:, None]], axis=1)
    start, starts, gaps = np.zeros((speeds, 2 * size)), [], []
    for _ in range(MOST_REVOLUTIONS):
        with np.errstate(over="ignore", invalid="ignore"):
            end, track = revolution(start)
        if not np.isfinite(end).all():
            break
        gap = (closing @ (end - start)[..., None])[..., 0]
        if np.abs(gap * scale).max() <= REPEATS * np.abs(np.array(track) * scale).max():
            motion = np.array(track[:-1])
            return motion[..., : size // 2] + 1j * motion[..., size // 2 : size]
        starts, gaps = [*starts[-9:], start], [*gaps[-9:], gap]
        start = _next_start(starts, gaps, scale)
    raise RotorstudyError("the motion does not repeat from one revolution to the next")


def _next_start(starts, gaps, scale):
    """Next initial state (speed, state) by Anderson acceleration, for each speed separately."""
    new = starts[-1] + gaps[-1]
    if len(starts) == 1:
        return new
    for s in range(len(new)):
        gap_steps = np.diff([gap[s] * scale[s] for gap in gaps], axis=0).T
        start_steps = np.diff([start[s] for start in starts], axis=0).T
        share = np.linalg.lstsq(gap_steps, gaps[-1][s] * scale[s], rcond=1e-10)[0]
        new[s] -= (start_steps + gap_steps / scale[s][:, None]) @ share
    return new
