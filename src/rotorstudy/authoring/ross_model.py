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

from rotorstudy.errors import RotorstudyError, reading

STEPS = 8  # cylinders of equal length instead of a cone
USUAL_SPEED = 377.0  # rad/s (3600 rpm), of the unbalance if the file states no speed
FASTEST = 1e4  # rad/s, up to which constant coefficients are written where a table is needed
GRADE = 2.5e-3  # m/s, G 2.5 of ISO 21940-11
SAME = 1e-9  # relative difference of equal coefficients
LIMP = 1e-6  # of the modulus of the shaft: a layer below it has mass only
OURS = {"xx": ("yy", 1), "xy": ("yx", -1), "yx": ("xy", -1), "yy": ("xx", 1)}  # direction here: that of ROSS, sign
COEFFICIENTS = {"stiffness_N_per_m": "k", "damping_N_s_per_m": "c", "mass_kg": "m"}


class RossRotor(NamedTuple):
    """A rotor of ROSS: sections of a rig, sentences on what differs here, and nodes, those of the bearings first."""

    sections: dict
    said: list
    planes: tuple


def read_ross(path):
    """The RossRotor of a file that `Rotor.save` of ROSS wrote."""
    path, said = Path(path), []
    parameters, parts = _parts(path)
    with reading("rotor of ROSS", path):
        return _rotor(parameters, parts, path, said)


def _rotor(parameters, parts, path, said):
    """The RossRotor of the parts of a file."""
    shaft = [part for name, part in parts if name == "ShaftElement"]
    elements, node_of = _shaft(shaft, path, said)
    rotor = {"kind": "finite_element", **_theory(shaft, said), **_common(elements), "discs": [], "point_masses": []}
    bearings, effects = [], _shaft_damping(shaft, said)
    supports = {part["n_link"] for _, part in parts if part.get("n_link") is not None}
    for name, part in ((name, part) for name, part in parts if name != "ShaftElement"):
        node, tag = node_of.get(part.get("n")), part.get("tag")
        if part.get("n") in supports and node is None:  # read with the bearing that it carries
            continue
        if node is None or part.get("n_link") in node_of:
            place = "between shaft and ground, or shaft and support"
            raise RotorstudyError(f"{path}: {name} '{tag}' is not {place}; save the rotor without it")
        if name == "PointMass" and part.get("m") is not None:
            rotor["point_masses"].append({"node": node, "mass_kg": part["m"]})
        elif {"m", "Id", "Ip"} <= set(part):
            rotor["discs"].append(_disc(part, node))
            if name != "DiskElement":
                said.append(f"{name} '{tag}': taken as a disc; the mesh of a gear is left out")
        elif part.get("n_link") is not None:
            bearings.append(_pedestal(part, node, [p for _, p in parts if p.get("n") == part["n_link"]], path))
        elif "kxx" in part:
            values = _coefficients(part, path)
            if not any(np.any(v) for table in values.values() for v in table.values()):
                said.append(f"{name} at node {node}: acts along the shaft only, left out")
                continue
            seal = _seal(part, node, values) if "Seal" in name else []
            effects += seal
            bearings += [] if seal else [_bearing(part, node, values, said)]
            if "Seal" in name and not seal:
                said.append("seals whose coefficients depend on speed or direction, or have a mass, are bearings here")
        else:
            raise RotorstudyError(f"{path}: {name} '{tag}' has no counterpart here; save the rotor without it")
    if not bearings:
        raise RotorstudyError(f"{path}: no bearing with coefficients; a rotor needs one")
    if not rotor["point_masses"]:
        del rotor["point_masses"]
    effects.append(_unbalance(rotor, parameters, said))
    seals = {str(part.get("tag")) for name, part in parts if "Seal" in name}
    nodes = [item["node"] for item in bearings if item["label"] not in seals]
    planes = tuple(dict.fromkeys([*nodes, *range(1, max(node_of.values()) + 1)]))
    said = [f"{one} ({n} times)" if (n := said.count(one)) > 1 else one for one in dict.fromkeys(said)]
    return RossRotor({"rotor": rotor, "bearings": bearings, "effects": effects}, said, planes)


def _parts(path):
    """Parameters of the rotor (dict), and its parts [(name of the class, dict)]."""
    if not path.is_file():
        raise RotorstudyError(f"file '{path}' does not exist")
    with reading(".toml or .json file", path):
        text = path.read_text(encoding="utf-8")
        found = json.loads(text) if text.lstrip().startswith("{") else tomllib.loads(text)  # 2.0 has TOML in both
        found = found if isinstance(found, dict) else {}
    if lists := [key for key, part in found.items() if isinstance(part, list)]:
        raise RotorstudyError(f"{path}: {lists[0]} is a list; each part of a rotor has a name of its own")
    parts = [(key.split("_")[0], part) for key, part in found.items() if isinstance(part, dict) and key != "parameters"]
    if not any(name == "ShaftElement" for name, _ in parts):
        raise RotorstudyError(f"{path}: no ShaftElement; give a file written by Rotor.save of ROSS")
    return found.get("parameters") or {}, parts


def _shaft(shaft, path, said):
    """Elements of the shaft here, and {node of ROSS: node here}. Parallel elements are a shaft and its layers."""
    at = {n: [part for part in shaft if part["n"] == n] for n in sorted({part["n"] for part in shaft})}
    if list(at) != list(range(len(at))):
        raise RotorstudyError(f"{path}: shaft elements at the nodes {list(at)}; several shafts are not read, save one")
    elements, node_of, node = [], {0: 1}, 1
    for n, parts in at.items():
        limp = LIMP * max(part["material"]["E"] for part in parts)
        inner, *layers = sorted(parts, key=lambda part: (part["material"]["E"] < limp, part["odl"]))
        if len({part["L"] for part in parts}) > 1:
            raise RotorstudyError(f"{path}: parallel shaft elements at the node {n} differ in length; save them as one")
        is_cone = any(part.get(f"{d}r", part[f"{d}l"]) != part[f"{d}l"] for part in parts for d in ("od", "id"))
        steps = STEPS if is_cone else 1
        for place in (np.arange(steps) + 0.5) / steps:
            force = {"axial_force_N": inner["axial_force"]} if inner.get("axial_force") else {}
            elements.append({"length_m": inner["L"] / steps, **_section(inner, place), **_material(inner), **force})
            if layers:
                elements[-1]["layers"] = [_layer(layer, inner, place) for layer in layers]
        node += steps
        node_of[n + 1] = node
        said += ["torque of the shaft is left out"] * any(part.get("torque") for part in parts)
        if steps > 1:
            said.append(f"cones: each {STEPS} cylinders here, so that further nodes have other numbers")
        if layers:
            said.append("parallel shaft elements: layers here, which stay plane with the shaft")
    return elements, node_of


def _section(part, place):
    """The diameters at a place from 0 to 1 of an element."""
    outer, inner = (float((1 - place) * part[f"{d}l"] + place * part.get(f"{d}r", part[f"{d}l"])) for d in ("od", "id"))
    return {"outer_diameter_m": outer} | ({"inner_diameter_m": inner} if inner else {})


def _layer(layer, shaft, place):
    """A layer; one of next to no modulus has mass only."""
    limp = layer["material"]["E"] < LIMP * shaft["material"]["E"]
    material = {"youngs_modulus_Pa": 0, "density_kg_per_m3": layer["material"]["rho"]} if limp else _material(layer)
    return {"inner_diameter_m": 0.0, **_section(layer, place), **material}


def _shaft_damping(shaft, said):
    """The effect of damping in proportion to the stiffness, if every element has the same; the rest is left out."""
    if any(part.get("alpha") for part in shaft):
        said.append("damping in proportion to the mass of the shaft is left out (mass_proportional_damping has discs)")
    beta = {float(part.get("beta") or 0.0) for part in shaft}
    if len(beta) > 1:
        said.append("damping in proportion to the stiffness of some elements is left out (see internal_damping)")
    if len(beta) > 1 or not any(beta):
        return []
    return [{"kind": "stiffness_proportional_damping", "stiffness_proportional_damping_s": beta.pop()}]


def _common(elements):
    """Options of the rotor: what all elements have in common, and the elements with the rest."""
    shared = {k: v for k, v in elements[0].items() if k != "length_m" and all(one.get(k) == v for one in elements)}
    return {**shared, "elements": [{k: v for k, v in one.items() if k not in shared} for one in elements]}


def _material(part):
    material = part["material"]
    poisson = round(material["E"] / (2 * material["G_s"]) - 1, 12)
    return {"youngs_modulus_Pa": material["E"], "poissons_ratio": poisson, "density_kg_per_m3": material["rho"]}


def _theory(shaft, said):
    """Options of the rotor on shear and inertia of the shaft, which are common to all elements here."""
    keys = ("shear_effects", "rotary_inertia", "gyroscopic")
    shear, rotary, gyroscopic = ([bool(part.get(key, True)) for part in shaft] for key in keys)
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


def _coefficients(part, path):
    """{"stiffness_N_per_m": {direction: values}, ...} in the axes here; as many values as the table has speeds."""
    count = max(len(_speeds(part)), 1)
    values = {}
    for name, letter in COEFFICIENTS.items():
        alike = {"yy": part.get(letter + "xx")}  # if it is not stated
        stated = {i: alike.get(i) if part.get(letter + i) is None else part[letter + i] for i in OURS}
        values[name] = {o: [sign * v + 0.0 for v in _listed(stated[i])] for o, (i, sign) in OURS.items()}
        if letter == "k" and not values[name]["yy"]:
            raise RotorstudyError(f"{path}: bearing '{part.get('tag')}' has no value of kxx")
        for direction, found in values[name].items():
            if len(found) not in (0, count):
                raise RotorstudyError(
                    f"{path}: bearing '{part.get('tag')}' has {len(found)} values of {letter}{OURS[direction][0]} and "
                    f"{len(_speeds(part))} speeds; save it with 'frequency' or 'speed' of as many values"
                )
    return values


def _speeds(part):
    """Speeds of a table, rad/s; CylindricalBearing and BearingFluidFlow have names of their own for them."""
    return next((found for key in ("frequency", "speed", "omega") if (found := _listed(part.get(key)))), [])


def _bearing(part, node, values, said):
    """A bearing with constant coefficients, or with a table over speed."""
    label, speeds = str(part.get("tag") or f"node {node}"), _speeds(part)
    start = {"node": node, "label": label}
    massive = any(map(np.any, values["mass_kg"].values()))
    if len(speeds) > 1 or massive:
        tables = {name: {d: v for d, v in table.items() if np.any(v)} for name, table in values.items()}
        if len(speeds) < 2:
            tables = {name: {d: 2 * v for d, v in table.items()} for name, table in tables.items()}
            speeds = [0.0, FASTEST]
        else:
            said.append("tables of bearings and seals, between whose speeds ROSS has a spline, are linear here")
        tables = {name: table for name, table in tables.items() if table or name == "stiffness_N_per_m"}
        return {"kind": "speed_tabulated", **start, "speeds_rad_per_s": speeds, **tables}
    crossed = any(map(np.any, (values[name][d] for name in list(values)[:2] for d in ("xy", "yx"))))
    found = {"kind": "linear", **start, "coefficients": "full" if crossed else "anisotropic"}
    for name in list(values)[:2]:
        quantity, unit = name.split("_", 1)
        stated = {d: v[0] if v else 0.0 for d, v in values[name].items() if crossed or d in ("xx", "yy")}
        found |= {f"bearing_{quantity}_{d}_{unit}": value for d, value in stated.items()}
    return found


def _pedestal(part, node, support, path):
    """A bearing on a support: its base, a bearing to the ground, and its point masses."""
    bases = [one for one in support if "kxx" in one]
    values = [_coefficients(one, path) for one in (part, *bases)]
    kept = [(table, d, name) for found in values for name, table in found.items() for d in table]
    parts = [table[d] for table, d, name in kept if d in ("xy", "yx") or name[0] == "m"]
    if len(bases) != 1 or any(len(_speeds(one)) > 1 for one in (part, *bases)) or any(map(np.any, parts)):
        raise RotorstudyError(
            f"{path}: bearing '{part.get('tag')}' is on a support; a flexible_pedestal has constant coefficients "
            "without cross coupling, of the bearing and of one base, and a point mass: save the rotor without supports"
        )
    found = {"kind": "flexible_pedestal", "node": node, "label": str(part.get("tag") or f"node {node}")}
    for name, one in zip(("bearing", "pedestal"), values, strict=True):
        for quantity in ("stiffness_N_per_m", "damping_N_s_per_m"):
            found[f"{name}_{quantity}"] = {d: (one[quantity][d] or [0.0])[0] for d in ("xx", "yy")}
    masses = [one for one in support if "kxx" not in one]
    of = {d: sum(one.get(key) or one.get("m") or 0.0 for one in masses) for d, key in (("xx", "my"), ("yy", "mx"))}
    return found | {"pedestal_mass_kg": of}


def _seal(part, node, values):
    """The effect of a seal with constant coefficients that are the same in all directions; [] for another one."""
    label = str(part.get("tag") or f"seal {node}")
    k, c, m = ({d: found or [0.0] for d, found in table.items()} for table in values.values())
    if len(_speeds(part)) > 1 or np.any(list(m.values())) or not (_is_isotropic(k) and _is_isotropic(c)):
        return []
    known = {"swirl_ratio": 0.0, "seal_damping_N_s_per_m": c["xx"][0], "seal_fluid_mass_kg": 0.0}
    stiffness = {"seal_stiffness_N_per_m": k["xx"][0], "seal_cross_stiffness_N_per_m": k["xy"][0]}
    cross = {"seal_cross_damping_N_s_per_m": c["xy"][0]}
    return [{"kind": "seal", "node": node, "label": label, **known, **stiffness, **cross}]


def _is_isotropic(of):
    """Whether coefficients {direction: [value]} are the same in all directions."""
    size = SAME * max(abs(values[0]) for values in of.values())
    return abs(of["xx"][0] - of["yy"][0]) <= size and abs(of["xy"][0] + of["yx"][0]) <= size


def _unbalance(rotor, parameters, said):
    """An unbalance, which files of ROSS do not hold: grade G 2.5 at the heaviest disc."""
    speed = parameters.get("rated_w") or parameters.get("max_w") or USUAL_SPEED
    heaviest = max(rotor["discs"], key=lambda disc: disc["mass_kg"], default={"node": 1, "mass_kg": 1.0})
    size = float(f"{1e6 * heaviest['mass_kg'] * GRADE / speed:.3g}")
    told = f"{size:g} g mm at node {heaviest['node']} is grade G 2.5, replace it by yours"
    said.append(f"unbalance: ROSS saves none; {told}")
    return {"kind": "unbalance", "node": heaviest["node"], "unbalance_g_mm": size, "eccentricity_phase_deg": 0.0}


def _listed(value):
    """Numbers of a coefficient, [] if there is none."""
    return [] if value is None else [float(v) for v in np.ravel(value)]
