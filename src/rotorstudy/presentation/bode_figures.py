"""1X over speed: Bode plots of amplitude and phase, and polar plots."""

import numpy as np

from rotorstudy.measurement.resonances import vectors_1x
from rotorstudy.presentation.plots import COLOURS, figure, phase_lag, png_bytes
from rotorstudy.units import RAD_PER_S

FEWEST_SPEEDS = 8
SHARP = 110  # dpi; these pictures are few
LABELLED = 6  # speeds marked in a polar plot


def bode_pictures(spectrum):
    """{title: PNG} of Bode and polar plots of 1X; none with few speeds or without harmonics 1 and -1."""
    if len(spectrum.speed) < FEWEST_SPEEDS or not {1, -1} <= set(spectrum.harmonics.tolist()):
        return {}
    order = np.argsort(spectrum.speed)
    rpm = spectrum.speed[order] / RAD_PER_S["rpm"]
    vectors = {name: 1e6 * vector[order] for name, vector in vectors_1x(spectrum).items()}
    return {"1X over speed (Bode)": _bode(rpm, vectors), "1X over speed (polar)": _polar(rpm, vectors)}


def _bode(rpm, vectors):
    """Amplitude and phase (lag, against the shaft's reference line) over speed."""
    picture, axes = figure(2, 1, height=2.0, width=5.0, sharex=True)
    size, phase = np.ravel(axes)
    for i, (name, vector) in enumerate(vectors.items()):
        size.plot(rpm, np.abs(vector), color=COLOURS[i % len(COLOURS)], label=name)
        phase.plot(rpm, phase_lag(vector), color=COLOURS[i % len(COLOURS)])
    size.set_ylabel("1X amplitude (µm)")
    size.legend()
    phase.set_ylabel("lag from reference line (°)")
    phase.set_xlabel("speed (rpm)")
    return png_bytes(picture, SHARP)


def _polar(rpm, vectors):
    """Vectors in the complex plane, with some speeds marked."""
    picture, axes = figure(1, 1, height=4.5, width=5.0)
    axes = np.ravel(axes)[0]
    for i, (name, vector) in enumerate(vectors.items()):
        axes.plot(vector.real, vector.imag, color=COLOURS[i % len(COLOURS)], label=name)
    largest = max(vectors.values(), key=lambda vector: np.abs(vector).max())
    length = np.concatenate([[0], np.cumsum(np.abs(np.diff(largest)))])
    for at in np.unique(np.searchsorted(length, np.linspace(0, length[-1], LABELLED))):
        axes.plot(largest[at].real, largest[at].imag, "k.", markersize=4)
        axes.annotate(
            f"{rpm[at]:.0f} rpm", (largest[at].real, largest[at].imag), textcoords="offset points", xytext=(4, 3)
        )
    axes.axhline(0, color="0.8", zorder=0)
    axes.axvline(0, color="0.8", zorder=0)
    axes.set_aspect("equal")
    axes.set_xlabel("1X, real part (µm)")
    axes.set_ylabel("1X, imaginary part (µm)")
    axes.legend()
    return png_bytes(picture, SHARP)
