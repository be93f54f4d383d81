"""Errors of the stated measuring conventions as hypotheses: units, signs, directions, phases, order and zero.

A hypothesis changes the data; that of another zero of displacement changes the model instead. The likelihood is that of
the changed data times the determinant of the change, so that shrinking the data and their errors alone gains nothing.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotorstudy.measurement.conventions import combine
from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.entries import on_real_parts
from rotorstudy.model.model import Model

FACTORS = {  # true over read
    25.4: "the file is in mil and read as um; state 'unit: mil'",
    1 / 25.4: "the file is in um and read as mil; state 'unit: um'",
    1e3: "the file is in mm and read as um, or in m and read as mm; state the unit of the file",
    1e-3: "the file is in um and read as mm, or in mm and read as m; state the unit of the file",
    25.4e-3: "the file is in mil and read as mm; state 'unit: mil'",
    1 / 25.4e-3: "the file is in mm and read as mil; state 'unit: mm'",
    2.0: "a sensitivity stated as twice the true one; correct 'sensitivity_V_per_m:' or the values",
    0.5: "peak-to-peak values read as amplitudes, or a sensitivity stated as half the true one; correct the values or "
    "'sensitivity_V_per_m:'",
    np.sqrt(2): "rms values read as amplitudes; multiply them by the root of two",
    np.sqrt(0.5): "amplitudes multiplied by the root of two as if they were rms values; divide them by it",
}
ANGLES_DEG = (90, 180, -90, 45, -45)


class Hypothesis(NamedTuple):
    """A convention that may be stated wrongly, and the change of the data that corrects it."""

    name: str  # what the records look like
    remedy: str  # what to state
    # (harmonic, sensor) complex, by which the corrected harmonics are direct R_n + mirrored conj(R_-n) + conjugate
    # conj(R_n) + opposite R_-n;  without any the data stay as they are
    factors: dict[str, np.ndarray] = {}
    # (sensor,) position of the sensor that each node's data are read from; None: as they are
    order: np.ndarray | None = None
    # whether displacements count from the zero that is not stated, which changes the model, not the data
    other_zero: bool = False

    def corrected(self, spectrum: Spectrum) -> tuple[Spectrum, float]:
        """The corrected Spectrum, and the logarithm of the determinant of the change."""
        order = np.arange(len(spectrum.sensors)) if self.order is None else self.order
        amplitude, covariance = spectrum.amplitude[..., order], spectrum.covariance[:, order]
        matrix = self._matrix(spectrum.harmonics, len(order))
        parts = np.concatenate([amplitude.real, amplitude.imag], axis=1)  # (speed, component, sensor)
        real, imag = np.split(np.einsum("sij,wjs->wis", matrix, parts), 2, axis=1)
        covariance = matrix @ covariance @ np.swapaxes(matrix, -1, -2)
        directions = spectrum.directions[order]
        changed = replace(spectrum, amplitude=real + 1j * imag, covariance=covariance, directions=directions)
        return changed, changed.log_change(matrix)

    def _matrix(self, harmonics, sensors):
        """(sensor, component, component) of the change of real and imaginary parts."""
        identity = np.eye(len(harmonics))
        mirror = (harmonics[:, None] == -harmonics).astype(float)
        factors = self.factors or {"direct": np.ones((len(harmonics), sensors), complex)}

        def rows(name, chosen):
            factor = factors.get(name, np.zeros((len(harmonics), sensors), complex))
            return np.swapaxes(factor, 0, 1)[..., None] * chosen

        on_harmonics = rows("direct", identity) + rows("opposite", mirror)
        return on_real_parts(on_harmonics, rows("mirrored", mirror) + rows("conjugate", identity))


def hypotheses(spectrum: Spectrum, model: Model) -> Iterator[Hypothesis]:
    """Every hypothesis that a spectrum allows; with single probes none that turns or mirrors what they show."""
    harmonics, sensors, reading = spectrum.harmonics, spectrum.sensors, model.structure.reading
    whole = np.ones((len(harmonics), len(sensors)), complex)
    turn = np.outer(harmonics, np.ones(len(sensors)))
    is_symmetric = set(harmonics.tolist()) == set((-harmonics).tolist())  # each has its opposite
    yield from _units(whole, sensors, reading if is_symmetric else None)
    for angle in ANGLES_DEG:
        name = f"the phase mark is {angle} degrees from where the rig file says"
        remedy = "correct 'keyphasor: sensor_angle_deg, mark_angle_deg, edge'"
        yield Hypothesis(name, remedy, {"direct": np.exp(-1j * turn * np.deg2rad(angle))})
    if not spectrum.single_probes:
        yield from _of_orbits(harmonics, sensors, reading, whole, turn, is_symmetric)
    if len(sensors) > 1:
        reverse = np.arange(len(sensors))[::-1]
        yield Hypothesis("the nodes are in the reverse order", "correct the 'node:' of the probes", order=reverse)
    if 0 in harmonics and model.structure.static_load.any():
        zero, at = ("at_rest", "position of the shaft at rest")
        if not model.from_unloaded_line:
            zero, at = ("unloaded_line", "unloaded line")
        name, remedy = f"displacements count from the {at}", f"state 'displacement_zero: {zero}'"
        yield Hypothesis(name, remedy, other_zero=True)


def _units(whole, sensors, reading):
    """Wrong units and sensitivities of all probes, of one node, and with a Reading of one probe."""
    for factor, remedy in FACTORS.items():
        times = f"{1 / factor:.4g} times the true ones"
        yield Hypothesis(f"all readings are {times}", remedy, {"direct": factor * whole})
        for s, node in enumerate(sensors):
            here = np.arange(len(sensors)) == s
            if len(sensors) > 1:
                direct = np.where(here, factor, 1.0) * whole
                yield Hypothesis(f"the readings at node {node} are {times}", remedy, {"direct": direct})
            probes = reading.probes_at(node) if reading else ()
            for probe in probes if len(probes) > 1 else ():
                direct, mirrored = ((factor - 1) * share for share in one_probe(reading, node, probe))
                factors = {"direct": np.where(here, 1 + direct, 1.0) * whole, "mirrored": here * mirrored * whole}
                yield Hypothesis(f"the readings of probe '{probe}' at node {node} are {times}", remedy, factors)


def one_probe(reading, node, name):
    """Factors of z and of conj(z) in what the probe of a name contributes to z at a node.

    Its reading is (z e^{-ja} + conj(z) e^{ja}) / 2, and the readings of all probes of the node give z by least squares.
    """
    probes = reading.probes_at(node)
    share = combine([*probes.values()], np.eye(len(probes)))[[*probes].index(name)] / 2
    return share * np.exp(-1j * probes[name]), share * np.exp(1j * probes[name])


def _of_orbits(harmonics, sensors, reading, whole, turn, is_symmetric):
    """Wrong directions of the probes and gravity, lags for leads, the wrong sense of rotation, swapped probes."""
    for angle in ANGLES_DEG:
        by, remedy = np.deg2rad(angle), "correct 'angle_deg:' or the sign of the probes"
        name = f"the probes are turned by {angle} degrees against the rig file"
        yield Hypothesis(name, remedy, {"direct": np.exp(1j * by) * whole})
        name = f"gravity points {angle} degrees from where the rig file says"
        yield Hypothesis(name, "correct 'gravity_angle_deg:'", {"direct": np.exp(1j * (turn - 1) * by)})
    moving = (harmonics != 0)[:, None] * whole
    marked = np.exp(-2j * turn * reading.mark_rad)  # by twice the phases from the mark to the reference line
    in_plane = np.exp(-2j * reading.gravity_rad) * marked * moving  # of the user
    axes = np.array([reading.axis(node) for node in sensors])
    lags, still = "phases of the {} are lags where leads are meant", {"direct": whole - moving}
    yield Hypothesis(lags.format("table"), "state 'table_phase: lag'", still | {"conjugate": in_plane})
    if is_symmetric:
        remedy = "change the sign of each probe's phases before they are combined to forward and backward harmonics"
        # a real signal with its phases reversed runs backwards in time, and so does z
        yield Hypothesis(lags.format("probes"), remedy, still | {"opposite": marked * moving})
        yield Hypothesis("the shaft turns in the other sense", "correct 'rotation:'", {"mirrored": marked.conj()})
        swapped = {"mirrored": 1j * axes**2 * whole}
        yield Hypothesis("the two probes of all nodes are swapped", "exchange the channels of the probes", swapped)
