from rotorstudy.studies.job import job

with job(snakemake):
    from pathlib import Path

    import numpy as np
    import pandas as pd

    from rotorstudy.presentation.tables import write_csv, write_scored_tables, write_table
    from rotorstudy.response.statics import static_deflection
    from rotorstudy.store import load
    from rotorstudy.studies.config import load_study
    from rotorstudy.thesis.printed import spectrum_rows, with_deviation
    from rotorstudy.thesis.scoreboard import KEYS, load_reasons, published, score

    NODES = (1, 2, 3)  # tables 6.2 to 6.4 are amplitudes there, 6.5 to 6.7 phases
    VARIANT = "the thesis: opposite gyroscopic sign"
    CASES = {"6.8": "100 rad/s", "6.9": "50 to 100 rad/s"}
    PARAMETERS = {"c_H": ("internal_damping", 1.0), "dk_22": ("stiffness_loss_22", 1.0)}
    for n in (1, 2):
        for axis in "xy":
            PARAMETERS[f"c_b{axis}{n}"] = (f"bearing_damping_{axis * 2}[{n}]", 1.0)
            PARAMETERS[f"k_b{axis}{n}"] = (f"bearing_stiffness_{axis * 2}[{n}]", 1.0)
        PARAMETERS[f"e_{n}"] = (f"eccentricity[{n}]", 1.0)
        PARAMETERS[f"phi_{n}"] = (f"eccentricity[{n}]_phase", 180 / np.pi)

    config = load_study(snakemake.input.config)
    spectra, variants = load(snakemake.input.spectra), load(snakemake.input.variants)
    printed = published(Path(snakemake.input.published).parent, [f"6.{n}" for n in range(2, 10)])

    columns = {}
    for first, quantity in ((2, "amplitude"), (5, "phase")):
        for node in NODES:
            for method in ("regression", "fft"):
                columns[f"6.{first + node - 1}", f"100 rad/s, node {node}", quantity, method] = {
                    "source": "from rest",
                    "record": "complete cycles",
                    "spectrum_method": method,
                    "phase_reference": "reference",
                    "speed": 100.0,
                    "node": node,
                }
    rows = spectrum_rows(spectra, columns)
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
    scored = score(printed, computed, load_reasons(snakemake.input.reasons))
    write_csv(scored, snakemake.output.scored)

    # Table 6.1 and the deflection that follows
    model = config.rig(config.main_rig)
    true = variants.true
    assumed = [(name, float(true.sel(parameter=ours)) * factor) for name, (ours, factor) in PARAMETERS.items()]
    deflection = static_deflection(model, [100.0], model.theta[: len(model.rotor_unknowns)]).value[0]
    for node in model.structure.nodes:
        assumed.append((f"u_x0 at node {node} (um)", deflection[model.structure.index(node)].real * 1e6))
        assumed.append((f"phi_y0 at node {node} (urad)", deflection[model.structure.index(node, "tilt")].real * 1e6))
    write_table(
        pd.DataFrame(assumed, columns=["parameter", "here"]),
        snakemake.output.csv[0],
        snakemake.output.html[0],
        "Table 6.1: Assumed parameters, and the static deflection that follows",
        "SI units, phases in degrees. The thesis prints the two phases of unbalance the other way round; its spectra "
        "come back with 45 degrees at disc 1 and 15 degrees at disc 2. Deflection of discs and shaft on the bearings.",
    )
    sheets = {}
    for n in range(2, 8):
        what = "Amplitudes" if n < 5 else "Phases"
        note = "Reversed gyroscopic sign, wrong signs in the horizontal mass matrix, deflection of unknown origin."
        sheets[f"6.{n}"] = (f"{what} at node {(n - 2) % 3 + 1}, 100 rad/s", note, ["item"], ["case", "method"])
    for name, case in CASES.items():
        sheets[name] = (
            f"Assumed and estimated parameters, {case}",
            "Simulated with one gyroscopic sign, identified with the other: eccentricities and phases come back with "
            f"their printed errors {'to 0.01' if name == '6.8' else 'within 0.2'} % points, the ten others do "
            "not. How the thesis combined speeds is not known. Rows under noise: ours without noise.",
            ["item"],
            ["noise_percent"],
        )
    write_scored_tables(scored, sheets, snakemake.output.csv[1:9], snakemake.output.html[1:9])

    # what each way of solving the equations costs
    error = variants.relative_error.to_series().unstack("parameter")
    phases = [name for name in error.columns if name.endswith("_phase")]
    error[[name for name in error.columns if name not in phases]] *= 100
    error[phases] = np.rad2deg(error[phases])
    error.columns = [f"{name} ({'deg' if name in phases else '%'})" for name in error.columns]
    write_table(
        error.reset_index(),
        snakemake.output.csv[9],
        snakemake.output.html[9],
        "Least squares from exact spectra, right and wrong",
        "Error of each parameter without any noise. Exact elimination of the tilts is exact; leaving the gyroscopic "
        "moments out of the condensation costs a few hundredths of a per cent; holding the static deflection of "
        "bearings 20 % too stiff puts 11 % into crack stiffness and internal damping and nothing elsewhere; the wrong "
        "gyroscopic sign puts 2 to 12 % into bearings, eccentricities and the crack.",
    )
