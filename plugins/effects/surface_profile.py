import numpy as np

from rotorstudy.plugins import Effect, Entry, Parameter, Whole, hookimpl, sensor_unit


def surface_profile(sensors, structure, node: int | None = None, order: Whole = 2):
    """Surface profile under two probes: y shows what x showed a quarter revolution before.

    x shows Re(c e^{jkwt}), so z shows c (1 + j e^{-jk pi/2}) / 2 at k and the mirrored term at -k: order 1 is only
    forward, order 3 only backward, order 2 both. Amplitudes are the cosine and sine part of the profile under x.
    """
    here = sensor_unit(sensors, node)
    forward, backward = (1 + 1j * (-1j) ** order) / 2, (1 + 1j * 1j**order) / 2
    parameters, usual = [], 0.04 * structure.scales.length
    for part, c in (("cosine", 1), ("sine", -1j)):
        shown = ((c * forward, order), (np.conj(c) * backward, -order))
        entries = tuple(Entry(share * here, on="one", shift=n) for share, n in shown if abs(share) > 0.1)
        parameters.append(Parameter(f"profile_{part}_{order}X", "m", entries, typical=usual))
    return parameters


def orders(structure, sensors):
    """Even orders; forward or backward runout already describes the odd ones."""
    return [{"node": node, "order": order} for node in sensors for order in (2, 4)]


@hookimpl
def rotorstudy_effect():
    return Effect(
        "surface_profile",
        surface_profile,
        source="API 670; Bently and Hatch 2002, Fundamentals of Rotating Machinery Diagnostics",
        acts_on="output",
        places=orders,
        parts=("order",),
        checked="x and y of a profile of orders 1 to 4, in time, to 1e-12",
        confounders=(
            (
                "runout",
                "both probes see a profile, y a quarter revolution later, which relates backward to forward harmonics",
            ),
        ),
    )
