"""Figures of Chapter 2: the rotor with two degrees of freedom."""

import numpy as np

from rotorstudy.model.cracks import SERIES_ORDER
from rotorstudy.model.registry import registry
from rotorstudy.presentation.plots import figure
from rotorstudy.presentation.spectrum_figures import Panel, full_spectra, time_and_orbit
from rotorstudy.store import as_complex
from rotorstudy.studies.config import file_name
from thesis.figures.common import study_figures
from thesis.scoreboard import published

SHORT = {  # cases of several speeds
    "Combined speed from 50 to 199 with increment +1": "50 to 199 rad/s",
    "Combined speed from 200 to 350 with increment +1": "200 to 350 rad/s",
}
TIME = {"figure_2_6": 0, "figure_2_7": 1}  # position of the speed shown
SPECTRA = {"figure_2_8": 0, "figure_2_9": 1}


def breathing_function(crack, speed):
    """Figure 2.4: the breathing function of a crack and its series, over two revolutions; crack : Crack plugin."""
    picture, axes = figure()
    time = np.linspace(0, 4 * np.pi / speed, 2000)
    axes[0, 0].plot(time * 1e3, crack.function(speed * time), label="switching crack")
    for order, style in ((7, "--"), (SERIES_ORDER, ":")):
        series = sum(s * np.exp(1j * k * speed * time) for k, s in crack.series(order).items()).real
        axes[0, 0].plot(time * 1e3, series, style, label=f"series to order {order}")
    title = f"Breathing function over two revolutions at {speed:g} rad/s"
    axes[0, 0].set(xlabel="time (ms)", ylabel="breathing function (1: open)", title=title)
    axes[0, 0].set_ylim(-0.15, 1.65)
    axes[0, 0].legend(loc="upper center", ncols=2)
    return picture


def spectra_figure(config, spectra, thesis_spectra, speed, printed):
    """Figures 2.8 and 2.9: full spectra, with the printed values if there are any."""
    late = {"source": "from rest", "record": "half a sample late", "spectrum_method": "fft", "speed": speed}

    def seen(data, phase):
        return as_complex(data.displacement.sel(**late, phase_reference=phase).isel(node=0))

    def marks(table, method):
        values = printed[(printed.table == table) & (printed.method == method)]
        return (values.item.astype(int), values.published) if speed == 88.0 else None

    label = "the thesis's reading"
    plain = {label: seen(thesis_spectra, "none")}
    both = {"physical signs": seen(spectra, "reference"), label: seen(thesis_spectra, "reference")}
    panels = [
        Panel(f"Amplitude, {speed:g} rad/s", "amplitude", both, marks("2.2", "fft")),
        Panel(f"Phase, record half a sample late, {speed:g} rad/s", "phase", plain, marks("2.3", "fft, uncompensated")),
        Panel(f"Phase, compensated by the reference, {speed:g} rad/s", "phase", both, marks("2.3", "fft, compensated")),
    ]
    return full_spectra(config.harmonics, panels)


TITLES = {
    "error_against_noise": "Maximum likelihood attains the bound; least squares of the equations does not",
    "bias": "Wrong mass or stiffness mostly affects maximum likelihood more than least squares",
    "weight_dominance": "Weight dominance is not a small approximation",
}


def figures(config, reference, records, spectra, thesis_spectra, monte_carlo, **stages):
    """The figures of Chapter 2, from the Datasets of its stages; of monte_carlo, file name of a case -> Dataset."""
    printed = published(reference, ["2.2", "2.3"])
    noisy = {shown: monte_carlo[file_name(case)].sel(record="steady state") for case, shown in SHORT.items()}
    crack = registry().get("crack", config.rigs[config.main_rig]["cracks"][0]["kind"])
    closed_form = (r"$1 + c_E / c_H$", lambda ratio: 1 + ratio)
    found = study_figures(config, stages, noisy, SHORT, TITLES, closed_form)
    found["figure_2_4"] = breathing_function(crack, 88.0)
    for name, i in TIME.items():
        speed = config.shown_speeds_rad_s[i]
        title = f"Three revolutions at {speed:g} rad/s: integration and closed form coincide"
        found[name] = time_and_orbit(config, records, speed, title)
    for name, i in SPECTRA.items():
        found[name] = spectra_figure(config, spectra, thesis_spectra, config.shown_speeds_rad_s[i], printed)
    return found
