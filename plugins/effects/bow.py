import numpy as np

from rotorstudy.plugins import CannotAct, Effect, Entry, Parameter, hookimpl


def bow(structure, node: int | None = None):
    """Permanent bend r_0 that rotates with the shaft, in the shape due to a load at the node: force K r_0 e^{jwt}.

    It is measured from the bearing line; for a shaft without rigid supports, from the line through its ends.
    """
    node = structure.default_node() if node is None else node
    here, shape = structure.unit(node), np.zeros(len(structure.dofs))
    ends = [] if structure.is_supported else [structure.index(structure.nodes[0]), structure.index(structure.nodes[-1])]
    free = np.setdiff1d(np.arange(len(here)), ends)
    if not here[free].any():
        raise CannotAct(
            f"bow: node {node} is an end of the shaft, from which a bow is measured; choose a node in between"
        )
    shape[free] = np.linalg.solve(structure.stiffness[np.ix_(free, free)], here[free])
    force = structure.stiffness @ shape / (here @ shape)
    return [Parameter("bow", "m", (Entry(force, on="one", shift=1),), 0.4 * structure.scales.length, is_complex=True)]


def between_the_ends(structure, sensors):
    """Every node; for a shaft without rigid supports, those between its ends."""
    nodes = structure.nodes if structure.is_supported else structure.nodes[1:-1]
    return [{"node": node} for node in nodes]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "bow",
        bow,
        source="Nicholas, Gunter, Allaire 1976",
        places=between_the_ends,
        checked="whirl b / |1 - eta^2| of a Jeffcott rotor to 1e-12",
        confounders=(
            ("unbalance", "an unbalance grows with the square of the speed and vanishes at slow roll, a bow does not"),
            ("runout", "equal at slow roll; a bow is amplified at the critical speed, a runout is not"),
            (
                "parallel_misalignment",
                "equal at 1X on a rotor of one coordinate; a misaligned coupling has 2X and acts at its own node",
            ),
        ),
    )
