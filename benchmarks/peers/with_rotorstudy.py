"""One task by rotorstudy: python with_rotorstudy.py TASK RUNS; prints JSON. Runs in `.venv`.

Axes of rotorstudy: x along the weight, y along the x of ROSS, so that z = j (x + j y) of ROSS.
"""

import sys

import machine
import numpy as np

from rotorstudy.blind.machines.rig_items import disc, shaft, springs, unbalance

QUARTER = np.pi / 2


def rig(elements, weight=True):
    """Rig file of the machine."""

    def place(one):
        return 1 + machine.node(one["place"], elements)

    discs = (disc(place(one), one["m"], one["Ip"], one["Id"]) for one in machine.DISCS)
    options = {"outer_diameter_m": machine.DIAMETER, "youngs_modulus_Pa": machine.STEEL["E"]}
    options |= {"density_kg_per_m3": machine.STEEL["rho"], "theory": "euler_bernoulli"}
    options["gravity_m_per_s2"] = machine.GRAVITY if weight else 0.0
    return {
        "rotor": shaft(machine.LENGTH, elements, *discs, **options),
        "bearings": [
            part
            for i, one in enumerate(machine.BEARINGS)
            for part in springs({place(one): str(i)}, (one["kyy"], one["kxx"]), (one["cyy"], one["cxx"]))
        ],
        "effects": [
            unbalance(place(one), one["magnitude"], one["phase"] + QUARTER, label=str(i), mass_kg=1.0)
            for i, one in enumerate(machine.UNBALANCE)
        ],
    }


def shown(response):
    """Translations in the axes of ROSS; coordinates are (translation, tilt) of each node."""
    return response[..., 0::2] / 1j


def orbit(response):
    """Forward and backward 1X, (2, ..., node), from harmonics (..., 2, dof) 1 and -1."""
    forward, backward = np.moveaxis(shown(response), -2, 0)
    return np.stack([forward, backward])


def first():
    """Import, and the unbalance response at one speed."""
    return response(4, [machine.SPEED])


def model(elements, weight=True):
    """The machine."""
    from rotorstudy import build_model

    return build_model(rig(elements, weight))


def modes(elements):
    """Eigenvalues at one speed, of a model that is new each time."""
    from rotorstudy import eigenvalues

    return lambda: eigenvalues(model(elements), [machine.SPEED])[0]


def response(elements, speeds=machine.SPEEDS):
    """Unbalance response at 51 speeds, of a model that is new each time."""
    from rotorstudy import harmonic_response

    return lambda: orbit(harmonic_response(model(elements), np.array(speeds), [1, -1]))


def from_rest(elements, integrated=False):
    """Motion after a start from rest, by the modes or by an integrator."""
    from rotorstudy.response.integration import time_response, transient_response

    ready, time = model(elements, weight=False), np.arange(0, machine.DURATION, machine.STEP)
    method = time_response if integrated else transient_response
    return lambda: shown(method(ready, machine.SPEED, time))


def steady(elements, cracked=False):
    """Steady state at the harmonics of the machine, also with the crack."""
    from rotorstudy import harmonic_response

    ready, listed = model(elements), sorted(machine.HARMONICS)
    ready = ready.plus(crack_of_ross(ready.structure, elements)) if cracked else ready
    order = np.searchsorted(listed, machine.HARMONICS)
    return lambda: shown(harmonic_response(ready, [machine.SPEED], listed))[0][order]


def crack_of_ross(structure, elements):
    """The crack of ROSS (Mayes) as a term.

    ROSS lowers, in each plane by itself, the shear stiffness of the cracked element seen from its end, whose pattern is
    t = (-1, -l, 1, 0) on (displacement, slope, displacement, slope): by a loss times (1 - cos a) / 2 along the crack,
    by another across, turned by the shaft angle a, without what couples the planes. Forces Lx t t'x and Ly t t'y are
    entries on z = x + j y, with the Fourier coefficients of (Lx + Ly) / 2, and on conj(z), of (Lx - Ly) / 2.
    """
    from rotorstudy import Entry, Parameter, Term

    along, across = (float(loss) for loss in sys.argv[3:5])  # N/m, as with_ross.py prints them
    angle = 2 * np.pi * np.arange(16) / 16
    share = (1 - np.cos(angle)) / 2
    of_y = share * (along * np.cos(angle) ** 2 + across * np.sin(angle) ** 2)  # y of rotorstudy is x of ROSS
    of_x = share * (along * np.sin(angle) ** 2 + across * np.cos(angle) ** 2)
    element = machine.node(machine.CRACK["place"], elements) - 1
    pattern = np.zeros(len(structure.dofs))
    pattern[2 * element : 2 * element + 4] = -1, -machine.LENGTH / elements, 1, 0
    entries = []
    for on, values in (("z", (of_x + of_y) / 2), ("conj", (of_x - of_y) / 2)):
        series = np.fft.fft(values) / len(angle)
        entries += [Entry(series[k] * np.outer(pattern, pattern), on=on, shift=k) for k in range(-3, 4)]
    parameter = Parameter("crack_of_ross", "1", tuple(entries), typical=1.0)
    return Term("crack_of_ross", (parameter,), {"crack_of_ross": 1.0})


if __name__ == "__main__":
    machine.report(globals())
