"""What a diagnosis gains at each speed when that speed is left out, and what it says of a thesis's own model."""

import numpy as np

from rotorstudy.diagnosis.fit import fit, predicted, with_model_error
from rotorstudy.diagnosis.page import gain_in_words, place
from rotorstudy.diagnosis.report import read_settings, read_spectrum
from rotorstudy.diagnosis.search import base_model
from rotorstudy.diagnosis.verdict import investigate
from rotorstudy.identification import magnitude_and_phase
from rotorstudy.response import measured_response
from rotorstudy.rig import read_yaml
from rotorstudy.store import as_complex
from rotorstudy.studies.checks import shown_name
from rotorstudy.studies.replay import thesis_estimates

UNLIMITED = 1e3  # times the stated uncertainty: as the thesis fits, with no limit on any parameter


def leave_one_out(records, rig_path):
    """Rows, one a speed: verdict and error there (m rms) when no fit has seen it.

    base, extended : the rig as its uncertainties allow, and with the causes found
    without_limits : the rig's own parameters fitted freely
    """
    spectrum, model, _ = read_spectrum(records, rig_path)
    settings = read_settings(read_yaml(rig_path), str(rig_path))
    free = settings.model_copy(update={"uncertainty": {k: UNLIMITED * v for k, v in settings.uncertainty.items()}})
    rows = []
    for i, speed in enumerate(spectrum.speed):
        verdict = investigate(spectrum, model, hold_out=[speed], settings=settings).verdict
        seen = np.arange(len(spectrum.speed)) != i
        whole, prior = base_model(model, free)
        fitted = fit(whole, with_model_error(spectrum.at_speeds(seen), settings.model_error), prior)
        off = spectrum.amplitude[i] - predicted(whole, spectrum.at_speeds([i]), fitted.theta)[0]
        gain = verdict["gain"]
        rows.append({
            "speed": float(speed), "verdict": verdict["verdict"], "causes": sorted(map(place, verdict["causes"])),
            "base": gain["before_m"], "extended": gain["after_m"],
            "without_limits": float(np.sqrt(np.mean(np.abs(off) ** 2))), "in_words": gain_in_words(verdict),
        })  # fmt: skip
    return rows


def harmonic_rows(config, data, folder):
    """A row a harmonic: what was measured, and what each model leaves (µm rms over the speeds).

    config : ReplayConfig;  data : Dataset of verdict.nc;  folder : of the published values
    The thesis's estimates are compared as the thesis does: without 0X and 1X of the slow roll, at the other speeds.
    """
    harmonics = [int(n) for n in data.harmonic.values]
    measured = as_complex(data.measured)[..., 0]
    slow = int(np.argmin(data.speed.values))
    moving = np.arange(len(data.speed)) != slow
    taken_off = np.where(np.isin(harmonics, (0, 1)), measured[slow], 0)
    theta = thesis_estimates(config, folder, config.all_speeds)
    shown = measured_response(config.model, data.speed.values[moving], harmonics, theta)[..., 0]
    left = {
        "thesis, left": measured[moving] - taken_off - shown,
        "base, left": measured - as_complex(data.base)[..., 0],
        "extended, left": measured - as_complex(data.extended)[..., 0],
    }
    sizes = {"measured": measured, "slow roll": measured[[slow]], **left}
    microns = {f"{name} (µm)": 1e6 * np.sqrt(np.mean(np.abs(v) ** 2, axis=0)) for name, v in sizes.items()}
    sigma = {
        f"{name} (σ)": np.sqrt((data[f"residual_{when}"][..., 0] ** 2).mean("speed")).values
        for name, when in (("base", "before"), ("extended", "after"))
    }
    return [
        {"rig": config.name.replace("_", " "), "harmonic": f"{n}X", **{k: float(v[i]) for k, v in columns.items()}}
        for columns in [microns | sigma]
        for i, n in enumerate(harmonics)
    ]


def parameter_rows(config, data, folder):
    """A row a parameter of the thesis: its estimate, and ours within the limits, before and after the causes."""
    printed = dict(zip(config.model.names, thesis_estimates(config, folder, config.all_speeds), strict=True))
    chosen = data.sel(parameter=list(printed))
    found = {}
    for source in ("base_", ""):
        theta, std = chosen[f"{source}estimate"].values, chosen[f"{source}std"].values
        names, theta, covariance = magnitude_and_phase(list(printed), theta, np.diag(std**2))
        found[source] = dict(zip(names, zip(theta, np.sqrt(np.diag(covariance)), strict=True), strict=True))
    thesis = magnitude_and_phase(list(printed), np.array(list(printed.values())), np.eye(len(printed)))
    rows = []
    for name, value in zip(thesis[0], thesis[1], strict=True):
        (unit,) = config.model.reported_units([name])
        small = 1e6 if unit == "m" else 1.0
        columns = {"thesis": value * small}
        for label, source in (("base", "base_"), ("extended", "")):
            columns |= {label: found[source][name][0] * small, f"{label} ±": found[source][name][1] * small}
        unit = "µm" if unit == "m" else unit
        rows.append({"rig": config.name.replace("_", " "), "parameter": shown_name(name), "unit": unit, **columns})
    return rows
