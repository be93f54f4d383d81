"""Tables of Chapter 4: the rotor with an offset disc."""

import numpy as np
import pandas as pd

from thesis.printed import estimate_rows, noise_rows, scored_against, spectrum_rows
from thesis.scoreboard import published
from thesis.tables import Table, scored_tables

CASE = "20 to 50 Hz"
SPECTRA = {  # quantity -> phase reference and the tables at 20 and 50 Hz
    "amplitude": ("none", "4.2", "4.3"),
    "phase": ("none", "4.4", "4.5"),
    "reference phase": (None, "4.6", "4.7"),
    "compensated phase": ("reference", "4.8", "4.9"),
}
METHODS = {"regression": "regression", "fft": "fft_multiples"}
SWAPPED = {"regression": "fft_multiples", "fft": "regression"}  # headings of the incomplete cycles of Table 4.7
PARAMETERS = {  # name in the thesis -> name here, factor to the printed unit
    "c_H": ("internal_damping", 1.0),
    "c_E": ("external_damping", 1.0),
    "e": ("eccentricity", 1.0),
    "phi": ("eccentricity_phase", 180 / np.pi),
    "dk_22": ("stiffness_loss_22", 1.0),
}
ROWS = {  # of Table 4.10 -> kind of record, phase reference
    f"{CASE}, complete cycles": ("complete cycles", "reference"),
    f"{CASE}, incomplete cycles, without phase compensation": ("incomplete cycles", "none"),
    f"{CASE}, incomplete cycles, with phase compensation": ("incomplete cycles", "reference"),
}
BY_METHOD = (["item"], ["case", "method"])
TRANSIENT = "Seventh second from rest; the tilt is hardly damped, so the record still holds its free vibration."
DESCRIBED = {
    "4.2": ("Amplitudes at 20 Hz", f"{TRANSIENT} 7X of complete cycles: one misprint, .0562 for .0565.", *BY_METHOD),
    "4.3": ("Amplitudes at 50 Hz", TRANSIENT, *BY_METHOD),
    "4.4": ("Phases at 20 Hz", "The thesis's regression counts phases from 100 samples before the record.", *BY_METHOD),
    "4.5": ("Phases at 50 Hz", "The thesis's regression counts phases from 100 samples before the record.", *BY_METHOD),
    "4.6": ("Phases of the reference signal at 20 Hz", "Complete cycles: zero to round-off.", *BY_METHOD),
    "4.7": (
        "Phases of the reference signal at 50 Hz",
        "The thesis swaps the headings of the incomplete cycles: its column 'regression' is compared with our FFT.",
        *BY_METHOD,
    ),
    "4.8": (
        "Compensated phases at 20 Hz",
        "Compensation removes the effect of the unknown start of the record.",
        *BY_METHOD,
    ),
    "4.9": ("Compensated phases at 50 Hz", "The difference that compensation leaves at 7X is leakage.", *BY_METHOD),
    "4.10": (
        "Assumed and estimated parameters",
        "Rows with noise: mean over our trials; the thesis prints a single realisation. Its column of dk_44 is "
        "missing; the error of dk_44 is in the figure of errors against noise.",
        ["case", "noise_percent"],
        ["item"],
    ),
}


def spectrum_columns(config):
    """Origin of each column of Tables 4.2 to 4.9, as `spectrum_rows` takes it."""
    columns = {}
    for quantity, (phase, *numbers) in SPECTRA.items():
        for table, speed, at in zip(numbers, config.shown_speeds_rad_s, ("20 Hz", "50 Hz"), strict=True):
            for record in config.record.kinds:
                methods = SWAPPED if (table, record) == ("4.7", "incomplete cycles") else METHODS
                for printed_as, method in methods.items():
                    where = {"record": record, "spectrum_method": method, "speed": speed}
                    if phase:
                        where |= {"source": "from rest", "phase_reference": phase}
                    columns[table, f"{at}, {record}", quantity, printed_as] = where
    return columns


def assumed_parameters(config, true):
    """Table 4.1; true : (parameter,) values assumed for the unknowns."""
    rotor = config.rig("thesis").structure
    k, u = rotor.stiffness, rotor.static_deflection.real
    known = {name: float(true.sel(parameter=name)) for name in true.parameter.values}
    rows = [
        ("mass of disc", "m", 2.0, rotor.mass[0, 0], "kg"),
        ("polar moment of inertia", "I_p", 0.0048, -rotor.gyroscopic[1, 1], "kg m^2"),
        ("diametral moment of inertia", "I_d", 0.0024, rotor.mass[1, 1], "kg m^2"),
        ("shaft stiffness", "k_22", 5.779e5, k[0, 0], "N/m"),
        ("shaft stiffness", "k_24", 2.2016e4, k[0, 1], "N"),
        ("shaft stiffness", "k_44", 1.7613e4, k[1, 1], "N m"),
        ("additive crack stiffness", "dk_22", 1.7337e5, known["stiffness_loss_22"], "N/m"),
        ("additive crack stiffness", "dk_44", 1.7612e3, known["stiffness_loss_44"], "N m"),
        ("external damping", "c_E", 27.0, known["external_damping"], "N s/m"),
        ("internal damping", "c_H", 20.0, known["internal_damping"], "N s/m"),
        ("shaft deflection", "u_x0", 3.57e-5, u[0], "m"),
        ("tilt at rest", "phi_y0", -4.46e-5, u[1], "rad"),
        ("disc eccentricity", "e", 3e-5, known["eccentricity"], "m"),
        ("phase of eccentricity", "phi", 30.0, known["eccentricity_phase"] * 180 / np.pi, "deg"),
    ]
    return Table(
        pd.DataFrame(rows, columns=["parameter", "symbol", "thesis", "here", "unit"]),
        "Table 4.1: Assumed parameters of the rotor with an offset disc",
        "Stiffness and deflection follow from the shaft: 210 GPa, 15 mm, disc at 0.20 m of 0.36 m. The thesis prints "
        "u_x0 and phi_y0 rounded up; its tables follow from the unrounded numbers.",
    )


def tables(config, reference, spectra, identification, monte_carlo, reasons):
    """The tables of Chapter 4 beside the thesis's; as `chapter_2.tables`, with the Monte Carlo of the only case."""
    rows = spectrum_rows(spectra, spectrum_columns(config))
    estimates = identification.estimate.sel(
        case=CASE, source="from rest", spectrum_method="regression", estimator="least_squares"
    )
    for name, (record, phase) in ROWS.items():
        rows += estimate_rows(estimates.sel(record=record, phase_reference=phase), "4.10", name, PARAMETERS)
    printed = published(reference, list(DESCRIBED))
    rows += noise_rows(
        printed[printed.noise_percent > 0],
        {name: monte_carlo.sel(record=record) for name, (record, _) in ROWS.items()},
        PARAMETERS,
        {"per_harmonic": "per harmonic", "white": "white in time"},
        mean_of="white in time",
    )
    scored = scored_against(printed, rows, reasons)
    return scored, {"table_4_1": assumed_parameters(config, identification.true), **scored_tables(scored, DESCRIBED)}
