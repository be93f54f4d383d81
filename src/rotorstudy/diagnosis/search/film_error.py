"""What the linear coefficients of an oil film leave out: the part of its force that grows faster than the orbit.

About its equilibrium the force of a film is a power series in the orbit over the clearance, of which stiffness and
damping are the first term. The second gives 0X and 2X, the third 1X and 3X, and so on. Their coefficients are of the
size of the first one times the relative change of the stiffness per eccentricity ratio, which is 1 to 4 in films that
carry a load (J. W. Lund and K. K. Thomsen, A calculation method and data for the dynamic coefficients of oil-lubricated
journal bearings, 1978).
"""

import numpy as np

from rotorstudy.diagnosis.search.free_forces import shown_forces
from rotorstudy.errors import NoSteadyState
from rotorstudy.inference.prediction import carried_order
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.entries import apply_entries
from rotorstudy.model.model import Model
from rotorstudy.response.neighbourhood import Neighbourhood

GROWTH = 1.0  # half the relative change of the stiffness of a film per eccentricity ratio
LARGEST = 1.0  # orbit over the clearance


def with_film_error(spectrum: Spectrum, model: Model, growth: np.ndarray | None = None) -> Spectrum:
    """The spectrum with its covariance enlarged by what linear films leave out; the same without films.

    model  : of the rig, with a value for every amplitude
    growth : (speed,) by which orbits have changed, relative to those of the model, of a spectrum that is a change
    """
    films = [term for term in model.structure.bearings if term.options.get("radial_clearance_m")]
    if not films or model.before is not None:
        return spectrum
    near = Neighbourhood(model, spectrum.speed, spectrum.harmonics, order=carried_order(spectrum))
    try:
        motion, carried = near.motion.amplitude, near.blocks.harmonics
    except NoSteadyState:
        return spectrum
    degree = np.maximum(np.abs(spectrum.harmonics), np.where(spectrum.harmonics % 2, 3, 2))
    variance, structure = np.zeros(spectrum.amplitude.shape), model.structure
    for film in films:
        node = film.options["node"] or structure.default_node()
        place, in_housing = structure.index(node), structure.unit(node)
        if node in structure.housings:
            in_housing = structure.against_casing(node)
        parts = zip(film.theta, film.unknowns, strict=True)
        force = sum(x * apply_entries(u.entries, motion, spectrum.speed, carried)[..., place] for x, u in parts)
        moving = np.array(carried) != 0
        orbit, size = (np.linalg.norm(one[:, moving], axis=1) for one in (motion @ in_housing, force))
        ratio = np.minimum(orbit / film.options["radial_clearance_m"], LARGEST)
        more = GROWTH * size[:, None] * ratio[:, None] ** (degree - 1)  # (speed, harmonic), N
        if growth is not None:  # of a part that grows with that power of the orbit
            more *= (1 + np.minimum(growth, LARGEST)[:, None]) ** degree - 1
        (shown,) = shown_forces(near, spectrum, [in_housing])  # real and imaginary parts
        of_unit = np.abs(shown.reshape(2, -1, *shown.shape[1:])) ** 2
        variance += np.einsum("phsnc,sh->snc", of_unit, more**2 / 4)
    return spectrum.with_error(variance)
