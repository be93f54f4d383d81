"""Numbers of a rig that are probably wrong: far from any machine, or in another unit than their key says."""

import numpy as np

from rotorstudy.measurement.findings import Finding
from rotorstudy.units import METRES, number

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
        elif isinstance(key, str) and (told := _of_number(key, value)):
            yield Finding("warning", "units", where, f"{key} = {value:g} {told}")


def _of_number(key, value):
    """What is wrong with a value, in words; None if nothing is, or if it is no number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    if key.endswith("_rad") and abs(value) > TURN:
        return f"is more than a turn; for degrees write {key.removesuffix('_rad')}_deg"
    known = next((name for name in PLAUSIBLE if key == name or key.startswith(f"{name}_")), None)
    if known is None or value == 0 or not np.isfinite(value):
        return None
    low, high, example = PLAUSIBLE[known]
    if low <= abs(value) <= high:
        return None
    return f"is outside {low:g} to {high:g}, in which machines lie ({example}){_hint(value, low, high)}"


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
                text = f"{key} = {own[key]:g} is not of steel, and {other} is taken to be that of steel; state it too"
                return [Finding("warning", "material", f"rotor, elements[{i}]", text)]
    return []


def odd_discs(structure):
    """Findings on the discs: moments that no body has, or a mass that does not fit the moments and the shaft."""
    for disc in structure.discs:
        label = structure.labels.get(disc.node)
        where = f"disc at node {disc.node}" + (f" ({label})" if label else "")
        if disc.polar_moment > 2 * disc.diametral_moment * (1 + THIN):
            yield Finding("warning", "moments of inertia", where, f"polar_moment_kg_m2 = {disc.polar_moment:g} is more "
                          f"than twice diametral_moment_kg_m2 = {disc.diametral_moment:g}, which no rigid body has; a "
                          "thin disc has exactly twice")  # fmt: skip
        if disc.polar_moment and (told := _odd_size(disc, structure)):
            solid = f"a solid disc with this mass ({disc.mass:g} kg) and polar moment"
            yield Finding("warning", "disc", where, f"{solid} has a diameter of {2 * disc.radius:.3g} m{told}")


def _odd_size(disc, structure):
    """What is wrong with the solid disc of a mass and moments, in words; None if nothing is."""
    shaft = _shaft_diameter(structure, disc.node)
    if shaft and 2 * disc.radius < DIAMETERS * shaft:
        return f", less than the shaft ({shaft:.3g} m): heavier than plausible; check mass and moments"
    if structure.length and 2 * disc.radius > structure.length:
        return f", more than the length of the shaft ({structure.length:.3g} m): wrong unit of the moment?"
    if disc.thickness > THIN * disc.radius:
        density = disc.mass / (np.pi * disc.radius**2 * disc.thickness)
        if not DENSITY[0] < density < DENSITY[1]:
            return (
                f" and a thickness of {disc.thickness:.3g} m, so that its density would be {number(density)} kg/m3; "
                "check mass and moments of inertia"
            )
    return None


def odd_films(bearings, loads):
    """Findings on bearings with an oil film. bearings : items of the rig;  loads : {node: N, static}"""
    for item in bearings:
        if not {"radial_clearance_m", "diameter_m", "length_m"} <= set(item):
            continue
        where, diameter = _bearing_name(item), item["diameter_m"]
        ratio = 2 * item["radial_clearance_m"] / diameter
        if not CLEARANCE[0] < ratio < CLEARANCE[1]:
            side = "larger" if ratio > CLEARANCE[1] else "smaller"
            yield Finding("warning", "film clearance", where, f"radial_clearance_m is {ratio:.2g} of the radius, "
                          f"{side} than in any machine (0.0005 to 0.003 are usual); is it in other units, or the "
                          "diametral clearance?")  # fmt: skip
        load = item.get("load_N", loads.get(item.get("node")))
        if load is not None and not PRESSURE[0] < (pressure := load / (diameter * item["length_m"])) < PRESSURE[1]:
            size = f"{diameter:g} m x {item['length_m']:g} m"
            text = f"{load:.3g} N on {size} are {pressure:.2g} Pa; 1e4 to 3e6 are usual"
            yield Finding("warning", "film pressure", where, text)


def stated_loads(bearings, loads):
    """Findings on `load_N` of bearings beside the static load of the rotor; loads : {node: N}"""
    for item in bearings:
        load = loads.get(item.get("node"))
        if load is None or not ("load_N" in item or "radial_clearance_m" in item):
            continue
        if "load_N" not in item:
            text = f"{load:.4g} N by default, what it carries of the weight"
            yield Finding("note", "load_N", _bearing_name(item), text)
        elif abs(item["load_N"] - load) > 0.1 * abs(load):
            yield Finding("warning", "load_N", _bearing_name(item), f"load_N = {item['load_N']:g} N, but the weight of "
                          f"the rotor loads this bearing by {load:.4g} N; leave load_N out, unless a belt, a gear or "
                          "an alignment loads it too")  # fmt: skip


def _bearing_name(item):
    return f"bearing at node {item.get('node')}" + (f" ({item['label']})" if item.get("label") else "")


def _shaft_diameter(structure, node):
    """Outer diameter (m) of the shaft beside a node; None if its cross sections are not known."""
    if structure.section_at is None or not structure.node_positions:
        return None
    here, places = structure.node_positions[node], sorted(structure.node_positions.values())
    i = places.index(here)
    beside = (here + places[i + 1]) / 2 if i + 1 < len(places) else (here + places[i - 1]) / 2
    return structure.section_at(beside).outer_diameter_m
