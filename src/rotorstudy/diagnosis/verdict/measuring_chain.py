"""Errors of the stated measuring conventions as hypotheses: units, signs, directions, phases, order and zero.

A hypothesis changes the data; that of another zero of displacement changes the model instead. The likelihood is that of
the changed data times the determinant of the change, so that shrinking the data and their errors alone gains nothing.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from rotorstudy.measurement.spectrum import Spectrum
from rotorstudy.model.model import Model
from rotorstudy.model.reading import Reading

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


@dataclass(frozen=True)
class Hypothesis:
    """A convention that may be stated wrongly, and the change of the data that corrects it.

    The corrected harmonics are direct R_n + mirrored conj(R_-n) + conjugate conj(R_n) + opposite R_-n, of the nodes in
    `order`.

    name, remedy : what the records look like, and what to state
    direct, mirrored, conjugate, opposite : (harmonic, sensor) complex
    order : (sensor,) position of the sensor that each node's data are read from
    other_zero : whether displacements count from the zero that is not stated, which changes the model, not the data
    """

    name: str
    remedy: str
    direct: np.ndarray
    mirrored: np.ndarray
    conjugate: np.ndarray
    opposite: np.ndarray
    order: np.ndarray
    other_zero: bool = False

    def corrected(self, spectrum: Spectrum) -> tuple[Spectrum, float]:
        """The corrected Spectrum, and the logarithm of the determinant of the change."""
        amplitude, covariance = spectrum.amplitude[..., self.order], spectrum.covariance[:, self.order]
        matrix = self._matrix(spectrum.harmonics)
        parts = np.concatenate([amplitude.real, amplitude.imag], axis=1)  # (speed, component, sensor)
        moved = np.einsum("sij,wjs->wis", matrix, parts)
        real, imag = np.split(moved, 2, axis=1)
        covariance = matrix @ covariance @ np.swapaxes(matrix, -1, -2)
        directions = spectrum.directions[self.order]
        changed = replace(spectrum, amplitude=real + 1j * imag, covariance=covariance, directions=directions)
        return changed, changed.log_change(matrix)

    def _matrix(self, harmonics):
        """(sensor, component, component) of the change of real and imaginary parts."""
        identity = np.eye(len(harmonics))
        mirror = (harmonics[:, None] == -harmonics).astype(float)

        def rows(factor, chosen):
            return np.swapaxes(factor, 0, 1)[..., None] * chosen

        plain = rows(self.direct, identity) + rows(self.opposite, mirror)
        turned = rows(self.mirrored, mirror) + rows(self.conjugate, identity)
        return np.block(
            [[(plain + turned).real, (turned - plain).imag], [(plain + turned).imag, (plain - turned).real]]
        )


def one_probe(reading, node, name):
    """Factors of z and of conj(z) in what one probe of a node contributes to z.

    Its reading is (z e^{-ja} + conj(z) e^{ja}) / 2, and the readings of all probes of the node give z by least squares.
    reading : Reading;  node : int;  name : of the probe
    """
    along = np.exp(1j * np.array(list(reading.probes_at(node).values())))
    at = list(reading.probes_at(node)).index(name)
    x, y = np.linalg.pinv(np.column_stack([along.real, along.imag]))[:, at]
    return (x + 1j * y) * along[at].conj() / 2, (x + 1j * y) * along[at] / 2


def hypotheses(spectrum: Spectrum, model: Model) -> list[Hypothesis]:
    """Every hypothesis that a spectrum allows; with single probes none that turns or mirrors what they show.

    model : its structure has the Reading of the records
    """
    records = _Records(spectrum.harmonics, spectrum.sensors, model.structure.reading)
    of_orbits = [] if spectrum.single_probes else [*_angles(records), *_phases_and_sense(records)]
    return [*_units(records), *_mark(records), *of_orbits, *_order_and_zero(records, model)]


class _Records(NamedTuple):
    """The harmonics (harmonic,) and sensors (sensor,) of a spectrum, and its Reading."""

    harmonics: np.ndarray
    sensors: tuple[int, ...]
    reading: Reading

    @property
    def is_symmetric(self):
        """Whether each harmonic has its opposite, which some changes need."""
        return set(self.harmonics.tolist()) == set((-self.harmonics).tolist())

    @property
    def whole(self):
        """(harmonic, sensor) ones."""
        return np.ones((len(self.harmonics), len(self.sensors)), complex)

    @property
    def turn(self):
        """(harmonic, sensor) the number of each harmonic."""
        return np.outer(self.harmonics, np.ones(len(self.sensors)))

    @property
    def marked(self):
        """(harmonic, sensor) turn by twice the phases from the mark to the reference line."""
        return np.exp(-2j * self.turn * self.reading.mark_rad)

    def hypothesis(self, name, remedy, **changes):
        """The Hypothesis with some changes; without any the data stay as they are."""
        none, same = np.zeros_like(self.whole), np.arange(len(self.sensors))
        plain = {"direct": self.whole, "mirrored": none, "conjugate": none, "opposite": none, "order": same}
        return Hypothesis(name, remedy, **(plain | changes))


def _units(records):
    """Wrong units and sensitivities of all probes, of one node, of one probe."""
    whole, sensors = records.whole, records.sensors
    for factor, remedy in FACTORS.items():
        times = f"{1 / factor:.4g} times the true ones"
        yield records.hypothesis(f"all readings are {times}", remedy, direct=factor * whole)
        for s, node in enumerate(sensors if len(sensors) > 1 else ()):
            here = np.arange(len(sensors)) == s
            text = f"the readings at node {node} are {times}"
            yield records.hypothesis(text, remedy, direct=np.where(here, factor, 1.0) * whole)
        for s, node in enumerate(sensors if records.is_symmetric else ()):
            here = np.arange(len(sensors)) == s
            probes = records.reading.probes_at(node)
            for probe in probes if len(probes) > 1 else ():
                text = f"the readings of probe '{probe}' at node {node} are {times}"
                direct, mirrored = ((factor - 1) * share for share in one_probe(records.reading, node, probe))
                direct, mirrored = np.where(here, 1 + direct, 1.0) * whole, here * mirrored * whole
                yield records.hypothesis(text, remedy, direct=direct, mirrored=mirrored)


def _mark(records):
    """Wrong angles of the phase mark."""
    for angle in ANGLES_DEG:
        yield records.hypothesis(
            f"the phase mark is {angle} degrees from where the rig file says",
            "correct 'keyphasor: sensor_angle_deg, mark_angle_deg, edge'",
            direct=np.exp(-1j * records.turn * np.deg2rad(angle)),
        )


def _angles(records):
    """Wrong directions of the probes and gravity."""
    whole, turn = records.whole, records.turn
    for angle in ANGLES_DEG:
        by = np.deg2rad(angle)
        yield records.hypothesis(
            f"the probes are turned by {angle} degrees against the rig file",
            "correct 'angle_deg:' or the sign of the probes",
            direct=np.exp(1j * by) * whole,
        )
        yield records.hypothesis(
            f"gravity points {angle} degrees from where the rig file says",
            "correct 'gravity_angle_deg:'",
            direct=np.exp(1j * (turn - 1) * by),
        )


def _phases_and_sense(records):
    """Lags for leads, the wrong sense of rotation, swapped probes."""
    whole, marked = records.whole, records.marked
    moving = (records.harmonics != 0)[:, None] * whole
    yield records.hypothesis(
        "phases of the table are lags where leads are meant",
        "state 'table_phase: lag'",
        direct=whole - moving,
        conjugate=np.exp(-2j * records.reading.gravity_rad) * marked * moving,  # in the user's plane
    )
    if not records.is_symmetric:
        return
    yield records.hypothesis(
        "phases of the probes are lags where leads are meant",
        "change the sign of each probe's phases before they are combined to forward and backward harmonics",
        direct=whole - moving,
        opposite=marked * moving,  # a real signal with its phases reversed runs backwards in time, and so does z
    )
    none = np.zeros_like(whole)
    yield records.hypothesis(
        "the shaft turns in the other sense", "correct 'rotation:'", direct=none, mirrored=marked.conj()
    )
    axes = np.array([records.reading.axis(node) for node in records.sensors])
    yield records.hypothesis(
        "the two probes of all nodes are swapped",
        "exchange the channels of the probes",
        direct=none,
        mirrored=1j * axes**2 * whole,
    )


def _order_and_zero(records, model):
    """Nodes in the reverse order, and the other zero of displacement."""
    if len(records.sensors) > 1:
        reverse = np.arange(len(records.sensors))[::-1]
        yield records.hypothesis(
            "the nodes are in the reverse order", "correct the 'node:' of the probes", order=reverse
        )
    if 0 in records.harmonics and model.structure.static_load.any():
        zero, at = ("at_rest", "position of the shaft at rest")
        if not model.from_unloaded_line:
            zero, at = ("unloaded_line", "unloaded line")
        yield records.hypothesis(
            f"displacements count from the {at}", f"state 'displacement_zero: {zero}'", other_zero=True
        )
