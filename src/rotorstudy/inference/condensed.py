"""The equations of motion condensed as in the thesis, to compare with the exact elimination of `equation_error`."""

from collections.abc import Sequence

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.equation_error import Regression, check_absolute
from rotorstudy.inference.known import about_rest, known_amplitudes, nominal_amplitudes, rotor_unknown
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.entries import apply_entries
from rotorstudy.model.model import Model
from rotorstudy.response.coupling import check_speed
from rotorstudy.response.harmonic import reference_of
from rotorstudy.response.statics import static_deflection


def condensed_regression(
    model: Model, spectrum: Spectrum, names: Sequence[str], deflection: np.ndarray | None = None
) -> Regression:
    """The Regression with tilts condensed as in the thesis: T = [I; L_n], L_n = -(K_ss - n^2 w^2 M_ss)^-1 (K_sm - ...).

    The transformation leaves the gyroscopic moments out, so what is not measured is eliminated only approximately.
    Arguments as of `regression`. Source: Thesis Eqs. (6.31) to (6.34).
    """
    structure, speed, harmonics = model.structure, check_speed(spectrum.speed), np.asarray(spectrum.harmonics)
    check_absolute(model)
    unknowns = [rotor_unknown(model, name) for name in names]
    if any(e.shift and e.reads_motion for u in model.rotor_unknowns for e in u.entries):
        raise RotorstudyError("condensation as in the thesis needs a weight-dominant crack; use the exact one")
    hidden = np.setdiff1d(np.arange(len(structure.dofs)), model.measured)
    frequency = (speed[:, None] * harmonics)[..., None, None]
    static = structure.stiffness - frequency**2 * structure.mass
    transfer = -np.linalg.solve(static[..., hidden, :][..., hidden], static[..., hidden, :][..., model.measured])
    if deflection is None:
        deflection = static_deflection(model, speed, nominal_amplitudes(model)).value
    amplitude = about_rest(model, spectrum.amplitude, speed, harmonics, deflection)
    displacement = np.zeros((*amplitude.shape[:-1], len(structure.dofs)), complex)
    displacement[..., model.measured] = amplitude
    displacement[..., hidden] = np.einsum("snhm,...snm->...snh", transfer, amplitude)

    def reduced(rows):
        return rows[..., model.measured] + np.einsum("snhm,...snh->...snm", transfer, rows[..., hidden])

    known = known_amplitudes(model, names)
    dynamic = static + frequency * speed[:, None, None, None] * structure.gyroscopic
    rest = np.einsum("snij,...snj->...sni", dynamic, displacement)
    for value, unknown in zip(known, model.rotor_unknowns, strict=True):
        if value:
            at = reference_of(unknown, deflection)
            rest = rest - value * apply_entries(unknown.entries, displacement, speed, harmonics, at)
    rest[..., harmonics == 0, :] -= model.static_residual
    columns = [
        reduced(apply_entries(u.entries, displacement, speed, harmonics, reference_of(u, deflection))) for u in unknowns
    ]
    columns = np.stack(np.broadcast_arrays(*columns), axis=-1)
    right = reduced(rest)
    return Regression(
        columns.reshape(*columns.shape[:-3], -1, columns.shape[-1]), right.reshape(*right.shape[:-2], -1), tuple(names)
    )
