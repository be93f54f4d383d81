"""A rotor saved by ROSS (its .toml or .json, versions 1.5 to 2.3) as the sections of a rig.

ROSS has x to the side, y up, and turns from x to y; here x points down and y is a quarter of a revolution ahead of it:
x = -y and y = x of ROSS. Its coefficients along y are those along x here, and the cross-coupled ones change places and
sign. Its nodes count from 0.
"""

import json
import tomllib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import RotorstudyError

STEPS = 8  # cylinders of equal length instead of a cone
USUAL_SPEED = 377.0  # rad/s (3600 rpm), of the unbalance if the file states no speed
GRADE = 2.5e-3  # m/s, G 2.5 of ISO 21940-11
SAME = 1e-9  # relative difference of equal coefficients
OURS = {"xx": ("yy", 1), "xy": ("yx", -1), "yx": ("xy", -1), "yy": ("xx", 1)}  # direction here: that of ROSS, sign
COEFFICIENTS = {"stiffness_N_per_m": "k", "damping_N_s_per_m": "c"}
LEFT_OUT = {
    "axial_force": "axial force",
    "torque": "torque",
    "alpha": "damping proportional to the mass",
    "beta": "damping proportional to the stiffness (here: effect shaft_damping, which rotates with the shaft)",
}


class RossRotor(NamedTuple):
    """A rotor of ROSS as sections of a rig.

    sections : dict of rotor, bearings and effects
    said     : sentences on what is different here or left out, and what to do
    planes   : nodes here, those of the bearings first
    """

    sections: dict
    said: list
    planes: tuple


def read_ross(path):
    """The RossRotor of a file.

    Parameters
    ----------
    path : path
        Written by `Rotor.save` of ROSS.

    Returns
    -------
    RossRotor

    Raises
    ------
    RotorstudyError
        If the file cannot be read, is no rotor, or has parts without which the rotor would be another one.
    """
    path, said = Path(path), []
    parameters, parts = _parts(path)
    shaft = [part for name, part in parts if name == "ShaftElement"]
    elements, node_of = _shaft(shaft, path, said)
    rotor = {"kind": "finite_element", **_theory(shaft, said), **_common(elements), "discs": []}
    bearings, effects = [], []
    for name, part in parts:
        if name == "ShaftElement":
            continue
        node = node_of.get(part.get("n"))
        if node is None or part.get("n_link") is not None or name == "PointMass":  # which ROSS has at supports
            raise RotorstudyError(
                f"{path}: {name} '{part.get('tag')}' is not between the shaft and the ground; describe a support by a "
                "bearing of the kind flexible_pedestal, and save the rotor without it"
            )
        if {"m", "Id", "Ip"} <= set(part):
            rotor["discs"].append(_disc(part, node))
            if name != "DiskElement":
                said.append(f"{name} '{part['tag']}': taken as a disc; the mesh of a gear is left out")
        elif "Seal" in name:
            effects += _seal(part, node, said)
        elif "kxx" in part:
            bearings.append(_bearing(part, node, said))
        else:
            raise RotorstudyError(
                f"{path}: {name} '{part.get('tag')}' has no counterpart here; save the rotor without it"
            )
    if not bearings:
        raise RotorstudyError(f"{path}: no bearing with coefficients; a rotor needs one")
    effects.append(_unbalance(rotor, parameters, said))
    nodes = [item["node"] for item in bearings]
    every = range(1, max(node_of.values()) + 1)
    planes = (*dict.fromkeys(nodes), *(node for node in every if node not in nodes))
    return RossRotor({"rotor": rotor, "bearings": bearings, "effects": effects}, said, planes)


def _parts(path):
    """Parameters of the rotor (dict), and its parts [(name of the class, dict)]."""
    if not path.is_file():
        raise RotorstudyError(f"file '{path}' does not exist")
    try:
        text = path.read_text(encoding="utf-8")
        found = json.loads(text) if text.lstrip().startswith("{") else tomllib.loads(text)  # 2.0 has TOML in both
    except (ValueError, UnicodeDecodeError) as error:
        raise RotorstudyError(f"{path}: not a readable .toml or .json file ({error})") from None
    parts = [(key.split("_")[0], part) for key, part in found.items() if isinstance(part, dict) and key != "parameters"]
    if not any(name == "ShaftElement" for name, _ in parts):
        raise RotorstudyError(f"{path}: no ShaftElement; give a file written by Rotor.save of ROSS")
    return found.get("parameters") or {}, parts


def _shaft(shaft, path, said):
    """Elements of the shaft here, and {node of ROSS: node here}."""
    shaft = sorted(shaft, key=lambda part: part["n"])
    if [part["n"] for part in shaft] != list(range(len(shaft))):
        raise RotorstudyError(
            f"{path}: shaft elements at the nodes {[part['n'] for part in shaft]}; each stretch must be one element; "
            "layers and several rotors are not read, replace them by one element of the same stiffness and mass"
        )
    elements, node_of, node = [], {0: 1}, 1
    for part in shaft:
        pieces = _pieces(part)
        elements += [{**piece, **_material(part["material"])} for piece in pieces]
        node += len(pieces)
        node_of[part["n"] + 1] = node
        for key, words in LEFT_OUT.items():
            if part.get(key):
                said.append(f"'{part['tag']}': {words} = {part[key]:g} is left out")
        if len(pieces) > 1:
            said.append(f"'{part['tag']}': a cone, here {STEPS} cylinders, so that further nodes have other numbers")
    return elements, node_of


def _pieces(part):
    """The element as a cylinder, or as several if it is a cone, each of the diameters in its middle."""
    outer, inner = ((part[f"{d}l"], part.get(f"{d}r", part[f"{d}l"])) for d in ("od", "id"))
    steps = 1 if outer[0] == outer[1] and inner[0] == inner[1] else STEPS
    found = []
    for place in (np.arange(steps) + 0.5) / steps:
        diameters = [float(left + place * (right - left)) for left, right in (outer, inner)]
        found.append({"length_m": part["L"] / steps, "outer_diameter_m": diameters[0]})
        found[-1] |= {"inner_diameter_m": diameters[1]} if diameters[1] else {}
    return found


def _common(elements):
    """Options of the rotor: what all elements have in common, and the elements with the rest."""
    shared = {key: value for key, value in elements[0].items() if all(one.get(key) == value for one in elements)}
    shared = {key: value for key, value in shared.items() if key != "length_m"}
    return {**shared, "elements": [{k: v for k, v in one.items() if k not in shared} for one in elements]}


def _material(material):
    return {
        "youngs_modulus_Pa": material["E"],
        "poissons_ratio": round(material["E"] / (2 * material["G_s"]) - 1, 12),
        "density_kg_per_m3": material["rho"],
    }


def _theory(shaft, said):
    """Options of the rotor on shear and inertia of the shaft, which are common to all elements here."""
    shear, rotary, gyroscopic = (
        [bool(part.get(key, True)) for part in shaft] for key in ("shear_effects", "rotary_inertia", "gyroscopic")
    )
    if any(len(set(values)) > 1 for values in (shear, rotary, gyroscopic)):
        said.append("shear, rotary inertia and gyroscopic moments: not the same in all elements; here all have them")
        return {}
    if any(part.get("shear_method_calc", "cowper") != "cowper" for part in shaft) and shear[0]:
        said.append("shear coefficient by Hutchinson, here by Cowper: 1 % of the shear deflection")
    inertia = "gyroscopic" if gyroscopic[0] and rotary[0] else "rotary" if rotary[0] else "translation"
    return {"theory": "timoshenko" if shear[0] else "euler_bernoulli", "shaft_inertia": inertia}


def _disc(part, node):
    label = {"label": str(part["tag"])} if part.get("tag") else {}
    moments = {"polar_moment_kg_m2": part["Ip"], "diametral_moment_kg_m2": part["Id"]}
    return {"node": node, **label, "mass_kg": part["m"], **moments}


def _bearing(part, node, said):
    """A bearing with constant coefficients, or with a table over speed."""
    label, speeds = str(part.get("tag") or f"node {node}"), _listed(part.get("frequency"))
    if any(np.any(_listed(part.get(f"m{direction}"))) for direction in OURS):
        said.append(f"bearing '{label}': its mass coefficients are left out; add an item of point_masses of the rotor")
    start = {"node": node, "label": label}
    values = {
        name: {ours: [sign * v + 0.0 for v in _listed(part.get(letter + its))] for ours, (its, sign) in OURS.items()}
        for name, letter in COEFFICIENTS.items()
    }
    if len(speeds) > 1:
        said.append(f"bearing '{label}': its table, between whose speeds ROSS has a spline, is linear here")
        tables = {name: {d: v for d, v in table.items() if np.any(v)} for name, table in values.items()}
        return {"kind": "speed_tabulated", **start, "speeds_rad_per_s": speeds, **tables}
    crossed = any(np.any(table[d]) for table in values.values() for d in ("xy", "yx"))
    found = {"kind": "linear", **start, "coefficients": "full" if crossed else "anisotropic"}
    for name, table in values.items():
        quantity, unit = name.split("_", 1)
        stated = {d: v[0] if v else 0.0 for d, v in table.items() if crossed or d in ("xx", "yy")}
        found |= {f"bearing_{quantity}_{d}_{unit}": value for d, value in stated.items()}
    return found


def _seal(part, node, said):
    """The effect of a seal with constant coefficients that are the same in all directions; others are left out."""
    label = str(part.get("tag") or f"seal {node}")
    k, c = ({d: _listed(part.get(letter + d)) or [0.0] for d in OURS} for letter in "kc")
    constant = all(len(values) == 1 for values in [*k.values(), *c.values()])
    massless = not any(np.any(_listed(part.get(f"m{d}"))) for d in OURS)
    if not (constant and massless and _is_isotropic(k) and _is_isotropic(c)):
        said.append(
            f"seal '{label}' at node {node} is LEFT OUT, as its coefficients depend on speed or direction or have a "
            "mass; state an effect seal with the coefficients at running speed (rotorstudy plugins --name seal)"
        )
        return []
    return [
        {
            "kind": "seal",
            "node": node,
            "label": label,
            "swirl_ratio": 0.0,
            "seal_damping_N_s_per_m": c["xx"][0],
            "seal_fluid_mass_kg": 0.0,
            "seal_stiffness_N_per_m": k["xx"][0],
            "seal_cross_stiffness_N_per_m": k["xy"][0],
            "seal_cross_damping_N_s_per_m": c["xy"][0],
        }
    ]


def _is_isotropic(of):
    """Whether coefficients {direction: [value]} are the same in all directions."""
    size = SAME * max(abs(values[0]) for values in of.values())
    return abs(of["xx"][0] - of["yy"][0]) <= size and abs(of["xy"][0] + of["yx"][0]) <= size


def _unbalance(rotor, parameters, said):
    """An unbalance, which files of ROSS do not hold: grade G 2.5 at the heaviest disc."""
    speed = parameters.get("rated_w") or parameters.get("max_w") or USUAL_SPEED
    heaviest = max(rotor["discs"], key=lambda disc: disc["mass_kg"], default={"node": 1, "mass_kg": 1.0})
    size = float(f"{1e6 * heaviest['mass_kg'] * GRADE / speed:.3g}")
    said.append(
        f"unbalance: ROSS saves none; {size:g} g mm at node {heaviest['node']} is grade G 2.5, replace it by yours"
    )
    return {"kind": "unbalance", "node": heaviest["node"], "unbalance_g_mm": size, "eccentricity_phase_deg": 0.0}


def _listed(value):
    """Numbers of a coefficient, [] if there is none."""
    return [] if value is None else [float(v) for v in np.ravel(value)]
