"""Evidence for the misprints and sign errors of Chapter 6; see `errata`."""

import numpy as np
import pandas as pd

from rotorstudy.model.rig import build_model
from rotorstudy.response.measured import measured_response
from thesis.chapter_6 import CASES, NODES, PARAMETERS, VARIANT
from thesis.scoreboard import published

LEAST = 1e-7  # m, amplitude of the smallest harmonic compared
SENSORS = {f"100 rad/s, node {n}": n - 1 for n in NODES}  # case as printed -> sensor


def deviations(model, printed):
    """Deviations of printed harmonics of Chapter 6 from the steady state of a model at 100 rad/s.

    printed : rows of `published`, Tables 6.2 to 6.7
    returns : DataFrame with table, item, computed (m or rad) and deviation (amplitudes relative, phases in rad) of the
              harmonics above 0.1 µm
    """
    harmonics = sorted({int(n) for n in printed.item})
    response = measured_response(model, [100.0], harmonics)[0]
    rows = []
    for row in printed.itertuples():
        value = response[harmonics.index(int(row.item)), SENSORS[row.case]]
        if abs(value) < LEAST:
            continue
        if row.quantity == "amplitude":
            computed, deviation = abs(value), abs(abs(value) / row.published - 1)
        else:
            computed, deviation = np.angle(value), abs(np.angle(value * np.exp(-1j * row.published)))
        rows.append({"table": row.table, "item": row.item, "computed": computed, "deviation": deviation})
    return pd.DataFrame(rows)


def chapter_6(config, folder, variants):
    """Numbers on gyroscopic sign, mass matrix and unbalance phases of the spectra, and on Tables 6.8 and 6.9.

    config : StudyConfig;  folder : of the printed values;  variants : Dataset of `studies.variants.variants`
    """
    printed = published(folder, [f"6.{n}" for n in range(2, 8)])
    printed = printed[printed.method == "regression"]
    rig = config.rigs["thesis"]
    effects = [{**item} for item in rig["effects"]]
    unbalances = [item for item in effects if "eccentricity_phase_rad" in item]
    phases = [item["eccentricity_phase_rad"] for item in unbalances]
    for item, phase in zip(unbalances, reversed(phases), strict=True):
        item["eccentricity_phase_rad"] = phase
    read = {
        "thesis": rig,
        "right_sign": {**rig, "rotor": {**rig["rotor"], "gyroscopic_sign": 1}},
        "right_mass": {**rig, "effects": rig["effects"][:-1]},
        "printed_phases": {**rig, "effects": effects},
    }
    found = {name: deviations(build_model(own, f"Chapter 6, {name}"), printed) for name, own in read.items()}
    misprint = (found["thesis"].table == "6.4") & (found["thesis"].item == "-2")
    worst = {name: table.deviation[~misprint].max() * 100 for name, table in found.items()}
    one = published(folder, ["6.8"])
    one = one[one.noise_percent == 0].set_index("item").published
    names = ("e_1", "e_2", "phi_1", "phi_2")

    def off(variant):
        """Largest deviation of our eccentricities and phases from the printed ones, per cent."""
        here = variants.estimate.sel(variant=variant, case=CASES["6.8"])
        ours = {name: PARAMETERS[name] for name in names}
        return max(abs(float(here.sel(parameter=p)) * factor / one[n] - 1) for n, (p, factor) in ours.items()) * 100

    true = {name: float(variants.true.sel(parameter=PARAMETERS[name][0])) for name in names[:2]}
    return {
        **{f"reading_{name}_percent": value for name, value in worst.items()},
        "minus_2X_um": float(found["thesis"][misprint].computed.iloc[0]) * 1e6,
        "phi_1_deg": one["phi_1"],
        "e_1_off_percent": (one["e_1"] / true["e_1"] - 1) * 100,
        "e_2_off_percent": (one["e_2"] / true["e_2"] - 1) * 100,
        "opposite_signs_percent": off(VARIANT),
        "consistent_signs_percent": off("the thesis with consistent signs"),
    }
