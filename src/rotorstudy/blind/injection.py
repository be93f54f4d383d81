"""Cases of a blind test: a record of the independent simulator with a hidden effect, its rig file, and the truth."""

from dataclasses import replace
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from rotorstudy.blind.machines.cases import CHAIN_FAULTS, draw_case
from rotorstudy.blind.machines.faults import FAMILIES
from rotorstudy.blind.machines.files import ERRORS, write_case
from rotorstudy.blind.machines.forms import FORMS
from rotorstudy.blind.machines.stepping import NoSteadyState
from rotorstudy.blind.meanings import MEANS, in_library, left_out
from rotorstudy.errors import RotorstudyError
from rotorstudy.inference.linear import marginal
from rotorstudy.inference.prediction import with_model_error
from rotorstudy.inference.prior import prior_of, with_usual
from rotorstudy.measurement.measurement import measured_spectrum
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import read_rig
from rotorstudy.model.rig_items import make_term
from rotorstudy.model.rig_numbers import with_numbers
from rotorstudy.response.measured import measured_response_and_jacobian

STREAM = 6  # separates the random numbers of blind tests from those of studies
VISIBLE = 0.01  # least change of a harmonic by an effect, over the healthy 1X; a smaller one is drawn again
SINGLE = [name for name in FAMILIES if name != "healthy"]
BESIDE_A_FORM = ("added_mass", "support_loss", "bow", "unbalance")
POINT_ROTORS = ("jeffcott", "offset_disc")  # without elements and bearings, which most families need
USUAL = {"model_floor": 2e-4, "covariance_error": 0.1}  # what a diagnosis assumes by default
MOST = 10**4.5  # standard deviations that a change beside another one, of unknown size, may have in all
TRIES = 15  # draws of a case until its size is in the range asked for
FEWER, MORE = 0.4, 2.5  # times the severity of the next draw after one too large, too small


class Order(NamedTuple):
    """What is to be drawn; pairs are fewest and most, or smallest and largest; None: the default of the simulator."""

    number: int
    seed: object
    kind: str  # see KINDS_OF_CASES
    machines: dict = {"any": 1.0}  # shares of `machines.draw.MACHINES`
    elements: tuple | None = None
    speeds: tuple = (8, 8)
    harmonics: tuple | None = None
    sizes: tuple = (0.0, np.inf)
    rig_error: float = 1.0  # over the usual


def _one_of(names):
    return lambda rng: str(rng.choice(names))


def _two_of(names):
    return lambda rng: "+".join(rng.choice(names, 2, replace=False))


def _form_and_another(rng):
    crack = rng.random() < 0.7
    form = "crack_form" if crack else rng.choice([name for name in FORMS if in_library(name)])
    return f"{form}+{rng.choice(BESIDE_A_FORM)}"


# Kind of case -> function of a generator that gives the families of its faults, joined by "+"
KINDS_OF_CASES = {
    "clean": lambda rng: "healthy",
    "single": _one_of(SINGLE),
    "form": _one_of(list(FORMS)),
    "two": lambda rng: _form_and_another(rng) if rng.random() < 0.5 else _two_of(SINGLE)(rng),
    "chain": _one_of(CHAIN_FAULTS),
    "outside": _one_of([*SINGLE, *FORMS]),
    "pair": _two_of(SINGLE),
    "form_pair": _form_and_another,
    "form_outside": _one_of(list(FORMS)),
    "home": _one_of([*SINGLE, *CHAIN_FAULTS]),
} | {name: (lambda rng, name=name: name) for name in (*FAMILIES, *CHAIN_FAULTS, *FORMS)}


def order_of(config, seed, number):
    """The Order of a case of a BlindConfig by its number."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAM, number)))
    kind = str(rng.choice(list(config.shares), p=list(config.shares.values())))
    entropy = tuple(int(word) for word in rng.integers(2**32, size=4))
    return Order(number, entropy, kind, config.machines, config.elements, config.speeds, tuple(config.harmonics),
                 config.size, config.rig_error)  # fmt: skip


def draw(order, folder):
    """Write record and rig file of an Order to a folder; the truth, plain numbers and strings."""
    problem, severity = None, 1.0
    for attempt in range(TRIES):
        try:
            case, kind, fault = _drawn(order, attempt, severity)
        except NoSteadyState as error:
            problem = error
            continue
        harmonics = order.harmonics
        if case.rotor.films:  # the mean position of a journal is no displacement of the model
            harmonics = [n for n in harmonics or range(-5, 6) if n]
        write_case(case, folder, ERRORS * order.rig_error, order.seed, harmonics)
        true, (low, high) = truth_of(case, fault), order.sizes
        sizes = _sizes(case, true, folder)
        size = sizes["size"]
        if not true or size is None or low <= size <= high:
            return _truth(order, case, kind, fault, true) | sizes
        severity *= MORE if size < low else FEWER
        problem = f"the last had size {size:.3g}, of {low:g} to {high:g} asked for"
    raise RotorstudyError(f"case {order.number}, {order.kind}: {TRIES} draws failed: {problem}")


def _drawn(order, attempt, severity):
    """A case of the simulator, its kind as drawn and its fault of the measuring chain."""
    seed = [*np.atleast_1d(order.seed).tolist(), attempt]
    rng, kind = np.random.default_rng([*seed, 1]), order.kind
    speeds = int(rng.integers(order.speeds[0], order.speeds[1] + 1))
    family = KINDS_OF_CASES[kind](rng)
    fault, family = (family, "healthy") if family in CHAIN_FAULTS else (None, family)
    anywhere = family == "healthy" or family in FORMS
    left_out = () if anywhere else POINT_ROTORS
    left_out = left_out if anywhere and not fault else (*left_out, "films")
    names = [name for name in order.machines if name not in left_out]
    shares = np.array([order.machines[name] for name in names])
    machine = str(rng.choice(names, p=shares / shares.sum()))
    size = {"machine": machine, "speeds": speeds, "severity": severity * 10 ** rng.uniform(-0.7, 0.5)}
    if machine == "any" and order.elements:
        size["count"] = int(rng.integers(order.elements[0], order.elements[1] + 1))
    case = draw_case(seed, family, visible=0.0 if family == "healthy" else VISIBLE, chain_fault=fault, **size)
    return case, fault or family if kind == "home" else kind, fault


def _sizes(case, true, folder):
    """Size, None of refused records, size beside another effect, and harmonics without noise, m, in plain numbers."""
    rig = read_rig(folder / "rig.yaml")
    try:
        spectrum, model, _ = measured_spectrum([folder / "record.nc"], rig)
    except RotorstudyError:
        return {"size": None, "beside": None}
    shown = case.shown(case.steady, spectrum.harmonics)  # (speed, harmonic, node)
    found = {"size": 0.0, "beside": None, "without_noise": [shown.real.tolist(), shown.imag.tolist()]}
    if not true:
        return found
    stated = rig.given["diagnosis"]
    spectrum = with_model_error(spectrum, SimpleNamespace(model_error=stated["model_error"], **USUAL))
    columns = absorbed(spectrum, model, stated)
    found["size"] = min(left_by_base(change, spectrum, columns) for change in change_of(case, spectrum.harmonics))
    if len(true) > 1:
        found["beside"] = _size_beside(case, true, spectrum, columns)
    return found


def _truth(order, case, kind, fault, true):
    known = "outside" not in kind and all(in_library(one["family"]) for one in true)
    seed = [int(one) for one in np.atleast_1d(order.seed)]
    return {
        "case": order.number, "seed": seed[0] if len(seed) == 1 else seed, "kind": kind, "fault": fault, "true": true,
        "families": "+".join(one["family"] for one in true), "machine": case.machine,
        "speeds_rad_per_s": case.steady.speed.tolist(), "mass_kg": float(case.rotor.mass),
        "elements": len(case.rotor.elements), "probed_nodes": len(case.nodes), "known": known,
        "leave_out": [] if known else left_out(true),
    }  # fmt: skip


def truth_of(case, fault):
    """List of true effects: those of the machine, and the fault of the measuring chain, as plain numbers."""
    true = [one | {"family": _acting_as(case, one)} for one in case.effects if one["family"] != "healthy"]
    true += [{"family": fault, "node": case.faulty_node}] if fault else []
    return [{key: v.item() if isinstance(v, np.generic) else v for key, v in one.items()} for one in true]


def _acting_as(case, one):
    """Family of an effect; a one-sided stiffness is a linear loss on its soft side, a constant force beyond its gap."""
    if one["family"] not in ("looseness", "looseness_form") and not one.get("one_sided"):
        return one["family"]
    at, direction = 4 * (one["node"] - 1), np.array([np.cos(one["angle_rad"]), np.sin(one["angle_rad"])])
    along = case.steady.displacement[:, :, at : at + 2] @ direction - one.get("start_m", 0.0)
    gap, corner = one.get("gap_m", np.inf), 3 * one.get("width_m", 0.0)  # smooth: linear beyond three widths
    if along.min() >= gap + corner:
        return "preload"
    if along.min() >= corner and along.max() <= gap - corner:
        return "support_loss"
    return "one_sided_loss" if one.get("one_sided") else one["family"]


def change_of(case, harmonics):
    """What each effect alone changes of the measured harmonics (speed, harmonic, node), without noise, m."""
    sound, healthy = case.sound(), case.healthy
    if case.fault is None:
        return [sound.shown(one, harmonics) - sound.shown(healthy, harmonics) for one in case.alone]
    return [case.shown(healthy, harmonics) - replace(sound, zero=case.sag).shown(healthy, harmonics)]


def _size_beside(case, true, spectrum, columns):
    """Size of the smaller effect of a pair where the other is there too and of unknown size; 0 if a part of it."""
    motions, sound = (case.healthy, case.steady, *case.alone[::-1]), case.sound()
    healthy, both, *others = (sound.shown(motion, spectrum.harmonics) for motion in motions)
    sizes = []
    for one, other, of_other in zip(true, true[::-1], others, strict=True):
        part = set(MEANS[one["family"]].names) & set(MEANS[other["family"]].beside)
        is_part = bool(part) and one["node"] == other["node"]
        sizes.append(0.0 if is_part else left_by_base(both - of_other, spectrum, columns, of_other - healthy))
    return min(sizes)


def absorbed(spectrum, model, stated):
    """What base parameters and calibration change by one standard deviation each, (data, parameter), whitened."""
    calibration = [
        make_term("effect", {"kind": kind, "label": f"{kind} {i}", **place}, model.structure, model.sensors)
        for kind in stated["nuisance"]
        for i, place in enumerate(registry().get("effect", kind).places(model.structure, model.sensors))
    ]
    uncertainty = with_usual(stated["uncertainty"], model)
    model = with_numbers(model, uncertainty)
    prior = prior_of(model, uncertainty)
    std = dict(zip(prior.names, prior.std, strict=True))
    std |= {u.name: stated["nuisance"][term.kind] for term in calibration for u in term.unknowns}
    whole = model.plus(*calibration)
    theta = np.nan_to_num(whole.stated)
    _, columns = measured_response_and_jacobian(whole, spectrum.speed, spectrum.harmonics, theta)
    columns = columns * np.array([std.get(name, 0.0) for name in whole.names])  # 0: known exactly
    return spectrum.whitened(np.moveaxis(columns, -1, 0)).T


def left_by_base(change, spectrum, columns, beside=None):
    """Rms, in standard deviations, of what `absorbed` and a change `beside` of unknown size leave of a change, m."""
    change = spectrum.whitened(change)
    if beside is not None:
        beside = spectrum.whitened(beside)
        columns = np.column_stack([columns, MOST * beside / max(np.linalg.norm(beside), 1e-150)])
    return float(np.sqrt(marginal(columns, change)[0] / len(change)))
