"""Figures of Chapter 4: the rotor with an offset disc."""

import numpy as np

from rotorstudy.measurement.noise import noise_std, noisy, standard_normal
from rotorstudy.presentation import estimate_figures
from rotorstudy.presentation.spectrum_figures import full_spectra, time_and_orbit
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
    incomplete = f"{text}, incomplete cycles"
    panels = amplitude, plain, reference, compensated = (
        f"Amplitude, {text}",
        "Phase of incomplete cycles, uncompensated",
        "Phase of the reference signal, incomplete cycles",
        "Phase, compensated",
    )

    def seen(data, record, phase, method="regression"):
        here = data.displacement.sel(source="from rest", record=record, spectrum_method=method, phase_reference=phase)
        return as_complex(here.sel(speed=speed, method="nearest").isel(node=0))

    mark = thesis_spectra.reference_phase.sel(record="incomplete cycles", spectrum_method="fft_multiples")
    mark = np.exp(1j * mark.sel(speed=speed, method="nearest").values)
    whole, cut = (seen(thesis_spectra, f"{kind} cycles", "reference") for kind in ("complete", "incomplete"))
    physical = seen(spectra, "complete cycles", "reference")
    rows = {
        "physical sign": dict.fromkeys((amplitude, compensated), physical),
        "the thesis's sign": dict.fromkeys((amplitude, compensated), whole),
        "incomplete cycles": {
            amplitude: cut,
            plain: seen(thesis_spectra, "incomplete cycles", "none", "fft_multiples"),
            reference: mark,
            compensated: cut,
        },
        "with 1 % noise": dict.fromkeys((amplitude, compensated), disturbed_spectrum(config, speed, whole)),
    }
    column = "regression" if text == "50 Hz" else "fft"  # the headings of Table 4.7 are swapped
    marks = {}
    for panel, table, case, method in zip(
        panels,
        TABLES[text],
        (f"{text}, complete cycles", incomplete, incomplete, f"{text}, complete cycles"),
        ("regression", "fft", column, "regression"),
        strict=True,
    ):
        values = printed[(printed.table == table) & (printed.case == case) & (printed.method == method)]
        marks[panel] = (values.item.astype(int), values.published)
    kinds = ("amplitude", "phase", "phase", "phase")
    return full_spectra(config.harmonics, rows, list(zip(panels, kinds, strict=True)), marks)


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
    found["measurements"] = estimate_figures.measurements(
        stages["identifiability"], case, parameter, units[parameter], title
    )
    return found
