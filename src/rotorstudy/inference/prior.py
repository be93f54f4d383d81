"""Prior of the amplitudes: a normal distribution with a full covariance."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rotorstudy.errors import MissingValue
from rotorstudy.model.model import Model
from rotorstudy.model.rig_numbers import uncertain_numbers


@dataclass(frozen=True)
class Prior:
    """Normal distribution of the amplitudes `names`: mean (parameter,), covariance (parameter, parameter), definite."""

    names: tuple[str, ...]
    mean: np.ndarray
    covariance: np.ndarray

    @classmethod
    def independent(cls, known: dict[str, tuple[float, float]]) -> "Prior":
        """The Prior of independent amplitudes; known : name -> (mean, standard deviation)."""
        mean, std = np.array(list(known.values()), float).reshape(-1, 2).T
        return cls(tuple(known), mean, np.diag(std**2))

    @cached_property
    def std(self) -> np.ndarray:
        """(parameter,) standard deviations."""
        return np.sqrt(np.diag(self.covariance))

    @cached_property
    def factor(self) -> np.ndarray:
        """(parameter, parameter) Cholesky factor L, lower triangular, L L^T = covariance, by the correlations."""
        return self.std[:, None] * np.linalg.cholesky(self.covariance / np.outer(self.std, self.std))

    @cached_property
    def whitener(self) -> np.ndarray:
        """(parameter, parameter) inverse of `factor`: theta - mean in independent standard deviations."""
        from scipy.linalg import solve_triangular

        return solve_triangular(self.factor / self.std[:, None], np.diag(1 / self.std), lower=True)

    @property
    def by_name(self) -> dict[str, tuple[float, float]]:
        """name -> (mean, standard deviation)."""
        return dict(zip(self.names, zip(self.mean.tolist(), self.std.tolist(), strict=True), strict=True))

    def part(self, names: Sequence[str]) -> "Prior":
        """The Prior of some of its amplitudes."""
        place = [self.names.index(name) for name in names]
        return Prior(tuple(names), self.mean[place], self.covariance[np.ix_(place, place)])

    def plus(self, other: "Prior") -> "Prior":
        """The joint Prior of two independent ones."""
        from scipy.linalg import block_diag

        mean = np.concatenate([self.mean, other.mean])
        return Prior(self.names + other.names, mean, block_diag(self.covariance, other.covariance))


def with_usual(uncertainty: dict[str, float], model: Model) -> dict[str, float]:
    """Standard deviations with those that plugins state for numbers not named; `default: 0` gives none."""
    found = {}
    for section in ("rotor", "bearings"):
        if uncertainty.get(section, uncertainty.get("default", True)):
            usual = uncertain_numbers(model, section, uncertainty)
            found |= {name: uncertainty.get(section, share) for name, share in usual.items()}
    return found | uncertainty


def prior_of(model: Model, uncertainty: dict[str, float]) -> Prior:
    """The Prior about a model's values; `uncertainty` is relative to value or typical size, by name or "default"."""
    stated = model.uncertainty
    known = {}
    for term in model.terms:
        for parameter in term.parameters:
            value = term.values.get(parameter.name)
            if value is None:
                raise MissingValue(f"{term.full_name(parameter)} has no value; the rig needs one to be diagnosed")
            full = term.full_name(parameter)
            share = uncertainty.get(full, uncertainty.get(parameter.name, uncertainty.get("default", 0.1)))
            std = share * (abs(value) or parameter.typical)
            parts = {f"{full}_real": value.real, f"{full}_imag": value.imag} if parameter.is_complex else {full: value}
            known |= {n: (float(part), std) for n, part in parts.items() if std or (stated and n in stated.names)}
    prior = Prior.independent(known)
    if stated is None:
        return prior
    chosen = [i for i, name in enumerate(stated.names) if name in known]  # a term may have been removed
    place = [prior.names.index(stated.names[i]) for i in chosen]
    prior.covariance[place] = 0
    prior.covariance[:, place] = 0
    prior.covariance[np.ix_(place, place)] = stated.covariance[np.ix_(chosen, chosen)]
    return prior


def log_narrowing(jacobian: np.ndarray, factor: np.ndarray) -> float:
    """ln det (posterior precision / prior precision), the Occam factor; J (component, parameter), `Prior.factor`."""
    scaled = jacobian @ factor
    return float(np.linalg.slogdet(np.eye(len(factor)) + scaled.T @ scaled)[1])
