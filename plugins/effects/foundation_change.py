from dataclasses import replace

from rotorstudy.plugins import CannotAct, Effect, Parameter, Whole


def _feet(term):
    """Number of feet, of which each has entries of its own."""
    return len(term.options.get("feet_m") or [0, 0]) if term.options.get("second_node") else 1


def _of_foot(entries, foot, feet):
    """Those of one foot."""
    count = len(entries) // feet
    return entries if foot is None else entries[(foot - 1) * count : foot * count]


def places(structure, sensors):
    """Nodes of the items of the section `foundation` that have a stiffness, and the feet of those with several."""
    found = {}
    for term in structure.foundation:
        if any(p.unit == "N/m" for p in term.parameters):
            node = term.options["node"]
            found[node] = max(_feet(term), found.get(node, 1))
    feet = [{"node": node, "foot": foot + 1} for node, count in found.items() if count > 1 for foot in range(count)]
    return [{"node": node} for node in found] + feet


@Effect(
    source="Vance, Zeidan and Murphy 2010, Machinery Vibration and Rotordynamics, ch. 4",
    places=places,
    checked="response equal to that of a rotor on a foundation built with the other stiffness to 1e-12",
    confounders={"bearing_coefficients": "the housing moves on a soft foundation: measure that on its casing"},
)
def foundation_change(structure, node: int | None = None, foot: Whole | None = None):
    """What a bearing stands on is stiffer or softer than stated, by a share: grout, a foot, or a bolt.

    The stiffness k of the foundation at that node becomes (1 + change) k, along each direction that the rig states.
    foot is the number of one of several feet of a block, from 1, which alone changes; by default all do.
    """
    node = structure.default_node() if node is None else node
    found = [
        Parameter(
            f"change_of_{p.name}",
            "1",
            tuple(replace(entry, matrix=value * entry.matrix) for entry in _of_foot(p.entries, foot, _feet(term))),
            typical=0.3,
        )
        for term in structure.foundation
        if term.options["node"] == node
        for p, value in zip(term.parameters, term.theta, strict=True)
        if p.unit == "N/m" and (foot or 1) <= _feet(term)
    ]
    if not found:
        which = f"foot {foot} of " if foot else ""
        raise CannotAct(f"the rig states no stiffness of {which}a foundation at node {node}")
    return found
