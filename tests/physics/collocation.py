"""The equations of motion solved once more, in real x and y at instants of a turn; shares no code with the package."""

import numpy as np

from rotorstudy import Entry, Model, Parameter, Structure, Term

POINTS = 65  # instants of a turn: harmonics up to 32, of which those above 15 are below 1e-10 of the largest


def term(name, value, *entries):
    return Term(name, (Parameter(name, "1", entries, abs(value), np.iscomplexobj(value)),), {name: value})


def four_coordinates(seed, sensors=(1, 2)):
    """Two measured translations, a hidden translation and a hidden tilt; generic, coupled by every kind of entry."""
    rng = np.random.default_rng([4, seed])

    def symmetric(rank):
        root = rng.standard_normal((4, rank))
        return root @ root.T / rank

    mass = np.diag([2.0, 1.5, 1.0, 0.7]) + 0.1 * symmetric(4)
    structure = Structure(
        mass=mass,
        stiffness=(2 * np.eye(4) + symmetric(4)) * 1e5,
        gyroscopic=0.3 * symmetric(2),
        static_load=9.81 * np.array([2.0, 1.5, 1.0, 0.0]),
        dofs=((1, "translation"), (2, "translation"), (3, "translation"), (3, "tilt")),
    )
    seen = np.diag([1.0, 1.0, 0.0, 0.0])

    def measured(imaginary=0.0):
        return seen @ (rng.standard_normal((4, 4)) + 1j * imaginary * rng.standard_normal((4, 4))) @ seen

    def hidden():
        return rng.standard_normal(4)

    terms = (
        term("damping", 100.0, Entry(-mass, order=1)),
        term("swirl", 30.0, Entry(-seen, order=1), Entry(1j * seen, gain=lambda speed: speed)),
        term("uneven", 1e4, Entry(measured(0.5), on="conj")),
        term("turning", 8e3, Entry(measured(), shift=1), Entry(measured(), on="conj", shift=3)),
        term("backward", 20.0, Entry(measured(0.5), order=1, shift=-2), Entry(measured(), on="conj", order=1, shift=1)),
        term("push", 4.0 * np.exp(0.7j), Entry(hidden(), on="one", shift=1, gain=lambda speed: (speed / 100) ** 2)),
        term("rub", 1.5, Entry(hidden(), on="one", shift=-2)),
    )
    return Model(structure, terms, sensors)


def collocated(model, speed, gyroscopic_sign=1.0):
    """{n: (dof,)} harmonics of the displacement from the static line: M q'' - j w G q' + K q = f at every instant.

    The sum over entries is read off the definition: e^{j shift w t} gain(w) matrix times a derivative of q or conj(q).
    """
    structure, dof = model.structure, len(model.structure.dofs)
    angle = 2 * np.pi * np.arange(POINTS) / POINTS
    # derivative of a periodic function from an odd number of samples (Trefethen, Spectral Methods, 2000, ch. 3)
    apart = np.arange(POINTS)[:, None] - np.arange(POINTS)
    with np.errstate(divide="ignore"):
        slope = np.where(apart == 0, 0.0, (-1.0) ** apart / (2 * np.sin(np.pi * apart / POINTS)))
    slope = speed * slope
    derivative = [np.eye(POINTS), slope, slope @ slope]
    base = [structure.stiffness + 0j, -1j * speed * gyroscopic_sign * structure.gyroscopic, structure.mass + 0j]
    on_z = [np.tile(matrix, (POINTS, 1, 1)) for matrix in base]
    on_conj = [np.zeros((POINTS, dof, dof), complex) for _ in range(3)]
    force = np.tile(structure.static_load + 0j, (POINTS, 1))
    for part in model.terms:
        for parameter in part.parameters:
            for entry in parameter.entries:
                gain = 1.0 if entry.gain is None else entry.gain(speed)
                amount = part.values[parameter.name] * gain * np.exp(1j * entry.shift * angle)
                if entry.on == "one":
                    force += amount[:, None] * entry.matrix
                else:
                    side = on_z if entry.on == "z" else on_conj
                    side[entry.order] -= amount[:, None, None] * entry.matrix
    rows = np.zeros((2, POINTS, dof, 2, POINTS, dof))  # (x or y, instant, coordinate) twice
    for p in range(3):
        z, c, d = on_z[p], on_conj[p], derivative[p]
        for i, j, block in (
            (0, 0, z.real + c.real),
            (0, 1, -z.imag + c.imag),
            (1, 0, z.imag + c.imag),
            (1, 1, z.real - c.real),
        ):
            rows[i, :, :, j] += np.einsum("kab,kl->kalb", block, d)
    size = 2 * POINTS * dof
    found = np.linalg.solve(rows.reshape(size, size), np.stack([force.real, force.imag]).ravel())
    x, y = found.reshape(2, POINTS, dof)
    spectrum = np.fft.fft(x + 1j * y, axis=0) / POINTS
    spectrum[0] -= np.linalg.solve(structure.stiffness, structure.static_load)
    return {n: spectrum[n] for n in range(-(POINTS // 2), POINTS // 2 + 1)}
