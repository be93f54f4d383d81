"""Tables of Chapter 6: the rotor with two discs on anisotropic bearings."""

import numpy as np
import pandas as pd

from rotorstudy.response.statics import static_deflection
from rotorstudy.studies.common import is_phase
from rotorstudy.thesis.printed import spectrum_rows, with_deviation
from rotorstudy.thesis.scoreboard import KEYS, load_reasons, published, score
from rotorstudy.thesis.tables import Table, scored_tables

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
    """What each column of Tables 6.2 to 6.7 is made of, see `spectrum_rows`."""
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
        rows.append((f"u_x0 at node {node} (um)", deflection[model.structure.index(node)].real * 1e6))
        rows.append((f"phi_y0 at node {node} (urad)", deflection[model.structure.index(node, "tilt")].real * 1e6))
    return Table(
        pd.DataFrame(rows, columns=["parameter", "here"]),
        "Table 6.1: Assumed parameters, and the static deflection that follows",
        "SI units, phases in degrees. The thesis prints the two phases of unbalance the other way round; its spectra "
        "come back with 45 degrees at disc 1 and 15 degrees at disc 2. Deflection of discs and shaft on the bearings.",
    )


def variant_errors(config, relative_error):
    """What each way of solving the equations costs; relative_error : of `studies.variants.variants`."""
    error = relative_error.to_series().unstack("parameter")
    phase = is_phase(config, error.columns)
    error.loc[:, ~phase] *= 100
    error.loc[:, phase] = np.rad2deg(error.loc[:, phase])
    error.columns = [f"{name} ({'deg' if turns else '%'})" for name, turns in zip(error.columns, phase, strict=True)]
    return Table(
        error.reset_index(),
        "Least squares from exact spectra, right and wrong",
        "Error of each parameter without any noise. Exact elimination of the tilts is exact; leaving the gyroscopic "
        "moments out of the condensation costs a few hundredths of a per cent; holding the static deflection of "
        "bearings 20 % too stiff puts 11 % into crack stiffness and internal damping and nothing elsewhere; the wrong "
        "gyroscopic sign puts 2 to 12 % into bearings, eccentricities and the crack.",
    )


def described():
    """Title, note and keys of every scored table."""
    note = "Reversed gyroscopic sign, wrong signs in the horizontal mass matrix, deflection of unknown origin."
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
            "Simulated with one gyroscopic sign, identified with the other: eccentricities and phases come back with "
            f"their printed errors {'to 0.01' if table == '6.8' else 'within 0.2'} % points, the ten others do "
            "not. How the thesis combined speeds is not known. Rows under noise: ours without noise.",
            ["item"],
            ["noise_percent"],
        )
    return found


def tables(config, reference, spectra, variants, reasons):
    """The tables of Chapter 6 beside the thesis's, and what wrong equations cost.

    Parameters
    ----------
    config : StudyConfig
    reference : path
        Folder of the printed values.
    spectra : Dataset
        Of the rig "thesis", see `studies.simulate.spectra`.
    variants : Dataset
        Of `studies.variants.variants`.
    reasons : path
        YAML list of the reasons for differences.

    Returns
    -------
    tuple
        Rows of the scoreboard (DataFrame), and name -> Table.
    """
    texts = described()
    printed = published(reference, list(texts))
    rows = spectrum_rows(spectra, spectrum_columns())
    for row in printed[printed.table.isin(CASES)].to_dict("records"):
        ours, factor = PARAMETERS[row["item"]]
        value = variants.estimate.sel(variant=VARIANT, case=CASES[row["table"]], parameter=ours)
        rows.append({**{key: row[key] for key in KEYS}, "computed": float(value) * factor})
    computed = with_deviation(pd.DataFrame(rows), printed)
    known = printed.set_index(KEYS).published
    computed["percent"] = [
        100 * deviation / abs(known.get(tuple(key), np.nan))
        for key, deviation in zip(computed[KEYS].values, computed.deviation, strict=True)
    ]
    scored = score(printed, computed, load_reasons(reasons))
    return scored, {
        "table_6_1": assumed_parameters(config, variants.true),
        **scored_tables(scored, texts),
        "variants": variant_errors(config, variants.relative_error),
    }
