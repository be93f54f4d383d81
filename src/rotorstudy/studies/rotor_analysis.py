"""Rotordynamic analysis of one rig: static loads, whirl, critical speeds, unbalance response, stability."""

import logging
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import RigError, RotorstudyError
from rotorstudy.response import whirl
from rotorstudy.response.coupling import check_speed
from rotorstudy.response.few_shapes import few_shapes
from rotorstudy.response.floquet import varies_in_time
from rotorstudy.response.harmonic import harmonic_response
from rotorstudy.response.stability import damping_of_effects, eigenvalues
from rotorstudy.response.statics import static_deflection, static_loads
from rotorstudy.studies.common import results
from rotorstudy.studies.growth import growth_over_speed
from rotorstudy.studies.stability_margin import StabilityMargin, decrement_over_speed
from rotorstudy.studies.unbalance_response import NARROWEST, finer_speeds, probe_vectors, unbounded, with_unbalance

log = logging.getLogger(__name__)

SPEEDS = 150  # of the Campbell diagram
MODES = 8  # shown, the lowest
NATURAL_FREQUENCIES = 3.5  # default highest speed, relative to the lowest natural frequency
LOWEST_SHARE = 0.02  # of the highest speed: default lowest speed
OSCILLATING = 0.3  # imaginary part over modulus of an eigenvalue whose motion swings through; slower ones creep back
DENSER = 20  # speeds of the response over those of the whirl, where forces without it shift and damp the resonances


class ProbePeak(NamedTuple):
    """A resonance in the 1X amplitude along a probe (m, 0 to peak)."""

    node: int
    probe: str
    peak: whirl.Peak


class RotorAnalysis(NamedTuple):
    """Results of `analyse_rotor`."""

    data: object  # xarray.Dataset of whirl, response and growth rate over speed, and of the static deflection
    criticals: list  # list of whirl.Critical
    peaks: list  # list of ProbePeak, the resonances; with forces that whirl leaves out, every maximum of the response
    loads: list  # list of Load, static, of the bearings
    weight: float  # of the rotor, N
    threshold: float | None  # lowest speed, rad/s, at which a free motion grows; None if there is none in the range
    # {effect: part of the growth rate of the least stable mode, 1/s} at the threshold, else at the highest speed
    damping: dict  # empty if the stiffness rotates with the shaft
    left_out: list  # kinds of effects of which whirl and response leave out what rotates with the shaft or is nonlinear
    timeless: list  # kinds of effects that whirl and stability leave out: they are stated in frequency only
    at_spin_speed: bool  # whether whirl and stability take the timeless ones as they act at the spin speed instead
    unbalance: str  # how the rotor is unbalanced, in words
    operating: tuple[float, float] | None = None  # lowest and highest operating speed, rad/s, if stated
    margin: StabilityMargin | None = None  # StabilityMargin at the highest
    centrelines: tuple = ()  # list of Centreline, where journals run in their films

    @property
    def resonant(self):
        """The critical speeds that show as resonances; in film bearings most modes are overdamped."""
        return [one for one in self.criticals if one.damping_ratio <= whirl.RESONANT]


def analyse_rotor(model, lowest=None, highest=None, reading=None, covered=0.0):
    """The RotorAnalysis of a Model with a value for every amplitude, whose bearings hold it.

    lowest, highest : range of speeds, rad/s; by default to 3.5 times the lowest natural frequency, at least `covered`
    reading         : Reading, directions of the probes; along x and y at each sensor by default
    """
    model.require_values()
    still, steady = whirl.time_invariant(model), whirl.without_rotation(model)
    timeless = sorted({term.kind for term in steady.terms if not term.acts_on_output and not whirl.is_in_time(term)})
    at_spin_speed = whirl.is_held_in_frequency(steady)
    at_rest, moving = (steady, whirl.synchronous(model)) if at_spin_speed else (still, model)
    whirl.check_held(still, highest or lowest or still.structure.scales.frequency)
    highest = max(_default_highest(still, lowest), covered) if highest is None else highest
    lowest = LOWEST_SHARE * highest if lowest is None else lowest
    if not 0 < lowest < highest:
        raise RotorstudyError(f"speeds from {lowest:g} to {highest:g} rad/s: give 0 < lowest < highest")
    speeds = check_speed(np.linspace(lowest, highest, SPEEDS))
    log.info("whirl at %d speeds up to %.0f rad/s", len(speeds), highest)
    criticals = [whirl.critical_at(still, w) for w in whirl.critical_speeds(still, highest, speeds=speeds)[0]]
    unbalanced, unbalance = with_unbalance(steady, highest)
    fine = finer_speeds(np.linspace(lowest, highest, DENSER * SPEEDS) if timeless else speeds, criticals)
    log.info("unbalance response at %d speeds", len(fine))
    response = harmonic_response(unbalanced, fine, (1, -1))
    of_node = {node: response[..., model.structure.index(node)].T for node in model.sensors}
    probes, read = probe_vectors(of_node, reading or model.structure.reading)
    deflection = static_deflection(at_rest, [highest], at_rest.theta).value.reshape(-1)
    amplitudes = zip(probes, np.abs(read.T), strict=True)
    found = [ProbePeak(*probe, peak) for probe, one in amplitudes for peak in whirl.peaks(fine, one)]
    log.info("stability")
    modes = whirl.damped_modes(still, speeds, MODES)
    decrement = decrement_over_speed(model, speeds, modes)
    growing, growth, threshold = growth_over_speed(moving, still, speeds)
    given = {"speed": speeds, "mode": np.arange(1, MODES + 1), "log_decrement": decrement}
    given |= {"frequency": modes.frequency, "damping_ratio": modes.damping_ratio, "direction": modes.direction}
    given |= {"forward_shape": modes.forward, "backward_shape": modes.backward}
    given |= {"growth_speed": growing, "growth_rate": growth, "response_speed": fine, "unbalance_response": read}
    given |= {"probe": [f"{name} at node {node}" for node, name in probes], "probe_node": [node for node, _ in probes]}
    given["coordinate"] = [f"{motion} at node {node}" for node, motion in model.structure.dofs]
    return RotorAnalysis(
        data=results("rotor_analysis", "rotordynamic analysis", **given, static_deflection=deflection),
        criticals=criticals,
        peaks=found if timeless else _resonances(still, found, criticals, fine),
        loads=static_loads(at_rest, deflection, highest),
        weight=float(np.abs(model.structure.static_load @ model.structure.along)),
        threshold=threshold,
        damping={} if varies_in_time(model) else damping_of_effects(still, threshold or highest),
        left_out=sorted({term.kind for term in model.terms for one in term.unknowns if one.name not in steady.names}),
        timeless=timeless,
        at_spin_speed=at_spin_speed,
        unbalance=unbalance,
    )


def _default_highest(still, lowest):
    """A highest speed that shows the first critical ones, rad/s."""
    values = eigenvalues(still, [lowest or still.structure.scales.frequency], shapes=few_shapes(still))[0]
    share = np.abs(values.imag) / np.abs(values)
    whirling = np.abs(values.imag[share >= min(OSCILLATING, share.max())])
    if share.max() <= whirl.OVERDAMPED:
        raise RigError("every motion of the rotor is overdamped; state the range of speeds")
    return NATURAL_FREQUENCIES * float(whirling.min())


def _resonances(still, found, criticals, speeds):
    """The peaks at which a whirl frequency is the spin speed within its half-power width; others swing with no mode."""
    found = [one._replace(peak=unbounded(one.peak, criticals, speeds)) for one in found]
    at = {w: eigenvalues(still, [w], shapes=few_shapes(still))[0] for w in {one.peak.speed for one in found}}

    def swings(speed):
        width = 2 * np.maximum(np.abs(at[speed].real), NARROWEST * speed)
        return np.any(np.abs(np.abs(at[speed].imag) - speed) <= width)

    return [one for one in found if swings(one.peak.speed)]
