"""Rotors nobody chose: every kind of entry the table allows, with generic matrices."""

import numpy as np

from rotorstudy import Entry, Model, Parameter, Structure, Term, make_term

SENSORS = (1, 2)


def term(name, value, *entries):
    return Term(name, (Parameter(name, "1", entries, abs(value), np.iscomplexobj(value)),), {name: value})


def random_structure(seed):
    """Two translations and a tilt, gyroscopic, natural frequencies near 300, 500 and 900 rad/s."""
    rng = np.random.default_rng(seed)
    mass = rng.uniform(1, 3, 3)
    modes = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    frequency = np.array([300, 500, 900]) * rng.uniform(0.9, 1.1, 3)
    stiffness = np.sqrt(np.outer(mass, mass)) * ((modes * frequency**2) @ modes.T)
    disc = rng.standard_normal((3, 3))
    loss = np.array([*rng.uniform(0.5, 1, 2), 0])  # a crack takes stiffness from the two translations
    most = 1 / (loss @ np.linalg.solve(stiffness, loss))  # with more the shaft would not carry itself
    dofs = (1, "translation"), (2, "translation"), (2, "tilt")
    losses = {"stiffness_loss": (np.outer(loss, loss), "N/m", 0.3 * most)}
    matrices = {"mass": np.diag(mass), "stiffness": stiffness, "gyroscopic": 0.1 * disc @ disc.T}
    return Structure(static_load=9.81 * mass, dofs=dofs, stiffness_loss=losses, **matrices)


def random_model(seed):
    """Entries on z, conj(z) and 1, of order 0 to 2, shifted forward and back, real and complex; a full crack.

    The tilt is not measured. `on_translations` are the parameters that act on measured coordinates alone, or on none.
    """
    structure = random_structure(seed)
    rng = np.random.default_rng([seed, 1])
    size = np.linalg.norm(structure.stiffness[:2, :2], 2)
    translations, everywhere = np.diag([1.0, 1.0, 0.0]), np.eye(3)

    def symmetric(imaginary=0.0):
        """Random, as large as the stiffness of the translations, and on these alone."""
        matrix = rng.standard_normal((3, 3)) + 1j * imaginary * rng.standard_normal((3, 3))
        matrix = translations @ (matrix + matrix.T) @ translations
        return size * matrix / np.linalg.norm(matrix, 2)

    def plugin(kind, section="effect", **item):
        return make_term(section, {"kind": kind, **item}, structure, SENSORS)

    terms = (
        plugin("external_damping", node=1, external_damping_N_s_per_m=30.0),
        plugin("internal_damping", node=1, internal_damping_N_s_per_m=40.0),
        plugin("unbalance", node=2, eccentricity_m=5e-6, eccentricity_phase_rad=0.5),
        plugin(
            "switching",
            "crack",
            order=3,
            weight_dominance=False,
            stiffness_loss_N_per_m=structure.stiffness_loss["stiffness_loss"][2],
        ),
        # 120 1/s on every coordinate: transients fall as e^-60t
        term("damping", 120.0, Entry(-structure.mass, order=1)),
        term("anisotropy", 0.1, Entry(-symmetric(0.3), on="conj")),
        term("asymmetry", 0.05, Entry(-symmetric(), on="conj", shift=2)),
        term("turning_damper", 0.02, Entry(-symmetric() / 300, on="conj", order=1, shift=2)),
        term("cross_coupling", 0.03, Entry(-1j * symmetric()), Entry(symmetric(1.0), shift=-1)),
        term("added_mass", 0.1, Entry(-everywhere, order=2)),
        term("couple", 0.5, Entry(np.array([0, 0, 1.0]), on="one", shift=1, gain=lambda speed: (speed / 100) ** 2)),
    )
    return Model(structure, terms, SENSORS)


def on_translations(model):
    """Names of the amplitudes an equation of measured motion is linear in: all but those acting on the tilt."""
    return tuple(name for name in model.names if name not in ("damping", "added_mass"))


def four_coordinates(seed):
    """Two measured translations, a hidden translation and a hidden tilt; generic, coupled by every kind of entry."""
    rng = np.random.default_rng([4, seed])

    def symmetric(rank):
        root = rng.standard_normal((4, rank))
        return root @ root.T / rank

    mass = np.diag([2.0, 1.5, 1.0, 0.7]) + 0.1 * symmetric(4)
    dofs, load = ((1, "translation"), (2, "translation"), (3, "translation"), (3, "tilt")), [2.0, 1.5, 1.0, 0.0]
    matrices = {"mass": mass, "stiffness": (2 * np.eye(4) + symmetric(4)) * 1e5, "gyroscopic": 0.3 * symmetric(2)}
    structure = Structure(static_load=9.81 * np.array(load), dofs=dofs, **matrices)
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
    return Model(structure, terms, (1, 2))
