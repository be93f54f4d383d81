"""Items of a rig file: a shaft of equal elements with discs, springs with dampers, oil films, unbalance."""


def shaft(length_m, count, *discs, outer_diameter_m=0.02, **options):
    """A rotor of a length, of equal elements, with discs, of `disc`, and further options."""
    elements = [{"length_m": length_m, "count": count}]
    rotor = {"kind": "finite_element", "elements": elements, "outer_diameter_m": outer_diameter_m}
    return {**rotor, **({"discs": list(discs)} if discs else {}), **options}


def disc(node, mass_kg=2.0, polar=0.0048, diametral=0.0024, **more):
    """A disc with its moments of inertia, kg m2."""
    return {"node": node, "mass_kg": mass_kg, "polar_moment_kg_m2": polar, "diametral_moment_kg_m2": diametral, **more}


def by_axes(key, matrix, axes=("xx", "xy", "yx", "yy")):
    """{key with each of the axes in its braces: coefficient} of a matrix (2, 2)."""
    return {key.format(a + b): float(matrix["xy".index(a)]["xy".index(b)]) for a, b in axes}


def springs(nodes, stiffness=1e6, damping=300.0):
    """Equal bearings at some nodes, N/m and N s/m, of two numbers along x and y; labelled by node unless it is given.

    nodes : numbers, or {number: label}
    """
    labels = nodes if isinstance(nodes, dict) else {node: str(node) for node in nodes}
    if isinstance(stiffness, tuple):
        keys = {f"bearing_stiffness_{d}{d}_N_per_m": value for d, value in zip("xy", stiffness, strict=True)}
        keys |= {f"bearing_damping_{d}{d}_N_s_per_m": value for d, value in zip("xy", damping, strict=True)}
        keys["coefficients"] = "anisotropic"
    else:
        keys = {"bearing_stiffness_N_per_m": stiffness, "bearing_damping_N_s_per_m": damping}
    return [{"kind": "linear", "node": node, "label": label, **keys} for node, label in labels.items()]


def film(diameter_m, length_m, radial_clearance_m, viscosity_Pa_s, **more):
    """A short journal bearing, without a node unless it is given."""
    size = {"diameter_m": diameter_m, "length_m": length_m, "radial_clearance_m": radial_clearance_m}
    return {"kind": "short_journal", **more, **size, "viscosity_Pa_s": viscosity_Pa_s}


def unbalance(node, eccentricity_m, phase_rad=0.0, **more):
    """An unbalance at a node, of its disc unless a mass is given."""
    size = {"eccentricity_m": eccentricity_m, "eccentricity_phase_rad": phase_rad}
    return {"kind": "unbalance", "node": node, **size, **more}
