"""What is found in the records of machines in a plant: python benchmarks/plant_study.py FOLDER [CASE ...] [--draw N]

CASE is a machine (all its states) or machine/state of `plant.py`. The sound machine is diagnosed with the rig from
drawings, which updates the rig, and the state is compared with it. With --limits each fault has twice the size that is
stated as seen: by the diagnosis of the sound machine, and by its comparison with other records of itself. A row for
each goes to FOLDER/study.csv; what is there already is not repeated, and motions are kept.
"""

import argparse
import json
import logging
import time
from functools import partial
from pathlib import Path

import many_cases
import numpy as np
from plant import PLANTS, STATES, crack_place, motion, right_places, write

from rotorstudy.blind.machines.stepping import NoSteadyState
from rotorstudy.diagnosis.runs.compare import compare
from rotorstudy.diagnosis.verdict import sought
from rotorstudy.diagnosis.verdict.extend import extended_rig
from rotorstudy.diagnosis.verdict.hidden import with_hidden
from rotorstudy.diagnosis.verdict.investigate import investigate
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.rig import RigFile
from rotorstudy.yaml_file import read_yaml

PLACE = 0.05  # of the length, within which a crack is at the right place
DEEPEST = 0.5  # of the diameter, of a crack
LIMITED = ("clearance", "clearance_last", "crack", "crack_middle", "looseness", "hub_2X", "contact")  # states


def clocked(function, *arguments, **options):
    """What a function returns, and CPU seconds to the first answer and in all."""
    start, answered, logger = time.process_time(), [], logging.getLogger(sought.__name__)

    def passed(record):
        answered.append(time.process_time() - start)
        return True

    logger.setLevel(logging.INFO)
    logger.addFilter(passed)
    try:
        found = function(*arguments, **options)
    finally:
        logger.removeFilter(passed)
    return found, {"first_s": min(answered, default=np.nan), "seconds": time.process_time() - start}


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
    cracks = [c for c in stated if c.effect == "transverse_crack" and state.startswith("crack")]
    places = [c.parameters["position_m"] for c in cracks]
    ends = [one.interval_95 or one.value + one.std * np.array([-1.96, 1.96]) for one in places]
    right = [is_right(cause, plant, state) for cause in stated]
    return {
        "verdict": verdict.verdict, "sigma": round(float(np.sqrt(diagnosis.search.base.cost)), 1),
        "alone": verdict.verdict == "cause" and all(right),
        "in_set": verdict.verdict in ("cause", "ambiguous") and any(right),
        "place_held": [bool(low <= crack_place(plant, state) <= high) for low, high in ends],
        "causes": [[c.effect, c.where, round(c.posterior_probability, 3),
                    {k: float(f"{p.value:.4g}") for k, p in c.parameters.items()}] for c in stated],
        "p_before": verdict.residual_p_value.before, "p_after": verdict.residual_p_value.after,
        "outside": verdict.outside_probability, "places": [[one.where, one.motion] for one in verdict.one_place],
        "findings": [one.name for one in verdict.findings],
    }  # fmt: skip


def records(asked, name, state, size, again=0):
    """Paths of record and rig of a state, and the settings of its diagnosis."""
    steady = motion(name, state, size, kept=asked.folder / "motions")
    folder = asked.folder / f"{name}_{asked.draw}" / f"{state}_{size:g}_{again}"
    record, rig = write(folder, name, state, asked.draw, steady, again)
    return record, rig, RigFile(rig, read_yaml(rig)).given["diagnosis"]


def sound(asked, name, way):
    """File of what the sound machine left when it was diagnosed or compared: its updated rig, and its limits."""
    return asked.folder / f"{name}_{asked.draw}" / f"sound_{way.__name__}.json"


def with_limits(found, rig, case, asked, way):
    """A Diagnosis by a rig file; of a sound machine with its limits, which go to a file."""
    name, state, _ = case
    if state == "healthy":
        found = with_hidden(found)
        hidden = [[one.effect, one.where, one.size] for one in found.verdict.hidden]
        sound(asked, name, way).write_text(json.dumps({"rig": extended_rig(rig, found), "hidden": hidden}))
    return found


def diagnosed(case, asked):
    """Row of a diagnosis with the rig from drawings."""
    name, state, _ = case
    record, rig, settings = records(asked, *case)
    spectrum, model, _ = measured_spectrum([record], rig)
    investigated = partial(investigate, spectrum, model, settings=settings)
    found, seconds = clocked(lambda: with_limits(investigated(), read_yaml(rig), case, asked, diagnosed))
    return judged(PLANTS[name](), state, found) | seconds


def compared(case, asked):
    """Row of the comparison of a state with the sound machine, by the rig that this one updated."""
    name, state, size = case
    record, rig, settings = records(asked, name, "healthy", 0.0)
    updated = RigFile(rig, json.loads(sound(asked, name, diagnosed).read_text())["rig"])
    before, model, _ = measured_spectrum([record], updated)
    after, model, _ = measured_spectrum([records(asked, name, state, size, 1)[0]], updated)
    change = partial(compare, before, after, model, settings=settings)
    found, seconds = clocked(lambda: with_limits(change().diagnosis, updated.given, case, asked, compared))
    return judged(PLANTS[name](), state, found) | seconds


def at_twice_its_limit(name, state, asked, way):
    """Twice the size from which a fault is seen, nan where it is not, or cannot be that large.

    Where several places are right, the one at which it is seen worst counts.
    """
    plant, hidden = PLANTS[name](), json.loads(sound(asked, name, way).read_text())["hidden"]
    limits = [s for effect, where, s in hidden if s and is_there(effect, where, plant, state)]
    # of 2X a limit is of the forward part, half of the force; of a foot in N/m, of which a state is a share
    unit = {"hub_2X": 2.0, "looseness": 1 / plant.blocks[0].stiffness[0]}.get(state, 1.0)
    size = float(f"{2 * max(limits, default=np.inf) * unit:.3g}")
    largest = {"looseness": 1.0, "crack": DEEPEST, "crack_middle": DEEPEST}.get(state, 1e9)
    return size if size <= largest else np.nan


def row_of(case, asked, way):
    """The row of a machine in a state, also of one that is not run."""
    if np.isnan(case[-1]):
        return {"verdict": "no such limit"}
    try:
        return way(case, asked)
    except NoSteadyState as problem:
        return {"verdict": f"not run: {problem}"}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("cases", nargs="*", default=list(PLANTS))
    parser.add_argument("--draw", type=int, default=1)
    parser.add_argument("--limits", action="store_true")
    asked = parser.parse_args()

    def rows(way, cases):
        named = {f"{name} {state} {size:g}, {way.__name__}, draw {asked.draw}": (name, state, size)
                 for name, state, size in cases}  # fmt: skip
        many_cases.rows_of(partial(row_of, asked=asked, way=way), named, asked.folder / "study.csv")

    for case in asked.cases:
        name, _, state = case.partition("/")
        rows(diagnosed, [(name, "healthy", 0.0)])
        states = [state] if state else LIMITED if asked.limits else STATES
        if asked.limits:
            rows(compared, [(name, "healthy", 0.0)])
            for way in (diagnosed, compared):
                rows(way, [(name, one, at_twice_its_limit(name, one, asked, way)) for one in states])
        else:
            rows(compared, [(name, one, STATES[one][0]) for one in states])


if __name__ == "__main__":
    main()
