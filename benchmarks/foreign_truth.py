"""The truth of a case of benchmarks/foreign.py, its size in the records, and what is right about a verdict."""

from dataclasses import replace
from inspect import signature

import numpy as np

from rotorstudy.blind.machines.measuring import expected_harmonics
from rotorstudy.diagnosis.search.search import base_model
from rotorstudy.inference.fit import fit
from rotorstudy.model.depth import compliance
from rotorstudy.model.registry import registry

CRACKS = ("transverse_crack", "breathing_crack", "breathing_crack_weight")
NODE, ELEMENT, STRETCH, NEAR, ANY = "node", "element", "stretch", "near", "any"

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
    "softer_support": (("support_stiffness", "bearing_coefficients"), NODE, ()),
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
    # the same of other forms
    "crack_form": (CRACKS, NEAR, ()),
    "open_crack_form": (CRACKS, NEAR, ()),
    "looseness_form": (("looseness",), NODE, ()),
    "clearance_form": (("looseness", "cubic_stiffness"), NODE, ()),
    "stiffening_form": (("cubic_stiffness",), NODE, ()),
    "rub_form": (("rub",), NODE, ()),
    "coupling_form": (("parallel_misalignment", "angular_misalignment"), NODE, ("static_preload",)),
    "dry_friction_form": ((), ANY, ()),
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
    # two opposite ones in two planes; and a bend s of the shaft that inclines the disc without moving a node: in the
    # frame that follows it, z = y + s e^{jwt}, the shaft is straight and every mass has the unbalance of s, which is
    # the couple (I_d - I_p) s' of that disc, and no probe sees s. Exact but for the mass of the shaft: on a rotor with
    # its disc between two elements a bend of both is a couple to 0.3 %
    "couple_unbalance": ("unbalance", "bow"),
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
    # and the direct stiffness is that of an isotropic coupling
    "seal": ("cross_coupling", "external_damping", "support_stiffness", "parallel_misalignment"),
    # its eccentricity, its weight, and its inertia (a fluid that does not turn)
    "added_mass": ("unbalance", "static_preload", "seal"),
    # opposite moments at the ends of a bent element, that turn with the shaft
    "bow": ("angular_misalignment", "parallel_misalignment"),
    "thermal_bow": ("angular_misalignment", "parallel_misalignment"),
    "preload": ("parallel_misalignment",),  # whose force has a constant part
    "external_damping": ("seal",),  # whose fluid does not turn
}
ALIKE |= {
    "crack_form": ("shaft_asymmetry",),
    "open_crack_form": ALIKE["open_crack"],
    "looseness_form": ("rub", "cubic_stiffness", *ALIKE["support_loss"], *MEANS["support_loss"][0]),
    "clearance_form": ("rub", *ALIKE["support_loss"], *MEANS["support_loss"][0]),
    "stiffening_form": ("rub", "looseness", *ALIKE["support_loss"], *MEANS["support_loss"][0]),
    "rub_form": ("looseness", "cubic_stiffness"),
    "coupling_form": ALIKE["misalignment"],
    "dry_friction_form": ("external_damping", "bearing_coefficients"),
}
# Faults that the verdict states as a wrong convention of the records, by the words of that hypothesis
CONVENTIONS = {"unloaded_zero": "displacements count from the unloaded line"}
# Faults for which the records are refused, by the words of the finding after its node
REFUSED = {"swapped": "swapped probes", "reversed": "swapped probes"}


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
DEPTHS = np.linspace(0.01, 0.5, 99)  # over the diameter, between which depths are interpolated
INTERVAL = 1.96  # standard deviations of a 95 % interval
PLACE = 0.05  # error of the place of a crack of any form, of the length of the shaft
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
    if rule == NEAR and "position_m" in cause.parameters:
        off = abs(cause.parameters["position_m"].value - true["position_m"]) - true["softened_m"] / 2
        return off <= PLACE * true["length_m"]
    if rule == NEAR and "element" not in true:  # a rotor with one node
        return True
    if rule == NODE:
        return where.get("node", true["node"]) == true["node"]
    if rule in (ELEMENT, NEAR):  # within one, and at a node: next to it
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
    if one["family"] not in ("looseness", "looseness_form") and not one.get("one_sided"):
        return one["family"]
    at, direction = 4 * (one["node"] - 1), np.array([np.cos(one["angle_rad"]), np.sin(one["angle_rad"])])
    along = case.steady.displacement[:, :, at : at + 2] @ direction
    if one["family"] == "looseness_form":  # smooth: linear beyond three widths of its corners
        along, edge = along - one["start_m"], 3 * one["width_m"]
        if along.min() >= one["gap_m"] + edge:
            return "preload"
        return "support_loss" if edge <= along.min() <= along.max() <= one["gap_m"] - edge else "looseness_form"
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
        if "softened_m" in one:
            one |= {"nodes_m": nodes.tolist(), "length_m": case.rotor.length}
            one["depth_ratio"] = depth_of(case.rotor, one["across_rad_per_N_m"])
    return true + ([{"family": fault, "node": case.truth["faulty_node"]}] if fault else [])


def depth_of(rotor, across):
    """Depth over the diameter of a straight crack with a flexibility across its front, rad/(N m), by the library."""
    return float(np.interp(np.log(across), _log_flexibility(rotor.diameter, rotor.youngs_modulus), DEPTHS))


def _log_flexibility(diameter, modulus, depths=None):
    kind = signature(registry().get("effect", "transverse_crack").function).parameters["flexibility"].default
    plugin = registry().get("depth", kind)
    shaft = {"diameter_m": diameter, "youngs_modulus_Pa": modulus}
    depths = DEPTHS if depths is None else depths
    return np.log([compliance(plugin, depth, **shaft)[0] for depth in depths])


def crack_judged(case, true, causes):
    """Errors of the first crack among some causes: place (of the length), angle (degrees), flexibility (relative).

    The flexibility across its front is that of its depth, by the library, times its factor; `held` says whether the
    95 % interval of both holds the true one.
    """
    nothing = dict.fromkeys(("place_error", "angle_error_deg", "flexibility_error", "flexibility_held"), np.nan)
    for one in true:
        if one["family"] not in ("crack_form", "open_crack_form"):
            continue
        fold = 2 if one["family"] == "open_crack_form" else 1
        for cause in causes:
            stated = cause.parameters
            angle = stated.get("angle_rad", stated.get("crack_angle_rad"))
            if cause.effect not in CRACKS or angle is None:
                continue
            off = np.angle(np.exp(1j * fold * (angle.value - one["phase_rad"]))) / fold
            found = nothing | {"angle_error_deg": float(np.rad2deg(off))}
            if "position_m" in stated:
                found["place_error"] = abs(stated["position_m"].value - one["position_m"]) / one["length_m"]
            if "depth_ratio" in stated and "flexibility_factor" in stated:
                depth, factor = stated["depth_ratio"], stated["flexibility_factor"]
                near = [depth.value, *np.clip(depth.value * np.array([0.99, 1.01]), *DEPTHS[[0, -1]])]
                at, low, high = _log_flexibility(case["diameter_m"], case["youngs_modulus_Pa"], near)
                std = (high - low) / (near[2] - near[1]) * (depth.std or 0)
                std = np.hypot(std, (factor.std or 0) / factor.value) if factor.value > 0 else np.nan
                error = at + np.log(abs(factor.value)) - np.log(one["across_rad_per_N_m"])
                found |= {"flexibility_error": np.expm1(error), "flexibility_held": float(abs(error) <= INTERVAL * std)}
            return found
    return nothing


def seen(case, steady, harmonics):
    """Measured harmonics (speed, harmonic, node) of a motion by the probes of a case without gross faults, m."""
    sound = replace(case.chain, swapped=(), phase_offset=0.0, delay=0.0)
    return expected_harmonics(steady, case.nodes, _good(case.probes), sound, harmonics, None)


def _good(probes):
    return {
        node: tuple(replace(p, gain=1.0, angle_error=0.0, reversed=False, runout={}) for p in pair)
        for node, pair in probes.items()
    }


def change_of(case, harmonics):
    """What each effect alone changes of the measured harmonics (speed, harmonic, node), without noise, m."""
    if case.truth["chain_fault"] is None:
        return [seen(case, one, harmonics) - seen(case, case.healthy, harmonics) for one in case.alone]
    sound = replace(case.chain, swapped=(), phase_offset=0.0, delay=0.0)
    probes = (case.probes, case.chain, case.zero), (_good(case.probes), sound, case.sag)
    shown, right = (
        expected_harmonics(case.healthy, case.nodes, pair, chain, harmonics, zero) for pair, chain, zero in probes
    )
    return [shown - right]


def left_by_base(change, model, spectrum, settings, beside=None):
    """Rms of the part of a change that base parameters and calibration cannot absorb, in standard deviations.

    beside : another change, of unknown size, that may absorb it too
    """
    whole, prior = base_model(model, settings)
    base = fit(whole, spectrum, prior)
    known = np.vstack([base.jacobian, prior.whitener])
    none = np.zeros(len(prior.mean))
    if beside is not None:
        known = np.column_stack([known, np.concatenate([spectrum.whitened(beside), none])])
    change = np.concatenate([spectrum.whitened(change), none])
    basis, _ = np.linalg.qr(known / np.linalg.norm(known, axis=0))
    left = change - basis @ (basis.T @ change)
    return float(np.sqrt(left @ left / spectrum.amplitude.size / 2))


def size_beside(case, true, model, spectrum, settings):
    """Size of the smaller effect of a pair where the other one is there too and of unknown size; 0 if a part of it.

    An effect may be large by itself, and yet not be seen: a rub of a shaft that a seal keeps away from the stator.
    """
    both = seen(case, case.steady, spectrum.harmonics)
    sizes = []
    for one, other, alone in zip(true, true[::-1], case.alone[::-1], strict=True):
        of_other = seen(case, alone, spectrum.harmonics)
        beside = of_other - seen(case, case.healthy, spectrum.harmonics)
        is_part = bool(set(MEANS[one["family"]][0]) & set(MEANS[other["family"]][2])) and one["node"] == other["node"]
        sizes.append(0.0 if is_part else left_by_base(both - of_other, model, spectrum, settings, beside))
    return min(sizes)


def judged(true, verdict):
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
