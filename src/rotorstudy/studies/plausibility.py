"""Numbers of a rig that are probably wrong: far from any machine, or in another unit than their key says."""

from functools import partial
from pathlib import Path

import numpy as np

from rotorstudy.measurement import findings
from rotorstudy.units import METRES, number

WORDS = Path(__file__).with_name("templates") / "findings.txt"
told = partial(findings.told, table=findings.words_of(WORDS.read_text(encoding="utf-8")))

# Key -> lowest and highest plausible value, and an example. They are wide: what lies outside is in another unit.
PLAUSIBLE = {
    "youngs_modulus_Pa": (1e9, 1e12, "steel has 2.1e11"),
    "shear_modulus_Pa": (4e8, 4e11, "steel has 8.1e10"),
    "density_kg_per_m3": (500.0, 25000.0, "steel has 7850"),
    "outer_diameter_m": (5e-4, 5.0, "a shaft of 30 mm has 0.03"),
    "length_m": (1e-4, 30.0, "300 mm are 0.3"),
    "diameter_m": (5e-4, 5.0, "a journal of 100 mm has 0.1"),
    "thickness_m": (1e-4, 5.0, "a disc of 22 mm has 0.022"),
    "stiffness_N_per_m": (1e2, 1e11, "1 N/um is 1e6"),
    "bearing_stiffness": (1e3, 1e11, "100 N/um are 1e8"),
    "bearing_damping": (0.0, 1e8, "1 kN s/m is 1000"),
    "viscosity_Pa_s": (1e-5, 5.0, "an oil of ISO VG 32 at 50 °C has 0.02, which is 20 cP"),
    "eccentricity_m": (0.0, 1e-3, "10 um are 1e-5"),
    "shaft_damping_s": (0.0, 1e-2, "1e-5 is usual"),
}
STEEL = {"youngs_modulus_Pa": (1.7e11, 2.3e11), "density_kg_per_m3": (7000.0, 8500.0)}
TURN = 2 * np.pi * (1 + 1e-6)  # rad; a larger angle is probably in degrees
FACTORS = {1e3: "1000", 1e6: "a million", 1e9: "1e9", METRES["mil"]: "2.54e-5 (mil in m)"}
CLEARANCE = (2e-4, 1e-2)  # radial clearance over radius; 0.0005 to 0.003 in most machines
PRESSURE = (1e3, 2e7)  # Pa, load over projected area of a journal
DENSITY = (300.0, 25000.0)  # kg/m3 of a disc; wheels with blades are light, tungsten has 19300
DIAMETERS = 0.9  # of the shaft: a disc is not smaller
THIN = 1e-3  # relative error of the moments of a thin disc, as printed


def implausible_numbers(given, place=""):
    """Findings on the numbers of a rig dict, by their keys."""
    for key, value in given.items() if isinstance(given, dict) else enumerate(given):
        where = f"{place}[{key}]" if isinstance(given, list) else f"{place}, {key}" if place else str(key)
        if isinstance(value, (dict, list)):
            yield from implausible_numbers(value, where)
        elif isinstance(key, str) and isinstance(value, (int, float)) and not isinstance(value, bool):
            yield from _of_number(key, value, where)


def _of_number(key, value, where):
    """The Finding on a value that is odd."""
    if key.endswith("_rad") and abs(value) > TURN:
        yield told("units (of an angle)", where, option=key, value=value, in_degrees=f"{key.removesuffix('_rad')}_deg")
        return
    known = next((name for name in PLAUSIBLE if key == name or key.startswith(f"{name}_")), None)
    low, high, example = PLAUSIBLE.get(known, (0.0, np.inf, ""))
    if value != 0 and np.isfinite(value) and not low <= abs(value) <= high:
        usual = {"low": low, "high": high, "example": example, "hint": _hint(value, low, high)}
        yield told("units", where, option=key, value=value, **usual)


def _hint(value, low, high):
    """By which factor between units a value would be plausible."""
    for factor, words in FACTORS.items():
        for direction, changed in (("larger", value / factor), ("smaller", value * factor)):
            if low <= abs(changed) <= high:
                return f"; it may be {direction} than meant by a factor of {words}"
    return ""


def odd_materials(rotor):
    """The first Finding on a stretch of which the modulus or the density is another than that of steel, the default."""
    for i, stretch in enumerate(rotor.get("elements", ())):
        own = {**rotor, **stretch}
        for key, other in zip(STEEL, reversed(STEEL), strict=True):
            if own.get(key) and other not in own and not STEEL[key][0] <= own[key] <= STEEL[key][1]:
                return [told("material", f"rotor, elements[{i}]", option=key, value=own[key], other=other)]
    return []


def odd_discs(structure):
    """Findings on the discs: moments that no body has, or a mass that does not fit the moments and the shaft."""
    for disc in structure.discs:
        where = _at_node("disc", disc.node, structure.labels.get(disc.node))
        if disc.polar_moment > 2 * disc.diametral_moment * (1 + THIN):
            moments = {"polar": disc.polar_moment, "diametral": disc.diametral_moment}
            yield told("moments of inertia", where, **moments)
        if disc.polar_moment:
            yield from _odd_size(disc, structure, where)


def _odd_size(disc, structure, where):
    """The Finding on the solid disc of a mass and moments if it is odd."""
    shaft, diameter = _shaft_diameter(structure, disc.node), 2 * disc.radius
    solid = f"a solid disc with this mass ({disc.mass:g} kg) and polar moment has a diameter of {diameter:.3g} m"
    if shaft and diameter < DIAMETERS * shaft:
        yield told("disc (small)", where, solid=solid, shaft=shaft)
    elif structure.length and diameter > structure.length:
        yield told("disc (large)", where, solid=solid, length=structure.length)
    elif disc.thickness > THIN * disc.radius:
        density = disc.mass / (np.pi * disc.radius**2 * disc.thickness)
        if not DENSITY[0] < density < DENSITY[1]:
            yield told("disc (density)", where, solid=solid, thickness=disc.thickness, density=number(density))


def odd_films(bearings, loads):
    """Findings on bearings with an oil film. bearings : items of the rig;  loads : {node: N, static}"""
    for item in bearings:
        if not {"radial_clearance_m", "diameter_m", "length_m"} <= set(item):
            continue
        where, diameter = _at_node("bearing", **item), item["diameter_m"]
        ratio = 2 * item["radial_clearance_m"] / diameter
        if not CLEARANCE[0] < ratio < CLEARANCE[1]:
            side = "larger" if ratio > CLEARANCE[1] else "smaller"
            yield told("film clearance", where, ratio=ratio, side=side)
        load = item.get("load_N", loads.get(item.get("node")))
        if load is not None and not PRESSURE[0] < (pressure := load / (diameter * item["length_m"])) < PRESSURE[1]:
            size = {"diameter": diameter, "length": item["length_m"]}
            yield told("film pressure", where, load=load, pressure=pressure, **size)


def stated_loads(bearings, loads):
    """Findings on `load_N` of bearings beside the static load of the rotor; loads : {node: N}"""
    for item in bearings:
        load = loads.get(item.get("node"))
        if load is None or not ("load_N" in item or "radial_clearance_m" in item):
            continue
        if "load_N" not in item:
            yield told("load_N (by default)", _at_node("bearing", **item), load=load)
        elif abs(item["load_N"] - load) > 0.1 * abs(load):
            yield told("load_N", _at_node("bearing", **item), stated=item["load_N"], load=load)


def _at_node(what, node=None, label=None, **_):
    return f"{what} at node {node}" + (f" ({label})" if label else "")


def _shaft_diameter(structure, node):
    """Outer diameter (m) of the shaft beside a node; None if its cross sections are not known."""
    if structure.section_at is None or not structure.node_positions:
        return None
    here, places = structure.node_positions[node], sorted(structure.node_positions.values())
    i = places.index(here)
    beside = (here + places[i + 1]) / 2 if i + 1 < len(places) else (here + places[i - 1]) / 2
    return structure.section_at(beside).outer_diameter_m
