"""What the faults of the independent simulator are called in the library, and where they must be found."""

from typing import NamedTuple

import numpy as np

from rotorstudy.model.registry import registry

CRACKS = ("transverse_crack", "breathing_crack", "breathing_crack_weight")
CONTACTS = ("rub", "looseness", "support_clearance", "cubic_stiffness")  # near forms of each other at a support
COUPLINGS = ("parallel_misalignment", "angular_misalignment")
NODE, ELEMENT, STRETCH, NEAR, ANY = "node", "element", "stretch", "near", "any"
PLACE = 0.05  # error of the place of a crack of any form, of the length of the shaft


class Meaning(NamedTuple):
    """A family in the library.

    names      : effects that are this one; only exact physical equivalents
    place      : where they must be
    beside     : names that may stand beside them because they are part of the same truth
    alike      : further names that have the same forces, in part or as one of two causes. An effect is outside the
                 library only if these are left out too: else the verdict names the same physics in other words
    sizes      : {parameter of the effect: value of the truth}, where both state the same number; phases are those of
                 the moment
    convention : words of the hypothesis by which the verdict states it as a wrong convention of the records
    """

    names: tuple
    place: str = NODE
    beside: tuple = ()
    alike: tuple = ()
    sizes: dict = {}
    convention: str | None = None


OF_A_CRACK = {"position_m": "position_m", "depth_ratio": "depth_ratio", "angle_rad": "phase_rad"}
OF_A_FORM = {"position_m": "position_m", "angle_rad": "phase_rad", "crack_angle_rad": "phase_rad"}
# a notch is an asymmetry of its element, and the other way round; so is a coupling across it that is not isotropic
SLOT = Meaning(CRACKS, ELEMENT, (), (*COUPLINGS, "shaft_asymmetry"), OF_A_CRACK)
# a fixed offset of an isotropic coupling is a constant force, its 2X a rotating stiffness: both may be named
COUPLING = Meaning(COUPLINGS, NODE, ("static_preload",), ("static_preload",))
# a stiffness lost along one direction, and a stop that gives it back on one side
LOOSE = Meaning(("looseness",), NODE, (), CONTACTS, {"stiffness_lost_in_lift": "loss_N_per_m"})
# a linear loss along one direction is a change of the four stiffnesses, and half isotropic, half anisotropic; a
# pedestal far below its resonance is a softer support
LOSS = Meaning(("support_loss", "bearing_coefficients", "support_anisotropy"), NODE, ("support_stiffness",),
               ("support_stiffness", "pedestal_resonance"), {"support_stiffness_loss": "loss_N_per_m"})  # fmt: skip
# a bow is a shape along the whole shaft, and the place says only by which of the library's shapes it is described;
# opposite moments at the ends of a bent element turn with the shaft
BOW = Meaning(("bow",), ANY, (), COUPLINGS)
OF_A_SUPPORT = (*CONTACTS, *LOSS.alike, *LOSS.names)

MEANS = {
    "unbalance": Meaning(("unbalance",), sizes={"eccentricity_phase": "phase_rad"}),
    # two opposite ones in two planes; and a bend s of the shaft that inclines the disc without moving a node: in the
    # frame that follows it, z = y + s e^{jwt}, the shaft is straight and every mass has the unbalance of s, which is
    # the couple (I_d - I_p) s' of that disc, and no probe sees s. Exact but for the mass of the shaft: on a rotor with
    # its disc between two elements a bend of both is a couple to 0.3 %
    "couple_unbalance": Meaning(("couple_unbalance",), alike=("unbalance", "bow")),
    "crack": SLOT._replace(alike=()),  # the breathing law is its shape, not its name
    "open_crack": SLOT,
    "misalignment": COUPLING,
    "rub": Meaning(("rub",), sizes={"rub_stiffness": "stiffness_N_per_m", "contact_angle_rad": "side_rad"}),
    "looseness": LOOSE,
    "support_loss": LOSS,
    # one that gives way to one side of the unloaded position is a looseness there
    "one_sided_loss": LOOSE._replace(sizes={}),
    "pedestal": Meaning(("pedestal_resonance",), alike=("bearing_coefficients", "support_anisotropy", "support_loss",
                                                        "support_stiffness")),
    # with the direct stiffness of an isotropic coupling; of the same swirl at all speeds it is a cross coupling with
    # damping
    "seal": Meaning(("seal",), NODE, ("support_stiffness", "cross_coupling", "external_damping"),
                    ("cross_coupling", "external_damping", "support_stiffness", "parallel_misalignment"),
                    {"seal_damping": "damping_N_s_per_m", "seal_stiffness": "direct_N_per_m"}),
    # an eccentric mass is an unbalance at its node, too; its weight; and its inertia (a fluid that does not turn)
    "added_mass": Meaning(("added_mass",), NODE, ("unbalance",), ("unbalance", "static_preload", "seal"),
                          {"added_mass": "mass_kg"}),
    "bow": BOW,
    "thermal_bow": BOW,
    "preload": Meaning(("static_preload",), alike=("parallel_misalignment",),  # whose force has a constant part
                       sizes={"static_preload": "force_N", "static_preload_phase": "angle_rad"}),
    "cubic_bearing": Meaning(("cubic_stiffness",), sizes={"cubic_stiffness": "cubic_N_per_m3"}),
    "internal_damping": Meaning(("internal_damping", "shaft_damping"), STRETCH),
    "external_damping": Meaning(("external_damping",), alike=("seal",),  # whose fluid does not turn
                                sizes={"external_damping": "change_N_s_per_m"}),
    "asymmetry": Meaning(("shaft_asymmetry",), STRETCH, (), (*CRACKS, *COUPLINGS)),
    # the same of other forms
    "crack_form": Meaning(CRACKS, NEAR, (), ("shaft_asymmetry",), OF_A_FORM),
    "open_crack_form": SLOT._replace(place=NEAR, sizes=OF_A_FORM),
    "looseness_form": Meaning(("looseness",), alike=OF_A_SUPPORT),
    "clearance_form": Meaning(("support_clearance", "looseness", "cubic_stiffness"), alike=OF_A_SUPPORT),
    "stiffening_form": Meaning(("cubic_stiffness",), alike=OF_A_SUPPORT),
    "rub_form": Meaning(("rub",), alike=CONTACTS),
    "coupling_form": COUPLING,
    "dry_friction_form": Meaning((), ANY, (), ("external_damping", "bearing_coefficients")),
    # of the measuring chain
    "swapped": Meaning(("swapped_probes",)),
    "reversed": Meaning(("reversed_probe",)),
    "phase_offset": Meaning(("phase_reference",), ANY),
    "delay": Meaning(("delay",), ANY),
    "angle_error": Meaning(("probe_error", "probe_angle")),
    "gain": Meaning(("probe_error", "probe_gain")),
    "runout": Meaning(("runout",)),
    "unloaded_zero": Meaning((), ANY, convention="displacements count from the unloaded line"),
}  # fmt: skip
# Faults for which the records are refused, by the words of the finding after its node, or where no other is probed
REFUSED, SWAPPED, ALL_SWAPPED = ("swapped", "reversed"), "swapped probes", "the probes of all nodes swapped or of the"


def in_library(family):
    """Whether the package has a candidate for a family."""
    zoo, one = registry().plugins["effect"], MEANS[family]
    return one.convention is not None or any(name in zoo and zoo[name].candidate for name in one.names)


def left_out(true):
    """Effects without which the library lacks some true effects."""
    meant = [MEANS[one["family"]] for one in true]
    return sorted({name for one in meant for name in one.names + one.alike} & set(registry().plugins["effect"]))


def compared(true, cause):
    """Whether a cause has the name of a true effect, whether it is at its place too, and whether it is a companion."""
    meant = MEANS[true["family"]]
    named = cause["effect"] in meant.names
    return named, named and _is_there(meant.place, true, cause), cause["effect"] in meant.beside


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
