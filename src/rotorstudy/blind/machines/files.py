"""A case on disk: the record (NetCDF) and the rig file of the nominal machine."""

from itertools import groupby
from pathlib import Path

import numpy as np
import xarray as xr
import yaml

from rotorstudy.blind.machines.cases import RUNOUT, swing_of
from rotorstudy.blind.machines.machine import GRAVITY
from rotorstudy.blind.machines.rig_items import by_axes, disc, unbalance
from rotorstudy.blind.machines.rig_items import film as film_item

ERRORS = np.array([0.005, 0.02, 0.05])  # usual relative errors of modulus, bearings and unbalance in a rig file
FILM = 2.5  # error of clearance and viscosity over that of the coefficients of a bearing: 5 %


def plain(value):
    """Numbers, strings, lists and dicts as YAML takes them; ten digits of a number."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    value = value.item() if isinstance(value, np.generic) else value
    return float(f"{value:.9e}") if isinstance(value, float) else value


def page(sections):
    """YAML, an item a line."""
    return yaml.safe_dump(plain(sections), sort_keys=False, allow_unicode=True, width=10_000, default_flow_style=None)


def stretches(elements):
    """Neighbouring equal elements together: length of the stretch, count, diameter."""
    groups = ((one, len(list(alike))) for one, alike in groupby(elements))
    return [{"length_m": one.length * n, "count": n, "outer_diameter_m": one.outer_diameter} for one, n in groups]


def linear_bearing(rng, bearing, error):
    """A bearing as the rig file has it, each coefficient off by the relative `error`."""
    k = bearing.stiffness * (1 + error * rng.normal(size=(2, 2)))
    c = bearing.damping * (1 + error * rng.normal(size=(2, 2)))
    full = bool(bearing.stiffness[0, 1] or bearing.stiffness[1, 0] or bearing.damping[0, 1] or bearing.damping[1, 0])
    where = {"kind": "linear", "node": bearing.node + 1, "label": f"node {bearing.node + 1}"}
    where["coefficients"] = "full" if full else "anisotropic"
    axes = ("xx", "xy", "yx", "yy") if full else ("xx", "yy")
    return where | by_axes("bearing_stiffness_{}_N_per_m", k, axes) | by_axes("bearing_damping_{}_N_s_per_m", c, axes)


def film_bearing(rng, film, error):
    """An oil film as the rig file has it: clearance and viscosity off by the relative `error`."""
    clearance, viscosity = np.array([film.clearance, film.viscosity]) * (1 + error * rng.normal(size=2))
    where = {"node": film.node + 1, "label": f"node {film.node + 1}", "load_N": film.load}
    return film_item(film.diameter, film.length, clearance, viscosity, **where)


def point_rotor_section(rng, rotor, error):
    """The nominal rotor of one disc on a massless shaft."""
    stiffer, own = 1 + error * rng.normal(), rotor.disc
    if rotor.first == rotor.second:
        stiffness = rotor.plane_stiffness[0, 0] * stiffer
        kind = {"kind": "jeffcott", "mass_kg": own.mass, "stiffness_N_per_m": stiffness}
    else:
        kind = {"kind": "offset_disc", "mass_kg": own.mass, "polar_moment_kg_m2": own.polar_moment}
        kind |= {"diametral_moment_kg_m2": own.diametral_moment, "a_m": rotor.first, "b_m": rotor.second}
        kind |= {"diameter_m": rotor.diameter, "youngs_modulus_Pa": rotor.youngs_modulus * stiffer}
    return kind | {"gravity_m_per_s2": GRAVITY}


def rotor_section(rng, rotor, error):
    """The nominal rotor; the shear theory is the format's default and is left out."""
    if not rotor.elements:
        return point_rotor_section(rng, rotor, error)
    first = rotor.elements[0]
    section = {
        "kind": "finite_element",
        "elements": stretches(rotor.elements),
        "outer_diameter_m": first.outer_diameter,
        "youngs_modulus_Pa": first.youngs_modulus * (1 + error * rng.normal()),
        "density_kg_per_m3": first.density,
        "gravity_m_per_s2": GRAVITY,
    }
    if first.theory == "euler_bernoulli":
        section["theory"] = "euler_bernoulli"
    return section | {"discs": discs_section(rotor)}


def discs_section(rotor):
    """Its discs."""
    return [disc(one.node + 1, one.mass, one.polar_moment, one.diametral_moment) for one in rotor.discs]


def effects_section(rng, case, error):
    """Nominal damping and unbalance; the unbalance is known to `error` in amplitude and phase."""
    rotor, point = case.rotor, not case.rotor.elements
    if point:
        listed = [{"kind": "internal_damping", "internal_damping_N_s_per_m": rotor.internal}]
    else:
        listed = [{"kind": "shaft_damping", "shaft_damping_s": rotor.elements[0].internal_damping}]
    for one in rotor.discs:
        node, label = one.node + 1, f"disc {one.node + 1}"
        damping = rotor.external if point else rotor.external_damping[one.node]
        damped = {"kind": "external_damping", "node": node, "label": label}
        listed.append(damped | {"external_damping_N_s_per_m": damping})
        value = case.unbalance[one.node] * (1 + error * (rng.normal() + 1j * rng.normal()))
        listed.append(unbalance(node, abs(value) / one.mass, float(np.angle(value)), label=label, mass_kg=one.mass))
    return listed


def picture_angle(case, angle, direction=True):
    """Degrees in the picture of the rig file, of a direction in the model or of an angle from the reference line."""
    sign = 1 if case.picture["rotation"] == "with_angles" else -1
    start = case.picture["gravity_angle_deg"] if direction else 0.0
    return float(np.mod(start + sign * np.rad2deg(angle) + 180.0, 360.0) - 180.0)


def measurement_section(case, harmonics):
    """Probes, keyphasor and picture, as meant: no errors of gain or angle in it."""
    wanted = {} if harmonics is None else {"harmonics": [int(k) for k in harmonics]}
    pair = zip("ab", case.probes[case.nodes[0]], strict=True)
    probes = [{"channel": name, "angle_deg": picture_angle(case, probe.angle)} for name, probe in pair]
    keyphasor = {
        "channel": "keyphasor",
        "sensor_angle_deg": picture_angle(case, case.chain.sensor_angle),
        "mark_angle_deg": picture_angle(case, case.chain.mark_angle, direction=False),
    }
    return case.picture | wanted | {"probes": probes, "keyphasor": keyphasor}


def diagnosis_section(case, modulus_error, bearing_error, unbalance_error):
    """What the user knows: standard deviations of rig and probes; a cross coefficient of zero is held."""
    chain, rotor = case.chain, case.rotor
    linear = () if rotor.films else rotor.bearings
    crossed = any(bearing.stiffness[0, 1] for bearing in linear)
    modulus = "stiffness_N_per_m" if not rotor.elements and rotor.first == rotor.second else "youngs_modulus_Pa"
    relative = {}
    if linear:
        parts = ("xx", "xy", "yx", "yy") if crossed else ("xx", "yy")
        relative |= {f"bearing_stiffness_{part}": bearing_error for part in parts}
        relative |= {f"bearing_damping_{part}": bearing_error for part in ("xx", "yy")}
    relative |= {"eccentricity": unbalance_error * 2**0.5, "default": 0.1}
    relative |= {"rotor": 0.0, f"rotor.{modulus}": modulus_error}
    for film in rotor.films:
        parts = ("radial_clearance_m", "viscosity_Pa_s")
        relative |= {f"bearings[node {film.node + 1}].{part}": FILM * bearing_error for part in parts}
    relative |= {"bearing_scale": 0.0} if rotor.films else {}
    relative |= {"bearing_damping_xy": 0.0, "bearing_damping_yx": 0.0} if crossed else {}
    repeatability = float(np.hypot(chain.amplitude_scatter, chain.phase_scatter))
    return {
        "uncertainty": relative,
        "nuisance": {
            "probe_gain": 5e-3,
            "probe_angle": float(np.deg2rad(0.5) * 2**0.5),  # between two probes
            "phase_reference": 5e-3,
            "runout": RUNOUT * swing_of(case.healthy, case.nodes),
        },
        "model_error": max(repeatability, 1e-3),
    }


def write_records(path, records, nodes):
    """Write records of some nodes: displacement (speed, node, direction, time) in m, keyphasor (speed, time) in V."""
    names = ("speed", "node", "direction", "time")
    data = xr.Dataset(
        {
            "displacement": (names, records["displacement"], {"units": "m"}),
            "keyphasor": (("speed", "time"), records["keyphasor"], {"units": "V"}),
        },
        {
            "speed": ("speed", records["speed"], {"units": "rad/s"}),
            "node": ("node", np.array(nodes) + 1, {"units": "1"}),
            "direction": ("direction", ["a", "b"]),
            "time": ("time", records["time"], {"units": "s"}),
        },
        {"title": "Simulated vibration record"},
    )
    data.to_netcdf(path, encoding={"displacement": {"dtype": "float32"}})


def rig_of(case, errors=ERRORS, seed=0, harmonics=None):
    """The rig file of the nominal machine as a dict; see `write_case`."""
    rng, rotor, (modulus_error, bearing_error, unbalance_error) = np.random.default_rng(seed), case.rotor, errors
    return {
        "rotor": rotor_section(rng, rotor, modulus_error),
        "bearings": [film_bearing(rng, film, FILM * bearing_error) for film in rotor.films]
        or [linear_bearing(rng, bearing, bearing_error) for bearing in rotor.bearings],
        "effects": effects_section(rng, case, unbalance_error),
        "sensors": [node + 1 for node in case.nodes],
        "measurement": measurement_section(case, harmonics),
        "diagnosis": diagnosis_section(case, modulus_error, bearing_error, unbalance_error),
    }


def write_case(case, folder, errors=ERRORS, seed=0, harmonics=None):
    """Write `record.nc` and `rig.yaml`, whose numbers have errors as `ERRORS` drawn from the `seed`."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rig.yaml").write_text(page(rig_of(case, errors, seed, harmonics)), encoding="utf-8")
    write_records(folder / "record.nc", case.records, case.nodes)
    return folder
