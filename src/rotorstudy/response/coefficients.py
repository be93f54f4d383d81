"""The coefficients of the equations of motion in time, summed over the entries of all terms."""

import numpy as np

from rotorstudy.errors import RotorstudyError


def time_matrices(model, theta, speed, deflection):
    """Sums of the entries of effects, cracks and bearings by shift, as they act on the right-hand side.

    The constant force {shift: (dof,)}, N, at the static deflection (dof,), and stiffness, damping and mass, each {"z"
    or "conj": {shift: (dof, dof)}}. Numbers of the rotor are in `model.matrices`, exactly, and not here.
    """
    constant, on_motion = {}, [{"z": {}, "conj": {}} for _ in range(3)]
    for position, unknown in model.acting:
        for entry in unknown.entries:
            if entry.frequency_only:
                raise RotorstudyError(
                    f"{unknown.name!r} is defined in the frequency domain only: it cannot be integrated in time"
                )
            amount = theta[position] * entry.gain_at(speed, 0) * np.asarray(entry.matrix)
            if not entry.reads_motion:
                target = constant
                if not entry.is_constant:
                    amount = amount @ (np.conj(deflection) if entry.is_conjugate else deflection)
            else:
                target = on_motion[entry.order][entry.on]
            target[entry.shift] = target.get(entry.shift, 0) + amount
    return constant, *on_motion
