"""Tables of Chapter 6: the rotor with two discs on anisotropic bearings."""

import numpy as np
import pandas as pd

from rotorstudy.response.statics import static_deflection
from rotorstudy.studies.common import is_phase
from thesis.printed import scored_against, spectrum_rows
from thesis.scoreboard import KEYS, published
from thesis.tables import Table, scored_tables

NODES = (1, 2, 3)  # tables 6.2 to 6.4 are amplitudes there, 6.5 to 6.7 phases
FIRST = {"amplitude": 2, "phase": 5}  # number of the first table of a quantity
VARIANT = "the thesis: opposite gyroscopic sign"
CASES = {"6.8": "100 rad/s", "6.9": "50 to 100 rad/s"}
PARAMETERS = {"c_H": ("internal_damping", 1.0), "dk_22": ("stiffness_loss_22", 1.0)}
for _n in (1, 2):
    for _axis in "xy":
        PARAMETERS[f"c_b{_axis}{_n}"] = (f"bearing_damping_{_axis * 2}[{_n}]", 1.0)
        PARAMETERS[f"k_b{_axis}{_n}"] = (f"bearing_stiffness_{_axis * 2}[{_n}]", 1.0)
    PARAMETERS[f"e_{_n}"] = (f"eccentricity[{_n}]", 1.0)
    PARAMETERS[f"phi_{_n}"] = (f"eccentricity[{_n}]_phase", 180 / np.pi)


def spectrum_table(quantity, node):
    """Number of the table that prints a quantity at a node."""
    return f"6.{FIRST[quantity] + node - 1}"


def spectrum_columns():
    """Origin of each column of Tables 6.2 to 6.7, as `spectrum_rows` takes it."""
    return {
        (spectrum_table(quantity, node), f"100 rad/s, node {node}", quantity, method): {
            "source": "from rest",
            "record": "complete cycles",
            "spectrum_method": method,
            "phase_reference": "reference",
            "speed": 100.0,
            "node": node,
        }
        for quantity in FIRST
        for node in NODES
        for method in ("regression", "fft")
    }


def assumed_parameters(config, true):
    """Table 6.1 and the deflection that follows; true : (parameter,) values assumed for the unknowns."""
    model = config.rig(config.main_rig)
    rows = [(name, float(true.sel(parameter=ours)) * factor) for name, (ours, factor) in PARAMETERS.items()]
    deflection = static_deflection(model, [100.0], model.theta[: len(model.rotor_unknowns)]).value[0]
    for node in model.structure.nodes:
        rows.append((f"u_x0 at node {node} (µm)", deflection[model.structure.index(node)].real * 1e6))
        rows.append((f"phi_y0 at node {node} (µrad)", deflection[model.structure.index(node, "tilt")].real * 1e6))
    return Table(
        pd.DataFrame(rows, columns=["parameter", "here"]),
        "Table 6.1: Assumed parameters, and the static deflection that follows",
        "SI units, phases in degrees. The thesis swaps the two phases of unbalance; its spectra are reproduced with "
        "45 degrees at disc 1 and 15 degrees at disc 2. The deflection is that of discs and shaft on the bearings.",
    )


def variant_errors(config, relative_error):
    """Error of each variant of the equations; relative_error : of `studies.variants.variants`."""
    error = relative_error.to_series().unstack("parameter")
    phase = is_phase(config, error.columns)
    error.loc[:, ~phase] *= 100
    error.loc[:, phase] = np.rad2deg(error.loc[:, phase])
    error.columns = [
        f"{name.replace('_', ' ')} ({'°' if is_angle else '%'})"
        for name, is_angle in zip(error.columns, phase, strict=True)
    ]
    error.index = [f"{variant}: {case}" for variant, case in error.index]
    return Table(
        error.T.rename_axis("parameter").reset_index(),
        "Variants of least squares from exact spectra",
        "Error of each parameter without noise. The elimination of the tilts is exact. A condensation without "
        "gyroscopic moments causes errors of a few hundredths of a per cent. A static deflection held at that of "
        "bearings 20 % too stiff causes 11 % in crack stiffness and internal damping and none elsewhere. The wrong "
        "gyroscopic sign causes 2 to 12 % in bearings, eccentricities and the crack.",
        digits=2,
    )


def described():
    """Title, note and keys of every scored table."""
    note = "Here: reversed gyroscopic sign, wrong signs in the horizontal mass matrix, deflection of unknown origin."
    found = {
        spectrum_table(quantity, node): (
            f"{quantity.capitalize()}s at node {node}, 100 rad/s",
            note,
            ["item"],
            ["case", "method"],
        )
        for quantity in FIRST
        for node in NODES
    }
    for table, case in CASES.items():
        found[table] = (
            f"Assumed and estimated parameters, {case}",
            "Simulated with one gyroscopic sign, identified with the other: the printed errors of eccentricities and "
            f"phases are reproduced {'to 0.01' if table == '6.8' else 'within 0.2'} percentage points, those of the "
            "ten others are not. How the thesis combined speeds is not known. In rows with noise ours has none.",
            ["item"],
            ["noise_percent"],
        )
    return found


def tables(config, reference, spectra, variants, reasons):
    """As `thesis.chapter_2.tables`, with the errors that wrong equations cause, of `studies.variants.variants`."""
    texts = described()
    printed = published(reference, list(texts))
    rows = spectrum_rows(spectra, spectrum_columns())
    for row in printed[printed.table.isin(CASES)].to_dict("records"):
        ours, factor = PARAMETERS[row["item"]]
        value = variants.estimate.sel(variant=VARIANT, case=CASES[row["table"]], parameter=ours)
        rows.append({**{key: row[key] for key in KEYS}, "computed": float(value) * factor})
    scored = scored_against(printed, rows, reasons)
    return scored, {
        "table_6_1": assumed_parameters(config, variants.true),
        **scored_tables(scored, texts),
        "variants": variant_errors(config, variants.relative_error),
    }
