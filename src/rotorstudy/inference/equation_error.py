"""The equations of motion with the harmonics known and the amplitudes unknown.

With the harmonics R of a spectrum, D_known R - f_known = sum over unknowns of theta * column(R) is linear in theta.
Coordinates (and harmonics) that are not measured are eliminated exactly, by the Schur complement of D_known.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.spectrum import Spectrum, shared_product
from rotorstudy.model.entries import apply_entries
from rotorstudy.model.entry_table import EntryTable
from rotorstudy.model.model import Model
from rotorstudy.response.coupling import COUPLED_ORDER, check_speed, gather, layout, mirrored_unknown, own_harmonic
from rotorstudy.response.harmonic import static_force
from rotorstudy.response.solving import operator
from rotorstudy.response.statics import static_deflection


@dataclass(frozen=True)
class Regression:
    """Equations columns (..., speed, row, parameter) @ theta = right_side (..., speed, row), complex, N."""

    columns: np.ndarray
    right_side: np.ndarray

    def real_rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Real rows, then imaginary rows of each speed: A (..., speed, row, parameter), b (..., speed, row)."""
        a = np.concatenate([self.columns.real, self.columns.imag], axis=-2)
        return a, np.concatenate([self.right_side.real, self.right_side.imag], axis=-1)

    def real_system(self) -> tuple[np.ndarray, np.ndarray]:
        """The same with all speeds stacked: A (..., row, parameter), b (..., row)."""
        a, b = self.real_rows()
        return a.reshape(*a.shape[:-3], -1, a.shape[-1]), b.reshape(*b.shape[:-2], -1)


def regression(
    model: Model,
    spectrum: Spectrum,
    names: Sequence[str],
    *,
    order: int = COUPLED_ORDER,
    deflection: np.ndarray | None = None,
    condensation: str = "exact",
) -> Regression:
    """Equations for the amplitudes `names` from a spectrum, at a deflection (..., speed, dof), m, or the usual one.

    condensation : of the coordinates that are not measured; unless "exact", T = [I; L_n] with the matrix L_n =
                   -(K_ss - n^2 w^2 M_ss)^-1 (K_sm - n^2 w^2 M_sm), without gyroscopic moments, as in the thesis, Eqs.
                   (6.31) to (6.34): they are eliminated only approximately
    """
    if tuple(spectrum.sensors) != tuple(model.sensors):
        raise RotorstudyError(f"the spectrum is of sensors {spectrum.sensors}, the model of {model.sensors}")
    if spectrum.single_probes:
        raise RotorstudyError(
            f"node {spectrum.single_probes[0]} has a single probe, and the equations of motion need the orbit: use an "
            "output-error estimator, such as maximum_likelihood"
        )
    if riding := [node for node in model.sensors if node in model.structure.riding]:
        raise RotorstudyError(
            f"the probes at node {riding[0]} are relative to a bearing, and the equations of motion need the motion in "
            "space: use an output-error estimator, such as maximum_likelihood"
        )
    at = _key(check_speed(spectrum.speed), spectrum.harmonics)
    return _equations_at(model, *at, tuple(names), order, condensation)(spectrum.amplitude, deflection)


def _key(speed, harmonics):
    return tuple(np.asarray(speed).tolist()), tuple(np.asarray(harmonics).tolist())


@lru_cache(maxsize=2)  # many spectra of one model follow one another
def _equations_at(model, speed, harmonics, names, order, condensation="exact"):
    """Function of amplitudes (..., speed, harmonic, sensor) and a deflection, or None, that gives their Regression.

    speed, harmonics, names : tuples
    """
    blocks, speed, harmonics = layout(model, harmonics, order), np.array(speed), np.array(harmonics)
    carried, dof = blocks.harmonics, len(model.structure.dofs)
    count, here = len(carried), np.searchsorted(carried, harmonics)[:, None]
    unknowns = [_rotor_unknown(model, name) for name in names]
    known = _known_amplitudes(model, names)
    is_sensor = np.isin(np.arange(dof), model.measured)
    matrices = eliminating = operator(model, known, speed, blocks)
    groups, keys, following = [], [], None
    if condensation == "exact":
        involved = np.unique(np.concatenate([own_harmonic(group, carried).ravel() for group in blocks.groups]))
        for unknown in unknowns:
            _check_reads_measured(model, unknown, harmonics, involved)
    elif any(shift for _, shift in model.couplings):
        raise RotorstudyError("condensation as in the thesis needs a weight-dominant crack; use the exact one")
    else:
        eliminating, following = _without_gyroscopic_moments(model.structure, speed, harmonics, blocks, is_sensor)
    for matrix, by, group, mirror in zip(matrices, eliminating, blocks.groups, blocks.mirrors, strict=True):
        # unknown and degree of freedom in one number
        coordinate = (group[..., None] * dof + np.arange(dof)).reshape(len(group), -1)
        measured = (np.isin(own_harmonic(group[0], carried), harmonics)[:, None] & is_sensor).ravel()
        direct = coordinate[0][measured] < count * dof
        kept = direct | mirror  # the equation of w_n is the conjugate of that of q_{-n}
        groups.append((group, matrix, _reduction(measured, _transfer(by, measured), direct, kept)))
        unknown, place = np.divmod(coordinate[:, measured], dof)
        own = np.where(direct, unknown, mirrored_unknown(unknown, carried)) if mirror else unknown
        keys.append((own * dof + place)[:, kept].ravel())
    table, in_order = EntryTable(unknowns, dof), np.argsort(np.concatenate(keys))

    def equations(amplitude, deflection=None):
        if deflection is None:
            deflection = static_deflection(model, speed, model.nominal[: len(model.rotor_unknowns)]).value
        amplitude = _about_rest(model, amplitude, speed, harmonics, deflection)
        displacement = np.zeros((*amplitude.shape[:-2], count, dof), complex)
        displacement[..., here, model.measured] = amplitude
        if following is not None:
            hidden = np.einsum("snhm,...snm->...snh", following, amplitude)
            displacement[..., here, np.flatnonzero(~is_sensor)] = hidden
        columns = np.moveaxis(table.dense_columns(displacement, speed, carried, deflection), -1, 0)
        force = static_force(model, known, speed, carried, deflection)
        force[..., carried == 0, :] += model.static_residual
        left, right = [], []
        for group, matrix, reduced in groups:
            residual = shared_product(matrix, gather(displacement, group, count, carried))
            right.append(reduced(residual - gather(force, group, count, carried)))
            left.append(reduced(gather(columns, group, count, carried)))
        left, right = (np.concatenate(rows, axis=-1)[..., in_order] for rows in (left, right))
        return Regression(np.moveaxis(left, 0, -1), right)

    return equations


def _without_gyroscopic_moments(structure, speed, harmonics, blocks, is_sensor):
    """Dynamic stiffness of groups by which the thesis eliminates what is not measured, and L_n of `regression`."""
    still = Model(replace(structure, gyroscopic=np.zeros_like(structure.gyroscopic)))
    stiffness = structure.stiffness - (speed[:, None] * harmonics)[..., None, None] ** 2 * structure.mass
    return operator(still, still.theta, speed, blocks), -np.swapaxes(_transfer(stiffness, is_sensor), -1, -2)


def _reduction(measured, transfer, direct, kept):
    """Function of rows (..., speed, block, member * dof) at what is measured, the others eliminated: (..., speed, row).

    measured : (member * dof,) bool;  transfer : see `_transfer`
    direct   : (measured,) bool, equations of q_n, not of a mirrored harmonic;  kept : (measured,) bool
    """

    def reduced(rows):
        hidden, found = rows[..., ~measured], rows[..., measured]
        if hidden.shape[-1]:
            found = found - shared_product(transfer, hidden)
        found = np.where(direct, found, found.conj())[..., kept]
        return found.reshape(*found.shape[:-2], -1)

    return reduced


def _transfer(matrix, measured):
    """D_ms D_ss^-1 (speed, block, measured, hidden), by which hidden coordinates are eliminated."""
    hidden = ~measured
    transposed = np.swapaxes(matrix, -1, -2)
    found = np.linalg.solve(transposed[..., hidden, :][..., hidden], transposed[..., hidden, :][..., measured])
    return np.swapaxes(found, -1, -2)


def residual_sensitivity(
    model: Model, spectrum: Spectrum, names: Sequence[str], theta: np.ndarray, *, order: int = COUPLED_ORDER
) -> np.ndarray:
    """Derivative (..., speed, row, component), real, of the residual columns @ theta - right_side by the spectrum."""
    columns, right_side = equation_sensitivity(model, spectrum, names, order=order)
    return np.einsum("srcp,...p->...src", columns, theta) - right_side


def equation_sensitivity(
    model: Model, spectrum: Spectrum, names: Sequence[str], *, order: int = COUPLED_ORDER
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of columns (speed, row, component, parameter) and right side (..., component) by the spectrum."""
    return _slopes(model, *_key(spectrum.speed, spectrum.harmonics), tuple(names), order)


@lru_cache(maxsize=2)
def _slopes(model, speed, harmonics, names, order):
    count = len(harmonics) * len(model.sensors)
    basis = np.eye(count).reshape(-1, 1, len(harmonics), len(model.sensors)) * np.ones((len(speed), 1, 1))
    trials = np.concatenate([0 * basis[:1], basis, 1j * basis]).astype(complex)
    found = _equations_at(model, speed, harmonics, names, order)(trials, np.zeros(len(model.structure.dofs)))
    columns, right_side = (part[1:] - part[0] for part in found.real_rows())
    return np.moveaxis(columns, 0, -2), np.moveaxis(right_side, 0, -1)


def _rotor_unknown(model, name):
    """The amplitude of a name, or an error unless it is an amplitude of a force on the rotor."""
    model.position([name])
    numbers = {*model.bearing_numbers, *(model.varied.positions if model.varied else ())}
    for p, unknown in enumerate(model.rotor_unknowns):
        if unknown.name == name and p in numbers:
            raise RotorstudyError(f"{name!r} is a number of the rig; use the estimator 'maximum_likelihood'")
        if unknown.name == name:
            return unknown
    raise RotorstudyError(
        f"{name!r} acts on the sensors, not on the rotor: the equations of motion do not contain it; "
        "use the estimator 'maximum_likelihood'"
    )


def _known_amplitudes(model, names):
    """(rotor parameter,) values of the known rotor amplitudes, zero for the unknown ones."""
    values = model.stated[: len(model.rotor_unknowns)].copy()
    for p, unknown in enumerate(model.rotor_unknowns):
        if unknown.force and (unknown.name in names or values[p]):
            raise RotorstudyError(
                f"{unknown.name!r} multiplies a nonlinear force, which depends on the whole motion; "
                "use the estimator 'maximum_likelihood'"
            )
        if unknown.name in names:
            values[p] = 0
        elif np.isnan(values[p]):
            raise RotorstudyError(f"{unknown.name!r} is neither among the unknowns {list(names)} nor given a value")
    return values


def _check_reads_measured(model, unknown, harmonics, involved):
    """Raise unless all harmonics and coordinates that an unknown acts on are measured, also in eliminated equations."""
    unmeasured = set(involved.tolist()) - set(harmonics.tolist())
    for entry in (e for e in unknown.entries if e.reads_motion):
        read = np.flatnonzero(np.any(entry.matrix, axis=0))
        hidden = [model.structure.dofs[i] for i in read if i not in model.measured]
        source = [(int(n) - entry.shift) * (-1 if entry.is_conjugate else 1) for n in involved]
        lost = sorted(unmeasured.intersection(source))
        if hidden or lost:
            what = f"coordinates {hidden}" if hidden else f"harmonics {lost}"
            raise RotorstudyError(
                f"{unknown.name!r} acts on {what}, which were not measured, so the equations are not "
                "linear in it; use the estimator 'maximum_likelihood'"
            )


def _about_rest(model, amplitude, speed, harmonics, deflection):
    """Amplitudes (..., speed, harmonic, sensor) m less the known constant output terms, from the static deflection."""
    values = model.stated[len(model.rotor_unknowns) :]
    for value, unknown in zip(values, model.output_unknowns, strict=True):
        if np.isnan(value) or (value and any(e.reads_motion for e in unknown.entries)):
            raise RotorstudyError(
                f"the sensor term {unknown.name!r} cannot be subtracted from the spectrum; "
                "give it a value, or use the estimator 'maximum_likelihood'"
            )
        if value:
            zeros = np.zeros(amplitude.shape, complex)
            amplitude = amplitude - value * apply_entries(unknown.entries, zeros, speed, harmonics)
    if model.from_unloaded_line:
        mean = (np.asarray(harmonics) == 0)[:, None]
        amplitude = amplitude - mean * deflection[..., None, model.measured]
    return amplitude
