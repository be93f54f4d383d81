"""What is found in the records of machines in a plant: python benchmarks/plant_study.py FOLDER [CASE ...] [--draw N]

CASE is a machine (all its states) or machine/state of `plant.py`. The sound machine is diagnosed with the rig from
drawings, which updates the rig, and the state is compared with it. With --limits the fault is diagnosed, by the rig
from drawings, at twice the size that the verdict on the sound machine states as seen. A line of JSON for each goes to
FOLDER/study.jsonl; what is there already is not repeated, and motions are kept.
"""

import argparse
import json
import logging
import os
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads slow them down
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from plant import PLANTS, STATES, crack_place, motion, right_places, write

from rotorstudy.blind.machines.stepping import NoSteadyState
from rotorstudy.diagnosis.runs.compare import compare
from rotorstudy.diagnosis.verdict.extend import extended_rig
from rotorstudy.diagnosis.verdict.hidden import with_hidden
from rotorstudy.diagnosis.verdict.investigate import investigate
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.rig import RigFile
from rotorstudy.yaml_file import read_yaml

PLACE = 0.05  # of the length, within which a crack is at the right place
DEEPEST = 0.5  # of the diameter, of a crack
LIMITED = ("clearance", "clearance_last", "crack", "crack_middle", "looseness", "hub_2X", "contact")  # states


class Clock(logging.Handler):
    """CPU seconds until the first answer."""

    def __init__(self):
        super().__init__()
        self.start, self.first = time.process_time(), None

    def emit(self, record):
        if self.first is None and record.name.endswith("verdict.sought"):
            self.first = round(time.process_time() - self.start, 1)


def clocked(function, *arguments, **options):
    """What a function returns, and CPU seconds to the first answer and in all."""
    clock, logger = Clock(), logging.getLogger("rotorstudy")
    logger.addHandler(clock)
    logger.setLevel(logging.INFO)
    try:
        found = function(*arguments, **options)
    finally:
        logger.removeHandler(clock)
    return found, {"first_s": clock.first, "seconds": round(time.process_time() - clock.start, 1)}


def is_there(effect, where, plant, state):
    """Whether an effect at a place is what a state is, as far as its kind and place say."""
    near = right_places(plant, state)
    return effect in STATES[state][1] and all(value in near[key] for key, value in where.items() if key in near)


def is_right(cause, plant, state):
    """The same of a cause of a verdict, a crack within `PLACE`."""
    far = (
        cause.effect == "transverse_crack"
        and state.startswith("crack")
        and (abs(cause.parameters["position_m"].value - crack_place(plant, state)) > PLACE * plant.rotor.length)
    )
    return is_there(cause.effect, cause.where, plant, state) and not far


def judged(plant, state, diagnosis):
    """What is said of a Diagnosis; sigma : what the rig without the fault leaves, in standard deviations."""
    verdict = diagnosis.verdict
    stated = [*verdict.causes, *verdict.ambiguous_with]
    right = [is_right(cause, plant, state) for cause in stated]
    return {
        "verdict": verdict.verdict, "sigma": round(float(np.sqrt(diagnosis.search.base.cost)), 1),
        "alone": verdict.verdict == "cause" and all(right),
        "in_set": verdict.verdict in ("cause", "ambiguous") and any(right),
        "causes": [[c.effect, c.where, round(c.posterior_probability, 3),
                    {k: float(f"{p.value:.4g}") for k, p in c.parameters.items()}] for c in stated],
        "p_before": verdict.residual_p_value.before, "p_after": verdict.residual_p_value.after,
        "outside": verdict.outside_probability, "places": [[one.where, one.motion] for one in verdict.one_place],
        "findings": [one.name for one in verdict.findings],
    }  # fmt: skip


class Study:
    """The rows of a folder and a draw."""

    def __init__(self, folder, draw):
        self.folder, self.draw, self.file = Path(folder), draw, Path(folder) / "study.jsonl"
        self.folder.mkdir(parents=True, exist_ok=True)
        self.rows = [json.loads(line) for line in self.file.read_text().splitlines()] if self.file.exists() else []

    def row(self, key, made):
        """The row of a key, made by a function if it is new."""
        key = key | {"draw": self.draw}
        known = [row for row in self.rows if row | key == row]
        if known:
            return known[0]
        row = key | made()
        self.rows.append(row)
        with open(self.file, "a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        print({name: value for name, value in row.items() if name != "hidden"}, flush=True)
        return row

    def records(self, name, state, size, again=0):
        """Paths of record and rig of a state, and the settings of its diagnosis."""
        steady = motion(name, state, size, kept=self.folder / "motions")
        folder = self.folder / f"{name}_{self.draw}" / f"{state}_{size:g}_{again}"
        record, rig = write(folder, name, state, self.draw, steady, again)
        return record, rig, RigFile(rig, read_yaml(rig)).given["diagnosis"]

    def diagnosed(self, name, state="healthy", size=0.0):
        """Row of a diagnosis with the rig from drawings; that of the sound machine leaves the updated rig."""

        def made():
            record, rig, settings = self.records(name, state, size)
            spectrum, model, _ = measured_spectrum([record], rig)
            whole = with_hidden if state == "healthy" else lambda found: found
            found, seconds = clocked(lambda: whole(investigate(spectrum, model, settings=settings)))
            if state == "healthy":
                (rig.parent / "updated.json").write_text(json.dumps(extended_rig(read_yaml(rig), found)))
            hidden = [[one.effect, one.where, one.size] for one in found.verdict.hidden]
            return judged(PLANTS[name](), state, found) | seconds | {"hidden": hidden}

        return self.row({"way": "diagnosed", "machine": name, "state": state, "size": size}, made)

    def compared(self, name, state):
        """Row of the comparison of a state with the sound machine."""

        def made():
            self.diagnosed(name)
            record, rig, settings = self.records(name, "healthy", 0.0)
            updated = RigFile(rig, json.loads((rig.parent / "updated.json").read_text()))
            before, model, _ = measured_spectrum([record], updated)
            after, model, _ = measured_spectrum([self.records(name, state, STATES[state][0], 1)[0]], updated)
            one, seconds = clocked(compare, before, after, model, settings=settings)
            return judged(PLANTS[name](), state, one.diagnosis) | seconds

        return self.row({"way": "compared", "machine": name, "state": state, "size": STATES[state][0]}, made)

    def at_twice_its_limit(self, name, state):
        """Row of the diagnosis of a fault at twice its limit, None where it is not seen, or cannot be that large.

        Where several places are right, the one at which it is seen worst counts.
        """
        plant = PLANTS[name]()
        limits = [
            s for effect, where, s in self.diagnosed(name)["hidden"] if s and is_there(effect, where, plant, state)
        ]
        # of 2X a limit is of the forward part, half of the force; of a foot in N/m, of which a state is a share
        unit = {"hub_2X": 2.0, "looseness": 1 / plant.blocks[0].stiffness[0]}.get(state, 1.0)
        size = float(f"{2 * max(limits, default=np.inf) * unit:.3g}")
        largest = {"looseness": 1.0, "crack": DEEPEST, "crack_middle": DEEPEST}.get(state, 1e9)
        return self.diagnosed(name, state, size) if size <= largest else print(name, state, "has no such limit", size)


def main():
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("folder")
    asked.add_argument("cases", nargs="*", default=list(PLANTS))
    asked.add_argument("--draw", type=int, default=1)
    asked.add_argument("--limits", action="store_true")
    asked = asked.parse_args()
    study = Study(asked.folder, asked.draw)
    for case in asked.cases:
        name, _, state = case.partition("/")
        for one in [state] if state else LIMITED if asked.limits else STATES:
            try:
                (study.at_twice_its_limit if asked.limits else study.compared)(name, one)
            except NoSteadyState as problem:  # such a machine is not run
                print(case, problem)


if __name__ == "__main__":
    main()
