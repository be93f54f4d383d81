"""Invariants of an effect: places, units, agreement of time and frequency domain, and identifiability."""

import inspect
import re
from dataclasses import replace

import numpy as np

from rotorstudy.authoring.invariants import bench
from rotorstudy.authoring.invariants.base import SPEEDS, BrokenInvariant, require
from rotorstudy.errors import RotorstudyError, check_known
from rotorstudy.model.entries import apply_entries
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry
from rotorstudy.model.rig_items import named
from rotorstudy.response.harmonic import harmonic_response
from rotorstudy.response.integration import force_in_time, time_response
from rotorstudy.units import unit_ending

SCALES = dict.fromkeys(("length", "vibration", "shaft"), "m") | {"frequency": "rad/s", "time": "s"}  # of `Effect.shape`
UNITS = ("kg", "m", "s", "rad", "N", "Pa", "K", "V", "A", "W", "J", "Hz")  # of which others are made, all SI


def effect_offers_places(plugin):
    """states places where it can act, each once"""
    bench.bench_of(plugin)
    for structure in (bench.bench_structure(), bench.tilting_bench()):
        found = bench.places_of(plugin, structure, structure.nodes)
        require(all(found.count(place) == 1 for place in found), f"it states a place twice: {found}")
        for place in found:
            with named(f"it cannot act at its own place {place}"):
                bench.typical_term(plugin, structure, place)


def effect_names_exist(plugin):
    """names options, parameters and other effects that exist"""
    options = {*inspect.signature(plugin.function).parameters}
    structure, place = bench.bench_of(plugin)
    terms = [bench.typical_term(plugin, structure, place | more) for more in ({}, plugin.hypothesis)]
    own = {parameter.name for term in terms for parameter in term.parameters}
    feared = plugin.feared
    for name, stated, known in (
        ("option", [*plugin.hypothesis, *plugin.alternatives, *plugin.formulas, *plugin.parts], options),
        ("parameter", plugin.positive if isinstance(plugin.positive, tuple) else (), own),
        ("parameter", plugin.form_error if isinstance(plugin.form_error, dict) else (), own),
        ("option or parameter", [feared.size] if feared else (), options | own),
        ("option", [*feared.shape, *feared.worst] if feared else (), options),
        ("effect", [*plugin.confounders, *plugin.brings], registry().plugins["effect"]),
    ):
        check_known(name, stated, known, f"@Effect of '{plugin.name}'")


def effect_shape_is_open(plugin):
    """has shape options with ranges in their units that contain their defaults, or do nothing by default"""
    known = inspect.signature(plugin.function).parameters
    for name, scale in ((name, ends[2]) for name, ends in plugin.shape.items() if len(ends) > 2):
        check_known("scale", [scale], SCALES, f"shape '{name}'")
        told = f"shape '{name}' has a range in the scale '{scale}', of {SCALES[scale]}, and a name that ends otherwise"
        require(unit_ending(name)[1] == SCALES[scale], told)
    for name, (low, high) in plugin.ranges(bench.bench_of(plugin)[0]).items():
        require(name in known, f"shape '{name}' is not an option of the function")
        require(low < high, f"shape '{name}' has the range {low:g} to {high:g}")
        default = plugin.example[name] if known[name].default is inspect.Parameter.empty else known[name].default
        inside = default is None or low <= default <= high
        require(inside, f"shape '{name}' has the default {default} outside {low:g} to {high:g}")


def term_states_units(plugin):
    """states the unit and a typical size of every parameter"""
    parameters = bench.typical_term(plugin, *bench.bench_of(plugin)).parameters
    require(parameters, "it has no parameters")
    for parameter in parameters:
        check_known("unit", re.findall("[^ ^/0-9-]+", parameter.unit), UNITS, f"'{parameter.unit}' of {parameter.name}")
        size = parameter.typical
        require(size > 0, f"{parameter.name} has the typical size {size:g}; it must be positive")


def term_is_one_table(plugin):
    """has the same force in time and in frequency, or states that it has no time-domain form"""
    structure, place = bench.bench_of(plugin)
    term = bench.typical_term(plugin, structure, place)
    if any(unknown.force for unknown in term.unknowns):
        check_steady_state(term, structure)
    else:
        check_table(term, len(structure.nodes if term.acts_on_output else structure.dofs))
        entries = [] if term.acts_on_output else [entry for unknown in term.unknowns for entry in unknown.entries]
        if any(e.order == 2 for e in entries) and not any(e.frequency_only for e in entries):
            check_steady_state(term, structure, 2 * bench.SERIES_ORDER)  # a mass, which may rotate, is no force in time


def check_steady_state(term, structure, order=bench.HIGHEST):
    """Check that harmonic balance agrees with time integration, within a share of the effect of the force."""
    forces = [p.name for p in term.parameters if p.force] or list(term.values)
    other_terms, w = Model(structure, bench.bench_terms(structure)), SPEEDS[1]
    model = other_terms.plus(term)
    inert = other_terms.plus(replace(term, values=term.values | dict.fromkeys(forces, 0.0)))
    harmonics = np.arange(-order, order + 1)
    found, without = (harmonic_response(m, [w], harmonics)[0] for m in (model, inert))
    size, moves = np.abs(found - without).max(), np.abs(without[harmonics != 0]).max()
    told = f"the force is zero on the bench, which vibrates by {moves:.1g} m without it"
    require(size > 0, f"{told}; state options with which it acts: example={{'clearance_m': {moves / 10:.1g}}}")
    # after two revolutions a wrong start has lost 96 % of its error
    sampled = (2 + np.arange(128) / 128) * 2 * np.pi / w
    start = (found.sum(axis=0), 1j * w * harmonics @ found)
    moved = time_response(model, w, sampled, start=start, relative_tolerance=1e-8)
    seen = (np.fft.fft(moved, axis=0) / len(sampled))[harmonics]
    off = np.abs(found - seen).max()
    # a sudden contact has harmonics beyond those carried, which decrease with the cube of their number
    told = f"its steady state by harmonic balance and time integration differ by {off:.3g} m"
    require(off < 1e-2 * size, f"{told}; it changes the motion by {size:.3g} m")


def check_table(term, dof):
    """Check that the force of each amplitude in frequency is the Fourier transform of its force in time."""
    generator = np.random.default_rng(1)
    w, harmonics = 88.0, np.arange(-9, 10)
    time = np.arange(128) * 2 * np.pi / w / 128
    amplitude = np.zeros((1, len(harmonics), dof), complex)
    amplitude[:, 7:12] = generator.normal(size=(1, 5, dof)) + 1j * generator.normal(size=(1, 5, dof))
    turning = np.exp(1j * harmonics * w * time[:, None])
    motion = [turning * (1j * harmonics * w) ** order @ amplitude[0] for order in range(3)]
    still = generator.normal(size=dof) + 1j * generator.normal(size=dof)
    motion[0] = motion[0] + still
    for unknown in term.unknowns:
        column = apply_entries(unknown.entries, amplitude, np.array([w]), harmonics, still)[0]
        if any(entry.frequency_only for entry in unknown.entries):
            try:
                force_in_time(unknown.entries, w, time, *motion)
            except RotorstudyError:
                continue
            raise BrokenInvariant(f"{unknown.name} is defined in the frequency domain only, but gives a force in time")
        force = force_in_time(unknown.entries, w, time, *motion, deflection=still)
        seen = (np.fft.fft(force, axis=0) / len(time))[harmonics]
        off = np.abs(column - seen).max()
        told = f"the force of {unknown.name} in frequency and in time differ by {off:.3g} N"
        require(off <= 1e-10 * np.abs(seen).max(), told)


def term_is_found_again(plugin):
    """is identified from its own simulated response, from a start 30 % off"""
    structure, place = bench.bench_of(plugin)
    bench.check_round_trip(bench.typical_term(plugin, structure, place), structure)
