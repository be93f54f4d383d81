"""Figures of Chapter 4: the rotor with an offset disc."""

import numpy as np

from rotorstudy.measurement.noise import noise_std, noisy, standard_normal
from rotorstudy.presentation import estimate_figures
from rotorstudy.presentation.spectrum_figures import Panel, full_spectra, time_and_orbit
from rotorstudy.store import as_complex
from thesis.figures.common import study_figures
from thesis.scoreboard import published

SPEEDS = ("20 Hz", "50 Hz")  # names of the shown speeds
TIME = {"figure_4_5": 0, "figure_4_6": 1}  # position of the speed shown
SPECTRA = {"figure_4_7": 0, "figure_4_8": 1}
TABLES = {"20 Hz": ("4.2", "4.4", "4.6", "4.8"), "50 Hz": ("4.3", "4.5", "4.7", "4.9")}
WHITE = "white in time"


def record_figure(config, records, speed, text):
    """Figures 4.5 and 4.6: records in time; text : name of the speed."""
    steady, rest = as_complex(records.displacement.sel(speed=speed, method="nearest").isel(node=0))
    left = np.abs(rest - steady).max() / np.abs(steady).max()
    title = f"Three revolutions at {text}; from rest: off the steady state by {left * 100:.1g} % after six seconds"
    return time_and_orbit(config, records, speed, title)


def disturbed_spectrum(config, speed, spectrum):
    """(harmonic,) the given spectrum with one realisation of 1 % white noise in time, m."""
    steady = config.clean_spectrum(config.rig("thesis"), [speed])
    std = noise_std(steady, 0.01, WHITE, config.record.samples)
    numbers = standard_normal(config.monte_carlo.seed, 99, 1, (2, *steady.amplitude.shape))
    return spectrum + (noisy(steady.amplitude, std, numbers, WHITE)[0] - steady.amplitude)[0, :, 0]


def spectra_figure(config, spectra, thesis_spectra, speed, text, printed):
    """Figures 4.7 and 4.8: full spectra of complete and incomplete cycles, without and with noise."""

    def seen(data, record, phase, method="regression"):
        here = data.displacement.sel(source="from rest", record=record, spectrum_method=method, phase_reference=phase)
        return as_complex(here.sel(speed=speed, method="nearest").isel(node=0))

    def marks(table, case, method):
        values = printed[(printed.table == table) & (printed.case == f"{text}, {case}") & (printed.method == method)]
        return values.item.astype(int), values.published

    mark = thesis_spectra.reference_phase.sel(record="incomplete cycles", spectrum_method="fft_multiples")
    mark = np.exp(1j * mark.sel(speed=speed, method="nearest").values)
    label, whole, cut = "incomplete cycles", "complete cycles", seen(thesis_spectra, "incomplete cycles", "reference")
    by_thesis = seen(thesis_spectra, whole, "reference")
    every = {
        "physical sign": seen(spectra, whole, "reference"),
        "the thesis's sign": by_thesis,
        label: cut,
        "with 1 % noise": disturbed_spectrum(config, speed, by_thesis),
    }
    plain = {label: seen(thesis_spectra, label, "none", "fft_multiples")}
    column = "regression" if text == "50 Hz" else "fft"  # the headings of Table 4.7 are swapped
    amplitude, phase, reference, turned = TABLES[text]
    panels = [
        Panel(f"Amplitude, {text}", "amplitude", every, marks(amplitude, whole, "regression")),
        Panel(f"Phase of {label}, uncompensated", "phase", plain, marks(phase, label, "fft")),
        Panel(f"Phase of the reference signal, {label}", "phase", {label: mark}, marks(reference, label, column)),
        Panel("Phase, compensated", "phase", every, marks(turned, whole, "regression")),
    ]
    return full_spectra(config.harmonics, panels)


TITLES = {
    "error_against_noise": "Maximum likelihood attains the bound, and the bound of 44 is high",
    "collinearity": "Crack stiffnesses 22 and 44 act alike",
    "campbell": "The sign of the gyroscopic moment exchanges forward and backward whirl",
    "bias": "Wrong mass or modulus: resonances affect the dampings, collinearity the crack stiffnesses",
    "weight_dominance": "Weight dominance needs a vibration small against the static deflection",
}


def figures(config, reference, records, spectra, thesis_spectra, monte_carlo, monte_carlo_thesis, **stages):
    """The figures of Chapter 4; as those of Chapter 2."""
    (case,), (monte_carlo,), (monte_carlo_thesis,) = config.cases, monte_carlo.values(), monte_carlo_thesis.values()
    printed, units = published(reference, [f"4.{n}" for n in range(2, 10)]), config.reported
    hertz = list(zip(config.shown_speeds_rad_s, SPEEDS, strict=True))
    best = {"exact steady state": monte_carlo.sel(record="steady state")}
    closed_form = ("$1 + c_E / c_H$, rotor without tilt", lambda ratio: 1 + ratio)
    rigs = {"physical": "physical sign of the gyroscopic moment", "thesis": "the thesis's sign"}
    found = study_figures(config, stages, best, {case: case}, TITLES, closed_form, rigs)
    found |= {name: record_figure(config, records, *hertz[i]) for name, i in TIME.items()}
    for name, i in SPECTRA.items():
        found[name] = spectra_figure(config, spectra, thesis_spectra, *hertz[i], printed)
    thesis = {record: monte_carlo_thesis.sel(record=record) for record in config.record.kinds}
    title = "The thesis's least squares: crack stiffness 44 scatters twenty times more than necessary"
    found["figure_4_9"] = estimate_figures.error_against_noise(thesis, units, title)
    parameter, title = "stiffness_loss_44", "A second probe resolves crack stiffness 44; higher speeds help, too"
    known = stages["identifiability"]
    found["measurements"] = estimate_figures.measurements(known, case, parameter, units[parameter], title)
    return found
