import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


def support_stiffness(structure, node: int | None = None):
    """Additional stiffness to ground at a node, negative if too much was modelled: force -k z."""
    here = structure.unit(structure.default_node() if node is None else node)
    usual = 0.03 * structure.scales.stiffness(node)
    return [Parameter("support_stiffness", "N/m", (Entry(-np.outer(here, here)),), typical=usual)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "support_stiffness",
        support_stiffness,
        source="Hooke; a negative value also describes magnetic pull",
        checked="response equal to that of a rotor built with K + k to 1e-11",
        confounders=(
            (
                "bearing_coefficients",
                "one stiffness in all directions, without damping; change the film: speed, oil, load",
            ),
            ("pedestal_resonance", "equal far below its resonance; tap the pedestal, or measure its motion"),
            ("support_loss", "a loss along one direction leaves the other; apply a static load along both"),
            (
                "stiffness_error",
                "equal on a rotor of one coordinate; otherwise measurements at more nodes separate them",
            ),
            ("seal", "a seal also damps, and its stiffness changes with the pressure drop"),
            ("looseness", "looseness gives multiples of 1X and depends on the amplitude"),
            ("cubic_stiffness", "cubic stiffness depends on the amplitude: change the unbalance"),
        ),
    )
