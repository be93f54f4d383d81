"""Cracks with fronts that the library does not have, from the independent simulator: their depth and its interval."""

from dataclasses import replace

import numpy as np

from rotorstudy.blind.machines.beam import Element
from rotorstudy.blind.machines.cracks import add_form, arc_form, static_moment
from rotorstudy.blind.machines.machine import Bearing, Disc, Rotor, build
from rotorstudy.blind.machines.stepping import NoSteadyState, steady_state
from rotorstudy.diagnosis.one_cause.answer import identified, interval_of
from rotorstudy.diagnosis.search.candidates import candidate, form_ranges, freedoms_of
from rotorstudy.diagnosis.search.shape_fit import fitted_from
from rotorstudy.measurement.noise import standard_normal
from rotorstudy.model.cracks import compliance
from rotorstudy.model.registry import registry
from rotorstudy.studies.common import results
from rotorstudy.studies.crack_study.sensitivity import Machine

REFERENCE = "reference"  # the law of `equivalent_beam`
FINE = np.linspace(0.01, 0.6, 600)  # depths between which it is inverted


def equivalent_beam(depth):
    """Compliances (xi, eta) of an open crack, E = R = 1, fitted to finite elements in three dimensions.

    A beam with the moments of area of the cracked section (Bachschmid, Pennacchi, Tanzi 2010, Cracked Rotors); the
    polynomial for its length over the diameter is that of the FLEX model contributed to ROSS.
    """
    length = 2 * np.polyval([-33.3333, 77.5641, -49.5542, 9.0485, 1.2415, -0.0024], depth)
    half = np.arccos(1 - 2 * depth)  # the segment lost spans twice this angle
    area, first = half - np.sin(2 * half) / 2, 2 * np.sin(half) ** 3 / 3
    along = np.pi / 4 - (half - np.sin(4 * half) / 4) / 4 - first**2 / (np.pi - area)
    across = np.pi / 4 - (half - 2 * np.sin(2 * half) / 3 + np.sin(4 * half) / 12) / 4
    return length * (1 / along - 4 / np.pi), length * (1 / across - 4 / np.pi)


def fronts(config):
    """A Dataset of depths found from noisy records of cracks by three-dimensional elasticity whose fronts are arcs.

    A residual stress opens or closes them, and Poisson's ratio is not that of the library.

    The simulator shares nothing with the library. The numbers of the rig that the fit starts from are drawn from their
    prior about the true ones, then noise and model error; each fit starts at the true crack, its front at an aspect
    ratio of a half. A crack with which the rotor is unstable is drawn anew.
    """
    machine, settings = Machine(config, config.main), config.fronts
    rotor, unbalance = _independent(config.main)
    length = sum(element.length for element in rotor.elements)
    laws = [*settings.laws, REFERENCE, "front unknown"]
    ranges = settings.depth_ratios, settings.curvatures, (-np.pi, np.pi)
    ranges = *ranges, settings.closing_shares, settings.poissons_ratios
    rest, unstable = _shown(machine, _built(rotor, unbalance)), []

    def at(trial):
        rng = np.random.default_rng([settings.seed, trial])
        while True:
            depth, curvature, angle, closing, poisson = (rng.uniform(*ends) for ends in ranges)
            position = float(rng.choice(settings.positions)) * length
            cracked = _built(rotor, unbalance)
            part = replace(rotor.elements[np.searchsorted(rotor.positions, position) - 1], poissons_ratio=poisson)
            moment = closing * static_moment(cracked, position)
            add_form(cracked, position, arc_form(part, depth, curvature, closing=moment), angle)
            try:
                shown = _shown(machine, cracked) - rest * (machine.harmonics == 0)[:, None]
                break
            except NoSteadyState:
                unstable.append(trial)
        spectrum = machine.noisy_spectrum(shown, config.usual_noise_percent)
        size = len(machine.prior.names)
        (draw,) = standard_normal(settings.seed, trial, 1, size + 2 * shown.size)
        prior = replace(machine.prior, mean=machine.prior.mean + machine.prior.factor @ draw[:size])
        work = machine.work(machine.drawn(spectrum, shown, draw[size:]))._replace(prior=prior)
        shape = {"position_m": position, "depth_ratio": depth, "angle_rad": angle}
        truth = {"depth_ratio": depth, "curvature": curvature, "position": position, "closing_share": closing}
        found = np.transpose(_by_each_law(config, work, shape))
        return truth | dict(zip(("found", "low", "high", "p_value"), found, strict=True))

    given, title = {"law": laws, "trial": np.arange(settings.count)}, f"{config.title}: cracks with curved fronts"
    data = results("fronts", title, ("trial",), at, **given, seed=settings.seed)
    return data.assign_attrs(unstable=len(unstable))


def _by_each_law(config, work, shape):
    """(law, 4) depth, the ends of its 95 % interval and the p-value, by each law."""
    crack, rows = config.crack, []
    middle = {name: ends.value(0.5) for name, ends in form_ranges(crack.kind).items()}
    for options, form in [*((options, {}) for options in config.fronts.laws.values()), ({}, middle)]:
        width, variant = config.diagnosis.prior_width, {**crack.variant, **options}
        freedoms = freedoms_of(crack.kind, any_form=False) if form else ()
        one = candidate(work.rig, crack.kind, {}, shape | form, "crack", width, variant, freedoms)
        fitted = fitted_from(work, [one], np.concatenate([work.prior.mean, [mean for mean, _ in one.prior.values()]]))
        found = identified(work, fitted, [fitted])
        rows.append([found.cause.shape["depth_ratio"], *interval_of(found, "depth_ratio"), found.p_value])
    *straight, p_value = rows[-2]
    law = registry().get("depth", config.fronts.straight, "fronts")
    straight = np.clip(straight, *law.valid)  # an interval may reach beyond
    of_one = {"diameter_m": 2.0, "youngs_modulus_Pa": 1.0}  # the compliance along xi for E = R = 1
    across = [compliance(law, one, "fronts", **of_one)[0] for one in straight]
    same = np.interp(across, equivalent_beam(FINE)[0], FINE).tolist()
    return [*rows[:-1], [*same, p_value], rows[-1]]


def _independent(rotor):
    """A rotor of the study in the independent simulator, and its unbalance {node from 0: kg m}."""
    given, elements = rotor.rotor, []
    for part in given["elements"]:
        own = {"count": 1, "theory": "timoshenko"} | given | part
        sizes = own["length_m"] / own["count"], own["outer_diameter_m"]
        one = Element(*sizes, own["youngs_modulus_Pa"], own["density_kg_per_m3"], theory=own["theory"])
        elements += [one] * own["count"]
    keys = ("mass_kg", "polar_moment_kg_m2", "diametral_moment_kg_m2")
    discs = [Disc(disc["node"] - 1, *map(disc.get, keys)) for disc in given["discs"]]
    bearings = []
    for b in rotor.bearings:
        both = (("stiffness", "N_per_m"), ("damping", "N_s_per_m"))
        matrices = [np.diag([b[f"bearing_{what}_{axes}_{unit}"] for axes in ("xx", "yy")]) for what, unit in both]
        bearings.append(Bearing(b["node"] - 1, *matrices))
    unbalance = {}
    for e in rotor.effects:
        unbalance[e["node"] - 1] = e["mass_kg"] * e["eccentricity_m"] * np.exp(1j * e["eccentricity_phase_rad"])
    return Rotor(tuple(elements), tuple(discs), tuple(bearings)), unbalance


def _built(rotor, unbalance):
    machine = build(rotor)
    for node, moment in unbalance.items():
        machine.add_rotating(node, moment, power=2)
    return machine


def _shown(machine, true):
    """(speed, harmonic, sensor) of the steady motion, m."""
    nodes = [node - 1 for node in machine.model.sensors]
    return steady_state(true, machine.speed).harmonics(nodes, machine.harmonics)
