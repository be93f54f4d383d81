"""Both test rigs side by side: their estimates made dimensionless."""

import pandas as pd

from rotorstudy.store import as_complex
from rotorstudy.units import percent
from thesis.checks import largest_crack_response, limits, physical_checks, slow_roll_bow, slow_roll_share
from thesis.replay import COLUMN, thesis_estimates
from thesis.tables import Table


def _scales(config, bow):
    """Unit of a parameter -> name and SI value of the scale that makes it dimensionless."""
    allowed = limits(config)
    return {
        "N s/m": ("critical damping", allowed["critical damping"]),
        "m": ("1X of the slow roll", bow),
        "N/m": ("stiffness", allowed["stiffness"]),
    }


def relative_estimates(config, reference, identification, spectra):
    """Estimates of a replay from all speeds, made dimensionless; without phases.

    config                  : ReplayConfig;  reference : folder of the printed values
    identification, spectra : Dataset of `thesis.replay.identify` and `thesis.replay.spectra`
    returns                 : one row per parameter
    """
    model, bow = config.model, slow_roll_bow(config, spectra, COLUMN)
    theta = dict(zip(model.names, thesis_estimates(config, reference, config.all_speeds), strict=True))
    theta["eccentricity"] = abs(theta["eccentricity_real"] + 1j * theta["eccentricity_imag"])
    scales, rows = _scales(config, bow), []
    best = identification.sel(data_set=COLUMN, group=config.all_speeds)[["estimate", "low", "high"]]
    for name, (ours, _) in config.thesis_names.items():
        (unit,) = model.reported_units([ours])
        if unit not in scales:
            continue
        what, scale = scales[unit]
        row = {
            "rig": config.name.replace("_", " ").capitalize(),
            "parameter": name,
            "relative to": what,
            "thesis": theta[ours] / scale,
        }
        for estimator in config.estimators:
            here = best.sel(estimator=estimator, parameter=ours)
            row |= {f"{estimator.replace('_', ' ')}: {key}": float(here[key]) / scale for key in here.data_vars}
        here = best.sel(estimator="least_squares", parameter=[ours]).to_dataframe().reset_index()
        (check,) = physical_checks(config, here.assign(source="least squares"), bow).itertuples()
        row["largest possible"] = check.largest_possible / (scale * (1e6 if check.unit == "µm" else 1.0))
        row["verdict on least squares"] = check.verdict
        rows.append(row)
    return rows


def slow_roll_parts(config, spectra):
    """harmonic -> (higher case,) share already present at slow roll, of -1X and 2X."""
    compensated = spectra.compensated.sel(version="corrected", data_set=COLUMN, spectrum_method=COLUMN)
    share = slow_roll_share(config, as_complex(compensated))
    return {n: share[:, config.harmonics.index(n)] for n in (-1, 2)}


def slow_roll_note(config, spectra):
    """Shares of the harmonics already present at slow roll, in words."""
    there = ", ".join(
        f"of {n}X {percent(part.min())} to {percent(part.max())}"
        for n, part in slow_roll_parts(config, spectra).items()
    )
    slow = spectra.compensated.sel(version="corrected", data_set=COLUMN, spectrum_method=COLUMN)
    slow = abs(as_complex(slow.sel(case=config.slow_roll, harmonic=-1))) * 1e6
    most = largest_crack_response(config, -1) * 1e6
    rig = config.name.replace("_", " ").capitalize()
    return (
        f"{rig}: already present at slow roll, as vectors, are {there}; -1X is {slow:.0f} µm there, of which weight "
        f"can cause at most {most:.1f} µm by a crack within the limits of the impact tests."
    )


def rigs_table(replays, reference):
    """Parameters identified for several rigs.

    replays   : (ReplayConfig, identification, spectra) of each;  reference : folder of the printed values
    returns   : Table
    """
    rows = [row for config, found, seen in replays for row in relative_estimates(config, reference, found, seen)]
    return Table(
        pd.DataFrame(rows),
        "Parameters identified for both rigs",
        [
            f"All published speeds together, column '{COLUMN}' of the printed spectra. Dampings are relative to "
            "critical damping, eccentricity to 1X of the slow roll, stiffness losses to the stiffness.",
            "The rigs have the same disc and similar cracks, so these values should be alike; the impact tests allow "
            "losses of a few per cent and dampings of a few tenths at most.",
            *(slow_roll_note(config, seen) for config, _, seen in replays),
            "The part that weight cannot cause is runout or unequal probes, which Eq. (3.1) does not remove: it "
            "subtracts 0X and 1X only.",
        ],
        digits=4,
    )
