"""Cracked rotors integrated step by step in real x and y, from physics alone; shares no code with the package.

x points down, y 90 degrees on in the sense of rotation. The crack's edge is at the angle `turn + angle` from x, the
weak direction; its element loses `loss` of its bending stiffness along that direction times the opening. A crack opens
where bending stretches the shaft.
"""

import numpy as np

STEPS, TURNS = 512, 50  # a period error of 3e-4 at 5X; in 50 turns at low speed the start decays to 1e-3
OPENINGS = {
    "switching": lambda phase: 1.0 * (np.cos(phase) > 0),
    "breathing": lambda phase: (1 + np.cos(phase)) / 2,
    "open": lambda phase: np.ones_like(phase),
    "power_cosine": lambda phase: np.cos(phase / 2) ** 4,
}


def beam(length, diameter, modulus=2.1e11, density=7850.0):
    """Stiffness, mass and weight shares of an Euler-Bernoulli element on (u, slope, u, slope)."""
    bending, area = modulus * np.pi * diameter**4 / 64, np.pi * diameter**2 / 4
    k = bending / length**3 * np.array([
        [12, 6 * length, -12, 6 * length], [6 * length, 4 * length**2, -6 * length, 2 * length**2],
        [-12, -6 * length, 12, -6 * length], [6 * length, 2 * length**2, -6 * length, 4 * length**2],
    ])  # fmt: skip
    m = density * area * length / 420 * np.array([
        [156, 22 * length, 54, -13 * length], [22 * length, 4 * length**2, 13 * length, -3 * length**2],
        [54, 13 * length, 156, -22 * length], [-13 * length, -3 * length**2, -22 * length, 4 * length**2],
    ])  # fmt: skip
    return k, m, 9.81 * density * area * length * np.array([1 / 2, length / 12, 1 / 2, -length / 12])


class Shaft:
    """Equal elements, discs {node: (mass, polar, diametral)}, bearings {node: (kx, ky, c)}; nodes from 1.

    crack : (element, loss, angle, opening), the opening a name of OPENINGS, or "curvature": open where the curvature of
            the moving shaft in the crack's element stretches the side of the crack
    """

    def __init__(self, element_m, count, diameter_m, discs, bearings, unbalance, crack=None, beta=0.0):
        size = 2 * (count + 1)
        self.size, self.crack, self.unbalance = size, crack, unbalance
        k, m, g, self.weight = np.zeros((size, size)), np.zeros((size, size)), np.zeros((size, size)), np.zeros(size)
        element, mass, load = beam(element_m, diameter_m)
        for e in range(count):
            here = slice(2 * e, 2 * e + 4)
            k[here, here] += element
            m[here, here] += mass
            self.weight[here] += load
        for node, (disc, polar, diametral) in discs.items():
            m[2 * node - 2, 2 * node - 2] += disc
            m[2 * node - 1, 2 * node - 1] += diametral
            g[2 * node - 1, 2 * node - 1] += polar
            self.weight[2 * node - 2] += 9.81 * disc
        zero = np.zeros_like(k)
        self.mass, self.stiffness = np.block([[m, zero], [zero, m]]), np.block([[k, zero], [zero, k]])
        self.damping, self.gyroscopic = np.zeros((2, 2 * size, 2 * size))
        self.gyroscopic[:size, size:], self.gyroscopic[size:, :size] = g, -g
        self.damping += beta * self.stiffness  # in the shaft, turning with it
        self.swirl = beta * np.block([[zero, k], [-k, zero]])
        for node, (kx, ky, c) in bearings.items():
            for place, spring in ((2 * node - 2, kx), (size + 2 * node - 2, ky)):
                self.stiffness[place, place] += spring
                self.damping[place, place] += c
        if crack:
            here = slice(2 * crack[0] - 2, 2 * crack[0] + 2)
            self.lost, self.bend = np.zeros((size, size)), np.zeros(size)
            self.lost[here, here] = crack[1] * element
            self.bend[[2 * crack[0] - 1, 2 * crack[0] + 1]] = -1 / element_m, 1 / element_m

    def rest(self):
        return np.linalg.solve(self.stiffness, np.concatenate([self.weight, np.zeros(self.size)]))

    def loss_at(self, turn, position):
        """(speed or 1, 2 size, 2 size) stiffness lost at a shaft angle and a position (speed, 2 size, 1)."""
        _, _, angle, opening = self.crack
        c, s = np.cos(turn + angle), np.sin(turn + angle)
        if opening == "curvature":
            x, y = position[:, : self.size, 0] @ self.bend, position[:, self.size :, 0] @ self.bend
            share = 1.0 * (c * x + s * y < 0)  # the convex side is opposite to the centre of curvature
        else:
            share = OPENINGS[opening](np.array([turn + angle]))
        return share[:, None, None] * np.block(
            [[c * c * self.lost, c * s * self.lost], [c * s * self.lost, s * s * self.lost]]
        )

    def turn(self, w, steps, x, v, forced):
        """Positions at the end of each step of a turn, and the last velocity, by average acceleration (Newmark).

        w : (speed, 1, 1);  x, v : (speed, 2 size, column);  forced : (column,) 1 where the load acts, else 0
        """
        h, size = 2 * np.pi / steps / w, self.size
        damping, stiffness = self.damping + w * self.gyroscopic, self.stiffness + w * self.swirl
        push = np.zeros(2 * size, complex)
        for node, moment in self.unbalance.items():  # kg m, complex
            push[2 * node - 2] += moment
            push[size + 2 * node - 2] += -1j * moment
        weight = np.concatenate([self.weight, np.zeros(size)])
        own = 4 / h**2 * self.mass + 2 / h * damping + stiffness
        inverse = np.linalg.inv(own)

        def load(phase):
            return (weight + w[:, 0] ** 2 * (push * np.exp(1j * phase)).real)[..., None] * forced

        def lost(phase, x):
            """Mean of the openings just before and after, so that a jump at a step counts half."""
            return (self.loss_at(phase - 1e-9, x) + self.loss_at(phase + 1e-9, x)) / 2 if self.crack else 0

        a = np.linalg.solve(self.mass, load(0.0) - damping @ v - (stiffness - lost(0.0, x)) @ x)
        seen = []
        for step in range(1, steps + 1):
            phase = 2 * np.pi * step / steps
            right = load(phase) + self.mass @ (4 / h**2 * x + 4 / h * v + a) + damping @ (2 / h * x + v)
            new = np.linalg.solve(own - lost(phase, x), right) if self.crack else inverse @ right
            x, v, a = new, 2 / h * (new - x) - v, 4 / h**2 * (new - x) - 4 / h * v - a
            seen.append(x)
        return np.array(seen), v

    def harmonics(self, speeds, orders, steps=STEPS):
        """Harmonics (speed, order, node) of x + j y about the position at rest without crack and unbalance.

        The motion that repeats is found from the motions of one turn from every unit start; where the crack opens by
        the motion itself, by waiting.
        """
        w, size = np.asarray(speeds, float)[:, None, None], self.size
        rest = self.rest()
        x, v = np.tile(rest[:, None], (len(w), 1, 1)), np.zeros((len(w), 2 * size, 1))
        if self.crack and self.crack[-1] == "curvature":
            for _ in range(TURNS):
                seen, v = self.turn(w, steps, x, v, np.ones(1))
                x = seen[-1]
        else:
            start = np.eye(4 * size, 4 * size + 1)
            unit = (np.tile(part, (len(w), 1, 1)) for part in (start[: 2 * size], start[2 * size :]))
            seen, v = self.turn(w, steps, *unit, np.eye(4 * size + 1)[-1])
            after = np.concatenate([seen[-1], v], axis=1)
            begin = np.linalg.solve(np.eye(4 * size) - after[..., :-1], after[..., -1:])
            x, v = np.split(begin, 2, axis=1)
        seen, _ = self.turn(w, steps, x, v, np.ones(1))
        moved = seen[:, :, :size:2, 0] + 1j * seen[:, :, size::2, 0] - (rest[:size:2] + 1j * rest[size::2])
        lines = np.fft.fft(np.roll(moved, 1, axis=0), axis=0) / steps  # the last sample is turn 0
        return np.moveaxis(lines[list(orders)], 0, 1)
