"""Tables of the simulated chapters (2, 4 and 6) beside the thesis's, as tables.yaml of the reference describes them."""

import numpy as np
import pandas as pd

from rotorstudy.presentation.pages import Table
from rotorstudy.response.statics import static_deflection
from rotorstudy.store import as_complex
from rotorstudy.studies.config import file_name
from rotorstudy.yaml_file import read_yaml
from thesis.scoreboard import KEYS, PLACE, PRINTED, load_reasons, published, score, scored_tables, table_name

QUANTITIES = {"amplitude": np.abs, "phase": np.angle, "compensated phase": np.angle}
BY_METHOD = (["item"], ["case", "method"])  # keys of the rows and of the columns
BY_CASE, BY_NOISE = (["case", "noise_percent"], ["item"]), (["item"], ["noise_percent"])


def described(reference, chapter):
    """What tables.yaml says of a chapter; reference : folder of the printed values."""
    return read_yaml(f"{reference}/tables.yaml")[chapter]


def places(reference, name, numbers, columns=None):
    """Rows of a file, as dicts without what is empty, of the tables with some numbers: where ours of them are."""
    as_text = {"dtype": {"table": str}, "keep_default_na": False, "na_values": [""]}
    rows = pd.read_csv(f"{reference}/{name}.csv", usecols=columns, **as_text)
    return [row.dropna().to_dict() for _, row in rows[rows.table.isin(numbers)].iterrows()]


def spectrum_rows(spectra, columns):
    """Rows of amplitudes and phases for a scoreboard, with KEYS and `computed`; columns : of `places`."""
    rows = []
    for column in columns:
        where = dict(column)
        table, case, quantity, method = map(where.pop, PRINTED)
        here = spectra.sel(speed=where.pop("speed_rad_s"), method="nearest")
        here = here.sel(node=int(where.pop("node", spectra.node[0])))
        if quantity == "reference phase":
            values = here.reference_phase.sel(where).values
        else:
            values = QUANTITIES[quantity](as_complex(here.displacement.sel(where)))
        for n, value in zip(spectra.harmonic.values, values, strict=True):
            rows.append(dict(zip(KEYS, (table, case, str(n), np.nan, quantity, method), strict=True), computed=value))
    return rows


def joint_share(printed, without_noise, trials):
    """Share of trials (trial, parameter) whose errors have a smaller Mahalanobis distance than those printed."""
    scale = trials.std(axis=0)
    errors = (trials - without_noise) / scale
    inverse = np.linalg.inv(errors.T @ errors / len(errors))
    size = np.einsum("tp,pq,tq->t", errors, inverse, errors)
    own = (printed - without_noise) / scale
    return float((size <= own @ inverse @ own).mean())


def noise_rows(printed, trials, names, models):
    """Rows of estimates under noise at one level: where the values printed, one realisation, fall among our trials.

    printed : rows of `published`;  trials : Monte Carlo Dataset of their case, one record kind and level
    names   : name in the thesis -> parameter;  models : short name -> noise model; the mean of the last one is ours
    returns : dicts with KEYS, `computed`, and for each model percentile_, std_, distance_ (from the mean, in standard
              deviations) and share_ (percent of trials nearer to the noise-free estimate, see `joint_share`)
    """
    ours, factor = [names[item] for item in printed["item"]], printed.unit.map(_factor).to_numpy()
    rows, value = printed[KEYS].to_dict("records"), printed.published.to_numpy()
    exact = trials.without_noise.sel(parameter=ours).values * factor
    for short, model in models.items():
        found = trials.estimate.sel(noise_model=model, parameter=ours).transpose("trial", "parameter").values * factor
        share, mean, std = joint_share(value, exact, found), found.mean(axis=0), found.std(axis=0)
        for i, row in enumerate(rows):
            row["computed"] = mean[i]
            row[f"percentile_{short}"] = (found[:, i] < value[i]).mean() * 100
            row[f"std_{short}"], row[f"share_{short}"] = std[i], share * 100
            row[f"distance_{short}"] = abs(value[i] - mean[i]) / std[i]
    return rows


def _factor(unit):
    return 180 / np.pi if unit == "deg" else 1.0


def estimate_rows(printed, where, texts, estimate, monte_carlo):
    """Rows of the estimates of some printed rows; those with noise have ours without it if there are no trials."""
    at = {key: value for key, value in where.items() if key not in ("table", "printed_case", "trials")}
    rows = []
    for level, some in printed.groupby("noise_percent"):
        if level and monte_carlo:
            trials = monte_carlo[file_name(at["case"])].sel(record=where["trials"], noise=level)
            trials = trials.sel(estimator="least_squares")
            rows += noise_rows(some, trials, texts["parameters"], texts["noise_models"])
            continue
        for row in some.to_dict("records"):
            value = float(estimate.sel(**at, parameter=texts["parameters"][row["item"]])) * _factor(row["unit"])
            rows.append({**{key: row[key] for key in KEYS}, "computed": value})
    return rows


def assumed_parameters(config, texts, true):
    """The first table of a chapter; true : (parameter,) values assumed for the unknowns."""
    about, model = texts["assumed"], config.rig(config.main_rig)
    rotor, known = model.structure, dict(zip(true.parameter.values, true.values.tolist(), strict=True))
    if "rows" in about:
        for name in ("mass", "stiffness"):
            known |= {f"{name}[{i},{j}]": value for (i, j), value in np.ndenumerate(getattr(rotor, name))}
        known |= {f"deflection[{i}]": value.real for i, value in enumerate(rotor.static_deflection)}
        known["polar_moment"] = abs(rotor.gyroscopic[-1, -1])
        rows = pd.DataFrame(about["rows"], columns=about["columns"])
        rows = rows.assign(here=rows.here.map(known) * rows.unit.map(_factor))
    else:  # parameters, and the deflection on the bearings
        deg = {name: _factor("deg" if "phi" in name else "") for name in texts["parameters"]}
        rows = [(name, known[ours] * deg[name]) for name, ours in texts["parameters"].items()]
        deflection = static_deflection(model, [100.0], model.theta[: len(model.rotor_unknowns)]).value[0].real * 1e6
        for node in rotor.nodes:
            rows.append((f"u_x0 at node {node} (µm)", deflection[rotor.index(node)]))
            rows.append((f"phi_y0 at node {node} (µrad)", deflection[rotor.index(node, "tilt")]))
        rows = pd.DataFrame(rows, columns=["parameter", "here"])
    return Table(rows, f"Table {about['number']}: {about['title']}", about["note"])


def variant_errors(config, text, relative_error):
    """Error of each variant of the equations; text : title, note;  relative_error : of `studies.analyses.variants`."""
    error = relative_error.to_series().unstack("parameter")
    phase = np.array([config.reported[name] == "rad" for name in error.columns])
    error.loc[:, ~phase] *= 100
    error.loc[:, phase] = np.rad2deg(error.loc[:, phase])
    names = zip(error.columns, np.where(phase, "°", "%"), strict=True)
    error.columns = [f"{name.replace('_', ' ')} ({unit})" for name, unit in names]
    error.index = [f"{variant}: {case}" for variant, case in error.index]
    return Table(error.T.rename_axis("parameter").reset_index(), *text, digits=2)


def tables(
    config, reference, reasons, spectra_thesis, identification_thesis, monte_carlo_thesis=None, variants=None, **others
):
    """The tables of a chapter by the rig "thesis", beside the printed ones, and the rows of the scoreboard, by name.

    others : results that only figures show
    """
    texts = described(reference, config.name)
    printed, by_variants = published(reference, list(texts["tables"])), variants is not None
    found = variants if by_variants else identification_thesis.sel(estimator="least_squares")
    rows = spectrum_rows(spectra_thesis, places(reference, "full_spectrum", texts["tables"], [*PRINTED, *PLACE]))
    for where in places(reference, "rows_of_estimates", texts["tables"]):
        some = printed[(printed.table == where["table"]) & (printed.case == where["printed_case"])]
        rows += estimate_rows(some, where, texts, found.estimate, monte_carlo_thesis)
    scored = score(printed, pd.DataFrame(rows), load_reasons(reasons))
    keys = dict.fromkeys(printed[printed.quantity == "estimate"].table, BY_NOISE if by_variants else BY_CASE)
    about = {number: (*text, *keys.get(number, BY_METHOD)) for number, text in texts["tables"].items()}
    first = {table_name(texts["assumed"]["number"]): assumed_parameters(config, texts, found.true)}
    last = {"variants": variant_errors(config, texts["variants"], variants.relative_error)} if by_variants else {}
    return {"scored": Table(scored), **first, **scored_tables(scored, about), **last}
