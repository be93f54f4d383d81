"""Cracks of the independent simulator (blind.machines), in millimetres: python benchmarks/cracks.py --cases 100

Random machines with one crack of 5 to 40 % of the diameter, or, every fifth, a slot that never closes, measured at
seven speeds in two planes with 1 % noise. The cracks are those of three-dimensional elasticity with unilateral contact,
but with fronts that the library does not have, arcs of a circle of any curvature, with a residual stress that opens or
closes them, and with a Poisson's ratio that the rig file does not state.

Each takes the way of a user: record and rig file on disk, spectrum, and `identify --cause transverse_crack`. One row a
case goes to `cracks.csv`, the shares with their 95 % bounds to `summary.csv`. A run can be done in parts: cases that
are in `cracks.csv` already are not repeated (another version of the package needs another folder).
"""

import argparse
import tempfile
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import many_cases
import numpy as np

from rotorstudy.blind.machines.cases import RUNOUT, draw_case, ordinary_probes, swing_of
from rotorstudy.blind.machines.cracks import CURVATURES, add_form, arc_form, static_moment
from rotorstudy.blind.machines.files import write_case
from rotorstudy.blind.machines.measuring import record
from rotorstudy.blind.machines.stepping import NoSteadyState
from rotorstudy.blind.run import read_case
from rotorstudy.diagnosis.one_cause.answer import interval_of
from rotorstudy.diagnosis.one_cause.identify import identify_cause
from rotorstudy.errors import RotorstudyError
from rotorstudy.units import HALF_INTERVAL

SLOTS = 5  # every fifth seed is a slot
SPEEDS, MOST_ELEMENTS, HARMONICS = 7, 8, list(range(-4, 5))
DEPTHS = (0.05, 0.4)  # over the diameter
CLOSING, POISSON = (-0.1, 0.1), (0.25, 0.33)  # residual moment that closes a crack over the static one; its ratio
NOISE = 0.01  # standard deviation of each sample over the rms of a channel
LAW = {"gradual": "gradual", "open": "none"}  # names of the simulator -> of the package
NAMES = ("position_m", "depth_ratio", "angle_rad")
DEPTH, PLACE, ANGLE = 0.15, 0.05, np.deg2rad(10)  # accepted errors: relative, of the length, rad
EXPLAINED = 1e-3  # p-value from which no warning is given
VISIBLE = 0.01  # change of a harmonic over 1X
BINS = (0.05, 0.1, 0.2, 0.3, 0.4)  # of the depth over the diameter


def drawn(seed, kind):
    """Case of a random machine with a `crack` that opens and closes, or a `slot` that never closes.

    The probes and the run-to-run scatter are of ordinary quality (`cases.draw_chain`), the noise is white.
    """
    family, rng = f"{kind} of any depth", np.random.default_rng([seed, 13])
    count, known = int(rng.integers(2, MOST_ELEMENTS + 1)), {family: cracked("gradual" if kind == "crack" else "open")}
    case = draw_case(seed, family, speeds=SPEEDS, count=count, known=known)
    first = int(rng.choice([disc.node for disc in case.rotor.discs]))
    nodes = sorted([first, int(rng.choice([node for node in range(case.rotor.nodes) if node != first]))])
    swing, angles = swing_of(case.healthy, nodes), [probe.angle for probe in next(iter(case.probes.values()))]
    probes = {node: ordinary_probes(rng, angles, swing * RUNOUT) for node in nodes}
    chain = replace(case.chain, noise=NOISE * swing / 2**0.5, coloured_noise=0.0, quantum=0.0)
    records = record(rng, case.steady, nodes, probes, chain, case.zero)
    return replace(case, nodes=nodes, probes=probes, chain=chain, records=records)


def cracked(law):
    """Family of machines with one crack, of a law of closing."""

    def family(draw):
        rng, element = draw.rng, draw.element()
        share, depth, curvature = (float(rng.uniform(*ends)) for ends in ((0.1, 0.9), DEPTHS, CURVATURES))
        angle, kind = draw.angle(), str(rng.choice([law]))
        part = draw.rotor.elements[element]
        position = float(draw.rotor.positions[element] + share * part.length)
        closing, poisson = (float(rng.uniform(*ends)) for ends in (CLOSING, POISSON))
        moment = closing * static_moment(draw.machine, position)
        form = arc_form(replace(part, poissons_ratio=poisson), depth, curvature, kind, moment)
        add_form(draw.machine, position, form, angle)
        return {"position_m": position, "depth_ratio": depth, "angle_rad": angle, "breathing": kind,
                "curvature": curvature, "closing": closing, "poisson": poisson, "element": element + 1}  # fmt: skip

    return family


def run_case(work):
    """Row of one case: seed, and crack or slot."""
    seed, kind = work
    row = {"kind": kind}
    try:
        case = drawn(seed, kind)
    except NoSteadyState as problem:
        return row | {"outcome": f"not drawn: {problem}"}
    true = {key: value for key, value in case.effects[0].items() if key != "family"} | {"length_m": case.rotor.length}
    row |= {f"true_{key}": value for key, value in true.items()}
    row |= {"elements": len(case.rotor.elements), "mass_kg": case.rotor.mass,
            "change": max(value for k, value in case.changed.items() if k != "0")}  # fmt: skip
    with tempfile.TemporaryDirectory() as files:
        write_case(case, files, seed=seed, harmonics=HARMONICS)
        try:
            spectrum, model, settings, _ = read_case(Path(files))
            row |= _identified(spectrum, model, settings, true)
        except (RotorstudyError, np.linalg.LinAlgError) as problem:
            return row | {"outcome": f"{type(problem).__name__}: {problem}"}
    return row | {"outcome": "done"}


def _identified(spectrum, model, settings, true):
    """What `identify --cause transverse_crack` finds."""
    start = time.process_time()
    found = identify_cause(spectrum, model, "transverse_crack", settings)
    row = {"seconds": time.process_time() - start, "breathing": found.cause.variant["breathing"]}
    row |= {"p_value": found.p_value, "law_right": found.cause.variant["breathing"] == LAW[true["breathing"]]}
    stated = [(one, _errors(one, true)) for one in (found.cause, *(other.cause for other in found.elsewhere))]
    row |= {"stated": len(stated), "stated_right": any(all(_right(errors, true)) for _, errors in stated)}
    row |= dict(zip(("place_right", "depth_right", "angle_right"), _right(stated[0][1], true), strict=True))
    for name in NAMES:
        row |= {name: found.cause.shape[name], f"{name}_std": found.cause.shape_std[name]}
        row |= {f"{name}_error": stated[0][1][name]}
        held = [abs(errors[name]) <= HALF_INTERVAL * one.shape_std[name] for one, errors in stated[1:]]
        low, high = interval_of(found, name)
        row[f"{name}_held"] = bool(low <= found.cause.shape[name] - stated[0][1][name] <= high or any(held))
    return row


def _errors(cause, true):
    """Found less true position (m), depth over the diameter, and angle (rad)."""
    turn = np.pi if true["breathing"] == "open" else 2 * np.pi  # a slot looks the same from both sides
    errors = {name: cause.shape[name] - true[name] for name in NAMES}
    errors["angle_rad"] = (errors["angle_rad"] + turn / 2) % turn - turn / 2
    return errors


def _right(errors, true):
    """Whether position, depth and angle are near enough."""
    accepted = PLACE * true["length_m"], DEPTH * true["depth_ratio"], ANGLE
    return [bool(abs(errors[name]) <= most) for name, most in zip(NAMES, accepted, strict=True)]


def summary(rows):
    """The shares that count, with 95 % bounds; cases that could not be drawn are left out."""
    rows = rows[~rows.outcome.str.startswith("not drawn")]
    right = rows[["place_right", "depth_right", "angle_right"]].fillna(False).astype(bool)  # wrong without an answer
    rows = rows.assign(all_right=right.all(axis=1), **right)
    cracks, slots, done = rows[rows.kind == "crack"], rows[rows.kind == "slot"], rows[rows.outcome == "done"]
    off = done.depth_ratio_error / done.true_depth_ratio
    answered = cracks[(cracks.outcome == "done") & (cracks.p_value >= EXPLAINED)]
    found = {
        "depth within 15 %, place within 5 %, angle within 10 degrees": cracks.all_right,
        "of the cracks that change a harmonic by 1 % of 1X or more": cracks.all_right[cracks.change >= VISIBLE],
        "of the answers without a warning": answered.all_right,
        "at the best place or another one stated": cracks.stated_right.fillna(False).astype(bool),
        "answers with another place beside the best": answered.stated > 1,
        "depth within 15 %": cracks.depth_right,
        "place within 5 % of the length": cracks.place_right,
        "angle within 10 degrees": cracks.angle_right,
        **{f"95 % intervals that hold {name}": done[f"{name}_held"].astype(bool) for name in NAMES},
        "the same of cracks, depth_ratio": done[done.kind == "crack"].depth_ratio_held.astype(bool),
        "error of the depth over it": off,
        "its size": off.abs(),
        "breathing law right": cracks.law_right.fillna(False).astype(bool),
        "slots said to open and close": slots.breathing.fillna("none") != "none",
        "seconds of one core for an identification": rows.seconds.dropna(),
    }
    for low, high in pairwise(BINS):
        here = cracks[(cracks.true_depth_ratio >= low) & (cracks.true_depth_ratio < high)]
        found[f"all three right, depth {100 * low:.0f} to {100 * high:.0f} %"] = here.all_right
    return many_cases.shares(found)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=50)
    parser.add_argument("--first", type=int, default=1, help="seed of the first case")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=np.inf, help="no case is begun later than that")
    parser.add_argument("--out", type=Path, default=Path("crack_cases"))
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.cases)
    cases = {seed: (seed, "crack" if seed % SLOTS else "slot") for seed in seeds}
    file = given.out / "cracks.csv"
    rows = many_cases.rows_of(run_case, cases, file, key="seed", processes=given.processes, minutes=given.minutes)
    if not (rows.outcome == "done").any():
        raise SystemExit(f"No case was answered; the reasons are in {file}")
    table = summary(rows)
    table.to_csv(given.out / "summary.csv", index=False)
    print(table.to_string(index=False))


if __name__ == "__main__":
    main()
