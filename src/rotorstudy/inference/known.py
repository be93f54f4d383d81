"""What the equations of motion take as known: values of amplitudes, and displacements from the static deflection."""

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.entries import apply_entries


def rotor_unknown(model, name):
    """The Unknown of a name, or an error unless it is an amplitude of a force on the rotor."""
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


def known_amplitudes(model, names):
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


def nominal_amplitudes(model):
    """(rotor parameter,) values given, typical where none is: the static deflection is taken there."""
    values = model.stated[: len(model.rotor_unknowns)]
    return np.where(np.isnan(values), model.typical[: len(values)], values)


def check_reads_measured(model, unknown, harmonics, involved):
    """Raise unless all harmonics and coordinates that an unknown acts on are measured, also in eliminated equations."""
    unmeasured = set(involved.tolist()) - set(harmonics.tolist())
    for entry in (e for e in unknown.entries if e.reads_motion):
        read = np.flatnonzero(np.any(entry.matrix, axis=0))
        hidden = [model.structure.dofs[i] for i in read if i not in model.measured]
        source = [entry.seen_by(int(n)) for n in involved]
        lost = sorted(unmeasured.intersection(source))
        if hidden or lost:
            what = f"coordinates {hidden}" if hidden else f"harmonics {lost}"
            raise RotorstudyError(
                f"{unknown.name!r} acts on {what}, which were not measured, so the equations are not "
                "linear in it; use the estimator 'maximum_likelihood'"
            )


def about_rest(model, amplitude, speed, harmonics, deflection):
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
