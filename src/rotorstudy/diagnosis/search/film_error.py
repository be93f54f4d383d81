"""What the linear coefficients of an oil film leave out: the part of its force that grows faster than the orbit.

About its equilibrium the force of a film is a power series in the orbit over the clearance, of which stiffness and
damping are the first term. Each further term is the one before times the orbit over the clearance, so that its
harmonics are sums of theirs: of a motion at 1X the second gives 0X and 2X, the third 1X and 3X. Their coefficients are
of the size of the first one times the relative change of the stiffness per eccentricity ratio, which is 1 to 4 in films
that carry a load (J. W. Lund and K. K. Thomsen, A calculation method and data for the dynamic coefficients of
oil-lubricated journal bearings, 1978). They are a force in the film, which all probes show. Its part at nX turns
by n times the phase of the orbit at 1X, and its size changes slowly. So probes and speeds have this error in common.

Where a journal runs (0X) is known only as far as its probes keep their place. Journal, bracket and probe warm up, which
moves it by some per cent of the clearance from speed to speed, and by any share since the probe was set; so only how a
journal moves with the speed counts. On the machines of `benchmarks/plant.py` that tells a clearance to 11 to 24 % and
a load to 37 to 60 %. Vibration tells a clearance to 4 to 5 % by a rig from drawings, and clearance and load to 2 and
3 % between two states. So the gap voltages of tables, which add nothing, are no data of a fit.
"""

from dataclasses import replace

import numpy as np

from rotorstudy.diagnosis.search.form import SLOWLY_VARYING, over_speeds
from rotorstudy.diagnosis.search.shown_forces import shown_forces
from rotorstudy.diagnosis.settings import Settings
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.prediction import neighbourhood
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.entries import apply_entries
from rotorstudy.model.model import Model
from rotorstudy.model.registry import registry

GROWTH = 1.0  # half the relative change of the stiffness of a film per eccentricity ratio
LARGEST = 1.0  # orbit over the clearance
DEGREES = (2, 3, 4, 5)  # of the terms
CONSTANT, SLOW, FREE = SLOWLY_VARYING  # of their variance over the speeds: it changes as the eccentricity does
DRIFT = 0.05  # of the clearance, of a mean position with the temperature, beside what is the same at all speeds


def with_offset_of_mean(settings: Settings, spectrum: Spectrum, model: Model) -> Settings:
    """The settings with an unknown offset of 0X at each sensor in every run, if films carry the machine."""
    films, effects = _films(model), registry().plugins["effect"]
    offsets = [name for name, one in effects.items() if one.nuisance == "clearance" and name not in settings.nuisance]
    if not films or 0 not in spectrum.harmonics:
        return settings
    std = max(film.options["radial_clearance_m"] for film in films)
    nuisance = settings.nuisance | dict.fromkeys(offsets, std)
    return settings.model_copy(update={"nuisance": nuisance, "run_to_run": [*settings.run_to_run, *offsets]})


def _films(model):
    return [term for term in model.structure.bearings if term.options.get("radial_clearance_m")]


def with_film_error(
    spectrum: Spectrum, model: Model, theta: np.ndarray | None = None, growth: np.ndarray | None = None
) -> Spectrum:
    """The spectrum with what linear films leave out as common errors, and with drift; the same without films.

    model  : whose motion it is
    theta  : (parameter,) values of the amplitudes, by default as stated
    growth : (speed,) by which orbits have changed, relative to those of the model, of a spectrum that is a change
    """
    films = _films(model)
    if not films or model.before is not None:
        return spectrum
    near = neighbourhood(model, spectrum, theta)
    try:
        motion, carried = near.motion.amplitude, np.array(near.blocks.harmonics)
    except NoSteadyState:
        return spectrum
    errors, variance, structure = [], np.zeros(spectrum.amplitude.shape), model.structure
    modes = over_speeds(spectrum.speed, (CONSTANT, SLOW, 0.0))[:, None, :, None, None]
    for film in films:
        node = film.options["node"] or structure.default_node()
        in_housing = structure.against_casing(node) if node in structure.housings else structure.unit(node)
        parts = zip(film.theta, film.unknowns, strict=True)
        force = sum(x * apply_entries(u.entries, motion, spectrum.speed, carried) for x, u in parts)
        orbit = motion @ in_housing / film.options["radial_clearance_m"]
        square = _further_terms(force[..., structure.index(node)], orbit, carried, growth)
        size = np.sqrt(square[:, np.searchsorted(carried, spectrum.harmonics)]).T[..., None, None]
        # of forces that keep their time to the motion at 1X
        turn = np.exp(1j * np.angle(orbit[:, carried == 1]) * np.asarray(spectrum.harmonics)).T[..., None, None]
        (shown,) = shown_forces(near, spectrum, [in_housing])
        real, imaginary = size * shown.reshape(2, -1, *shown.shape[1:])
        in_phase, in_quadrature = turn.real * real + turn.imag * imaginary, turn.real * imaginary - turn.imag * real
        errors += [(modes * one).reshape(-1, *variance.shape) for one in (in_phase, in_quadrature)]
        variance += FREE / 4 * np.sum(np.abs(in_phase) ** 2 + np.abs(in_quadrature) ** 2, axis=0)
    drift = DRIFT * max(film.options["radial_clearance_m"] for film in films)
    variance[:, np.asarray(spectrum.harmonics) == 0] += drift**2
    return replace(spectrum.with_error(variance), common_error=spectrum.shown(np.concatenate(errors)))


def _further_terms(force, orbit, carried, growth):
    """Mean square (speed, harmonic), N^2, of the further terms of the force of a film, at the harmonics carried.

    force : (speed, harmonic), N, the first term;  orbit : (speed, harmonic), over the clearance
    """
    last, moving = int(np.abs(carried).max()), carried != 0
    term, factor = (np.zeros((len(force), 2 * last + 1)) for _ in range(2))
    for power, one in ((term, force), (factor, orbit)):
        power[:, last + carried[moving]] = np.abs(one[:, moving]) ** 2
    factor = factor + factor[:, ::-1]  # the force depends on the orbit and on its conjugate
    factor *= np.minimum(1.0, LARGEST**2 / np.maximum(factor.sum(axis=1, keepdims=True) / 2, np.finfo(float).tiny))
    term, found = term + term[:, ::-1], np.zeros_like(term)
    for degree in DEGREES:
        term = np.stack([np.convolve(*pair, "same") for pair in zip(term, factor, strict=True)])
        # in a change: of a part that grows with that power of the orbit
        more = 1.0 if growth is None else ((1 + np.minimum(growth, LARGEST)[:, None]) ** degree - 1) ** 2
        found += more * term
    return GROWTH**2 * found[:, last + carried]
