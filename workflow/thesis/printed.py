"""Numbers of a simulated study in the shape of the thesis's printed tables."""

import numpy as np
import pandas as pd

from rotorstudy.store import as_complex
from thesis.scoreboard import KEYS, load_reasons, score

QUANTITIES = {"amplitude": np.abs, "phase": np.angle, "compensated phase": np.angle}


def spectrum_rows(spectra, columns):
    """Rows of amplitudes and phases for a scoreboard.

    spectra : Dataset of `studies.simulate.spectra`
    columns : (table, case, quantity, method) as printed -> {dimension: label} of the column here; the nearest "speed"
              is taken, and the first sensor unless a "node" is given
    returns : list of dicts with KEYS and `computed`
    """
    rows = []
    for (table, case, quantity, method), where in columns.items():
        where = dict(where)
        here = spectra.sel(speed=where.pop("speed"), method="nearest").sel(node=where.pop("node", spectra.node[0]))
        if quantity == "reference phase":
            values = here.reference_phase.sel(where).values
        else:
            values = QUANTITIES[quantity](as_complex(here.displacement.sel(where)))
        for n, value in zip(spectra.harmonic.values, values, strict=True):
            rows.append(dict(zip(KEYS, (table, case, str(n), np.nan, quantity, method), strict=True), computed=value))
    return rows


def estimate_rows(estimate, table, case, parameters):
    """Rows of estimates without noise.

    estimate   : (parameter,) DataArray;  parameters : name in the thesis -> (name here, factor to its unit)
    """
    keys = [(table, case, name, 0.0, "estimate", "least squares") for name in parameters]
    values = [float(estimate.sel(parameter=ours)) * factor for ours, factor in parameters.values()]
    return [dict(zip(KEYS, key, strict=True), computed=value) for key, value in zip(keys, values, strict=True)]


def joint_share(printed, without_noise, trials):
    """Share of trials whose errors have a smaller Mahalanobis distance than those printed.

    printed, without_noise : (parameter,);  trials : (trial, parameter)
    """
    scale = trials.std(axis=0)
    errors = (trials - without_noise) / scale
    inverse = np.linalg.inv(errors.T @ errors / len(errors))
    size = np.einsum("tp,pq,tq->t", errors, inverse, errors)
    own = (printed - without_noise) / scale
    return float((size <= own @ inverse @ own).mean())


def noise_rows(printed, noisy, parameters, models, mean_of):
    """Rows of estimates under noise: where the printed values, one unknown realisation, fall among our trials.

    printed   : rows of `published` with a noise level above zero
    noisy     : printed case -> its Monte Carlo Dataset, one record kind
    models    : short name -> noise model;  mean_of : the model whose mean is reported as ours
    returns   : dicts with KEYS, `computed`, and for each model percentile_, std_, distance_ (from the mean, in standard
                deviations) and share_ (percent of trials nearer to the noise-free estimate, see `joint_share`)
    """
    rows, shares = [], {}
    for (case, level), group in printed.groupby(["case", "noise_percent"]):
        data = noisy[case].sel(noise=level, estimator="least_squares")
        names = [parameters[item][0] for item in group["item"]]
        factors = np.array([parameters[item][1] for item in group["item"]])
        exact = data.without_noise.sel(parameter=names).values * factors
        for short, model in models.items():
            trials = data.estimate.sel(noise_model=model, parameter=names).transpose("trial", "parameter").values
            shares[case, level, short] = joint_share(group["published"].to_numpy(), exact, trials * factors)
    for row in printed.to_dict("records"):
        ours, factor = parameters[row["item"]]
        trials = noisy[row["case"]].estimate.sel(noise=row["noise_percent"], estimator="least_squares", parameter=ours)
        found = {"computed": float(trials.sel(noise_model=mean_of).mean()) * factor}
        for short, model in models.items():
            values = trials.sel(noise_model=model).values * factor
            found[f"percentile_{short}"] = float((values < row["published"]).mean()) * 100
            found[f"std_{short}"] = float(values.std())
            found[f"share_{short}"] = shares[row["case"], row["noise_percent"], short] * 100
            found[f"distance_{short}"] = abs(row["published"] - float(values.mean())) / float(values.std())
        rows.append({**{key: row[key] for key in KEYS}, **found})
    return rows


def scored_against(printed, rows, reasons, measured_again=()):
    """The scoreboard of computed rows; reasons may quote their `deviation` from the printed values and its `percent`.

    rows : with KEYS and `computed`, and perhaps further columns that reasons quote;  measured_again : see `score`
    """
    computed, values = pd.DataFrame(rows), printed.set_index(KEYS).published
    known = np.array([values.get(tuple(key), np.nan) for key in computed[KEYS].values])
    deviation = np.abs(computed.computed - known)
    with np.errstate(divide="ignore", invalid="ignore"):
        percent = 100 * deviation / np.abs(known)
    return score(printed, computed.assign(deviation=deviation, percent=percent), load_reasons(reasons), measured_again)
