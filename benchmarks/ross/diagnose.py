"""The diagnosis on records that ROSS simulated: python benchmarks/ross/diagnose.py OUT [CASE ...]

OUT is the folder that simulate.py wrote. Compares the healthy machine with ROSS's own unbalance response first, then
writes a rig file for each case, reads the records by it and diagnoses them. The table goes to OUT/verdicts.csv.
"""

import json
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from rotorstudy import build_model, measured_response
from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.settings import read_settings
from rotorstudy.errors import RotorstudyError
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.rig import read_rig

# Truth -> names of the package that are this effect
MEANS = {
    "unbalance": ("unbalance",),
    "added_mass": ("added_mass",),
    "support_loss": ("support_loss", "bearing_coefficients", "support_anisotropy"),
    "cross_coupling": ("cross_coupling", "bearing_coefficients"),
    "seal": ("seal",),
    "misalignment": ("parallel_misalignment", "angular_misalignment"),
    "rub": ("rub",),
    "crack": ("transverse_crack",),
}
X, Y = "yy", "xx"  # coefficients of ROSS along and across the weight, which acts along its -y


def rig_of(machine, weight):
    """Rig file of the healthy machine; ROSS counts the weight only where a crack needs it."""
    shaft, discs = machine["shaft"], {disc["n"]: disc for disc in machine["discs"]}
    unbalance = zip(*machine["unbalance"].values(), strict=True)
    return {
        "rotor": {
            "kind": "finite_element",
            "elements": [{"length_m": shaft["length"] * shaft["count"], "count": shaft["count"]}],
            "outer_diameter_m": shaft["diameter"],
            "youngs_modulus_Pa": machine["steel"]["E"],
            "poissons_ratio": machine["steel"]["Poisson"],
            "density_kg_per_m3": machine["steel"]["rho"],
            "gravity_m_per_s2": machine["gravity"] if weight else 0.0,
            "discs": [
                {
                    "node": n + 1,
                    "mass_kg": disc["m"],
                    "polar_moment_kg_m2": disc["Ip"],
                    "diametral_moment_kg_m2": disc["Id"],
                }
                for n, disc in discs.items()
            ],
        },
        "bearings": [
            {
                "kind": "linear",
                "node": bearing["n"] + 1,
                "label": f"node {bearing['n'] + 1}",
                "coefficients": "anisotropic",
                "bearing_stiffness_xx_N_per_m": bearing[f"k{X}"],
                "bearing_stiffness_yy_N_per_m": bearing[f"k{Y}"],
                "bearing_damping_xx_N_s_per_m": bearing[f"c{X}"],
                "bearing_damping_yy_N_s_per_m": bearing[f"c{Y}"],
            }
            for bearing in machine["bearings"]
        ],
        "effects": [
            {
                "kind": "unbalance",
                "node": n + 1,
                "label": f"disc {n + 1}",
                "mass_kg": discs[n]["m"],
                "eccentricity_m": magnitude / discs[n]["m"],
                "eccentricity_phase_rad": phase,
            }
            for n, magnitude, phase in unbalance
        ],
        "sensors": [n + 1 for n in machine["probes"]],
        "measurement": {
            "gravity_angle_deg": -90,
            "displacement_zero": "unloaded_line",
            "probes": [
                {"channel": f"{direction}{n}", "node": n + 1, "angle_deg": angle, "unit": "m"}
                for n in machine["probes"]
                for direction, angle in (("x", 0), ("y", 90))
            ],
            "keyphasor": {"channel": "key", "sensor_angle_deg": 0, "mark_angle_deg": 0},
        },
        "diagnosis": {
            "uncertainty": {
                "bearing_stiffness_xx": 0.02,
                "bearing_stiffness_yy": 0.02,
                "bearing_damping_xx": 0.05,
                "bearing_damping_yy": 0.05,
                "eccentricity": 0.05,
            }
        },
    }  # fmt: skip


def difference(machine):
    """Largest difference of the healthy response at +1X and -1X from that of ROSS, over the largest response."""
    model = build_model(rig_of(machine, weight=False))
    ours = measured_response(model, machine["speeds"], [1, -1])
    part = np.array(machine["response"])
    x, y = ((part[d::6] @ [1, 1j])[list(machine["probes"])] for d in (0, 1))  # (node, speed)
    # The package's x is down, 90 degrees behind that of ROSS, and its time is zero when the reference line points
    # there: harmonic n is turned by 90 degrees, and by -90 n degrees
    theirs = np.stack([(x + 1j * y) / 2, -np.conj(x - 1j * y) / 2])
    return np.abs(ours - np.transpose(theirs, (2, 0, 1))).max() / np.abs(theirs).max()


def there(true, cause, element_length):
    """Whether a cause is the true effect at its place: at a node, in an element (m long) or at one of its ends."""
    if not true or cause.effect not in MEANS[true["family"]]:
        return False
    first = true.get("node", true.get("element")) + 1
    if "position_m" in cause.parameters:
        middle = true.get("position_m", (first - 0.5) * element_length)
        return abs(cause.parameters["position_m"].value - middle) <= element_length / 2
    places = (first,) if "node" in true else (first, first + 1)
    return cause.where.get("element", cause.where.get("node", first)) in places


def row_of(folder, machine):
    """Row of a case: truth, verdict, what it names and states, whether that is right, and the size of the effect."""
    true = json.loads((folder / "truth.json").read_text())
    rig_file = folder / "rig.yaml"
    rig_file.write_text(yaml.safe_dump(rig_of(machine, true.get("weight", False)), sort_keys=False))
    place = " ".join(f"{key} {true[key] + 1}" for key in ("node", "element") if key in true)
    row = {"case": folder.name, "truth": f"{true.get('family', 'healthy')} {place}".strip()}
    start = time.process_time()
    try:
        rig = read_rig(rig_file)
        spectrum, model, findings = measured_spectrum(sorted(folder.glob("run_*.csv")), rig)
        found = investigate(spectrum, model, settings=read_settings(rig.given, "rig.yaml"), findings=findings)
    except RotorstudyError as problem:
        return row | {"verdict": "refused", "named": str(problem), "alone": False, "in_set": False}
    verdict, base = found.verdict, found.search.base
    (folder / "verdict.json").write_text(verdict.model_dump_json(indent=1))
    stated = (*verdict.causes, *verdict.ambiguous_with) if verdict.verdict in ("cause", "ambiguous") else ()
    healthy = verdict.verdict == "nothing" and not true
    return row | {
        "size": np.sqrt(base.cost / len(base.residual)),  # of what the healthy machine leaves and moves, rms in sigma
        "verdict": verdict.verdict,
        "named": " + ".join(name_of(cause) for cause in verdict.causes),
        "stated": " | ".join(name_of(cause) for cause in verdict.ambiguous_with),
        "alone": healthy
        or (verdict.verdict == "cause" and all(there(true, cause, machine["shaft"]["length"]) for cause in stated)),
        "in_set": healthy or any(there(true, cause, machine["shaft"]["length"]) for cause in stated),
        "p_after": verdict.residual_p_value.after,
        "share_left": verdict.residual_share,
        "seconds": time.process_time() - start,
    }


def name_of(cause):
    """Effect and place in a few characters."""
    return cause.effect + "".join(f" {value}" for value in cause.where.values())


def main(out, wanted):
    """Compare the healthy machine, diagnose the wanted cases (none: all), write the table."""
    warnings.simplefilter("ignore")
    machine = json.loads((out / "machine.json").read_text())
    print(f"healthy response, largest difference from ROSS: {difference(machine):.1e}", flush=True)
    rows = []
    for folder in wanted or sorted(file.parent.name for file in out.glob("*/truth.json")):
        rows.append(row_of(out / folder, machine))
        print(json.dumps(rows[-1], default=float), flush=True)
        pd.DataFrame(rows).to_csv(out / "verdicts.csv", index=False)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
