from typing import Literal

from rotorstudy.plugins import DepthRatio, Effect, NonNegative, Parameter, crack_at, hookimpl


def transverse_crack(
    structure,
    position_m: NonNegative,
    depth_ratio: DepthRatio = 0.2,
    angle_rad: float = 0.0,
    breathing: Literal["by moment", "by weight", "open"] = "by moment",
    flexibility: str = "strip_integration",
):
    """Straight-fronted crack across a solid shaft: a kink of the shaft by the moment that opens it.

    position_m: from node 1.  depth_ratio: depth over the diameter.  angle_rad: of the middle of the crack edge from the
    phase mark, in the direction of rotation.  breathing: opened by the moment of the instant (weight and vibration), by
    that of the weight, or a notch that never closes.  flexibility: name of a depth plugin.
    """
    hinge = crack_at(structure, position_m, depth_ratio, angle_rad, flexibility)
    if breathing == "by moment":
        return [Parameter("flexibility_factor", "1", (), typical=1.0, force=hinge.force())]
    entries = hinge.entries_by_weight() if breathing == "by weight" else hinge.open_entries()
    return [Parameter("flexibility_factor", "1", entries, typical=1.0)]


def where_it_cracks(structure, sensors):
    """One place, the shaft: the position is an option."""
    return [{}] if structure.section_at else []


@hookimpl
def rotorstudy_effect():
    return Effect(
        "transverse_crack",
        transverse_crack,
        source="Papadopoulos and Dimarogonas 1987; Darpe, Gupta, Chawla 2004, J. Sound Vib. (crack closure line)",
        places=where_it_cracks,
        candidate=False,
        example={"position_m": 0.2},
        positive=True,
        fixed=True,
        checked="rotational spring between two beam elements to 1e-12; integrated x-y motion",
    )
