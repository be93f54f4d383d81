"""One task by ROSS, or by scipy on its matrices: python with_ross.py TASK RUNS; prints JSON. Runs in `.venv-ross`."""

import machine
import numpy as np


def rotor(elements):
    """The machine in ROSS."""
    import ross

    steel = ross.Material("steel", **machine.STEEL)
    size = {"L": machine.LENGTH / elements, "idl": 0.0, "odl": machine.DIAMETER, "material": steel}

    def placed(part):
        return {"n": machine.node(part["place"], elements)} | {k: v for k, v in part.items() if k != "place"}

    return ross.Rotor(
        [ross.ShaftElement(n=n, shear_effects=False, **size) for n in range(elements)],
        [ross.DiskElement(**placed(disc)) for disc in machine.DISCS],
        [ross.BearingElement(**placed(bearing)) for bearing in machine.BEARINGS],
    )


def unbalance(elements):
    """Nodes, magnitudes and phases of the unbalance."""
    return (
        [machine.node(one["place"], elements) for one in machine.UNBALANCE],
        [one["magnitude"] for one in machine.UNBALANCE],
        [one["phase"] for one in machine.UNBALANCE],
    )


def lateral(values):
    """x + j y (..., node) of every node; coordinates (..., dof) are six a node."""
    return values[..., 0::6] + 1j * values[..., 1::6]


def orbit(response):
    """Forward and backward 1X of every node, (2, ..., node), from complex amplitudes of x and y."""
    x, y = response[..., 0::6], response[..., 1::6]
    return np.stack([(x + 1j * y) / 2, (x - 1j * y).conj() / 2])


def first():
    """Import, and the unbalance response at one speed."""
    return response(4, [machine.SPEED])


def modes(elements):
    """Eigenvalues at one speed, of a rotor that is new each time because ROSS keeps what it computed."""
    return lambda: rotor(elements).run_modal(machine.SPEED, num_modes=24).evalues


def response(elements, speeds=machine.SPEEDS):
    """Unbalance response at 51 speeds, of a rotor that is new each time."""
    acting, at = unbalance(elements), np.array(speeds)
    return lambda: orbit(rotor(elements).run_unbalance_response(*acting, at).forced_resp.T)


def from_rest(elements):
    """Motion after a start from rest."""
    ready = rotor(elements)
    time = np.arange(0, machine.DURATION, machine.STEP)

    def run():
        force = ready.unbalance_force_over_time(*unbalance(elements), machine.SPEED, time)
        return lateral(ready.run_time_response(machine.SPEED, force.T, time).yout)

    return run


def harmonics(motion):
    """Harmonics (harmonic, node) of whole revolutions."""
    angle = 2 * np.pi * np.arange(len(motion)) / machine.STEPS
    return np.exp(-1j * np.outer(machine.HARMONICS, angle)) @ motion / len(motion)


def revolutions():
    """Times of a record until it has settled, from an instant at which the shaft angle is zero."""
    turns = np.ceil(machine.SETTLING * machine.SPEED / 2 / np.pi) + machine.REVOLUTIONS
    return np.arange(int(turns) * machine.STEPS) * 2 * np.pi / machine.SPEED / machine.STEPS


def kept(motion):
    """The last revolutions."""
    return motion[-machine.REVOLUTIONS * machine.STEPS :]


def crack(elements):
    """Steady state of a breathing crack (Mayes), by integration until the transient has gone."""
    ready, time = rotor(elements), revolutions()
    place = machine.node(machine.CRACK["place"], elements) - 1

    nodes, magnitudes, phases = unbalance(elements)
    acting = {"node": nodes, "unbalance_magnitude": magnitudes, "unbalance_phase": phases}

    def run():
        depth = machine.CRACK["depth_ratio"]
        found = ready.run_crack(place, depth, crack_model="Mayes", speed=machine.SPEED, t=time, **acting)
        return harmonics(kept(lateral(found.yout)))

    return run


def losses():
    """Stiffness (N/m) that the open crack takes away along and across itself, as a complex number."""
    from ross.faults.crack import Crack

    law = Crack(rotor(4), machine.node(machine.CRACK["place"], 4) - 1, machine.CRACK["depth_ratio"], "Mayes")
    return lambda: np.array([law.Ko[0, 0] - law.Kc[0, 0] + 1j * (law.Ko[0, 0] - law.Kc[1, 1])])


def equations(elements, cracked):
    """Mass, damping and force of the lateral coordinates of ROSS for an integrator: acceleration, slope, size."""
    from ross.faults.crack import Crack

    ready = rotor(elements)
    keep = np.flatnonzero(np.isin(np.arange(ready.ndof) % 6, (0, 1, 3, 4)))
    chosen = np.ix_(keep, keep)
    mass = np.linalg.inv(ready.M()[chosen])
    stiffness = mass @ ready.K(machine.SPEED)[chosen]
    damping = mass @ (ready.C(machine.SPEED) + machine.SPEED * ready.G())[chosen]
    nodes, magnitudes, phases = unbalance(elements)
    force = np.zeros((ready.ndof, 2), complex)  # of e^{jwt}, and constant
    for node, magnitude, phase in zip(nodes, magnitudes, phases, strict=True):
        turning = magnitude * machine.SPEED**2 * np.exp(1j * phase)
        force[6 * node, 0], force[6 * node + 1, 0] = turning, -1j * turning
    if cracked:
        force[:, 1] = ready.gravitational_force()
        place = machine.node(machine.CRACK["place"], elements) - 1
        law = Crack(ready, place, machine.CRACK["depth_ratio"], "Mayes")
        local = np.searchsorted(keep, [dof for dof in law.dofs if dof in set(keep)])
        among = np.flatnonzero(np.isin(np.arange(12) % 6, (0, 1, 3, 4)))
        within = np.ix_(among, among)
    force = mass @ force[keep]

    def acceleration(angle, position, velocity):
        found = (force[:, 0] * np.exp(1j * angle)).real + force[:, 1].real
        found = found - stiffness @ position - damping @ velocity
        if cracked:
            lost = (law.K_elem - law.mayes(angle))[within]
            found = found + mass[:, local] @ (lost @ position[local])
        return found

    size = len(keep)
    slope = np.block([[np.zeros((size, size)), np.eye(size)], [-stiffness, -damping]])
    return acceleration, slope, size


def integrated(elements, cracked=False):
    """Steady state by solve_ivp of scipy on the same equations, also with the breathing crack."""
    from scipy.integrate import solve_ivp

    acceleration, slope, size = equations(elements, cracked)
    time = revolutions()
    settled = kept(time)

    def derivative(t, state):
        return np.concatenate([state[size:], acceleration(machine.SPEED * t, state[:size], state[size:])])

    def run():
        found = solve_ivp(derivative, (0, settled[-1]), np.zeros(2 * size), "Radau", settled, jac=slope, rtol=1e-6,
                          atol=1e-11)  # fmt: skip
        motion = found.y[:size].T
        return harmonics(motion[:, 0::4] + 1j * motion[:, 1::4])

    return run


if __name__ == "__main__":
    machine.report(globals())
