"""Rotordynamic analysis of one rig: static loads, whirl, critical speeds, unbalance response, stability."""

import logging
from typing import NamedTuple

import numpy as np

from rotorstudy.errors import RotorstudyError
from rotorstudy.model.rig_items import make_term
from rotorstudy.response.coupling import check_speed
from rotorstudy.response.floquet import varies_in_time
from rotorstudy.response.harmonic import harmonic_response
from rotorstudy.response.resonance import Peak, peaks
from rotorstudy.response.stability import damping_of_effects, eigenvalues
from rotorstudy.response.statics import static_deflection, static_loads
from rotorstudy.response.whirl import (
    OVERDAMPED,
    critical_speeds,
    damped_modes,
    is_in_time,
    time_invariant,
    without_rotation,
)
from rotorstudy.store import dataset
from rotorstudy.studies.common import SPEED
from rotorstudy.studies.growth import growth_over_speed

log = logging.getLogger(__name__)

SPEEDS = 150  # of the Campbell diagram
MODES = 8  # shown, the lowest
NATURAL_FREQUENCIES = 3.5  # default highest speed, relative to the lowest natural frequency
LOWEST_SHARE = 0.02  # of the highest speed: default lowest speed
BALANCE_GRADE = 2.5e-3  # m/s, grade G 2.5 of ISO 21940-11: residual unbalance of a rig that states none
ABOUT_A_RESONANCE = np.sinh(np.linspace(-3, 3, 61)) / np.sinh(3)  # further speeds about a critical one, dense at it
RESONANCE_WIDTHS = 12  # half their range, in half-power half-widths
SAME = 1e-6  # relative difference of whirl frequencies that are equal
OSCILLATING = 0.3  # imaginary part over modulus of an eigenvalue whose motion swings through; slower ones creep back
RESONANT = 0.5  # damping ratio up to which a critical speed shows as a resonance
UNDAMPED = 1e-6  # damping ratio that is round-off: the response at such a critical speed has no bound
NARROWEST = 1e-4  # damping ratio of the narrowest resonance that is resolved
DENSER = 20  # speeds of the response over those of the whirl, where forces without it shift and damp the resonances
UNHELD = 1e-6  # of the lowest natural frequency: eigenvalue of a motion that nothing holds


class Critical(NamedTuple):
    """A critical speed, at which a damped whirl frequency is the spin speed; the mode there.

    speed : rad/s;  damping_ratio : 1;  direction : 1 forward circles, 0 straight lines, -1 backward circles
    """

    speed: float
    damping_ratio: float
    direction: float


class ProbePeak(NamedTuple):
    """A resonance in the 1X amplitude along a probe (m, 0 to peak)."""

    node: int
    probe: str
    peak: Peak


class RotorAnalysis(NamedTuple):
    """Results of `analyse_rotor`.

    data      : xarray.Dataset of whirl, response and growth rate over speed, and of the static deflection
    criticals : list of Critical
    peaks     : list of ProbePeak
    loads     : list of Load, static, of the bearings
    weight    : of the rotor, N
    threshold : lowest speed, rad/s, at which a free motion grows; None if there is none in the range
    damping   : {effect: change of the growth rate of the least stable mode, 1/s} at the threshold, else at the highest
                speed; empty if the stiffness rotates with the shaft
    left_out  : kinds of effects that whirl and response leave out: they rotate with the shaft or are nonlinear
    timeless  : kinds of effects that whirl and stability leave out: they are stated in frequency only
    unbalance : how the rotor is unbalanced, in words
    """

    data: object
    criticals: list
    peaks: list
    loads: list
    weight: float
    threshold: float | None
    damping: dict
    left_out: list
    timeless: list
    unbalance: str

    @property
    def resonant(self):
        """The critical speeds that show as resonances; in film bearings most modes are overdamped."""
        return [one for one in self.criticals if one.damping_ratio <= RESONANT]


def analyse_rotor(model, lowest=None, highest=None, reading=None):
    """Analyse a rotor.

    Parameters
    ----------
    model : Model
        With a value for every amplitude.
    lowest, highest : float, optional
        Range of speeds, rad/s; up to 3.5 times the lowest natural frequency by default.
    reading : Reading, optional
        Directions of the probes; along x and y at each sensor by default.

    Returns
    -------
    RotorAnalysis

    Raises
    ------
    RotorstudyError
        For an amplitude without a value, an empty range of speeds, bearings that are not defined in it, or a rotor that
        its bearings do not hold.
    """
    model.require_values()
    still, steady = time_invariant(model), without_rotation(model)
    timeless = sorted({term.kind for term in steady.terms if not term.acts_on_output and not is_in_time(term)})
    if not (still.is_carried or still.structure.is_supported) and steady.is_carried:
        raise RotorstudyError(
            f"{', '.join(timeless)}: stated in the frequency domain only, so that the whirl of a rotor that nothing "
            "else supports is not known; use bearings with stiffness and damping, such as 'linear' or 'speed_tabulated'"
        )
    _check_held(still, highest or lowest or still.structure.scales.frequency)
    highest = _default_highest(still, lowest) if highest is None else highest
    lowest = LOWEST_SHARE * highest if lowest is None else lowest
    if not 0 < lowest < highest:
        raise RotorstudyError(f"speeds from {lowest:g} to {highest:g} rad/s: give 0 < lowest < highest")
    speeds = check_speed(np.linspace(lowest, highest, SPEEDS))
    log.info("whirl at %d speeds up to %.0f rad/s", len(speeds), highest)
    criticals = [_critical(still, w) for w in critical_speeds(still, highest, speeds=speeds)[0]]
    unbalanced, unbalance = with_unbalance(steady, highest)
    fine = _finer(np.linspace(lowest, highest, DENSER * SPEEDS) if timeless else speeds, criticals)
    log.info("unbalance response at %d speeds", len(fine))
    response = harmonic_response(unbalanced, fine, (1, -1))
    of_node = {node: response[..., model.structure.index(node)].T for node in model.sensors}
    probes, read = probe_vectors(of_node, reading or model.structure.reading)
    deflection = static_deflection(still, [highest], still.theta).value.reshape(-1)
    log.info("stability")
    growing, growth, threshold = growth_over_speed(model, still, speeds)
    return RotorAnalysis(
        data=_dataset(
            model, speeds, fine, damped_modes(still, speeds, MODES), probes, read, (growing, growth), deflection
        ),
        criticals=criticals,
        peaks=[
            ProbePeak(*probe, peak if timeless else _unbounded(peak, criticals, fine))
            for probe, one in zip(probes, np.abs(read.T), strict=True)
            for peak in peaks(fine, one)
        ],
        loads=static_loads(still, deflection, highest),
        weight=float(np.abs(model.structure.static_load @ model.structure.along)),
        threshold=threshold,
        damping={} if varies_in_time(model) else damping_of_effects(still, threshold or highest),
        left_out=sorted({term.kind for term in model.terms} - {term.kind for term in steady.terms}),
        timeless=timeless,
        unbalance=unbalance,
    )


def _default_highest(still, lowest):
    """A highest speed that shows the first critical ones, rad/s."""
    values = eigenvalues(still, [lowest or still.structure.scales.frequency])[0]
    share = np.abs(values.imag) / np.abs(values)
    whirl = np.abs(values.imag[share >= min(OSCILLATING, share.max())])
    if share.max() <= OVERDAMPED:
        raise RotorstudyError("every motion of the rotor is overdamped; state the range of speeds")
    return NATURAL_FREQUENCIES * float(whirl.min())


def _check_held(still, speed):
    """Raise if the rotor can move at a speed (rad/s) without a restoring force."""
    slowest = np.abs(eigenvalues(still, [speed])).min()
    if slowest < UNHELD * still.structure.scales.frequency:
        raise RotorstudyError(
            "the bearings do not hold the rotor, which can move without a restoring force; add bearings"
        )


def _critical(still, speed):
    modes = damped_modes(still, [speed], 2 * len(still.structure.dofs))
    near = np.abs(modes.frequency[0] - speed) < np.nanmin(np.abs(modes.frequency[0] - speed)) + SAME * speed
    nearest = int(np.argmax(np.where(near, modes.direction[0], -np.inf)))  # unbalance drives a forward whirl
    return Critical(float(speed), float(modes.damping_ratio[0, nearest]), float(modes.direction[0, nearest]))


def _finer(speeds, criticals):
    """Speeds with more of them about the critical ones, as a lightly damped resonance is narrow."""
    around = [
        c.speed * (1 + RESONANCE_WIDTHS * max(c.damping_ratio, NARROWEST) * ABOUT_A_RESONANCE)
        for c in criticals
        if abs(c.damping_ratio) > UNDAMPED
    ]
    found = np.unique(np.concatenate([speeds, *around]))
    for one in criticals:
        if abs(one.damping_ratio) < UNDAMPED:
            found = found[np.abs(found - one.speed) > SAME * one.speed]
    return found[(found >= speeds[0]) & (found <= speeds[-1])]


def _unbounded(peak, criticals, speeds):
    """The peak; that of an undamped mode, which lies beside it between two speeds, without bound."""
    at = np.searchsorted(speeds, peak.speed)
    below, above = speeds[max(at - 1, 0)], speeds[min(at + 1, len(speeds) - 1)]
    for one in criticals:
        if below <= one.speed <= above and abs(one.damping_ratio) < UNDAMPED:
            return Peak(one.speed, np.inf, np.inf)
    return peak


def with_unbalance(model, highest):
    """The model with an unbalance, and how it is unbalanced, in words.

    A rotor without a force that rotates with it gets the unbalance of grade G 2.5 for the highest speed (rad/s) at its
    heaviest node.
    """
    acting = [term for term in model.terms if not term.acts_on_output]
    turning = [t for t in acting for u in t.unknowns for e in u.entries if e.is_constant and e.shift == 1]
    if any(np.any(term.theta) for term in turning):
        return model, f"as stated in the rig ({', '.join(sorted({term.kind for term in turning}))})"
    structure = model.structure
    mass = float(structure.along @ structure.mass @ structure.along)
    node = max(structure.nodes, key=lambda n: structure.mass[structure.index(n), structure.index(n)])
    item = {
        "kind": "unbalance",
        "node": node,
        "mass_kg": mass,
        "label": "G 2.5",
        "eccentricity_m": BALANCE_GRADE / highest,
    }
    text = (
        f"none is stated in the rig; it has grade G 2.5 (ISO 21940-11) for {60 * highest / (2 * np.pi):.0f} rpm, "
        f"{1e6 * mass * BALANCE_GRADE / highest:.3g} g mm, at node {node}"
    )
    return model.plus(make_term("effect", item, structure, model.sensors)), text


def probe_vectors(of_node, reading):
    """1X of each probe as it reads.

    of_node : node -> (forward, backward) 1X and -1X of the displacement, each (speed,) complex, m;  reading : Reading
    returns : probes [(node, name)] and their 1X, phase leading the mark, (speed, probe) complex m
    """
    probes, columns = [], []
    for node, (forward, backward) in of_node.items():
        for name, direction in reading.probes_at(node).items():
            probes.append((node, name))
            one = np.exp(-1j * direction) * forward + np.conj(np.exp(-1j * direction) * backward)
            columns.append(one * np.exp(1j * reading.mark_rad))
    return probes, np.stack(columns, axis=-1)


def _dataset(model, speeds, fine, modes, probes, read, growth, deflection):
    coordinates = {
        "speed": (speeds, *SPEED),
        "growth_speed": (growth[0], "rad/s", "spin speed of the growth rate"),
        "mode": (np.arange(1, MODES + 1), "1", "whirl mode, by frequency"),
        "response_speed": (fine, "rad/s", "spin speed of the unbalance response"),
        "probe": ([f"{name} at node {node}" for node, name in probes], "1", "probe"),
        "coordinate": ([f"{motion} at node {node}" for node, motion in model.structure.dofs], "1", "coordinate"),
    }
    variables = {
        "frequency": (("speed", "mode"), modes.frequency, "rad/s", "damped whirl frequency"),
        "damping_ratio": (("speed", "mode"), modes.damping_ratio, "1", "damping ratio"),
        "direction": (("speed", "mode"), modes.direction, "1", "1 forward, 0 straight lines, -1 backward"),
        "forward_shape": (("speed", "mode", "coordinate"), modes.forward, "1", "forward part of the mode"),
        "backward_shape": (("speed", "mode", "coordinate"), modes.backward, "1", "backward part of the mode"),
        "unbalance_response": (("response_speed", "probe"), read, "m", "1X of the probe, lead from the mark"),
        "probe_node": (("probe",), np.array([node for node, _ in probes]), "1", "node of the probe"),
        "growth_rate": (("growth_speed",), growth[1], "1/s", "growth rate of the fastest growing free motion"),
        "static_deflection": (("coordinate",), deflection, "m", "static deflection (rad for tilts)"),
    }
    return dataset(variables, coordinates, title="rotordynamic analysis")
