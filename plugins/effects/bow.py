import numpy as np

from rotorstudy.plugins import CannotAct, Effect, Entry, Parameter


def bent(structure, stretch):
    """Forces (dof,) of a stretch of elements bent by 1 rad, N (N m), one of constant and one of linear curvature.

    A curvature a + b s over an element, s from its middle, tilts its ends by b l^2 / 12 -+ a l / 2 against its chord.
    The middle of the stretch moves against its curvature, which is negative for a positive angle.
    """
    # a tilt of one end by 1 rad is a mean curvature of one over the length
    lengths = np.array([1 / (structure.curvature_at(i) @ structure.unit(i + 1, "tilt")) for i in stretch])
    total, constant, linear = lengths.sum(), 0.0, 0.0
    middles = np.cumsum(lengths) - lengths / 2
    for element, length, middle in zip(stretch, lengths, middles, strict=True):
        start, end = structure.unit(element, "tilt"), structure.unit(element + 1, "tilt")
        turned = structure.stiffness_of(element) @ np.array([end - start, end + start]).T
        constant = constant + turned[:, 0] * length / total / 2
        growth, mean = 2 / total**2, (2 * middle / total - 1) / total
        linear = linear + turned @ [mean * length / 2, growth * length**2 / 12]
    return -constant, -linear


def between_the_ends_or_a_stretch(structure, sensors):
    """Every node (for a shaft without rigid supports, those between its ends), and every stretch of elements."""
    nodes = structure.nodes if structure.is_supported else structure.nodes[1:-1]
    stretches = structure.stretches()
    if stretches:
        stretches.append({"element": 1, "last_element": len(structure.crack_places())})
    return [{"node": node} for node in nodes] + stretches


@Effect(
    source="Nicholas, Gunter, Allaire 1976; of a shaft hotter on one side: Boley and Weiner 1960",
    places=between_the_ends_or_a_stretch,
    parts=("node", "element", "last_element"),
    checked="whirl b / |1 - eta^2| of a Jeffcott rotor to 1e-12; a bent stretch rests in its shape to 1e-9",
    confounders={
        "unbalance": "an unbalance grows with the square of the speed and vanishes at slow roll, a bow does not",
        "runout": "equal at slow roll; a bow is amplified at the critical speed, a runout is not",
    },
)
def bow(structure, node: int | None = None, element: int | None = None, last_element: int | None = None):
    """Permanent bend r_0 that rotates with the shaft: force K r_0 e^{jwt}.

    At a node: its deflection there, in the shape due to a load there, from the bearing line; for a shaft without rigid
    supports, from the line through its ends. In an element, or in all up to a last one: bow_angle is the angle by which
    the stretch is bent with a constant curvature, its middle towards the phase (a shaft that is hotter on that side);
    bow_angle_skew adds a curvature that grows linearly along it, from minus to plus that of this angle. The shaft is
    straight elsewhere.
    """
    if element is not None:
        stretch = range(element, (element if last_element is None else last_element) + 1)
        usual = 1.6 * structure.scales.length / structure.length
        forces = zip(("bow_angle", "bow_angle_skew"), bent(structure, stretch), strict=True)
        return [Parameter(name, "rad", (Entry(f, on="one", shift=1),), usual, is_complex=True) for name, f in forces]
    node = structure.default_node() if node is None else node
    here, shape = structure.unit(node), np.zeros(len(structure.dofs))
    ends = [] if structure.is_supported else [structure.index(structure.nodes[0]), structure.index(structure.nodes[-1])]
    ends += [structure.index(housing, "housing") for housing in structure.housings]  # the shaft alone is bent
    free = np.setdiff1d(np.arange(len(here)), ends)
    if not here[free].any():
        raise CannotAct(f"bow: node {node} is an end of the shaft, from which a bow is measured; choose one in between")
    shape[free] = np.linalg.solve(structure.stiffness[np.ix_(free, free)], here[free])
    force = structure.stiffness @ shape / (here @ shape)
    return [Parameter("bow", "m", (Entry(force, on="one", shift=1),), 0.4 * structure.scales.length, is_complex=True)]
