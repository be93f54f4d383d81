"""Nodes with a single probe: which part of the harmonics of an orbit it shows.

A probe at direction a reads r(t) = Re(e^{-ja} z(t)), so that its harmonic n is
r_n = (e^{-ja} R_n + e^{ja} conj(R_-n)) / 2, and r_-n = conj(r_n). The motion across it is not measured. Such a node is
kept as the motion along the probe, z = e^{ja} r, and only the components of r_n for n >= 0 count as data.
"""

import numpy as np

from rotorstudy.errors import RotorstudyError


def is_orbit(directions):
    """(sensor,) whether both directions of a node are measured. directions : (sensor,) rad, NaN for orbits."""
    return np.isnan(directions)


def check_pairs(harmonics, nodes):
    """Raise RotorstudyError if no harmonic has its opposite, which a single probe shows together with it."""
    if len(nodes) and not any(n > 0 and -n in harmonics for n in harmonics):
        raise RotorstudyError(
            f"node {nodes[0]} has a single probe, which shows harmonics n and -n together; of "
            f"{list(map(int, harmonics))} none has its opposite: take both ('measurement: harmonics:' or --harmonics)"
        )


def along_probes(amplitude, harmonics, directions):
    """The part (..., harmonic, sensor) that probes show: (R_n + e^{2ja} conj(R_-n)) / 2; of orbits (NaN) all."""
    single = np.flatnonzero(~is_orbit(directions))
    if not len(single):
        return amplitude
    order = list(harmonics)
    paired = [i for i, n in enumerate(order) if -n in order]
    shown = np.array(amplitude)
    there, opposite = shown[..., paired, :][..., single], [order.index(-order[i]) for i in paired]
    mirrored = np.exp(2j * directions[single]) * shown[..., opposite, :][..., single].conj()
    shown[..., np.array(paired)[:, None], single] = (there + mirrored) / 2
    return shown


def seen_components(harmonics, direction):
    """(component,) whether a component is a datum: all of an orbit, of a single probe those of n >= 0 that have -n.

    Components are the real parts of all harmonics, then the imaginary parts; the mean of a probe has no imaginary part.
    """
    if np.isnan(direction):
        return np.ones(2 * len(harmonics), bool)
    harmonics = np.asarray(harmonics)
    paired = np.isin(-harmonics, harmonics)
    return np.concatenate([paired & (harmonics >= 0), paired & (harmonics > 0)])


def seen_rows(harmonics, direction):
    """(component, component) from the harmonics of an orbit to the data: sqrt(2) r_n for n > 0, and r_0.

    With these factors its rows are orthonormal, and white noise of the probe has the same variance in all; the rows of
    components that are not data are zero. Of an orbit it is the identity.
    """
    count = len(harmonics)
    if np.isnan(direction):
        return np.eye(2 * count)
    harmonics, turn = np.asarray(harmonics), np.exp(-1j * direction)
    factor = np.where(harmonics > 0, np.sqrt(0.5), 0.5 * (harmonics == 0))[:, None]
    factor = factor * np.isin(-harmonics, harmonics)[:, None]
    plain, mirror = factor * turn * np.eye(count), factor * turn.conj() * (harmonics[:, None] == -harmonics)
    return np.block([[(plain + mirror).real, (mirror - plain).imag], [(plain + mirror).imag, (plain - mirror).real]])


def along_probe(covariance, harmonics, direction):
    """The part (..., component, component) of a covariance that is of the motion along a probe."""
    rows = seen_rows(harmonics, direction)
    return rows.T @ (rows @ covariance @ rows.T) @ rows
