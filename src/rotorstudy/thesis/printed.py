"""Numbers of a simulated study in the shape of the thesis's printed tables."""

import numpy as np

from rotorstudy.store import as_complex
from rotorstudy.thesis.scoreboard import KEYS

QUANTITIES = {"amplitude": np.abs, "phase": np.angle, "compensated phase": np.angle}


def spectrum_rows(spectra, columns):
    """Rows of amplitudes and phases for a scoreboard.

    spectra : Dataset of `studies.simulate.spectra`
    columns : (table, case, quantity, method) as printed -> {dimension: label} of the column here; "speed" is taken to
              the nearest, and the first sensor is meant unless a "node" is given
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
    """Share of trials whose errors, all parameters together, are smaller than those printed (Mahalanobis distance).

    printed, without_noise : (parameter,);  trials : (trial, parameter)
    """
    scale = trials.std(axis=0)
    errors = (trials - without_noise) / scale
    inverse = np.linalg.inv(errors.T @ errors / len(errors))
    size = np.einsum("tp,pq,tq->t", errors, inverse, errors)
    own = (printed - without_noise) / scale
    return float((size <= own @ inverse @ own).mean())


def noise_rows(printed, noisy, parameters, models, mean_of):
    """Rows of estimates under noise: one unknown realisation was printed; say where it falls among our trials.

    printed   : rows of `published` with a noise level above zero
    noisy     : printed case -> its Monte Carlo Dataset, one record kind
    models    : short name -> noise model;  mean_of : the model whose mean is taken as ours
    returns   : dicts with KEYS, `computed`, and for each model percentile_, std_, distance_ from the mean (in standard
                deviations), and share_, that of trials nearer to the noise-free estimate in all parameters together
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


def with_deviation(computed, printed):
    """The computed table with `deviation`, its distance from the printed values."""
    values = printed.set_index(KEYS).published
    computed["deviation"] = [
        abs(value - values.get(tuple(key), np.nan))
        for key, value in zip(computed[KEYS].values, computed.computed, strict=True)
    ]
    return computed
