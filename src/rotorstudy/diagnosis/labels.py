"""Names that the user gave to nodes, for texts: 'node 5 (disc 1)'."""

import re


def labels_of(rig: dict) -> dict[int, str]:
    """Node -> label: of `measurement: node_of_label:`, unless it is a number, else of the bearing there.

    Parameters
    ----------
    rig : dict
        As read from its file.

    Returns
    -------
    dict
    """
    bearings = {item["node"]: f"bearing {item['label']}" for item in rig.get("bearings") or [] if "label" in item}
    stated = (rig.get("measurement") or {}).get("node_of_label") or {}
    return bearings | {node: str(label) for label, node in stated.items() if not str(label).lstrip("-").isdigit()}


def labelled(text: str, labels: dict[int, str]) -> str:
    """A text with the label of each node that has one behind its number.

    Parameters
    ----------
    text : str
    labels : dict
        Node -> label.

    Returns
    -------
    str
    """

    def named(found):
        label = labels.get(int(found[1]))
        return f"{found[0]} ({label})" if label else found[0]

    return re.sub(r"\bnode (\d+)\b", named, text)
