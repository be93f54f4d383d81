from dataclasses import replace

from rotorstudy.plugins import CannotAct, Effect, Parameter, hookimpl


def foundation_change(structure, node: int | None = None):
    """What a bearing stands on is stiffer or softer than stated, by a share: grout, a foot, or a bolt.

    The stiffness k of the foundation at that node becomes (1 + change) k, along each direction that the rig states.
    """
    node = structure.default_node() if node is None else node
    parts = [(p, value) for term in _at(structure, node) for p, value in zip(term.parameters, term.theta, strict=True)]
    found = [
        Parameter(
            f"change_of_{p.name}",
            "1",
            tuple(replace(entry, matrix=value * entry.matrix) for entry in p.entries),
            typical=0.3,
        )
        for p, value in parts
        if p.unit == "N/m"
    ]
    if not found:
        raise CannotAct(f"the rig states no stiffness of a foundation at node {node}")
    return found


def _at(structure, node):
    """Terms of the section `foundation` with their node here."""
    return [term for term in structure.foundation if term.options["node"] == node]


def places(structure, sensors):
    """Nodes of the items of the section `foundation` that have a stiffness."""
    nodes = [t.options["node"] for t in structure.foundation if any(p.unit == "N/m" for p in t.parameters)]
    return [{"node": node} for node in dict.fromkeys(nodes)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "foundation_change",
        foundation_change,
        source="Vance, Zeidan and Murphy 2010, Machinery Vibration and Rotordynamics, ch. 4",
        places=places,
        checked="response equal to that of a rotor on a foundation built with the other stiffness to 1e-12",
        confounders={"bearing_coefficients": "the housing moves on a soft foundation: measure that on its casing"},
    )
