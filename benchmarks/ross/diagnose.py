"""The diagnosis on records that ROSS simulated: python benchmarks/ross/diagnose.py OUT [CASE ...]

OUT is the folder that simulate.py wrote. Compares the healthy machine with ROSS's own unbalance response first, then
writes a rig file for each case, reads the records by it and diagnoses them. The table goes to OUT/verdicts.csv.
"""

import json
import sys
from functools import partial
from pathlib import Path

import numpy as np
import yaml

sys.path.insert(0, str(Path(__file__).parents[1]))

from many_cases import rows_of, shares

from rotorstudy import build_model, measured_response
from rotorstudy.authoring.ross_model import read_ross
from rotorstudy.blind.meanings import MEANS
from rotorstudy.blind.run import answer_case
from rotorstudy.blind.scoring import name_of

CROSS_COUPLING = ("cross_coupling", "bearing_coefficients")  # names of an effect that blind tests do not hide


def rig_of(machine, weight):
    """Rig file of the healthy machine; ROSS counts the weight only where a crack needs it."""
    sections, known = machine["sections"], zip(*machine["unbalance"].values(), strict=True)
    return {
        "rotor": sections["rotor"] | {"gravity_m_per_s2": machine["gravity"] if weight else 0.0},
        "bearings": sections["bearings"],
        "effects": [
            {"kind": "unbalance", "node": n + 1, "label": f"disc {n + 1}", "unbalance_kg_m": size,
             "eccentricity_phase_rad": phase}
            for n, size, phase in known
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
                **dict.fromkeys(("bearing_stiffness_xx", "bearing_stiffness_yy"), 0.02),
                **dict.fromkeys(("bearing_damping_xx", "bearing_damping_yy", "eccentricity"), 0.05),
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
    family = true.get("family")
    names = CROSS_COUPLING if family == "cross_coupling" else MEANS[family].names if true else ()
    if cause["effect"] not in names:
        return False
    first = true.get("node", true.get("element")) + 1
    if "position_m" in cause["parameters"]:
        middle = true.get("position_m", (first - 0.5) * element_length)
        return abs(cause["parameters"]["position_m"]["value"] - middle) <= element_length / 2
    places = (first,) if "node" in true else (first, first + 1)
    return cause["where"].get("element", cause["where"].get("node", first)) in places


def run_case(folder, machine):
    """Row of a case: truth, verdict, what it names and states, and whether that is right."""
    true = json.loads((folder / "truth.json").read_text())
    rig = rig_of(machine, true.get("weight", False))
    (folder / "rig.yaml").write_text(yaml.safe_dump(rig, sort_keys=False))
    answer = answer_case(folder, records=sorted(path.name for path in folder.glob("run_*.csv")))
    verdict = answer["verdict"]
    (folder / "verdict.json").write_text(json.dumps(verdict, indent=1))
    place = " ".join(f"{key} {true[key] + 1}" for key in ("node", "element") if key in true)
    row = {"truth": f"{true.get('family', 'healthy')} {place}".strip(), "verdict": verdict["verdict"]}
    if "error" in verdict:
        return row | {"named": verdict["error"], "alone": False, "in_set": False}
    causes, others = verdict["causes"], verdict["ambiguous_with"]
    right = [there(true, cause, machine["length"]) for cause in (*causes, *others)]
    if verdict["verdict"] not in ("cause", "ambiguous"):
        right = [not true] if verdict["verdict"] == "nothing" else [False]
    return row | {
        "named": " + ".join(map(name_of, causes)),
        "stated": " | ".join(map(name_of, others)),
        "alone": verdict["verdict"] != "ambiguous" and all(right),
        "in_set": any(right),
        "p_after": verdict["residual_p_value"]["after"],
        "share_left": verdict["residual_share"],
        "seconds": answer["seconds"],
    }


def main(out, wanted):
    """Compare the healthy machine, diagnose the wanted cases (none: all), write the table."""
    machine = json.loads((out / "machine.json").read_text())
    machine["sections"] = read_ross(out / "machine.toml").sections
    print(f"healthy response, largest difference from ROSS: {difference(machine):.1e}", flush=True)
    (out / "verdicts.csv").unlink(missing_ok=True)
    names = wanted or sorted(file.parent.name for file in out.glob("*/truth.json"))
    rows = rows_of(partial(run_case, machine=machine), {name: out / name for name in names}, out / "verdicts.csv")
    print(shares({name: rows[name].astype(bool) for name in ("alone", "in_set")}).to_string(index=False))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
