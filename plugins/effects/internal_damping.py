import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


def internal_damping(structure, node: int | None = None):
    """Viscous damping in the rotating shaft: force -c (dz/dt - j w z), that is -j (n - 1) w c z_n on harmonic n."""
    here = structure.unit(structure.default_node() if node is None else node)
    here = np.outer(here, here)
    entries = (Entry(-here, order=1), Entry(1j * here, gain=lambda speed: speed))
    return [Parameter("internal_damping", "N s/m", entries, 0.008 * structure.scales.critical_damping(node))]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "internal_damping",
        internal_damping,
        source="Tondl 1965; thesis Eq. (2.7)",
        positive=True,
        checked="-c (dz/dt - j w z) in time to 1e-12; onset at w_n (1 + c_e / c_i) in tests/physics/test_stability.py",
        confounders=(
            (
                "seal",
                "equal with external damping at the node; only the force of a seal changes with its pressure drop",
            ),
            ("external_damping", "internal damping has no force at +1X and gives a static cross force at 0X"),
            ("shaft_damping", "equal on a rotor of one coordinate; internal damping acts at one node"),
            (
                "cross_coupling",
                "cross-coupling does not grow with the speed and acts at +1X, where internal damping has no force",
            ),
            (
                "phase_reference",
                "a wrong mark also shifts the phase far from resonance, where damping has little influence",
            ),
        ),
    )
