from pathlib import Path
from typing import Literal

import numpy as np

from rotorstudy.plugins import Bearing, Parameter, RotorstudyError, planar_entries, receptances_in

ORDERS = {"receptance": 0, "mobility": 1, "accelerance": 2}  # derivative of the motion by time
LARGEST_CONDITION = 1e10  # beyond it the dynamic stiffness has no certain digit
UNSEEN = 1e-3  # of the stiffness: a mass that moves no more at the last frequency does not show
Axis = Literal["x", "y", "z", "-x", "-y", "-z"]


@Bearing(
    source="Ewins 2000, Modal Testing; Lees and Friswell 1997, rotor imbalance in flexibly mounted machines",
    example={"file": str(Path(__file__).with_suffix(".csv"))},
    checked="a table of the receptance of foundation_block gives the motion on that block",
    positive_damping=True,
    symmetric=True,
)
def foundation_receptance(
    structure,
    file: str,
    node: int | None = None,
    other_nodes: list[int] | None = None,
    quantity: Literal["receptance", "mobility", "accelerance"] = "receptance",
    axes: dict[Literal["x", "y"], Axis] | None = None,
    point_of_node: dict[int, int] | None = None,
):
    """Measured frequency responses of what bearings stand on, in the section `foundation`, times foundation_scale.

    file is a CSV file with the columns frequency_Hz, response, force (points such as 4x and 10y: a node, and an axis;
    of one node also x and y), real and imaginary, m/N, or m/s and m/s2 per N by `quantity`; or a UFF file with data
    sets 58, which say it. A pair that is not measured is zero, or that of force and response exchanged. axes: which
    axis of the file x and y are, such as {x: -z, y: x}; point_of_node: what the file calls a node. The matrix is
    inverted at each frequency, and the dynamic stiffness interpolated; beyond the last frequency it stays as it is
    there, below the first as its real part. Of the free vibration the mass, damping and stiffness nearest to it are
    part, all of it if the foundation is a rigid block; of the decrement of the first forward mode all is part.
    """
    node = structure.default_node() if node is None else node
    nodes, axes, names = [node, *(other_nodes or [])], axes or {}, point_of_node or {}
    frequency, responses = receptances_in(file, ORDERS[quantity])
    known = {point for pair in responses for point in pair}
    points = []  # sign, and name in the file
    for n in nodes:
        for axis in (axes.get(axis, axis) for axis in "xy"):
            name, letter = f"{names.get(n, n)}{axis[-1]}", axis[-1]
            points.append((-1.0 if "-" in axis else 1.0, letter if letter in known else name))
    matrix = np.zeros((len(frequency), len(points), len(points)), complex)
    for i, (sign, response) in enumerate(points):
        for k, (other, force) in enumerate(points):
            found = [responses[pair] for pair in ((response, force), (force, response)) if pair in responses][:1]
            if i == k and not found:
                raise RotorstudyError(
                    f"foundation_receptance: {file} has no response at {response} to a force there (its points: "
                    f"{', '.join(sorted(known))}); state 'axes:' or 'point_of_node:' if it calls them otherwise"
                )
            matrix[:, i, k] = sign * other * found[0] if found else 0.0
    if np.linalg.cond(matrix).max() > LARGEST_CONDITION:
        raise RotorstudyError(
            f"foundation_receptance: the receptances of {file} cannot be inverted; two nodes that move alike need one "
            "that is measured, or a foundation_block"
        )
    stiffness = np.linalg.inv(matrix)
    units, directions = [structure.unit(n) for n in nodes for _ in "xy"], "xy" * len(nodes)
    in_time, entries = _nearest_block(frequency, stiffness), []
    for i, k in np.ndindex(stiffness.shape[1:]):
        pattern, along, own = -np.outer(units[i], units[k]), directions[i] + directions[k], in_time[:, i, k]
        for order in np.flatnonzero(own):
            entries += planar_entries(along, own[order] * pattern, order=int(order))
        gain = _rest(frequency, stiffness[:, i, k], own)
        entries += planar_entries(along, pattern, gain=gain, frequency_only=True)
    return [Parameter("foundation_scale", "1", tuple(entries), typical=1.0, default=1.0)]


def _nearest_block(frequency, stiffness):
    """Stiffness, damping and mass (3, point, point) of a passive block, least squares of the shares they are off by."""
    weight = 1 / np.linalg.norm(stiffness, axis=(1, 2))
    flat = weight[:, None] * stiffness.reshape(len(frequency), -1)
    still = np.column_stack([np.ones_like(frequency), -(frequency**2)]) * weight[:, None]
    spring, mass = np.linalg.lstsq(still, flat.real)[0].reshape(2, *stiffness.shape[1:])
    damping = np.linalg.lstsq((weight * frequency)[:, None], flat.imag)[0].reshape(mass.shape)
    least = UNSEEN * np.linalg.norm(spring, 2) / frequency[-1] ** 2
    return np.array([_at_least(0.0, spring), _at_least(0.0, damping), _at_least(least, mass)])


def _at_least(least, matrix):
    """The symmetric part of a matrix, its eigenvalues not below the least one."""
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    return vectors * np.maximum(values, least) @ vectors.T


def _rest(frequency, stiffness, in_time):
    """The gain of an element of the dynamic stiffness, N/m, over frequency, rad/s, less what it is in time (3,), SI."""
    known = np.append(0.0, frequency), np.append(stiffness[0].real, stiffness)

    def gain(speed, harmonic):
        turning, (spring, damping, mass) = speed * harmonic, in_time
        found = np.interp(np.abs(turning), *known)
        return np.where(turning < 0, found.conj(), found) - (spring + 1j * turning * damping - turning**2 * mass)

    return gain
