"""Tables of Chapter 2: the rotor with two degrees of freedom."""

import numpy as np
import pandas as pd

from rotorstudy.studies.config import file_name
from thesis.printed import estimate_rows, noise_rows, scored_against, spectrum_rows
from thesis.scoreboard import published
from thesis.tables import Table, scored_tables

PARAMETERS = {  # name in the thesis -> name here, factor to the printed unit
    "c_H": ("internal_damping", 1.0),
    "c_E": ("external_damping", 1.0),
    "e": ("eccentricity", 1.0),
    "phi": ("eccentricity_phase", 180 / np.pi),
    "dk_xi": ("stiffness_loss", 1.0),
}
MODELS = {"shared": "per harmonic, same at all speeds", "per_harmonic": "per harmonic", "white": "white in time"}
COMPENSATION = {"without": "none", "with": "reference"}  # as in Table 2.5 -> phase reference here
BY_METHOD = (["item"], ["case", "method"])
DESCRIBED = {
    "2.2": (
        "Amplitudes of the full spectrum at 88 rad/s",
        "The regression columns agree to the last digit; the FFT column differs most at 7X.",
        *BY_METHOD,
    ),
    "2.3": (
        "Phases of the full spectrum at 88 rad/s",
        "The record of the uncompensated column starts half a sample late.",
        *BY_METHOD,
    ),
    "2.4": (
        "Phases of the reference signal",
        "The FFT columns equal n w dt, as for a record that starts one sample late.",
        *BY_METHOD,
    ),
    "2.5": (
        "Assumed and estimated parameters",
        "Rows with noise: mean over our trials; the thesis prints a single realisation.",
        ["case", "noise_percent"],
        ["item"],
    ),
}


def printed_case(case, compensation):
    """A case as Table 2.5 names it."""
    return f"{case}, {compensation} phase compensation"


def spectrum_columns(config):
    """Origin of each column of Tables 2.2 to 2.4, as `spectrum_rows` takes it."""
    steady = {"source": "steady state", "record": "complete", "spectrum_method": "regression"}
    whole = {"source": "from rest", "record": "complete", "spectrum_method": "fft"}
    late = {"source": "from rest", "record": "half a sample late", "spectrum_method": "fft"}
    at = {"phase_reference": "none", "speed": 88.0}
    columns = {
        ("2.2", "88 rad/s", "amplitude", "regression"): {**steady, **at},
        ("2.2", "88 rad/s", "amplitude", "fft"): {**whole, **at},
        ("2.3", "88 rad/s", "phase", "regression"): {**steady, **at},
        ("2.3", "88 rad/s", "phase", "fft, uncompensated"): {**late, **at},
        ("2.3", "88 rad/s", "phase", "fft, compensated"): {**late, **at, "phase_reference": "reference"},
    }
    for speed in config.shown_speeds_rad_s:
        for method, record in (("regression", "complete"), ("fft", "one sample late")):
            where = {"record": record, "spectrum_method": method, "speed": speed}
            columns["2.4", f"{speed:g} rad/s", "reference phase", method] = where
    return columns


def assumed_parameters(config, true):
    """Table 2.1; true : (parameter,) values assumed for the unknowns."""
    rotor = config.rig(config.main_rig).structure
    rows = [
        ("mass of disc", 2.0, rotor.mass[0, 0], "kg"),
        ("intact shaft stiffness", 7.6e5, rotor.stiffness[0, 0], "N/m"),
        ("shaft deflection", 2.58e-5, rotor.static_deflection[0].real, "m"),
        *(
            (label, thesis, float(true.sel(parameter=ours)) * factor, unit)
            for label, thesis, ours, factor, unit in (
                ("additive crack stiffness", 2.5e5, "stiffness_loss", 1.0, "N/m"),
                ("external damping", 100.0, "external_damping", 1.0, "N s/m"),
                ("internal damping", 20.0, "internal_damping", 1.0, "N s/m"),
                ("phase of unbalance", 30.0, "eccentricity_phase", 180 / np.pi, "deg"),
                ("disc eccentricity", 5e-6, "eccentricity", 1.0, "m"),
            )
        ),
    ]
    return Table(
        pd.DataFrame(rows, columns=["parameter", "thesis", "here", "unit"]),
        "Table 2.1: Assumed parameters of the 2-DOF rotor",
        "The deflection follows from mass and stiffness.",
    )


def tables(config, reference, spectra, identification, monte_carlo, reasons):
    """The tables of Chapter 2 beside the thesis's.

    The Datasets are of the rig "thesis"; of monte_carlo, file name of a case -> Dataset.
    returns : rows of the scoreboard (DataFrame), and name -> Table
    """
    identification = identification.sel(source="steady state", record="one sample late")
    rows = spectrum_rows(spectra, spectrum_columns(config))
    noisy = {}
    for case in config.cases:
        for compensation, phase in COMPENSATION.items():
            exact = identification.estimate.sel(
                case=case, phase_reference=phase, spectrum_method="fft", estimator="least_squares"
            )
            rows += estimate_rows(exact, "2.5", printed_case(case, compensation), PARAMETERS)
            noisy[printed_case(case, compensation)] = monte_carlo[file_name(case)].sel(record="steady state")
    printed = published(reference, list(DESCRIBED))
    under_noise = printed[(printed.table == "2.5") & (printed.noise_percent > 0)]
    rows += noise_rows(under_noise, noisy, PARAMETERS, MODELS, mean_of=MODELS["shared"])
    scored = scored_against(printed, rows, reasons)
    return scored, {"table_2_1": assumed_parameters(config, identification.true), **scored_tables(scored, DESCRIBED)}
