"""Rigs of the tests, as in a rig file, what the probes of a model would show, and motions by the simulator."""

from dataclasses import replace

import numpy as np

from rotorstudy import Spectrum, build_model, make_term, measured_response, measured_response_and_jacobian, registry
from rotorstudy.blind.machines.effects import add_unbalance
from rotorstudy.blind.machines.machine import Disc, PointRotor, build
from rotorstudy.blind.machines.rig_items import by_axes, disc, film, shaft, springs, unbalance
from rotorstudy.blind.machines.stepping import steady_state
from rotorstudy.measurement.spectrum import independent_covariance

HARMONICS = [0, 1, 2, 3, 5, 7, -1, -3, -5]  # those of the thesis
METHODS = list(registry().plugins["spectrum"].values())
# others take harmonics above those asked for, which drop out of whole turns in a linear fit, for speed or outliers
LINEAR = [m for m in METHODS if m.uses_marks or not (m.tolerates_wrong_speed or m.tolerates_outliers)]


def full_bearing(node, stiffness, damping, **more):
    """A bearing with all its coefficients, N/m and N s/m, (2, 2) each."""
    given = by_axes("bearing_stiffness_{}_N_per_m", stiffness) | by_axes("bearing_damping_{}_N_s_per_m", damping)
    return {"kind": "linear", "coefficients": "full", "node": node, **given, **more}


def pedestal_resonance(natural, damping_ratio, bearing_time_s, loss):
    """A pedestal at node 1, of natural frequencies (2,) rad/s, by the stiffness (2, 2) that is lost at rest."""
    shape = {"natural_frequency_rad_per_s": float(natural[0]), "frequency_ratio": float(natural[1] / natural[0])}
    shape |= {"damping_ratio": float(damping_ratio), "bearing_time_s": float(bearing_time_s)}
    return {"kind": "pedestal_resonance", "node": 1, **shape, **by_axes("stiffness_loss_at_rest_{}_N_per_m", loss)}


OFFSET_DISC = {"kind": "offset_disc", "mass_kg": 2.0, "polar_moment_kg_m2": 0.0048, "diametral_moment_kg_m2": 0.0024,
               "a_m": 0.2, "b_m": 0.16, "diameter_m": 0.015}  # of Chapter 4  # fmt: skip


def point(mass_kg=2.0, stiffness_N_per_m=7.6e5, **options):
    """A rotor with one disc amid a massless shaft, and further options."""
    return {"kind": "jeffcott", "mass_kg": mass_kg, "stiffness_N_per_m": stiffness_N_per_m, **options}


def rig_of(rotor, bearings, *effects, **sections):
    """A rig of these sections, as in a rig file; effects one by one."""
    return {"rotor": rotor, "bearings": bearings, "effects": [*effects], **sections}


def jeffcott_rig(eccentricity_m=5e-6, phase_rad=None, *effects, internal=None, external=100.0, **sections):
    """A rotor with one disc, with an unbalance, damped from outside and, unless None, from inside (N s/m)."""
    damping = {"internal": internal, "external": external}
    known = [{"kind": f"{n}_damping", f"{n}_damping_N_s_per_m": c} for n, c in damping.items() if c is not None]
    phase = {} if phase_rad is None else {"eccentricity_phase_rad": phase_rad}
    if eccentricity_m is not None:
        known.append({"kind": "unbalance", "eccentricity_m": eccentricity_m, **phase})
    return {"rotor": point(), **sections, "effects": [*known, *effects]}


def jeffcott(*, weight_dominance=True, stiffness_loss=2.5e5, order=15, effects=()):
    """The cracked 2-DOF rotor of Table 2.1."""
    crack = {"kind": "switching", "weight_dominance": weight_dominance, "order": order}
    cracks = [{**crack, "stiffness_loss_N_per_m": stiffness_loss}]
    return build_model(jeffcott_rig(5e-6, np.pi / 6, *effects, internal=20.0, cracks=cracks))


def faulty(model, *items):
    """A model with effects that its rig does not know of."""
    hidden = ({"label": f"hidden {i}"} | item for i, item in enumerate(items))
    return model.plus(*(make_term("effect", item, model.structure, model.sensors) for item in hidden))


# Effects of which the search fits many shapes, which takes most of its time: tests about others leave them out. The
# whole library is searched in test_report.py, test_findings.py, the blind tests and those against foreign machines.
SLOW = ["breathing_crack", "cubic_stiffness", "looseness", "pedestal_resonance", "rub", "support_clearance",
        "transverse_crack"]  # fmt: skip


def all_but(*effects):
    """Names of all effects of the library but some, which are left out of a search."""
    return sorted(set(registry().plugins["effect"]) - set(effects))


def spectrum_of(model, speeds, harmonics, std=0.0, seed=None, **options):
    """What the probes of a model show, as `readings` has it; options : theta and others of `measured_response`."""
    shown = measured_response(model, speeds, harmonics, **options)
    return readings(shown, speeds, harmonics, model.sensors, std, seed)


def readings(shown, speeds, harmonics, sensors, std, seed=None):
    """A Spectrum of harmonics (speed, harmonic, sensor); std : of each part of the noise, added only by a seed."""
    if seed is not None:
        real, imaginary = np.random.default_rng(seed).normal(0, std, (2, *shown.shape))
        shown = shown + real + 1j * imaginary
    covariance = independent_covariance(np.full(shown.shape, std**2))
    return Spectrum(shown, np.array(speeds), np.array(harmonics), tuple(sensors), covariance)


def joined(one, other):
    """The Spectrum of the speeds of one and of another."""
    parts = ("amplitude", "speed", "covariance")
    return replace(one, **{part: np.concatenate([getattr(one, part), getattr(other, part)]) for part in parts})


def point_machine(mass, stiffness, damping, moment, internal=0.0):
    """A rotor with one disc by the independent simulator, and its rest (dof,); damping N s/m, moment kg m."""
    diameter = (stiffness * 64 / (48 * 2.1e11 * np.pi)) ** 0.25  # of a shaft of 1 m
    machine = build(PointRotor(0.5, 0.5, diameter, 2.1e11, Disc(0, mass, 2e-3, 1e-3), damping, internal), gravity=9.81)
    rest = machine.sag()
    add_unbalance(machine, 0, abs(moment), np.angle(moment))
    return machine, rest


def stepped(machine, speeds, harmonics, steps, rest):
    """Harmonics (speed, harmonic, node) of all nodes by the independent simulator, about the rest (dof,)."""
    steady, sag = steady_state(machine, speeds, steps), rest[0::4] + 1j * rest[1::4]
    return steady.harmonics(range(len(sag)), harmonics) - np.outer(np.equal(harmonics, 0), sag)


def errors_of_derivatives(model, speeds, harmonics, steps, change=None):
    """(parameter,) errors, relative, of derivatives of the response (by default its own) by central differences."""
    change = measured_response_and_jacobian(model, speeds, harmonics).jacobian if change is None else change
    found = []
    for p, step in enumerate(steps[:, None] * np.eye(len(steps), len(model.theta))):
        up, down = measured_response(model, speeds, harmonics, model.theta + np.stack([step, -step]))
        numerical = (up - down) / (2 * step[p])
        found.append(np.abs(change[..., p] - numerical).max() / np.abs(numerical).max())
    return np.array(found)


def in_x_and_y(on_z, on_conj):
    """Matrix (2 dof, 2 dof) acting on real (x, y) as on_z acts on z = x + jy and on_conj on its conjugate."""
    both, less = on_z + on_conj, on_z - on_conj
    return np.block([[both.real, -less.imag], [both.imag, less.real]])


def free_motion(mass, damping, stiffness):
    """Matrix of the rate of the state (z, z') of mass z'' + damping z' + stiffness z = 0."""
    size = len(mass)
    accelerations = -np.linalg.solve(mass, np.hstack([stiffness, damping]))
    return np.vstack([np.eye(size, 2 * size, size), accelerations])


def write_harmonics(path, spectrum):
    """A table of a Spectrum, as a machine's owner may have it."""
    rows = ["speed_rad_per_s,node,harmonic,amplitude_m,phase_rad"]
    for (i, h, s), z in np.ndenumerate(spectrum.amplitude):
        rows.append(f"{spectrum.speed[i]},{spectrum.sensors[s]},{spectrum.harmonics[h]},{abs(z):.6e},{np.angle(z):.6f}")
    path.write_text("\n".join(rows) + "\n")
