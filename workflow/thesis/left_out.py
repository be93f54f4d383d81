"""Diagnosis of the replayed experiments: error at each speed left out, and comparison with the thesis's estimates."""

import json

import numpy as np
import pandas as pd

from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.diagnosis.settings import read_settings
from rotorstudy.diagnosis.verdict.cause_words import place, readable
from rotorstudy.diagnosis.verdict.investigate import diagnose
from rotorstudy.diagnosis.verdict.words import gain_in_words
from rotorstudy.inference.estimate import magnitude_and_phase
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import predicted, with_model_error
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import read_rig
from rotorstudy.response.measured import measured_response
from rotorstudy.store import as_complex, write_text
from rotorstudy.units import shown_unit
from thesis.checks import shown_name
from thesis.replay import thesis_estimates

UNLIMITED = 1e3  # times the stated uncertainty: parameters are free, as in the thesis


def leave_one_out(records, rig_path):
    """Rows, one per speed: verdict and rms error (m) at that speed, left out of every fit: base, extended, all free."""
    rig = read_rig(rig_path)
    spectrum, model, _ = measured_spectrum(records, rig)
    settings = read_settings(rig.given, str(rig_path))
    free = settings.model_copy(update={"uncertainty": {k: UNLIMITED * v for k, v in settings.uncertainty.items()}})
    rows = []
    for i, speed in enumerate(spectrum.speed):
        verdict = diagnose(spectrum, model, hold_out=[speed], settings=settings)
        seen = np.arange(len(spectrum.speed)) != i
        whole, prior = base_model(model, free)
        fitted = fit(whole, with_model_error(spectrum.at_speeds(seen), settings), prior)
        off = spectrum.amplitude[i] - predicted(whole, spectrum.at_speeds([i]), fitted.theta)[0]
        row = {"speed": float(speed), "verdict": verdict.verdict, "causes": sorted(map(place, verdict.causes))}
        row |= {"base": verdict.gain.before_m, "extended": verdict.gain.after_m}
        rms = float(np.sqrt(np.mean(np.abs(off) ** 2)))
        rows.append({**row, "without_limits": rms, "summary": gain_in_words(verdict)})
    return rows


def harmonic_rows(config, data, folder):
    """One row per harmonic: its size and residuals (µm rms); the thesis's has no slow roll, as in the thesis."""
    harmonics = [int(n) for n in data.harmonic.values]
    measured = as_complex(data.measured)[..., 0]
    slow = int(np.argmin(data.speed.values))
    moving = np.arange(len(data.speed)) != slow
    taken_off = np.where(np.isin(harmonics, (0, 1)), measured[slow], 0)
    theta = thesis_estimates(config, folder, config.all_speeds)
    shown = measured_response(config.model, data.speed.values[moving], harmonics, theta)[..., 0]
    left = {
        "thesis, residual": measured[moving] - taken_off - shown,
        "base, residual": measured - as_complex(data.base)[..., 0],
        "extended, residual": measured - as_complex(data.extended)[..., 0],
    }
    sizes = {"measured": measured, "slow roll": measured[[slow]], **left}
    microns = {f"{name} (µm)": 1e6 * np.sqrt(np.mean(np.abs(v) ** 2, axis=0)) for name, v in sizes.items()}
    whitened = {"base": data.residual_before, "extended": data.residual_after}
    sigma = {f"{name} (σ)": np.sqrt((one[..., 0] ** 2).mean("speed")).values for name, one in whitened.items()}
    columns = {"rig": readable(config.name), "harmonic": [f"{n}X" for n in harmonics], **microns, **sigma}
    return pd.DataFrame(columns).to_dict("records")


def compared_parameters(config, data, folder):
    """Rows of the parameters of the thesis's model (µm): its estimate, ours and its deviation without and with causes.

    kind : `phase`; `force`, of a crack, which acts on the static deflection alone; `positive`, of a passive part
    """
    names = list(config.model.names)
    chosen = data.sel(parameter=names)
    fits = {"thesis": (thesis_estimates(config, folder, config.all_speeds), np.ones(len(names)))}
    for source, prefix in (("base", "base_"), ("extended", "")):
        fits[source] = (chosen[f"{prefix}estimate"].values, chosen[f"{prefix}std"].values)
    found = {}
    for source, (theta, std) in fits.items():
        shown, theta, covariance = magnitude_and_phase(names, theta, np.diag(std**2))
        found[source] = dict(zip(shown, zip(theta, np.sqrt(np.diag(covariance)), strict=True), strict=True))
    rows = []
    for term in config.model.terms:
        effect = registry().plugins["effect"].get(term.kind)
        for p in term.parameters:
            full = term.full_name(p)
            passive = "positive" if effect and effect.is_positive(p.name) else ""
            kind = "force" if {entry.on for entry in p.entries} == {"static"} else passive
            for name, unit, what in ((full, p.unit, kind), (f"{full}_phase", "rad", "phase"))[: 1 + p.is_complex]:
                unit, factor = shown_unit(unit) if unit in ("m", "rad") else (unit, 1.0)
                row = {"rig": readable(config.name), "parameter": shown_name(name), "kind": what, "unit": unit}
                for source, by_name in found.items():
                    row[source], row[f"{source} ±"] = (one * factor for one in by_name[name])
                rows.append(row)
    return rows


def write(path, records, rig_path):
    """Write the rows of `leave_one_out` as JSON."""
    write_text(path, json.dumps(leave_one_out(records, rig_path), indent=1, ensure_ascii=False) + "\n")
