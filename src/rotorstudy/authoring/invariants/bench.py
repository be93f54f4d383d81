"""Bench rotors for checking effects, bearings and estimators, and the round trip of their parameters."""

from dataclasses import replace

import numpy as np

from rotorstudy.authoring.invariants.base import HARMONICS, SPEEDS, BrokenInvariant, kind_of, require
from rotorstudy.inference.output_error import output_error_fit
from rotorstudy.inference.problem import Problem
from rotorstudy.measurement.spectrum import Spectrum, independent_covariance
from rotorstudy.model.cracks import crack_parameters
from rotorstudy.model.entries import Entry
from rotorstudy.model.kinds import Crack, Effect
from rotorstudy.model.model import Model
from rotorstudy.model.registry import blamed, registry
from rotorstudy.model.rig_items import make_term
from rotorstudy.model.shaft import Section
from rotorstudy.model.structure import Structure
from rotorstudy.model.terms import Parameter, Term
from rotorstudy.response.measured import measured_response

SERIES_ORDER = 15
HIGHEST = SERIES_ORDER + 2  # harmonic of the force of the known crack at rest: of its part on the conjugate


def bench_structure():
    """One mass on a shaft, 2 kg and 98 Hz, for effects and bearings."""
    stiffness = 7.6e5
    return Structure(
        mass=np.array([[2.0]]),
        stiffness=np.array([[stiffness]]),
        gyroscopic=np.zeros((1, 1)),
        static_load=np.array([2.0 * 9.81]),
        dofs=((1, "translation"),),
        stiffness_loss={"stiffness_loss": (np.eye(1), "N/m", 0.3 * stiffness)},
    )


def tilting_bench():
    """The same mass as a disc with tilt and gyroscopic moment, off mid-span, for effects on the tilt or the shaft."""
    bent = Section(0.2, 0.015, 0.0, 2.1e11, 0.3, moment=np.array([6e4, 2e3]), own_moment=0.1, stiffness=8e3)
    return replace(
        bench_structure(),
        mass=np.diag([2.0, 0.0024]),
        stiffness=np.array([[7.6e5, 3e4], [3e4, 1.2e4]]),
        gyroscopic=np.diag([0.0, 0.0036]),
        static_load=np.array([2.0 * 9.81, 0.0]),
        dofs=((1, "translation"), (1, "tilt")),
        stiffness_loss={"stiffness_loss": (np.diag([1.0, 0.0]), "N/m", 0.3 * 7.6e5)},
        section_at=lambda position: bent,
        length=0.4,
    )


def bearing_bench():
    """The first one on a bearing whose numbers may change, for effects on these, and on the like as a foundation."""
    structure = bench_structure()
    plugin = next(plugin for kind, plugin in registry() if kind == "bearing" and plugin.changeable)
    springs = (typical_term(one, structure, {"node": 1}) for kind, one in registry() if kind == "bearing")
    under = next(term for term in springs if any(p.unit == "N/m" for p in term.parameters))
    return replace(structure, bearings=(typical_term(plugin, structure),), foundation=(under,))


def bench_terms(structure):
    """A known damper and a known crack, so that the rotor vibrates at all harmonics."""
    here = np.diag(np.diag(structure.mass) / structure.mass[0, 0])
    damping = Parameter("damping", "N s/m", (Entry(-here, order=1),), typical=100.0)
    breathing = {k: np.sinc(k / 2) / 2 for k in range(-SERIES_ORDER, SERIES_ORDER + 1)}  # open for half a revolution
    shares = breathing.items()
    crack = Crack("bench", None, source="", series=lambda order: {k: s for k, s in shares if abs(k) <= order})
    loss = crack_parameters(crack, structure)
    return (
        Term("bench_damping", (damping,), {"damping": 90.0}, label="bench"),
        Term("bench_crack", tuple(loss), {p.name: 0.13 * 7.6e5 for p in loss}, label="bench"),
    )


def places_of(plugin, structure, sensors):
    """Options of each place where an effect can act on a rotor; a bearing has one place without options."""
    if not isinstance(plugin, Effect):
        return [{}]
    try:
        found = plugin.places(structure, sensors)
    except TypeError as error:
        raise BrokenInvariant(f"places(structure, sensors): {blamed(error) or error}") from None
    given = isinstance(found, list) and all(isinstance(place, dict) for place in found)
    require(given, f"places(structure, sensors) gives {found!r}; it must give a list of options, as [{{'node': 1}}]")
    return found


def bench_of(plugin):
    """The first bench rotor on which a plugin can act, and the options of that place."""
    for structure in (bench_structure(), tilting_bench(), bearing_bench()):
        found = places_of(plugin, structure, structure.nodes)
        if found:
            return structure, found[0]
    raise BrokenInvariant("it has no place on any bench rotor")


def typical_term(plugin, structure, place=None):
    """An effect or bearing at a place (its own by default), every parameter with its typical size."""
    item = {"kind": plugin.name, **(place or {}), **plugin.example}
    term = make_term(kind_of(plugin), item, structure, structure.nodes)
    return replace(term, values={p.name: p.typical * (np.exp(0.6j) if p.is_complex else 1) for p in term.parameters})


def check_round_trip(term, structure):
    """Check that a term is identified from its own response, from a start 30 % off."""
    model = Model(structure, (*bench_terms(structure), *structure.bearings, term))
    spectrum = exact_spectrum(model, measured_response(model, SPEEDS, HARMONICS))
    names = tuple(unknown.name for unknown in term.unknowns)
    true = model.theta[model.position(names)]
    found = output_error_fit(Problem(model, spectrum, names), start=1.3 * true).theta
    off = np.abs(found - true) / np.abs(true).max()
    worst = off.argmax()
    told = f"{names[worst]} is identified as {found[worst]:.7g}, simulated with {true[worst]:.7g}"
    require(off.max() < 1e-6, told)


def exact_spectrum(model, shown):
    """Harmonics (..., speed, harmonic, sensor), m, as a Spectrum with negligible noise."""
    covariance = independent_covariance(np.full(np.shape(shown)[-3:], 1e-9) ** 2)
    return Spectrum(shown, np.array(SPEEDS), np.array(HARMONICS), model.sensors, covariance)
