import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, hookimpl


def support_stiffness(structure, node: int | None = None):
    """Spring to the surroundings at a node, more (or less, if negative) than modelled: force -k z."""
    here = structure.unit(structure.default_node() if node is None else node)
    return [Parameter("support_stiffness", "N/m", (Entry(-np.outer(here, here)),), typical=2e4)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "support_stiffness",
        support_stiffness,
        source="Hooke; a negative one is a magnetic pull",
        checked="response equal to that of a rotor built with K + k to 1e-11",
        confounders=(
            (
                "stiffness_error",
                "equal on a rotor of one coordinate; elsewhere more nodes tell them apart",
            ),
            ("looseness", "looseness gives harmonics of 1X and depends on the size of the motion"),
            ("cubic_stiffness", "cubic stiffness grows with the motion: change the unbalance"),
        ),
    )
