"""A diagnosis as a Dataset: by speed, harmonic and node; by parameter; by explanation tried."""

import numpy as np

from rotorstudy.diagnosis.search.odds import odds_of
from rotorstudy.diagnosis.search.shown_forces import shown_forces
from rotorstudy.diagnosis.verdict.evidence import parameter_labels
from rotorstudy.diagnosis.verdict.result import FORMAT_VERSION
from rotorstudy.inference.prediction import BEYOND, predicted
from rotorstudy.response.neighbourhood import Neighbourhood
from rotorstudy.store import dataset


def verdict_dataset(diagnosis, spectrum):
    """The content of verdict.nc; spectrum : Spectrum of all speeds, fitted and held out."""
    base, best = diagnosis.search.base, diagnosis.best
    parts = [one for one in (diagnosis.search.spectrum, diagnosis.held_out) if one is not None]  # with all their errors
    held = np.isin(spectrum.speed, parts[1].speed if len(parts) > 1 else [])
    grid = ("speed", "harmonic", "node")
    variables = {
        "measured": (grid, spectrum.amplitude, "m", "measured harmonics"),
        "standard_deviation": (grid, np.sqrt(spectrum.variance), "m", "noise of the measured harmonics"),
        "held_out": (("speed",), held.astype("int8"), "1", "1 if the speed was held out of every fit"),
    }
    for when, name, fitted in (("before", "base", base), ("after", "extended", best)):
        shown = spectrum.shown(predicted(fitted.model, spectrum, fitted.theta))
        off = spectrum.amplitude - shown
        sigma = np.empty(off.shape)
        for one, here in zip(parts, (~held, held), strict=False):
            sigma[here] = one.by_harmonic(one.whitened(off[here]))
        force = equivalent_residual_force(fitted.model, fitted.theta, spectrum.speed, spectrum.harmonics, off)
        variables |= {
            name: (grid, shown, "m", f"harmonics of the {name} model, as the probes show them"),
            f"residual_{when}": (grid, sigma, "1", f"measured minus {name} model, in standard deviations"),
            f"equivalent_residual_force_{when}": (grid, force, "N", f"equivalent residual force of the {name} model"),
        }
    variables |= _parameters(diagnosis) | _explanations(diagnosis)
    coordinates = {
        "speed": (spectrum.speed, "rad/s", "spin speed"),
        "harmonic": (spectrum.harmonics, "1", "harmonic, n > 0 forward, n < 0 backward"),
        "node": (np.array(spectrum.sensors), "1", "node"),
        "parameter": (list(best.names), "1", "fitted parameter"),
    }
    return dataset(variables, coordinates, title="diagnosis", format_version=FORMAT_VERSION)


def _parameters(diagnosis):
    """Fitted parameters: as stated, in the base model and in the extended one."""
    best, along = diagnosis.best, ("parameter",)
    labels = parameter_labels(best.model, diagnosis.search.best.causes)
    texts = {
        "unit": (best.model.reported_units(best.names), "unit of the parameter"),
        "label": ([labels[name] for name in best.names], "readable name of the parameter"),
    }
    found = {name: (along, np.array(text, object), "1", told) for name, (text, told) in texts.items()}
    each = {
        ("stated", "stated_std"): diagnosis.search.prior.by_name,
        ("base_estimate", "base_std"): diagnosis.search.base.by_name,
        ("estimate", "std"): best.by_name,
    }
    for keys, known in each.items():
        columns = np.array([known.get(name, (np.nan, np.nan)) for name in best.names]).reshape(-1, 2).T
        for key, values in zip(keys, columns, strict=True):
            found[key] = (along, values, "SI", f"{key.replace('_', ' ')} of the parameter, in its unit")
    return found


def _explanations(diagnosis):
    """Every explanation that was fitted, that with the highest odds first."""
    weights, best, others = diagnosis.search.posterior(), diagnosis.search.best, 0.0
    if diagnosis.verdict.verdict == "nothing":
        odds = odds_of_causes_not_fitted(diagnosis.search)
        others = odds / (odds + 1 / next(w for e, w in weights if not e.causes))
    every = [e for e, _ in weights]
    labels = [" + ".join(cause.label for cause in e.causes) or "nothing more" for e in every]
    alternative = [bool(e.named & diagnosis.alternatives) and not best.named <= e.named for e in every]
    told = "posterior probability; all sum to one with that of causes that were not fitted and of an unknown fault"
    columns = {
        "explanation_label": (np.array(labels, object), "causes"),
        "log_posterior_odds": ([odds_of(e) for e in every], "natural logarithm of the odds against the base alone"),
        "posterior_probability": ([(1 - others) * w for _, w in weights], told),
        "cost": ([e.fit.cost for e in every], "misfit of data and priors"),
        "is_alternative": (np.array(alternative, "int8"), "1 if the data cannot rule it out"),
        "is_best": (np.array([e is best for e in every], "int8"), "1 for the best"),
    }
    found = {name: (("explanation",), np.array(column), "1", told) for name, (column, told) in columns.items()}
    told = "posterior probability of causes that nothing asked to be fitted"
    return found | {"not_fitted_probability": ((), others, "1", told)}


def odds_of_causes_not_fitted(search):
    """Posterior odds, against nothing, that one of the causes acts that were screened alone, over all their shapes."""
    fitted, each = {e.named for e in search.explanations}, {}
    for cause, screened in zip(search.candidates, search.screened, strict=True):
        if frozenset([cause.cause]) not in fitted:
            shapes = each.setdefault((cause.cause, *cause.variant.values()), [])
            shapes.append(np.exp(search.prior_odds.log_odds((cause,)) + screened.evidence))
    return float(sum(np.mean(shapes) for shapes in each.values()))


def equivalent_residual_force(model, theta, speed, harmonics, residual):
    """The force at the measured nodes, N, that would cause the residual (speed, harmonic, sensor), m, of a model.

    Coupled harmonics are solved together; the receptance of nonlinear forces is neglected.
    """
    near = Neighbourhood(model, speed, np.asarray(harmonics), theta, order=int(np.abs(harmonics).max()) + BEYOND)
    units = [model.structure.unit(node) for node in model.sensors]
    shown = np.moveaxis(shown_forces(near, near, units), 2, 0)  # (speed, node, part and harmonic, harmonic, sensor)
    columns, right = shown.reshape(len(speed), -1, residual[0].size).swapaxes(1, 2), residual.reshape(len(speed), -1, 1)
    found = np.linalg.solve(*(np.concatenate([one.real, one.imag], axis=1) for one in (columns, right)))
    real, imag = np.moveaxis(found.reshape(len(speed), len(units), 2, -1), 2, 0)
    return (real + 1j * imag).swapaxes(1, 2)
