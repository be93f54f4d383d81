"""The diagnosis on records of the independent simulator in tests/foreign: python benchmarks/foreign.py --cases 100

Each case is diagnosed as by a user: record and rig file on disk, spectrum, verdict. One row per case goes to
`cases.csv`, the shares with their 95 % bounds (`foreign_scores.py`) to `summary.csv`; truth and verdict of each case
stay in `cases/`.
"""

import argparse
import json
import os
import shutil
import sys
import tempfile
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import cycle
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads slow them down
os.environ.setdefault("OMP_NUM_THREADS", "1")
ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import numpy as np
import pandas as pd
from foreign.cases import CHAIN_FAULTS, draw_case
from foreign.faults import FAMILIES
from foreign.files import write_case
from foreign.measuring import expected_harmonics
from foreign.stepping import NoSteadyState
from foreign_scores import by_kind, summary

from rotorstudy.diagnosis import investigate
from rotorstudy.diagnosis.search import base_model
from rotorstudy.diagnosis.settings import read_settings
from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.fit import fit
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import read_rig

VISIBLE = 0.01  # least change of a harmonic by an effect, over the healthy 1X; a smaller one is drawn again
QUICK = (0, 1, -1, 2, -2, 3, -3)  # harmonics of a quick run
CRACKS = ("transverse_crack", "breathing_crack", "breathing_crack_weight")
NODE, ELEMENT, STRETCH, ANY = "node", "element", "stretch", "any"

# Truth -> names of the package that are this effect, where they must be, and names that may stand beside them because
# they are part of the same truth. Only exact physical equivalents are listed.
MEANS = {
    "unbalance": (("unbalance",), NODE, ()),
    "couple_unbalance": (("couple_unbalance",), NODE, ()),
    # the breathing law is the crack's shape, not its name
    "crack": (CRACKS, ELEMENT, ()),
    "open_crack": (CRACKS, ELEMENT, ()),
    # a fixed offset of an isotropic coupling is a constant force, its 2X a rotating stiffness: both may be named
    "misalignment": (("parallel_misalignment", "angular_misalignment"), NODE, ("static_preload",)),
    "rub": (("rub",), NODE, ()),
    "looseness": (("looseness",), NODE, ()),
    # a linear loss along one direction is a change of the four stiffnesses, and half isotropic, half anisotropic
    "support_loss": (("support_loss", "bearing_coefficients", "support_anisotropy"), NODE, ("support_stiffness",)),
    # one that gives way to one side of the unloaded position is a looseness there
    "one_sided_loss": (("looseness",), NODE, ()),
    "pedestal": (("pedestal_resonance",), NODE, ()),
    # with a direct stiffness; of the same swirl at all speeds it is a cross coupling with damping
    "seal": (("seal",), NODE, ("support_stiffness", "cross_coupling", "external_damping")),
    # an eccentric mass is an unbalance at its node, too
    "added_mass": (("added_mass",), NODE, ("unbalance",)),
    # a bow is a shape along the whole shaft; the place says only by which of the library's shapes it is described
    "bow": (("bow",), ANY, ()),
    "thermal_bow": (("bow",), ANY, ()),
    "preload": (("static_preload",), NODE, ()),
    "cubic_bearing": (("cubic_stiffness",), NODE, ()),
    "internal_damping": (("internal_damping", "shaft_damping"), STRETCH, ()),
    "external_damping": (("external_damping",), NODE, ()),
    "asymmetry": (("shaft_asymmetry",), STRETCH, ()),
    "swapped": (("swapped_probes",), NODE, ()),
    "reversed": (("reversed_probe",), NODE, ()),
    "phase_offset": (("phase_reference",), ANY, ()),
    "delay": (("delay",), ANY, ()),
    "angle_error": (("probe_error", "probe_angle"), NODE, ()),
    "gain": (("probe_error", "probe_gain"), NODE, ()),
    "runout": (("runout",), NODE, ()),
    "unloaded_zero": ((), ANY, ()),
}
# Truth -> further names that have the same forces, in part or as one of two causes. An effect is outside the library
# only if these are left out too: else the verdict names the same physics in other words.
ALIKE = {
    "couple_unbalance": ("unbalance",),  # two opposite ones in two planes
    # a notch is an asymmetry of its element, and the other way round; so is a coupling across it that is not isotropic
    "open_crack": ("angular_misalignment", "parallel_misalignment", "shaft_asymmetry"),
    "asymmetry": (*CRACKS, "angular_misalignment", "parallel_misalignment"),
    "misalignment": ("static_preload",),  # what a fixed offset of an isotropic coupling is
    # a stiffness lost along one direction, and a stop that gives it back on one side
    "looseness": ("rub",),
    "one_sided_loss": ("rub",),
    # a pedestal far below its resonance is a softer support
    "support_loss": ("support_stiffness", "pedestal_resonance"),
    "pedestal": ("bearing_coefficients", "support_anisotropy", "support_loss", "support_stiffness"),
    "seal": ("cross_coupling", "external_damping", "support_stiffness"),
    # its eccentricity, its weight, and its inertia (a fluid that does not turn)
    "added_mass": ("unbalance", "static_preload", "seal"),
    # opposite moments at the ends of a bent element, that turn with the shaft
    "bow": ("angular_misalignment", "parallel_misalignment"),
    "thermal_bow": ("angular_misalignment", "parallel_misalignment"),
    "preload": ("parallel_misalignment",),  # whose force has a constant part
    "external_damping": ("seal",),  # whose fluid does not turn
}
# Faults that the verdict states as a wrong convention of the records, by the words of that hypothesis
CONVENTIONS = {"unloaded_zero": "displacements count from the unloaded line"}
# Faults for which the records are refused, by the words of the finding after its node
REFUSED = {"swapped": "swapped probes", "reversed": "swapped probes"}
PAIRED = [name for name in FAMILIES if name != "healthy"]
KINDS = [*FAMILIES, *CHAIN_FAULTS, "pair", "outside"]  # outside: any family, with its effects left out of the library


# Truth -> {parameter of its effect: true value}, where both state the same number. Phases are those of the moment.
SIZES = {
    "unbalance": {"eccentricity_phase": "phase_rad"},
    "crack": {"position_m": "position_m", "depth_ratio": "depth_ratio", "angle_rad": "phase_rad"},
    "open_crack": {"position_m": "position_m", "depth_ratio": "depth_ratio", "angle_rad": "phase_rad"},
    "added_mass": {"added_mass": "mass_kg"},
    "preload": {"static_preload": "force_N", "static_preload_phase": "angle_rad"},
    "cubic_bearing": {"cubic_stiffness": "cubic_N_per_m3"},
    "external_damping": {"external_damping": "change_N_s_per_m"},
    "rub": {"rub_stiffness": "stiffness_N_per_m", "contact_angle_rad": "side_rad"},
    "looseness": {"stiffness_lost_in_lift": "loss_N_per_m"},
    "support_loss": {"support_stiffness_loss": "loss_N_per_m"},
    "seal": {"seal_damping": "damping_N_s_per_m", "seal_stiffness": "direct_N_per_m"},
}
INTERVAL = 1.96  # standard deviations of a 95 % interval
CRACK_ANGLE = np.deg2rad(10)  # error of the angle of a crack that is found


def in_library(family):
    """Whether the package has a candidate for a family."""
    zoo = registry().plugins["effect"]
    return family in CONVENTIONS or any(name in zoo and zoo[name].candidate for name in MEANS[family][0])


def left_out(true):
    """Effects without which the library lacks some true effects."""
    return sorted({name for one in true for name in MEANS[one["family"]][0] + ALIKE.get(one["family"], ())})


def is_there(rule, true, cause):
    """Whether the place of a cause is that of the truth."""
    where = cause.where
    if "position_m" in cause.parameters:
        where = {"element": int(np.searchsorted(true["nodes_m"], cause.parameters["position_m"].value))}
    if rule == ANY:
        return True
    if rule == NODE:
        return where.get("node", true["node"]) == true["node"]
    if rule == ELEMENT:  # within one, and at a node: next to it
        if "element" in where:
            return abs(where["element"] - true["element"]) <= 1
        return where.get("node") in (true["element"], true["element"] + 1)
    first, last = true["elements"][0], true["elements"][-1]
    place = where.get("element", where.get("node"))
    return place is None or (first <= where.get("last_element", place) and place <= last + ("node" in where))


def compared(true, cause):
    """Whether a cause has the name of a true effect, whether it is at its place too, and whether it is a companion."""
    names, rule, companions = MEANS[true["family"]]
    named = cause.effect in names
    return named, named and is_there(rule, true, cause), cause.effect in companions


def acting_as(case, one):
    """Family of an effect; that of a one-sided stiffness depends on where the shaft moves.

    Where it never leaves the soft side that is a linear loss, and where it stays beyond the gap a constant force.
    """
    if one["family"] != "looseness" and not one.get("one_sided"):
        return one["family"]
    at, direction = 4 * (one["node"] - 1), np.array([np.cos(one["angle_rad"]), np.sin(one["angle_rad"])])
    along = case.steady.displacement[:, :, at : at + 2] @ direction
    gap = one.get("gap_m", np.inf)
    if along.min() >= gap:
        return "preload"
    if along.min() >= 0 and along.max() <= gap:
        return "support_loss"
    return "looseness" if one["family"] == "looseness" else "one_sided_loss"


def truth_of(case, fault):
    """List of true effects: those of the machine, and the fault of the measuring chain."""
    true = [one | {"family": acting_as(case, one)} for one in case.effects if one["family"] != "healthy"]
    nodes = np.cumsum([0.0, *(element.length for element in case.rotor.elements)])
    for one in true:
        if "position_in_element" in one:
            first, last = nodes[one["element"] - 1 : one["element"] + 1]
            one["position_m"] = first + one["position_in_element"] * (last - first)
            one |= {"nodes_m": nodes.tolist(), "depth_ratio": one["depth_over_radius"] / 2}
    return true + ([{"family": fault, "node": case.truth["faulty_node"]}] if fault else [])


def change_of(case, harmonics):
    """What each effect alone changes of the measured harmonics (speed, harmonic, node), without noise, m."""

    def seen(steady, probes, chain, zero):
        return expected_harmonics(steady, case.nodes, probes, chain, harmonics, zero)

    sound = replace(case.chain, swapped=(), phase_offset=0.0, delay=0.0)
    good = {node: tuple(replace(p, gain=1.0, angle_error=0.0, reversed=False, runout={}) for p in pair)
            for node, pair in case.probes.items()}  # fmt: skip
    if case.truth["chain_fault"] is None:
        return [seen(one, good, sound, None) - seen(case.healthy, good, sound, None) for one in case.alone]
    return [seen(case.healthy, case.probes, case.chain, case.zero) - seen(case.healthy, good, sound, case.sag)]


def left_by_base(change, model, spectrum, settings):
    """Rms of the part of a change that base parameters and calibration cannot absorb, in standard deviations."""
    whole, prior = base_model(model, settings)
    base = fit(whole, spectrum, prior)
    known = np.vstack([base.jacobian, prior.whitener])
    change = np.concatenate([spectrum.whitened(change), np.zeros(len(prior.mean))])
    basis, _ = np.linalg.qr(known / np.linalg.norm(known, axis=0))
    left = change - basis @ (basis.T @ change)
    return float(np.sqrt(left @ left / spectrum.amplitude.size / 2))


def judged(case, true, verdict):
    """What is right about a verdict."""
    causes, others = (verdict.causes, verdict.ambiguous_with) if verdict.verdict in ("cause", "ambiguous") else ((), ())
    stated = [*causes, *others]
    fitting = stated or [*verdict.causes, *verdict.ambiguous_with]  # which may be another than the likely truth
    match = {id(cause): [compared(one, cause) for one in true] for cause in fitting}
    if verdict.measuring_chain is not None:
        said = verdict.measuring_chain.hypothesis
        right = len(true) == 1 and CONVENTIONS.get(true[0]["family"]) == said
        return {"verdict": "convention", "named": said, "stated": "", "alone": right, "in_set": right,
                "name_in_set": right, "wrong": not right, "probability": np.nan, "first_right": right,
                **held_out(None)}  # fmt: skip
    return {
        "verdict": verdict.verdict,
        "named": " + ".join(name_of(cause) for cause in verdict.causes),
        "stated": " | ".join(name_of(cause) for cause in others),
        "among_fitting": bool(true) and all(any(match[id(c)][i][1] for c in fitting) for i in range(len(true))),
        "alone": verdict.verdict == "cause"
        and all(any(match[id(c)][i][1] for c in causes) for i in range(len(true)))
        and all(any(there or beside for _, there, beside in match[id(c)]) for c in causes),
        "in_set": bool(true) and all(any(match[id(c)][i][1] for c in stated) for i in range(len(true))),
        "name_in_set": bool(true) and all(any(match[id(c)][i][0] for c in stated) for i in range(len(true))),
        "wrong": verdict.verdict == "cause"
        and any(not any(name or beside for name, _, beside in match[id(c)]) for c in causes),
        # posterior among the effects of the library, times the probability that the truth is one of those stated
        "probability": causes[0].posterior_probability * (1 - verdict.outside_probability) if causes else np.nan,
        "first_right": bool(causes) and any(there for _, there, _ in match[id(causes[0])]),
        **held_out(verdict.gain if causes else None),
    }


def held_out(gain):
    """Error at held-out speeds after over before, in m and in standard deviations; how probably noise makes it rise."""
    if gain is None:
        return {"gain": np.nan, "gain_sigma": np.nan, "rise_probability": np.nan}
    return {
        "gain": gain.ratio,
        "gain_sigma": gain.after_sigma / gain.before_sigma,
        "rise_probability": gain.rise_probability,
    }


def errors_of(true, causes):
    """(parameter, error, standard deviation) of every size that a named true effect states; angles in (-pi, pi]."""
    found = []
    for one in true:
        for cause in causes:
            for name, key in SIZES.get(one["family"], {}).items() if compared(one, cause)[1] else ():
                stated = cause.parameters.get(name)
                if stated is None or stated.std is None or key not in one:
                    continue
                error = stated.value - one[key]
                fold = 2 if one["family"] == "open_crack" else 1  # which faces either way
                error = np.angle(np.exp(1j * fold * error)) / fold if key.endswith("_rad") else error
                found.append((name, float(error), stated.std))
    return found


def sizes_judged(true, causes):
    """Number of sizes to compare, of 95 % intervals that hold theirs, and whether the angle of a crack is right."""
    errors = errors_of(true, causes)
    angles = [error for name, error, _ in errors if name == "angle_rad"]
    return {
        "sizes": len(errors),
        "covered": sum(abs(error) <= INTERVAL * std for _, error, std in errors),
        "angle_right": all(abs(error) <= CRACK_ANGLE for error in angles),
    }


def name_of(cause):
    """Effect and place in a few characters."""
    return cause.effect + "".join(f" {value}" for value in cause.where.values())


def drawn(seed, kind, quick):
    """A case of a kind: healthy, one family, a fault of the chain, a pair of families, or any family."""
    rng = np.random.default_rng([seed, 1])
    size = {"speeds": 6, "count": int(rng.integers(2, 6))} if quick else {}
    if kind == "pair":
        kind = "+".join(rng.choice(PAIRED, 2, replace=False))
    if kind == "outside":
        kind = str(rng.choice(PAIRED))
    if kind in CHAIN_FAULTS:
        return draw_case(seed, "healthy", chain_fault=kind, **size), kind
    return draw_case(seed, kind, visible=0.0 if kind == "healthy" else VISIBLE, **size), None


class Work(NamedTuple):
    """A case to be diagnosed.

    out           : folder of results
    rig_error     : of the rig file, 0: none, 1: as real ones have
    without_truth : whether the effects that are its truth are left out of the library
    """

    number: int
    seed: int
    kind: str
    out: Path
    rig_error: float
    quick: bool
    without_truth: bool


def run_case(work):
    """Row of one case."""
    seed, kind, quick = work.seed, work.kind, work.quick
    row = {"case": work.number, "seed": seed, "kind": kind}
    try:
        case, fault = drawn(seed, kind, quick)
    except (NoSteadyState, ValueError) as problem:
        return row | {"verdict": "not drawn", "named": str(problem)}
    true, outside = truth_of(case, fault), work.without_truth or kind == "outside"
    row |= {
        "families": "+".join(one["family"] for one in true),
        "mass_kg": case.rotor.mass,
        "elements": len(case.rotor.elements),
        "probed_nodes": len(case.nodes),
        "known": not outside and all(in_library(one["family"]) for one in true),
        "size": np.nan,
    }
    error = np.array([0.005, 0.02, 0.05]) * work.rig_error  # of modulus, bearings, unbalance
    folder = Path(work.out) / "cases" / f"{work.number:04d}"
    try:
        with tempfile.TemporaryDirectory() as files, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            write_case(case, files, *error, seed, QUICK if quick else None)
            start = time.process_time()
            rig = read_rig(Path(files) / "rig.yaml")
            spectrum, model, findings = measured_spectrum([Path(files) / "record.nc"], rig)
            settings = read_settings(rig.given, "rig.yaml")
            if outside:
                settings = settings.model_copy(update={"leave_out": left_out(true)})
            found = investigate(spectrum, model, settings=settings, findings=findings)
            seconds = time.process_time() - start
            folder.mkdir(parents=True, exist_ok=True)
            for name in ("rig.yaml", "truth.json"):
                shutil.copy(Path(files) / name, folder)
    except RotorstudyError as problem:
        right = fault in REFUSED and f"node {true[-1]['node']}: {REFUSED[fault]}" in str(problem)
        return row | {"verdict": "refused", "named": str(problem), "alone": right, "in_set": right, "wrong": False}
    except np.linalg.LinAlgError as problem:  # a defect of the package
        return row | {"verdict": "crashed", "named": str(problem), "alone": False, "in_set": False, "wrong": True}
    (folder / "verdict.json").write_text(found.verdict.model_dump_json(indent=1), encoding="utf-8")
    whole = with_model_error(spectrum, settings)
    sizes = [
        left_by_base(change, model, whole, settings) for change in (change_of(case, spectrum.harmonics) if true else [])
    ]
    right = judged(case, true, found.verdict)
    sized = sizes_judged(true, found.verdict.causes if right["alone"] else ())
    return row | right | sized | {
        "size": min(sizes, default=0.0),
        "p_before": found.verdict.residual_p_value.before,
        "p_after": found.verdict.residual_p_value.after,
        "residual_share": found.verdict.residual_share,
        "seconds": seconds,
    }  # fmt: skip


def main():
    """Draw, diagnose, score, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="number of the first case, to go on with a seed")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--families", nargs="+", choices=KINDS, default=KINDS, metavar="FAMILY")
    parser.add_argument("--out", type=Path, default=Path("foreign_cases"))
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--rig-error", type=float, default=1.0, help="0: the rig file is exact; 1: as real ones are")
    parser.add_argument("--quick", action="store_true", help="rotors of 2 to 5 elements, 6 speeds, harmonics to 3X")
    parser.add_argument("--without-truth", action="store_true", help="leave the effects that are the truth out")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    last = given.first + given.cases
    work = [
        Work(i, 100_000 * given.seed + i, kind, given.out, given.rig_error, given.quick, given.without_truth)
        for i, kind in zip(range(last), cycle(given.families))
        if i >= given.first
    ]
    rows = []
    with ProcessPoolExecutor(given.processes) as pool:
        for row in pool.map(run_case, work):
            rows.append(row)
            said = {
                key: row.get(key) for key in ("case", "kind", "size", "verdict", "named", "stated", "alone", "seconds")
            }
            print(json.dumps(said, default=str), flush=True)
            pd.DataFrame(rows).to_csv(given.out / "cases.csv", index=False)
    table = pd.DataFrame(rows)
    shares = summary(table)
    shares.to_csv(given.out / "summary.csv", index=False)
    with pd.option_context("display.width", 200, "display.max_columns", 30, "display.max_colwidth", 60):
        print(by_kind(table).to_string())
        print(shares.to_string(index=False, float_format=lambda value: f"{value:.3f}"))


if __name__ == "__main__":
    main()
