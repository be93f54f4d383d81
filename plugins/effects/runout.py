from rotorstudy.plugins import Effect, Entry, Parameter, sensor_unit


def usual_harmonics(structure, sensors):
    """1X to 4X forward and backward, of each probe that faces the shaft."""
    nodes = [node for node in sensors if node not in structure.casings]
    return [{"node": node, "harmonic": n} for node in nodes for n in (1, 2, 3, 4, -1, -2, -3, -4)]


@Effect(
    source="API 670; thesis Eq. (3.1)",
    acts_on="output",
    places=usual_harmonics,
    parts=("harmonic",),
    checked="the same harmonic at every speed to 1e-12",
    confounders={"unbalance": "a runout is the same at all speeds, also at the critical speed"},
)
def runout(sensors, structure, node: int | None = None, harmonic: int = 1):
    """Shaft surface measured as motion: the same harmonic is added at all speeds.

    Both probes see the profile of the surface, y a quarter revolution after x, so that a lobe is a forward harmonic
    (order 1), a backward one (order 3), or both (2 and 4); of probes not at right angles every order shows both ways.
    """
    entry = Entry(sensor_unit(sensors, node), on="one", shift=harmonic)
    return [Parameter(f"runout_{harmonic}X", "m", (entry,), 0.04 * structure.scales.length, is_complex=True)]
