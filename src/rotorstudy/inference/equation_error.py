"""The equations of motion with the harmonics known and the amplitudes unknown.

With the harmonics R of a spectrum, D_known R - f_known = sum over unknowns of theta * column(R) is linear in theta.
Coordinates (and harmonics) that are not measured are eliminated exactly, by the Schur complement of D_known.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.spectrum import Spectrum, shared_product
from rotorstudy.model.entries import apply_entries
from rotorstudy.model.model import Model
from rotorstudy.response.coupling import COUPLED_ORDER, check_speed, gather, layout, mirrored_unknown, own_harmonic
from rotorstudy.response.harmonic import reference_of, static_force
from rotorstudy.response.solving import operator
from rotorstudy.response.statics import static_deflection


@dataclass(frozen=True)
class Regression:
    """Equations columns @ theta = right_side, in newtons, a complex row for each measured harmonic and sensor.

    Parameters
    ----------
    columns : ndarray (..., speed, row, parameter)
        Complex.
    right_side : ndarray (..., speed, row)
        Complex.
    names : tuple of str
        The unknowns.
    """

    columns: np.ndarray
    right_side: np.ndarray
    names: tuple[str, ...]

    def real_system(self) -> tuple[np.ndarray, np.ndarray]:
        """All speeds stacked, real rows then imaginary rows of each speed: A (..., row, parameter), b (..., row)."""
        a = np.concatenate([self.columns.real, self.columns.imag], axis=-2)
        b = np.concatenate([self.right_side.real, self.right_side.imag], axis=-1)
        return a.reshape(*a.shape[:-3], -1, a.shape[-1]), b.reshape(*b.shape[:-2], -1)


def regression(model: Model, spectrum: Spectrum, names: Sequence[str], *, order: int = COUPLED_ORDER) -> Regression:
    """Equations for unknown amplitudes from a spectrum.

    Parameters
    ----------
    model : Model
        Gives the values of all amplitudes that are not in `names`.
    spectrum : Spectrum
        Of the model's sensors.
    names : sequence of str
        The unknowns.
    order : int
        Highest harmonic carried where the model couples harmonics.

    Returns
    -------
    Regression

    Raises
    ------
    RotorstudyError
        If an unknown acts on coordinates or harmonics that were not measured, or on the output.
    """
    if tuple(spectrum.sensors) != tuple(model.sensors):
        raise RotorstudyError(f"the spectrum is of sensors {spectrum.sensors}, the model of {model.sensors}")
    if spectrum.single_probes:
        raise RotorstudyError(
            f"node {spectrum.single_probes[0]} has a single probe, and the equations of motion need the orbit: use an "
            "output-error estimator, such as maximum_likelihood"
        )
    speed, harmonics = check_speed(spectrum.speed), np.asarray(spectrum.harmonics)
    blocks = layout(model, harmonics, order)
    carried, dof = blocks.harmonics, len(model.structure.dofs)
    count = len(carried)
    unknowns = [_rotor_unknown(model, name) for name in names]
    known = _known_amplitudes(model, names)
    is_sensor = np.isin(np.arange(dof), model.measured)
    involved = np.unique(np.concatenate([own_harmonic(group, carried).ravel() for group in blocks.groups]))
    for unknown in unknowns:
        _check_reads_measured(model, unknown, harmonics, involved)

    deflection = static_deflection(model, speed, _nominal_amplitudes(model)).value
    amplitude = _about_rest(model, spectrum, deflection)
    displacement = np.zeros((*amplitude.shape[:-2], count, dof), complex)
    places = [int(np.flatnonzero(carried == n)[0]) for n in harmonics]
    displacement[..., np.array(places)[:, None], model.measured] = amplitude
    columns = [apply_entries(u.entries, displacement, speed, carried, reference_of(u, deflection)) for u in unknowns]
    columns = np.stack(np.broadcast_arrays(*columns), axis=0)
    force = static_force(model, known, speed, carried, deflection)
    force[..., carried == 0, :] += model.static_residual

    left, right, keys = [], [], []
    matrices = operator(model, known, speed, blocks)
    for matrix, group, mirror in zip(matrices, blocks.groups, blocks.mirrors, strict=True):
        # unknown and degree of freedom in one number
        coordinate = (group[..., None] * dof + np.arange(dof)).reshape(len(group), -1)
        measured = (np.isin(own_harmonic(group[0], carried), harmonics)[:, None] & is_sensor).ravel()
        direct = coordinate[0][measured] < count * dof
        kept = direct | mirror  # the equation of w_n is the conjugate of that of q_{-n}
        residual = shared_product(matrix, gather(displacement, group, count, carried))
        residual = residual - gather(force, group, count, carried)
        for side, rows in ((right, residual), (left, gather(columns, group, count, carried))):
            reduced = _eliminate(matrix, measured, rows)
            reduced = np.where(direct, reduced, reduced.conj())[..., kept]
            side.append(reduced.reshape(*reduced.shape[:-2], -1))
        unknown, place = np.divmod(coordinate[:, measured], dof)
        own = np.where(direct, unknown, mirrored_unknown(unknown, carried)) if mirror else unknown
        keys.append((own * dof + place)[:, kept].ravel())
    in_order = np.argsort(np.concatenate(keys))
    right = np.concatenate(right, axis=-1)[..., in_order]
    left = np.concatenate(left, axis=-1)[..., in_order]
    return Regression(np.moveaxis(left, 0, -1), right, tuple(names))


def condensed_regression(model: Model, spectrum: Spectrum, names: Sequence[str]) -> Regression:
    """The equations with tilts condensed as in the thesis: T = [I; L_n], L_n = -(K_ss - n^2 w^2 M_ss)^-1 (K_sm - ...).

    The transformation leaves the gyroscopic moments out, so what is not measured is eliminated only approximately.

    Parameters
    ----------
    model, spectrum, names
        See `regression`.

    Returns
    -------
    Regression

    Raises
    ------
    RotorstudyError
        For terms that couple harmonics.

    References
    ----------
    Thesis Eqs. (6.31) to (6.34).
    """
    structure, speed, harmonics = model.structure, check_speed(spectrum.speed), np.asarray(spectrum.harmonics)
    unknowns = [_rotor_unknown(model, name) for name in names]
    if any(e.shift and e.reads_motion for u in model.rotor_unknowns for e in u.entries):
        raise RotorstudyError("condensation as in the thesis needs a weight-dominant crack; use the exact one")
    hidden = np.setdiff1d(np.arange(len(structure.dofs)), model.measured)
    frequency = (speed[:, None] * harmonics)[..., None, None]
    static = structure.stiffness - frequency**2 * structure.mass
    transfer = -np.linalg.solve(static[..., hidden, :][..., hidden], static[..., hidden, :][..., model.measured])
    deflection = static_deflection(model, speed, _nominal_amplitudes(model)).value
    amplitude = _about_rest(model, spectrum, deflection)
    displacement = np.zeros((*amplitude.shape[:-1], len(structure.dofs)), complex)
    displacement[..., model.measured] = amplitude
    displacement[..., hidden] = np.einsum("snhm,...snm->...snh", transfer, amplitude)

    def reduced(rows):
        return rows[..., model.measured] + np.einsum("snhm,...snh->...snm", transfer, rows[..., hidden])

    known = _known_amplitudes(model, names)
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


def residual_sensitivity(
    model: Model, spectrum: Spectrum, names: Sequence[str], theta: np.ndarray, *, order: int = COUPLED_ORDER
) -> np.ndarray:
    """Derivative of the residual columns @ theta - right_side by the spectrum; its covariance follows from it.

    Parameters
    ----------
    model, spectrum, names, order
        See `regression`.
    theta : ndarray (..., parameter)
        Values of `names`.

    Returns
    -------
    ndarray (..., speed, row, component)
        Real, rows as in `Regression.real_system`, components of all sensors together.
    """
    columns, right_side = equation_sensitivity(model, spectrum, names, order=order)
    return np.einsum("srcp,...p->...src", columns, theta) - right_side


def equation_sensitivity(
    model: Model, spectrum: Spectrum, names: Sequence[str], *, order: int = COUPLED_ORDER
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of columns (speed, row, component, parameter) and right side (speed, row, component) by the spectrum.

    Parameters are those of `regression`.
    """
    harmonics, sensors = spectrum.amplitude.shape[-2:]
    basis = np.eye(harmonics * sensors).reshape(-1, 1, harmonics, sensors) * np.ones((len(spectrum.speed), 1, 1))
    trials = np.concatenate([0 * basis[:1], basis, 1j * basis]).astype(complex)
    equations = regression(model, spectrum.with_amplitude(trials), names, order=order)  # affine in the spectrum
    columns, right_side = (part[1:] - part[0] for part in (equations.columns, equations.right_side))
    return (
        np.moveaxis(np.concatenate([columns.real, columns.imag], axis=-2), 0, -2),
        np.moveaxis(np.concatenate([right_side.real, right_side.imag], axis=-1), 0, -1),
    )


def _eliminate(matrix, measured, rows):
    """Rows (..., speed, block, coordinate) reduced to the measured ones by D_ms D_ss^-1."""
    if measured.all():
        return rows
    hidden = ~measured
    transfer = np.linalg.solve(np.swapaxes(matrix[..., hidden, :][..., hidden], -1, -2),
                               np.swapaxes(matrix[..., measured, :][..., hidden], -1, -2))  # fmt: skip
    return rows[..., measured] - shared_product(np.swapaxes(transfer, -1, -2), rows[..., hidden])


def _rotor_unknown(model, name):
    model.position([name])
    numbers = {*model.bearing_numbers, *(model.varied.positions if model.varied else ())}
    for p, unknown in enumerate(model.rotor_unknowns):
        if unknown.name == name and p in numbers:
            raise RotorstudyError(f"{name!r} is a number of the rig; use the estimator 'maximum_likelihood'")
        if unknown.name == name:
            return unknown
    raise RotorstudyError(f"{name!r} acts on the sensors, not on the rotor: the equations of motion do not contain it; "
                          "use the estimator 'maximum_likelihood'")  # fmt: skip


def _known_amplitudes(model, names):
    """(rotor parameter,) values of the known rotor amplitudes, zero for the unknown ones."""
    values = np.concatenate([term.theta for term in model.terms])[: len(model.rotor_unknowns)]
    for p, unknown in enumerate(model.rotor_unknowns):
        if unknown.force and (unknown.name in names or values[p]):
            raise RotorstudyError(f"{unknown.name!r} multiplies a nonlinear force, which depends on the whole motion; "
                                  "use the estimator 'maximum_likelihood'")  # fmt: skip
        if unknown.name in names:
            values[p] = 0
        elif np.isnan(values[p]):
            raise RotorstudyError(f"{unknown.name!r} is neither among the unknowns {list(names)} nor given a value")
    return values


def _nominal_amplitudes(model):
    """(rotor parameter,) values given, typical where none is: the static deflection is taken there."""
    values = np.concatenate([term.theta for term in model.terms])[: len(model.rotor_unknowns)]
    return np.where(np.isnan(values), model.typical[: len(values)], values)


def _check_reads_measured(model, unknown, harmonics, involved):
    """Raise unless all harmonics and coordinates that an unknown acts on are measured, also in eliminated equations."""
    unmeasured = set(involved.tolist()) - set(harmonics.tolist())
    for entry in (e for e in unknown.entries if e.reads_motion):
        read = np.flatnonzero(np.any(entry.matrix, axis=0))
        hidden = [model.structure.dofs[i] for i in read if i not in model.measured]
        source = [entry.seen_by(int(n)) for n in involved]
        lost = sorted(unmeasured.intersection(source))
        if hidden or lost:
            what = f"coordinates {hidden}" if hidden else f"harmonics {lost}"
            raise RotorstudyError(f"{unknown.name!r} acts on {what}, which were not measured, so the equations are not "
                                  "linear in it; use the estimator 'maximum_likelihood'")  # fmt: skip


def _about_rest(model, spectrum, deflection):
    """Amplitudes (..., speed, harmonic, sensor) m less the known constant output terms, from the static deflection."""
    amplitude = spectrum.amplitude
    values = np.concatenate([term.theta for term in model.terms])[len(model.rotor_unknowns) :]
    for value, unknown in zip(values, model.output_unknowns, strict=True):
        if np.isnan(value) or (value and any(e.reads_motion for e in unknown.entries)):
            raise RotorstudyError(f"the sensor term {unknown.name!r} cannot be subtracted from the spectrum; "
                                  "give it a value, or use the estimator 'maximum_likelihood'")  # fmt: skip
        if value:
            zeros = np.zeros(amplitude.shape, complex)
            amplitude = amplitude - value * apply_entries(unknown.entries, zeros, spectrum.speed, spectrum.harmonics)
    if model.from_unloaded_line:
        mean = (np.asarray(spectrum.harmonics) == 0)[:, None]
        amplitude = amplitude - mean * deflection[..., None, model.measured]
    return amplitude
