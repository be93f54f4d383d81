"""What the faults of the independent simulator are called in the library, and where they must be found."""

import numpy as np

from rotorstudy.model.registry import registry

CRACKS = ("transverse_crack", "breathing_crack", "breathing_crack_weight")
CONTACTS = ("rub", "looseness", "support_clearance", "cubic_stiffness")  # near forms of each other at a support
NODE, ELEMENT, STRETCH, NEAR, ANY = "node", "element", "stretch", "near", "any"
PLACE = 0.05  # error of the place of a crack of any form, of the length of the shaft

# Family -> names of the library that are this effect, where they must be, and names that may stand beside them because
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
    "clearance_form": (("support_clearance", "looseness", "cubic_stiffness"), NODE, ()),
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
    "looseness": CONTACTS,
    "one_sided_loss": CONTACTS,
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
OF_A_SUPPORT = (*CONTACTS, *ALIKE["support_loss"], *MEANS["support_loss"][0])
ALIKE |= {
    "crack_form": ("shaft_asymmetry",),
    "open_crack_form": ALIKE["open_crack"],
    "looseness_form": OF_A_SUPPORT,
    "clearance_form": OF_A_SUPPORT,
    "stiffening_form": OF_A_SUPPORT,
    "rub_form": CONTACTS,
    "coupling_form": ALIKE["misalignment"],
    "dry_friction_form": ("external_damping", "bearing_coefficients"),
}
# Faults that the verdict states as a wrong convention of the records, by the words of that hypothesis
CONVENTIONS = {"unloaded_zero": "displacements count from the unloaded line"}
# Faults for which the records are refused, by the words of the finding after its node, or where no other is probed
REFUSED, SWAPPED, ALL_SWAPPED = ("swapped", "reversed"), "swapped probes", "the probes of all nodes swapped or of the"


OF_A_CRACK = {"position_m": "position_m", "depth_ratio": "depth_ratio", "angle_rad": "phase_rad"}
OF_A_FORM = {"position_m": "position_m", "angle_rad": "phase_rad", "crack_angle_rad": "phase_rad"}
# Truth -> {parameter of its effect: true value}, where both state the same number. Phases are those of the moment.
SIZES = {
    "unbalance": {"eccentricity_phase": "phase_rad"},
    "crack": OF_A_CRACK,
    "open_crack": OF_A_CRACK,
    "crack_form": OF_A_FORM,
    "open_crack_form": OF_A_FORM,
    "added_mass": {"added_mass": "mass_kg"},
    "preload": {"static_preload": "force_N", "static_preload_phase": "angle_rad"},
    "cubic_bearing": {"cubic_stiffness": "cubic_N_per_m3"},
    "external_damping": {"external_damping": "change_N_s_per_m"},
    "rub": {"rub_stiffness": "stiffness_N_per_m", "contact_angle_rad": "side_rad"},
    "looseness": {"stiffness_lost_in_lift": "loss_N_per_m"},
    "support_loss": {"support_stiffness_loss": "loss_N_per_m"},
    "seal": {"seal_damping": "damping_N_s_per_m", "seal_stiffness": "direct_N_per_m"},
}


def in_library(family):
    """Whether the package has a candidate for a family."""
    zoo = registry().plugins["effect"]
    return family in CONVENTIONS or any(name in zoo and zoo[name].candidate for name in MEANS[family][0])


def left_out(true):
    """Effects without which the library lacks some true effects."""
    zoo = registry().plugins["effect"]
    named = {name for one in true for name in MEANS[one["family"]][0] + ALIKE.get(one["family"], ())}
    return sorted(named & set(zoo))


def compared(true, cause):
    """Whether a cause has the name of a true effect, whether it is at its place too, and whether it is a companion."""
    names, rule, companions = MEANS[true["family"]]
    named = cause["effect"] in names
    return named, named and _is_there(rule, true, cause), cause["effect"] in companions


def _is_there(rule, true, cause):
    """Whether the place of a cause is that of the truth."""
    where = cause.get("where") or {}
    position = cause.get("parameters", {}).get("position_m", {}).get("value")
    if rule == ANY:
        return True
    if rule == NEAR and "element" not in true:  # a rotor with one node: one probe shows little of the place
        return True
    if rule == NEAR and position is not None:
        return abs(position - true["position_m"]) - true["softened_m"] / 2 <= PLACE * true["length_m"]
    if rule == NODE:
        return where.get("node", true["node"]) == true["node"]
    if position is not None:
        where = {"element": int(np.searchsorted(true["nodes_m"], position))}
    if rule in (ELEMENT, NEAR):  # within one, and at a node: next to it
        if "element" in where:
            return abs(where["element"] - true["element"]) <= 1
        return where.get("node") in (true["element"], true["element"] + 1)
    first, last = true["elements"][0], true["elements"][-1]
    place = where.get("element", where.get("node"))
    return place is None or (first <= where.get("last_element", place) and place <= last + ("node" in where))
