"""How a blind test applies each effect to the machine or to its measurement, by name of the effect."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rotorstudy.blind import chain, physics, physics_in_time


class Scale(NamedTuple):
    """Characteristic sizes at a node: vibration amplitude (m), velocity (m/s) and elastic force (N)."""

    radius: float
    velocity: float
    force: float


@dataclass(frozen=True)
class SimulatedEffect:
    """How an effect of the plugin library is simulated, by physics independent of its table.

    on       : "rotor" for function(plant, values, where); "output" for function(signal, angle, speed, values, where,
               sensors) -> signal; "speed" if the spin speed differs from its label (no function)
    signed   : real amplitudes are drawn with either sign
    most     : largest amplitude in units of the typical size; None if it follows from the unit
    """

    on: str
    function: Callable | None = None
    signed: bool = False
    most: float | None = None


@dataclass(frozen=True)
class ForeignEffect(SimulatedEffect):
    """Physics that is missing in the library.

    size, unit  : name and unit of its amplitude
    confounders : effects of the library that it may be mistaken for
    draw        : function(Scale, generator) -> amplitude of the order of the motion, further options
    """

    size: str = ""
    unit: str = "1"
    confounders: tuple[str, ...] = ()
    draw: Callable | None = None


def _named(on, *functions, **attributes):
    return {function.__name__: SimulatedEffect(on, function, **attributes) for function in functions}


SIMULATED_EFFECTS = {
    **_named(
        "rotor",
        physics.unbalance, physics.couple_unbalance, physics.bow, physics.angular_misalignment,
        physics.parallel_misalignment, physics.base_motion, physics.static_preload, physics.external_damping,
        physics.internal_damping, physics.shaft_damping, physics.hysteretic_damping, physics.cross_coupling,
        physics.support_anisotropy, physics.added_mass, physics_in_time.shaft_asymmetry, physics_in_time.rub,
        physics_in_time.looseness, physics_in_time.cubic_stiffness, physics.seal, physics.pedestal_resonance,
    ),
    **_named(
        "rotor",
        physics.gravity_direction, physics.stiffness_error, physics.support_stiffness, physics.gyroscopic_error,
        physics.support_loss, physics.bearing_coefficients,
        signed=True,
    ),
    **_named("rotor", physics_in_time.breathing_crack, most=1.5),
    **_named("output", chain.swapped_probes, chain.reversed_probe, chain.runout, chain.delay, chain.ac_coupling),
    **_named(
        "output", chain.probe_gain, chain.probe_angle, chain.probe_error, chain.phase_reference,
        signed=True,
    ),
    "speed_error": SimulatedEffect("speed", signed=True),
    "coulomb_friction": ForeignEffect(
        "rotor", physics_in_time.coulomb_friction, size="friction_N", unit="N", confounders=("external_damping",),
        draw=lambda scale, generator: (scale.force, {"smooth_m_per_s": 0.1 * scale.velocity}),
    ),
    "quadratic_damping": ForeignEffect(
        "rotor", physics_in_time.quadratic_damping, size="drag_N_s2_per_m2", unit="N s2/m2",
        confounders=("external_damping",),
        draw=lambda scale, generator: (scale.force / scale.velocity**2, {}),
    ),
    "gear_mesh": ForeignEffect(
        "rotor", physics.gear_mesh, size="mesh_force_N", unit="N", confounders=("base_motion", "runout"),
        draw=lambda scale, generator: (
            scale.force,
            {"direction_rad": generator.uniform(0, np.pi), "phase_rad": generator.uniform(-np.pi, np.pi)},
        ),
    ),
    "probe_saturation": ForeignEffect(
        "output", chain.probe_saturation, size="bending_per_m", unit="1/m", confounders=("probe_gain",),
        draw=lambda scale, generator: (1 / scale.radius, {}),
    ),
    "mains_modulation": ForeignEffect(
        "output", chain.mains_modulation, size="ripple", confounders=("probe_gain",),
        draw=lambda scale, generator: (1.0, {}),
    ),
}  # fmt: skip
