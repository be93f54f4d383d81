"""Read and write the uncertainty of the values in a rig, its section `prior`.

    prior:
      parameters: [external_damping, eccentricity_real, eccentricity_imag]  # as in `Model.names`
      standard_deviations: [2.0, 1.0e-7, 1.0e-7]
      correlations:  # the lower triangle or the whole matrix; none by default
        - [1.0]
        - [0.3, 1.0]
        - [0.0, 0.1, 1.0]

The values themselves stay in the items of the rig.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.model.configuration import Strict, check_config
from rotorstudy.model.model import Model, Uncertainty
from rotorstudy.model.options import Positive
from rotorstudy.model.rig_numbers import with_numbers

ROUND_OFF = 1e-9  # of a correlation: tolerated asymmetry of a matrix that is read
REGULAR = 1e-9  # least eigenvalue of correlations that are written: smaller ones are round-off of a singular fit
SINGULAR = 1e-12  # eigenvalue of correlations up to which their Cholesky factor would be round-off


class Section(Strict):
    """The section `prior` of a rig file; (parameter,) names and standard deviations, rows of correlations."""

    parameters: list[str]
    standard_deviations: list[Positive]
    correlations: list[list[float]] | None = None


def with_uncertainty(model: Model, section: dict, where: str) -> Model:
    """The model with the Uncertainty stated by the section `prior` of a rig; numbers named there become parameters."""
    given = check_config(Section, section, where)
    model = with_numbers(model, given.parameters, where)
    names, count = given.parameters, len(given.parameters)
    values = dict(zip(model.names, model.stated, strict=True))
    check_known("parameter", names, values, where)
    for name in names:
        if np.isnan(values[name]):
            raise RotorstudyError(
                f"{name} in {where} has no value in the rig; give the value that the standard deviation refers to"
            )
        if names.count(name) > 1:
            raise RotorstudyError(f"{name} in {where} is given twice")
    if len(given.standard_deviations) != count:
        raise RotorstudyError(f"{len(given.standard_deviations)} standard deviations in {where} for {count} parameters")
    std = np.array(given.standard_deviations)
    covariance = np.outer(std, std) * _correlation(given.correlations, count, where)
    return replace(model, uncertainty=Uncertainty(tuple(names), covariance))


def _correlation(rows, count, where):
    """(parameter, parameter) from the rows given, a lower triangle or the whole matrix."""
    if rows is None:
        return np.eye(count)
    found, sizes = np.eye(count), [len(row) for row in rows]
    if sizes not in (list(range(1, count + 1)), [count] * count):
        raise RotorstudyError(
            f"correlations in {where} have rows of {sizes}; give the lower triangle, rows of 1 to {count}, or all "
            f"{count} rows of {count}"
        )
    for i, row in enumerate(rows):
        found[i, : len(row)] = row
    if sizes != [count] * count:
        found = np.tril(found) + np.tril(found, -1).T
    if np.abs(found - found.T).max(initial=0) > ROUND_OFF or np.abs(np.diag(found) - 1).max(initial=0) > ROUND_OFF:
        raise RotorstudyError(f"correlations in {where} must be symmetric, with ones on the diagonal")
    if count and np.linalg.eigvalsh(found)[0] <= SINGULAR:
        raise RotorstudyError(
            f"correlations in {where} are not positive definite; check them, and give them with all their digits"
        )
    return (found + found.T) / 2


def uncertainty_section(names: Sequence[str], covariance: np.ndarray) -> dict:
    """The section `prior` for a covariance (parameter, parameter)."""
    std = np.sqrt(np.diag(covariance))
    correlation = np.asarray(covariance) / np.outer(std, std)
    correlation = (correlation + correlation.T) / 2
    size, vectors = np.linalg.eigh(correlation)
    if len(names) and size[0] < REGULAR:
        correlation = vectors * np.maximum(size, REGULAR) @ vectors.T
        correlation /= np.sqrt(np.outer(np.diag(correlation), np.diag(correlation)))
    np.fill_diagonal(correlation, 1.0)
    rows = [correlation[i, : i + 1].tolist() for i in range(len(names))]
    return {"parameters": list(names), "standard_deviations": std.tolist(), "correlations": rows}
